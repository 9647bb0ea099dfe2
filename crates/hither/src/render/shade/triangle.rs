//! Where the ray through a point of the image meets a triangle's plane: in f64, without clipping, for
//! triangles that pass behind the eye too.
//!
//! Corners become homogeneous triples h: (x, y, −z) in view space for a pinhole, (x, y, 1) for parallel
//! rays. With p = (p, q, 1) the image point in view units, eᵢ = p · (hⱼ × hₖ) is linear across the image,
//! positive or negative on the inner side of the edge opposite corner i, and the barycentric weights are
//! eᵢ / (e₀ + e₁ + e₂). Swapping an edge's ends negates eᵢ exactly, so neighbours never both take a point
//! nor both leave it. [Olano & Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997]

use crate::conventions::{Projection, View};
use glam::{DVec2, DVec3};

/// The rays through the points of a view's image.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct Rays {
    pinhole: bool,
    /// View-space width of a pixel, at distance 1 for a pinhole.
    unit: f64,
    /// Middle of the image, pixels.
    middle: DVec2,
}

impl Rays {
    pub(in crate::render) fn new(view: &View) -> Rays {
        Rays {
            pinhole: matches!(view.projection, Projection::Perspective { .. }),
            unit: 1.0 / view.pixels_per_unit(),
            middle: DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5,
        }
    }

    /// The direction from a surface seen at `at` (pixels) to the eye, unit, in view space.
    pub(in crate::render) fn toward_eye(&self, at: DVec2) -> DVec3 {
        if !self.pinhole {
            return DVec3::Z;
        }
        let aside = (self.middle - at) * self.unit;
        DVec3::new(aside.x, -aside.y, 1.0).normalize()
    }
}

/// A triangle as the rays of a view meet it.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct TriangleInView {
    /// eᵢ = `edges[i]` · (x, y, 1) with (x, y) in pixels, y down.
    edges: [DVec3; 3],
    /// Distance along the view axis of each corner, metres.
    distances: DVec3,
    /// Six times the volume below the triangle as the eye sees it: positive if counter-clockwise.
    pub(in crate::render) orientation: f64,
}

impl TriangleInView {
    /// `corners` in view space.
    pub(in crate::render) fn new(rays: &Rays, corners: [DVec3; 3]) -> TriangleInView {
        let h = corners.map(|c| DVec3::new(c.x, c.y, if rays.pinhole { -c.z } else { 1.0 }));
        let across_pixels = |n: DVec3| {
            let (x, y) = (n.x * rays.unit, n.y * rays.unit);
            DVec3::new(x, -y, n.z - x * rays.middle.x + y * rays.middle.y)
        };
        let normals = [h[1].cross(h[2]), h[2].cross(h[0]), h[0].cross(h[1])];
        TriangleInView {
            edges: normals.map(across_pixels),
            distances: -DVec3::new(corners[0].z, corners[1].z, corners[2].z),
            orientation: h[0].dot(normals[0]),
        }
    }

    /// The weights of the corners where the ray through `at` (pixels) meets the triangle; outside it, of a
    /// point of it nearby. Never negative, sum 1; a triangle seen exactly edge-on gives its centroid.
    pub(in crate::render) fn weights(&self, at: DVec2) -> DVec3 {
        let e = self.edge_values(at) * self.orientation.signum();
        let inside = e.max(DVec3::ZERO);
        let weights = inside / inside.element_sum();
        if weights.is_finite() { weights } else { DVec3::splat(1.0 / 3.0) }
    }

    /// How the weights change from `at` to the next pixel, to the right and down. Zero where edge-on.
    pub(in crate::render) fn weights_per_pixel(&self, at: DVec2) -> [DVec3; 2] {
        let e = self.edge_values(at);
        let sum = e.element_sum();
        let by = |slopes: DVec3| {
            let change = (slopes - e * (slopes.element_sum() / sum)) / sum;
            if change.is_finite() { change } else { DVec3::ZERO }
        };
        let [a, b, c] = self.edges;
        [by(DVec3::new(a.x, b.x, c.x)), by(DVec3::new(a.y, b.y, c.y))]
    }

    /// Distance along the view axis, metres, at the given weights.
    pub(in crate::render) fn distance(&self, weights: DVec3) -> f64 {
        self.distances.dot(weights)
    }

    fn edge_values(&self, at: DVec2) -> DVec3 {
        DVec3::from_array(self.edges.map(|e| e.x * at.x + e.y * at.y + e.z))
    }
}

