//! From object space to the screen, in f64: the one matrix that triangles, boxes and clipping share.

use crate::conventions::{Projection, SUBPIXEL, View};
use glam::{DAffine3, DVec3};

/// Rows of `screen_from_object`: a point `p` has the homogeneous screen coordinates
/// `X = x·p`, `Y = y·p`, `W = w·p`, `D = d·p` (each row ends in its constant), is seen at
/// `(X / W, Y / W)` in units of 1/256 pixel, y down, and has depth `D / W`. It lies in front of the near
/// plane where `D ≤ W`.
#[derive(Clone, Copy, Debug)]
pub struct ScreenFromObject {
    /// Row of X, 1/256 pixel.
    pub x: [f64; 4],
    /// Row of Y, 1/256 pixel.
    pub y: [f64; 4],
    /// Row of W: distance along the view axis (perspective) or 1 (orthographic).
    pub w: [f64; 4],
    /// Row of D: the near distance (perspective) or depth itself (orthographic).
    pub d: [f64; 4],
    /// Whether `w` varies; else W is exactly 1.
    pub perspective: bool,
    /// Sign of the snapped doubled area (y down) of triangles that face the eye: −1, or +1 where the
    /// object is mirrored.
    pub front_sign: f64,
    /// Sums of the magnitudes that went into the constants of X, Y and of W or D, over all transforms composed. Where an
    /// eye is far from the origin and near an object, these cancel.
    composed: [f64; 3],
}

impl ScreenFromObject {
    /// The transform of `view` alone, from world space.
    pub fn of_view(view: &View) -> ScreenFromObject {
        ScreenFromObject::of_view_with_border(view, 0)
    }

    /// The same of an image with so many pixels more on each side.
    pub(crate) fn of_view_with_border(view: &View, border: u32) -> ScreenFromObject {
        let sub = f64::from(SUBPIXEL);
        let scale = view.pixels_per_unit() * sub;
        let middle = |side: u32| (f64::from(side) * 0.5 + f64::from(border)) * sub;
        let (cx, cy) = (middle(view.width), middle(view.height));
        let in_view = match view.projection {
            Projection::Perspective { near, .. } => ScreenFromObject {
                x: [scale, 0.0, -cx, 0.0],
                y: [0.0, -scale, -cy, 0.0],
                w: [0.0, 0.0, -1.0, 0.0],
                d: [0.0, 0.0, 0.0, near],
                perspective: true,
                front_sign: -1.0,
                composed: [0.0; 3],
            },
            Projection::Orthographic { near, far, .. } => ScreenFromObject {
                x: [scale, 0.0, 0.0, cx],
                y: [0.0, -scale, 0.0, cy],
                w: [0.0, 0.0, 0.0, 1.0],
                d: [0.0, 0.0, 1.0 / (far - near), far / (far - near)],
                perspective: false,
                front_sign: -1.0,
                composed: [0.0; 3],
            },
        };
        in_view.after(&view.view_from_world)
    }

    /// This transform applied after `here_from_inner`.
    #[inline(never)]
    pub fn after(&self, here_from_inner: &DAffine3) -> ScreenFromObject {
        let m = here_from_inner.matrix3;
        let t = here_from_inner.translation;
        let row = |r: &[f64; 4]| {
            let v = DVec3::new(r[0], r[1], r[2]);
            [v.dot(m.x_axis), v.dot(m.y_axis), v.dot(m.z_axis), v.dot(t) + r[3]]
        };
        let third = if self.perspective { &self.w } else { &self.d };
        let mut composed = self.composed;
        for (sum, r) in composed.iter_mut().zip([&self.x, &self.y, third]) {
            *sum += DVec3::new(r[0], r[1], r[2]).abs().dot(t.abs()) + r[3].abs();
        }
        let mirrored = m.determinant() < 0.0;
        ScreenFromObject {
            x: row(&self.x),
            y: row(&self.y),
            // An exact 1 must stay exact: the vector path never divides by it.
            w: if self.perspective { row(&self.w) } else { self.w },
            d: if self.perspective { self.d } else { row(&self.d) },
            perspective: self.perspective,
            front_sign: if mirrored { -self.front_sign } else { self.front_sign },
            composed,
        }
    }

