//! Sixteen boxes at a time onto the screen: which pixels each may touch, and how near it may come.
//!
//! *Bound.* A row's dot product in f32 with rounded coefficients differs from the exact one by at most
//! `8·2⁻²⁴·(|r₀|·X + |r₁|·Y + |r₂|·Z + |r₃|)`, where X, Y, Z are the box's largest coordinates: four rounded
//! coefficients, three products and three sums. It is taken for each box by itself. With errors eₓ of a
//! numerator, e_w of W and a quotient q, a screen coordinate is off by at most
//! `(eₓ + |q|·e_w) / (W − e_w)` plus four roundings of q. Each comparison of a number that is not one fails
//! on the side of *visible*.

use crate::raster::{ScreenFromObject, axes, corner_sums, corners, largest, smallest};
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};

/// A transform made ready for boxes of its space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxView {
    /// Pixels.
    x: [f32; 4],
    y: [f32; 4],
    w: [f32; 4],
    d: [f32; 4],
    perspective: bool,
    width: f32,
    height: f32,
    /// Whether f32 can hold the numbers; else every box is seen everywhere.
    in_range: bool,
    /// Whether only pixels whose centres a box holds count as touched, up to what snapping moves.
    pub centres: bool,
    /// How far the eye may move, metres, and pixels that a metre covers at distance 1: what lies beyond the
    /// image's border by no more than their product over its distance may come into view.
    pub margin: [f32; 2],
}

/// Where sixteen boxes lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxesOnScreen {
    /// First column each may touch, clipped to the image; then first row, last column, last row.
    pub left: [i32; 16],
    pub top: [i32; 16],
    pub right: [i32; 16],
    pub bottom: [i32; 16],
    /// No point of the box has a larger depth; +∞ where it may reach the near plane.
    pub depth: [f32; 16],
    /// No point of the box has a smaller depth; 0 where it may reach the near plane.
    pub farthest: [f32; 16],
    /// Boxes that the image may show.
    pub inside: u16,
    /// Of these, boxes wholly beyond the near plane and within the guard band.
    pub clear: u16,
    /// Of these, boxes that no border of the image cuts.
    pub uncut: u16,
}

impl BoxView {
    pub fn new(at: &ScreenFromObject, width: u32, height: u32) -> BoxView {
        let pixels = |r: [f64; 4]| r.map(|c| (c / 256.0) as f32);
        let plain = |r: [f64; 4]| r.map(|c| c as f32);
        let in_range = [at.x, at.y, at.w, at.d].as_flattened().iter().all(|c| c.abs() < 1e18);
        BoxView {
            in_range,
            x: pixels(at.x),
            y: pixels(at.y),
            w: plain(at.w),
            d: plain(at.d),
            perspective: at.perspective,
            width: width as f32,
            height: height as f32,
            centres: false,
            margin: [0.0; 2],
        }
    }
}

/// Pixels that snapping moves a corner by, at most, and as much again.
const SNAP: f32 = 1.0 / 256.0;

/// Eight times half a unit in the last place, and a little for the rounding of the bound itself.
const ROUNDING: f32 = 8.1 / (1 << 24) as f32;

