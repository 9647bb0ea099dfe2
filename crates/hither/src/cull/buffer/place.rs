//! Vertices onto the screen: f64, snapped to 1/256 pixel, with the depth rounded away from the eye.

use super::fill::Corner;
use super::occluder::{Patch, Vertices};
use crate::raster::{GUARD_MAX, ScreenFromObject};
use fearless_simd::{Simd, f32x16, f64x8, i32x4, i32x16, prelude::*};

/// A patch's vertices on the screen.
#[derive(Clone, Debug, Default)]
pub(super) struct Placed {
    /// x and y in 1/256 pixel, the bits of a depth that is no larger than the vertex's, and nothing: four
    /// together are one load. Depths of 0 and more are ordered as their bits are.
    pub corner: Vec<[i32; 4]>,
    /// The largest of the depths.
    pub nearest: f32,
}

impl Placed {
    #[inline(always)]
    fn corner(&self, vertex: u32) -> Corner {
        Corner::of_bits(self.corner[vertex as usize])
    }

    #[inline(always)]
    pub fn corners(&self, v: &[u32; 4]) -> [Corner; 4] {
        [self.corner(v[0]), self.corner(v[1]), self.corner(v[2]), self.corner(v[3])]
    }
}

/// A transform, and the sizes that its sums may reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    screen: f64,
    w: f64,
    depth: f64,
}

impl Sizes {
    /// For points whose coordinates are at most `reach` in magnitude.
    ///
    /// *Bound.* A dot product of three terms and a constant in f64, whose coefficients went through two
    /// products of matrices, is off by at most 16·2⁻⁵³ of the sum of the terms' magnitudes, and by what was lost of the
    /// constant where larger numbers cancelled.
    pub fn new(at: &ScreenFromObject, reach: [f64; 3]) -> Sizes {
        let size = |r: &[f64; 4], lost: f64| {
            let terms = r[0].abs() * reach[0] + r[1].abs() * reach[1] + r[2].abs() * reach[2] + r[3].abs();
            terms * 2f64.powi(-49) + lost
        };
        let [x, y, third] = at.lost();
        let w = if at.perspective { size(&at.w, third) } else { 0.0 };
        let depth = if at.perspective { 0.0 } else { size(&at.d, third) };
        Sizes { screen: size(&at.x, x).max(size(&at.y, y)), w, depth }
    }

    /// What W is at least where it was found to be so much.
    #[inline(always)]
    pub fn least_w(&self, found: f64) -> f64 {
        found - self.w
    }
}

/// A transform with what its arithmetic may be off by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placing {
    pub at: ScreenFromObject,
    /// How far a snapped point may be from the true one, 1/256 pixel.
    pub slack: i32,
    /// Factor below 1 that makes a depth no larger than the true one.
    pub shrink: f64,
}

impl Placing {
    /// For points whose W is at least `least_w`. `None` where f64 could not tell where on the screen they are.
    /// A quotient's error follows from the numerator's and W's.
    #[inline(always)]
    pub fn new(at: &ScreenFromObject, sizes: &Sizes, least_w: f64) -> Option<Placing> {
        let inverse = 1.0 / least_w;
        let w_error = sizes.w * inverse;
        let off = sizes.screen * inverse + GUARD_MAX * 256.0 * w_error;
        // Half a unit for snapping; the rest, rounded up.
        let slack = 1.0 + (off * 2.0).floor();
        if !(slack < 4096.0 && w_error < 1e-3 && sizes.depth < 1e-6) {
            return None;
        }
        Some(Placing { at: *at, slack: slack as i32, shrink: 1.0 - 2f64.powi(-22) - 2.0 * w_error })
    }

    /// Depth that is no larger than D/W, in f32. An orthographic depth has an absolute error besides, and is
    /// negative beyond the far plane.
    #[inline(always)]
    pub fn depth(&self, d: f64) -> f32 {
        (if self.at.perspective { d * self.shrink } else { d - (d.abs() * (1.0 - self.shrink) + 2e-6) })
            as f32
    }

    /// As [`Placing::depth`], of depths that are divided by W already, but still in f64.
    #[inline(always)]
    pub fn depths<S: Simd>(&self, simd: S, d: f64x8<S>) -> f64x8<S> {
        if self.at.perspective {
            d * f64x8::splat(simd, self.shrink)
        } else {
            d - (d.abs() * (1.0 - self.shrink) + 2e-6)
        }
    }

