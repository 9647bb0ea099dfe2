//! Polygons in homogeneous screen coordinates, cut by the near plane and the guard band.
//!
//! Cuts are computed from an edge's end points in a fixed order, so that two polygons that share an edge share its
//! cut point to the last bit and no crack opens between them.

/// The guard band, in pixels: coordinates inside it keep every edge function within 32 bits a tile, and edges whole
/// within 64. An image (at most 16384 wide) lies inside with at least 8192 pixels to spare on each side.
pub(crate) const GUARD_MIN: f64 = -8192.0;
pub(crate) const GUARD_MAX: f64 = 24576.0;

/// A convex polygon of (X, Y, W, D), and for each corner what is known of the edge that follows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GuardedPolygon<E> {
    /// The first `len` of these.
    pub corner: [([f64; 4], E); 8],
    pub len: usize,
}

impl<E: Copy> GuardedPolygon<E> {
    /// What is left of a triangle whose edges are known as `edges`; `cut` is what is said of the edges along which
    /// it was cut. `None` if nothing is left.
    pub fn of_triangle(v: &[[f64; 4]; 3], edges: [E; 3], cut: E) -> Option<GuardedPolygon<E>> {
        let mut polygon = GuardedPolygon { corner: [([0.0; 4], cut); 8], len: 3 };
        for k in 0..3 {
            polygon.corner[k] = (v[k], edges[k]);
        }
        let (low, high) = (GUARD_MIN * 256.0, GUARD_MAX * 256.0);
        // Non-negative inside; the near plane first, so that W is positive for the others.
        let planes: [fn(&[f64; 4], f64) -> f64; 5] = [
            |p, _| p[2] - p[3],
            |p, low| p[0] - low * p[2],
            |p, high| high * p[2] - p[0],
            |p, low| p[1] - low * p[2],
            |p, high| high * p[2] - p[1],
        ];
        for (plane, bound) in planes.iter().zip([0.0, low, high, low, high]) {
            polygon = polygon.cut(cut, |p| plane(p, bound));
            if polygon.len < 3 {
                return None;
            }
        }
        Some(polygon)
    }

    fn cut(&self, cut: E, side: impl Fn(&[f64; 4]) -> f64) -> GuardedPolygon<E> {
        let mut out = GuardedPolygon { corner: self.corner, len: 0 };
        let mut push = |p: [f64; 4], edge: E| {
            out.corner[out.len] = (p, edge);
            out.len += 1;
        };
        for i in 0..self.len {
            let ((p, edge), (q, _)) = (self.corner[i], self.corner[(i + 1) % self.len]);
            let (sp, sq) = (side(&p), side(&q));
            if sp >= 0.0 {
                // An edge in the plane itself: what is beyond is gone, whatever it was.
                push(p, if sp == 0.0 && sq == 0.0 { cut } else { edge });
            }
            if (sp >= 0.0) != (sq >= 0.0) {
                // From the inner end to the outer, whichever way the edge is walked.
                let (inner, outer, si, so) = if sp >= 0.0 { (p, q, sp, sq) } else { (q, p, sq, sp) };
                let t = si / (si - so);
                let at = std::array::from_fn(|k| inner[k] + (outer[k] - inner[k]) * t);
                // Going out, the plane's own edge follows; coming in, the rest of this one.
                push(at, if sp >= 0.0 { cut } else { edge });
            }
        }
        out
    }
}