// long because its steps share sixteen boxes' worth of registers
/// Projects boxes given as `min` and `max` (axis, lane).
#[inline(always)]
pub(crate) fn project<S: Simd>(
    simd: S,
    view: &BoxView,
    min: &[[f32; 16]; 3],
    max: &[[f32; 16]; 3],
) -> BoxesOnScreen {
    let (lo, hi) = (axes(simd, min, 0), axes(simd, max, 0));
    let reach = reach(&lo, &hi);
    let (x_error, y_error) = (error(&reach, &view.x), error(&reach, &view.y));
    let (mut low, mut high) = ([f32x16::splat(simd, 0.0); 2], [f32x16::splat(simd, 0.0); 2]);
    let (least_w, w_error, depth, farthest, clear, mut inside);
    if view.perspective {
        let (x, y) = (corner_sums(&view.x, &lo, &hi), corner_sums(&view.y, &lo, &hi));
        let w = corner_sums(&view.w, &lo, &hi);
        let (mut w_low, mut w_high) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 0.0));
        for c in 0..8 {
            let (xy, z) = (c & 3, c >> 2);
            let w = w.0[xy] + w.1[z];
            let reciprocal = f32x16::splat(simd, 1.0) / w;
            let (qx, qy) = ((x.0[xy] + x.1[z]) * reciprocal, (y.0[xy] + y.1[z]) * reciprocal);
            if c == 0 {
                (low, high, w_low, w_high) = ([qx, qy], [qx, qy], w, w);
            } else {
                low = [low[0].min(qx), low[1].min(qy)];
                high = [high[0].max(qx), high[1].max(qy)];
                (w_low, w_high) = (w_low.min(w), w_high.max(w));
            }
        }
        w_error = error(&reach, &view.w);
        least_w = w_low - w_error;
        let near = f32x16::splat(simd, view.d[3] * 1.000_001);
        clear = least_w.simd_gt(near) & least_w.simd_gt(w_error * 8.0);
        let most_w = w_high + w_error;
        inside = most_w.simd_ge(f32x16::splat(simd, view.d[3] * 0.999_999 - view.margin[0]));
        depth = near / least_w * 1.000_001;
        farthest = near / most_w * 0.999_997;
    } else {
        let d = corners(&view.d, &lo, &hi);
        let d_error = error(&reach, &view.d);
        (least_w, w_error) = (f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
        depth = largest(&d) + d_error;
        clear = depth.simd_le(f32x16::splat(simd, 1.0));
        farthest = smallest(&d) - d_error;
        inside = farthest.simd_le(f32x16::splat(simd, 1.0)) & depth.simd_gt(f32x16::splat(simd, 0.0));
        let (x, y) = (corners(&view.x, &lo, &hi), corners(&view.y, &lo, &hi));
        low = [smallest(&x), smallest(&y)];
        high = [largest(&x), largest(&y)];
    }
    let ring = f32x16::splat(simd, view.margin[0] * view.margin[1] * 1.000_001) / least_w;
    let mut rect = [f32x16::splat(simd, 0.0); 4];
    let (mut within, mut uncut, mut certain) = (clear, clear, clear);
    for (k, (size, error)) in [(view.width, x_error), (view.height, y_error)].into_iter().enumerate() {
        let farthest = low[k].abs().max(high[k].abs());
        let margin = (farthest * w_error + error) / least_w + farthest * (1.0 / (1 << 21) as f32);
        // A square touched in its border alone counts.
        let from = low[k] - margin - 1e-6;
        let to = high[k] + margin + 1e-6;
        within &= from.simd_gt(f32x16::splat(simd, -8000.0)) & to.simd_lt(f32x16::splat(simd, 24000.0));
        uncut &= from.simd_gt(ring) & to.simd_lt(ring * -1.0 + size);
        // Asked this way round, what is no number is seen.
        let unseen = from.simd_gt(ring + size) | to.simd_lt(ring * -1.0);
        inside &= !(unseen & clear);
        let far = f32x16::splat(simd, 1e30);
        certain &= from.abs().simd_lt(far) & to.abs().simd_lt(far);
        let (mut first, mut last) = (from.floor(), to.floor());
        if view.centres {
            first = (from - (0.5 + SNAP)).ceil().max(f32x16::splat(simd, 0.0));
            last = (to - (0.5 - SNAP)).floor().min(f32x16::splat(simd, size - 1.0));
            inside &= !(first.simd_gt(last) & clear);
        }
        rect[k] = first.max(f32x16::splat(simd, 0.0)).min(f32x16::splat(simd, size - 1.0));
        rect[k + 2] = last.min(f32x16::splat(simd, size - 1.0)).max(f32x16::splat(simd, 0.0));
    }
    let mut inside_bits = inside.to_bitmask() as u16;
    let clear_bits = clear.to_bitmask() as u16;
    let crossing = inside_bits & !clear_bits;
    if crossing != 0 {
        inside_bits &= !(crossing & beyond_a_side(simd, view, &lo, &hi, [x_error, y_error]));
    }
    let ordered = if view.in_range { ordered(&lo, &hi).to_bitmask() as u16 } else { 0 };
    let infinite = f32x16::splat(simd, f32::INFINITY);
    let known = certain & mask32x16::from_bitmask(simd, u64::from(ordered));
    BoxesOnScreen {
        left: whole(rect[0]),
        top: whole(rect[1]),
        right: whole(rect[2]),
        bottom: whole(rect[3]),
        depth: known.select(depth, infinite).into(),
        farthest: known.select(farthest, f32x16::splat(simd, 0.0)).into(),
        // What is no box may be anywhere.
        inside: inside_bits | !ordered,
        clear: within.to_bitmask() as u16 & ordered,
        uncut: uncut.to_bitmask() as u16 & ordered,
    }
}

