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
}

impl ScreenFromObject {
    /// The transform of `view` alone, from world space.
    pub fn of_view(view: &View) -> ScreenFromObject {
        let sub = f64::from(SUBPIXEL);
        let scale = view.pixels_per_unit() * sub;
        let (cx, cy) = (f64::from(view.width) * 0.5 * sub, f64::from(view.height) * 0.5 * sub);
        let in_view = match view.projection {
            Projection::Perspective { near, .. } => ScreenFromObject {
                x: [scale, 0.0, -cx, 0.0],
                y: [0.0, -scale, -cy, 0.0],
                w: [0.0, 0.0, -1.0, 0.0],
                d: [0.0, 0.0, 0.0, near],
                perspective: true,
                front_sign: -1.0,
            },
            Projection::Orthographic { near, far, .. } => ScreenFromObject {
                x: [scale, 0.0, 0.0, cx],
                y: [0.0, -scale, 0.0, cy],
                w: [0.0, 0.0, 0.0, 1.0],
                d: [0.0, 0.0, 1.0 / (far - near), far / (far - near)],
                perspective: false,
                front_sign: -1.0,
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
        let mirrored = m.determinant() < 0.0;
        ScreenFromObject {
            x: row(&self.x),
            y: row(&self.y),
            // An exact 1 must stay exact: the vector path never divides by it.
            w: if self.perspective { row(&self.w) } else { self.w },
            d: if self.perspective { self.d } else { row(&self.d) },
            perspective: self.perspective,
            front_sign: if mirrored { -self.front_sign } else { self.front_sign },
        }
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