/// Depth of a surface at `distance` along the view axis; `None` where it is clipped. The inverse of
/// [`Projection::distance`].
pub(in crate::render) fn depth_at(projection: &Projection, distance: f64) -> Option<f32> {
    let depth = match *projection {
        Projection::Perspective { near, .. } => near / distance,
        Projection::Orthographic { near, far, .. } => (far - distance) / (far - near),
    };
    (depth > 0.0 && depth <= 1.0).then_some(depth as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;
    use proptest::prelude::*;

    fn view(projection: Projection) -> View {
        View { view_from_world: DAffine3::IDENTITY, projection, width: 64, height: 48 }
    }

    const PINHOLE: Projection = Projection::Perspective { fov_y: 1.2, near: 0.1 };
    const PARALLEL: Projection = Projection::Orthographic { half_height: 3.0, near: -2.0, far: 9.0 };

    /// The image position of a point in view space, pixels.
    fn project(view: &View, p: DVec3) -> DVec2 {
        let scale = view.pixels_per_unit()
            / if matches!(view.projection, Projection::Perspective { .. }) { -p.z } else { 1.0 };
        DVec2::new(32.0 + p.x * scale, 24.0 - p.y * scale)
    }

    fn point() -> impl Strategy<Value = DVec3> {
        (-3.0..3.0, -3.0..3.0, -8.0..-0.5).prop_map(|(x, y, z)| DVec3::new(x, y, z))
    }

    fn any_point() -> impl Strategy<Value = DVec3> {
        // A grid, so that points coincide, align with pixels, and lie behind the eye.
        (-4..5, -4..5, -6..3).prop_map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.5)
    }

    proptest! {
        #[test]
        fn weights_are_those_of_the_point_seen(
            a in point(), b in point(), c in point(), u in 0.05..0.9f64, v in 0.05..0.9f64, flat in any::<bool>(),
        ) {
            let view = view(if flat { PARALLEL } else { PINHOLE });
            let w = DVec3::new(1.0, u, v) / (1.0 + u + v);
            let seen = a * w.x + b * w.y + c * w.z;
            let triangle = TriangleInView::new(&Rays::new(&view), [a, b, c]);
            prop_assume!(triangle.orientation.abs() > 1e-2);
            let at = project(&view, seen);
            let found = triangle.weights(at);
            prop_assert!((found - w).length() < 1e-8, "{} is not {}", found, w);
            prop_assert!((triangle.distance(found) + seen.z).abs() < 1e-7);
        }

        #[test]
        fn slopes_predict_the_next_pixel(
            a in point(), b in point(), c in point(), flat in any::<bool>(),
        ) {
            let view = view(if flat { PARALLEL } else { PINHOLE });
            let triangle = TriangleInView::new(&Rays::new(&view), [a, b, c]);
            prop_assume!(triangle.orientation.abs() > 0.1);
            let at = project(&view, (a + b + c) / 3.0);
            let [right, down] = triangle.weights_per_pixel(at);
            // So that the step neither leaves the triangle nor bends.
            prop_assume!(right.length() + down.length() < 50.0);
            let step = 1e-7;
            for (slope, offset) in [(right, DVec2::X), (down, DVec2::Y)] {
                let difference = (triangle.weights(at + offset * step) - triangle.weights(at)) / step;
                prop_assert!((difference - slope).length() < 1e-3 * (1.0 + slope.length()));
            }
        }

        #[test]
        fn clamped_weights_are_always_usable(
            a in any_point(), b in any_point(), c in any_point(),
            x in -100.0..100.0f64, y in -100.0..100.0f64, scale in prop::sample::select(vec![1.0, 1e-30, 1e30]),
        ) {
            let triangle = TriangleInView::new(&Rays::new(&view(PINHOLE)), [a * scale, b * scale, c * scale]);
            let w = triangle.weights(DVec2::new(x, y));
            prop_assert!(w.min_element() >= 0.0 && (w.element_sum() - 1.0).abs() < 1e-9);
            prop_assert!(triangle.weights_per_pixel(DVec2::new(x, y)).iter().all(|s| s.is_finite()));
        }
    }

    #[test]
    fn depth_and_distance_are_inverse_and_clip_at_the_planes() {
        for projection in [PINHOLE, PARALLEL] {
            for distance in [0.2, 1.0, 7.5] {
                let depth = depth_at(&projection, distance).unwrap();
                assert!((projection.distance(depth) - distance).abs() < 1e-5);
            }
        }
        assert_eq!(depth_at(&PINHOLE, 0.1), Some(1.0));
        assert_eq!(depth_at(&PINHOLE, 0.0999), None);
        assert_eq!(depth_at(&PINHOLE, -5.0), None);
        assert_eq!(depth_at(&PARALLEL, 9.0), None);
        assert_eq!(depth_at(&PARALLEL, -2.0), Some(1.0));
        assert_eq!(depth_at(&PARALLEL, -2.1), None);
    }
}