/// Largest magnitudes of the coordinates.
#[inline(always)]
fn reach<S: Simd>(lo: &[f32x16<S>; 3], hi: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
    [lo[0].abs().max(hi[0].abs()), lo[1].abs().max(hi[1].abs()), lo[2].abs().max(hi[2].abs())]
}

/// What a row's products with the corners may be off by.
#[inline(always)]
fn error<S: Simd>(reach: &[f32x16<S>; 3], r: &[f32; 4]) -> f32x16<S> {
    (reach[0] * r[0].abs() + reach[1] * r[1].abs() + reach[2] * r[2].abs() + r[3].abs()) * ROUNDING
}

/// Coordinates beyond this, metres, could overflow on their way; such a box is seen everywhere.
const FARTHEST: f32 = 1e15;

/// Lanes whose corners are in order and not too far away.
#[inline(always)]
fn ordered<S: Simd>(lo: &[f32x16<S>; 3], hi: &[f32x16<S>; 3]) -> mask32x16<S> {
    let mut good = lo[0].simd_le(hi[0]);
    for k in 0..3 {
        let far = f32x16::splat(lo[k].token(), FARTHEST);
        good = good & lo[k].simd_le(hi[k]) & lo[k].simd_ge(far * -1.0) & hi[k].simd_le(far);
    }
    good
}

/// Boxes, crossing the near plane, that lie wholly beyond one of the image's sides (planes through the eye).
#[inline(always)]
fn beyond_a_side<S: Simd>(
    simd: S,
    view: &BoxView,
    lo: &[f32x16<S>; 3],
    hi: &[f32x16<S>; 3],
    errors: [f32x16<S>; 2],
) -> u16 {
    if view.margin[0] > 0.0 {
        return 0;
    }
    let one = f32x16::splat(simd, 1.0);
    let w = if view.perspective { corners(&view.w, lo, hi) } else { [one; 8] };
    let (x, y) = (corners(&view.x, lo, hi), corners(&view.y, lo, hi));
    let w_error = error(&reach(lo, hi), &view.w);
    let mut beyond = 0u16;
    for (p, own, size) in [(&x, errors[0], view.width), (&y, errors[1], view.height)] {
        for (bound, sign) in [(-0.01f32, 1.0f32), (size + 0.01, -1.0)] {
            let slack = own + w_error * bound.abs();
            let mut most = f32x16::splat(simd, f32::NEG_INFINITY);
            for c in 0..8 {
                most = most.max((p[c] - w[c] * bound) * sign);
            }
            // Twice the bound, for the rounding of the difference itself.
            beyond |= most.simd_lt(slack * -2.0).to_bitmask() as u16;
        }
    }
    beyond
}

#[inline(always)]
fn whole<S: Simd>(v: f32x16<S>) -> [i32; 16] {
    v.to_int::<fearless_simd::i32x16<S>>().into()
}