    /// All vertices of a patch whose box lies before the near plane and inside the guard band.
    #[inline(always)]
    pub fn place<S: Simd>(&self, simd: S, vertices: &Vertices, patch: &Patch, placed: &mut Placed) {
        let (first, count) = (patch.first_vertex as usize, patch.vertices as usize);
        placed.corner.resize(count, [0; 4]);
        let mut nearest = f32x16::splat(simd, 0.0);
        let mut done = 0;
        while done < count {
            // Sixteen at a time, or the last eight twice.
            let wide = done + 16 <= count;
            let (lo, hi) = (first + done, if wide { first + done + 8 } else { first + done });
            let (x, y) = (load(simd, &vertices.x, lo, hi), load(simd, &vertices.y, lo, hi));
            let [sx, sy, depth] = self.snapped(simd, [x, y, load(simd, &vertices.z, lo, hi)]);
            let depth = depth.bitcast::<f32x16<S>>();
            nearest = nearest.max(depth);
            if wide {
                store_corners(simd, [sx, sy, depth.bitcast()], &mut placed.corner[done..][..16]);
                done += 16;
            } else {
                let mut twice = [[0; 4]; 16];
                store_corners(simd, [sx, sy, depth.bitcast()], &mut twice);
                placed.corner[done..][..8].copy_from_slice(&twice[..8]);
                done += 8;
            }
        }
        placed.nearest = nearest.reduce_max();
    }

    /// Some points of such a patch. What is largest among the depths is not found out.
    #[inline(always)]
    pub fn place_points<S: Simd>(
        &self,
        simd: S,
        mut points: impl ExactSizeIterator<Item = [f32; 3]>,
        placed: &mut Placed,
    ) {
        placed.corner.resize(points.len().next_multiple_of(16), [0; 4]);
        let mut p = [[0.0; 16]; 3];
        for corners in placed.corner.chunks_exact_mut(16) {
            for (lane, point) in points.by_ref().take(16).enumerate() {
                (p[0][lane], p[1][lane], p[2][lane]) = (point[0], point[1], point[2]);
            }
            let x = simd.widen_f32x16(f32x16::from_slice(simd, &p[0]));
            let y = simd.widen_f32x16(f32x16::from_slice(simd, &p[1]));
            let z = simd.widen_f32x16(f32x16::from_slice(simd, &p[2]));
            let [x, y, depth] = self.snapped(simd, [x, y, z]);
            store_corners(simd, [x, y, depth], corners);
        }
    }

    /// Sixteen points on the screen: x and y, 1/256 pixel, and the bits of depths.
    #[inline(always)]
    fn snapped<S: Simd>(&self, simd: S, [x, y, z]: [(f64x8<S>, f64x8<S>); 3]) -> [i32x16<S>; 3] {
        let round = f64x8::splat(simd, ROUND);
        let low = self.project(simd, [x.0, y.0, z.0]);
        let high = self.project(simd, [x.1, y.1, z.1]);
        let x = simd.narrow_i64x8((low[0] + round).bitcast(), (high[0] + round).bitcast());
        let y = simd.narrow_i64x8((low[1] + round).bitcast(), (high[1] + round).bitcast());
        [x, y, simd.narrow_f64x8(low[2], high[2]).bitcast()]
    }

    /// Screen x and y in 1/256 pixel, and depth.
    #[inline(always)]
    fn project<S: Simd>(&self, simd: S, p: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        let at = &self.at;
        let (x, y) = (dot(simd, &at.x, &p), dot(simd, &at.y, &p));
        if at.perspective {
            let reciprocal = f64x8::splat(simd, 1.0) / dot(simd, &at.w, &p);
            [x * reciprocal, y * reciprocal, reciprocal * (at.d[3] * self.shrink)]
        } else {
            let d = dot(simd, &at.d, &p);
            [x, y, d - (d.abs() * (1.0 - self.shrink) + 2e-6)]
        }
    }
}

/// Sixteen vertices' numbers, vertex by vertex.
#[inline(always)]
fn store_corners<S: Simd>(simd: S, [x, y, d]: [i32x16<S>; 3], to: &mut [[i32; 4]]) {
    let (x, y, d) = (quarters(x), quarters(y), quarters(d));
    let none = i32x4::splat(simd, 0);
    for (q, four) in to.chunks_exact_mut(4).enumerate() {
        i32x4::store_four_interleaved([x[q], y[q], d[q], none], four.as_flattened_mut());
    }
}

#[inline(always)]
fn quarters<S: Simd>(v: i32x16<S>) -> [i32x4<S>; 4] {
    let (low, high) = v.split();
    let ((a, b), (c, d)) = (low.split(), high.split());
    [a, b, c, d]
}

/// Eight numbers from each of two places, as f64.
#[inline(always)]
fn load<S: Simd>(simd: S, list: &[f32], lo: usize, hi: usize) -> (f64x8<S>, f64x8<S>) {
    let mut both = [0.0f32; 16];
    both[..8].copy_from_slice(&list[lo..][..8]);
    both[8..].copy_from_slice(&list[hi..][..8]);
    simd.widen_f32x16(f32x16::from_slice(simd, &both))
}

/// Adding this rounds to a whole number, ties to even, whose low 32 bits are the sum's; for |v| < 2³¹.
pub(super) const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

#[inline(always)]
pub(super) fn dot<S: Simd>(simd: S, row: &[f64; 4], p: &[f64x8<S>; 3]) -> f64x8<S> {
    let xy = f64x8::splat(simd, row[0]) * p[0] + f64x8::splat(simd, row[1]) * p[1];
    (xy + f64x8::splat(simd, row[2]) * p[2]) + f64x8::splat(simd, row[3])
}