    /// What the constants of X, Y and of W or D may be off by: four roundings of 2⁻⁵³ of all that went into them, twice
    /// over for what later transforms make of it.
    pub fn lost(&self) -> [f64; 3] {
        self.composed.map(|sum| sum * 2f64.powi(-50))
    }

    /// `(X, Y, W, D)` of a point, with the operations and their order of the vector path.
    #[inline(always)]
    pub fn point(&self, p: [f64; 3]) -> [f64; 4] {
        [dot(&self.x, p), dot(&self.y, p), dot(&self.w, p), dot(&self.d, p)]
    }
}

#[inline(always)]
fn dot(row: &[f64; 4], p: [f64; 3]) -> f64 {
    ((row[0] * p[0] + row[1] * p[1]) + row[2] * p[2]) + row[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::trouble::Random;
    use glam::DMat3;

    /// An unevaluated sum of two numbers, twice as exact as one.
    #[derive(Clone, Copy)]
    struct Exact(f64, f64);

    impl Exact {
        fn plus(self, v: f64) -> Exact {
            let sum = self.0 + v;
            let back = sum - self.0;
            Exact(sum, self.1 + ((self.0 - (sum - back)) + (v - back)))
        }

        fn plus_product(self, a: f64, b: f64) -> Exact {
            let product = a * b;
            self.plus(product).plus(a.mul_add(b, -product))
        }
    }

    /// The constants of X, Y and W of a view after a translation, all but exactly.
    fn constants(view: &View, by: DVec3) -> [Exact; 3] {
        let m = &view.view_from_world;
        let in_view = [0, 1, 2].map(|k| {
            let row = m.matrix3.row(k);
            let sum = Exact(m.translation[k], 0.0);
            sum.plus_product(row.x, by.x).plus_product(row.y, by.y).plus_product(row.z, by.z)
        });
        let scale = view.pixels_per_unit() * 256.0;
        let half = [view.width, view.height].map(|n| f64::from(n) * 128.0);
        let [x, y, z] = in_view;
        let on_screen = |v: Exact, scale: f64, half: f64| {
            let sum = Exact(0.0, 0.0).plus_product(v.0, scale).plus_product(v.1, scale);
            sum.plus_product(z.0, -half).plus_product(z.1, -half)
        };
        [on_screen(x, scale, half[0]), on_screen(y, -scale, half[1]), Exact(-z.0, -z.1)]
    }

    #[test]
    fn what_constants_lose_where_large_numbers_cancel_is_bounded() {
        let random = &mut Random::new(8);
        let mut largest = 0.0f64;
        for round in 0..20_000 {
            let away = [1.0, 1e3, 1e6, 1e9, 1e12][round % 5];
            let eye = random.point(away);
            let projection = Projection::Perspective { fov_y: [0.001, 0.1, 2.0][round % 3], near: 1e-6 };
            let view = View::look_at(eye, eye + random.point(1.0), DVec3::Y, projection, (512, 512));
            let by = eye + random.point([1e-3, 1.0, 100.0][round / 5 % 3]);
            let at =
                ScreenFromObject::of_view(&view).after(&DAffine3::from_mat3_translation(DMat3::IDENTITY, by));
            let exact = constants(&view, by);
            for (k, (row, lost)) in [&at.x, &at.y, &at.w].into_iter().zip(at.lost()).enumerate() {
                let off = ((row[3] - exact[k].0) - exact[k].1).abs();
                assert!(off <= lost, "round {round}, row {k}: off by {off}, {lost} at most");
                largest = largest.max(off / lost);
            }
        }
        assert!(largest > 0.05, "{largest}");
    }
}
