//! Sixteen boxes at a time onto the screen: the rectangle of pixel centres each may cover, and the nearest
//! depth it may reach. Conservative in f32.
//!
//! # The bound
//!
//! A row's dot product in f32 with rounded coefficients differs from the exact one by at most
//! `8·2⁻²⁴·(|r₀|·X + |r₁|·Y + |r₂|·Z + |r₃|)` where X, Y, Z bound the coordinates (four rounded
//! coefficients, three products, three sums, and the incremental corner). [`BoxSet::new`] takes that for
//! all boxes of a tree at once. With errors `eₓ` of a numerator, `e_w` of W, and quotient `q`, a screen
//! coordinate is off by at most `(eₓ + |q|·e_w) / (W − e_w)` plus 4 roundings of `q`; snapping a corner
//! moves it by at most 1/512 pixel more. Boxes that may reach the near plane cover the whole window.
//!
//! Far from the origin rows' constants are what is left of large numbers. What f64 lost of them, on the way to the boxes and
//! on the way to what is in them, is [`ScreenFromObject::lost`] each.

use super::box_corners::{axes, corners, largest, smallest};
use super::pyramid::Rect;
use super::transform::ScreenFromObject;
use fearless_simd::{Simd, prelude::*};

/// One object's transform, prepared for its boxes.
#[derive(Clone, Copy, Debug)]
pub struct BoxSet {
    x: [f32; 4],
    y: [f32; 4],
    w: [f32; 4],
    d: [f32; 4],
    error: [f32; 4],
    perspective: bool,
    /// Whether f32 can hold the numbers; else every box counts as seen everywhere.
    in_range: bool,
}

/// Where sixteen boxes lie; lanes outside `alive` are meaningless.
#[derive(Clone, Copy, Debug)]
pub struct ProjectedBoxes {
    /// First column of each box's pixel centres, window coordinates, clipped to the window.
    pub left: [i32; 16],
    /// First row.
    pub top: [i32; 16],
    /// Last column (inclusive).
    pub right: [i32; 16],
    /// Last row (inclusive).
    pub bottom: [i32; 16],
    /// No point of the box has a larger depth; +∞ where the box may reach the near plane.
    pub depth: [f32; 16],
    /// Boxes that may hold a pixel centre of the window.
    pub alive: u16,
}

impl Default for ProjectedBoxes {
    fn default() -> ProjectedBoxes {
        ProjectedBoxes {
            left: [0; 16],
            top: [0; 16],
            right: [0; 16],
            bottom: [0; 16],
            depth: [0.0; 16],
            alive: 0,
        }
    }
}

impl BoxSet {
    /// Prepares `at` for boxes whose coordinates are at most `reach` in magnitude.
    // Called from code for one instruction set, into which closures would not be inlined.
    #[inline(never)]
    pub fn new(at: &ScreenFromObject, reach: [f64; 3]) -> BoxSet {
        let mut rows = [at.x, at.y, at.w, at.d];
        let (mut rounded, mut error) = ([[0f32; 4]; 4], [0f32; 4]);
        let [lost_x, lost_y, lost_third] = at.lost();
        let lost = [lost_x / 256.0, lost_y / 256.0, lost_third, lost_third];
        for (k, row) in rows.iter_mut().enumerate() {
            for (c, rounded) in row.iter_mut().zip(&mut rounded[k]) {
                if k < 2 {
                    *c *= 1.0 / 256.0;
                }
                *rounded = *c as f32;
            }
            let [x, y, z, w] = *row;
            let size = x.abs() * reach[0] + y.abs() * reach[1] + z.abs() * reach[2] + w.abs();
            error[k] = (size * 8.0 / f64::from(1 << 24) + lost[k] * 3.0) as f32 * 1.000_001;
        }
        let [x, y, w, d] = rounded;
        // Squares of nothing are taken here; quotients and margins stay below 1e38 under this bound.
        let in_range = error[0] < 1e25 && error[1] < 1e25 && error[2] < 1e25 && error[3] < 1e25;
        BoxSet { x, y, w, d, error, perspective: at.perspective, in_range }
    }
}

/// Projects boxes given as `min` and `max` (axis, lane) into `window` (image coordinates).
///
/// As many at once as a register holds: sixteen have 48 corners' coordinates, for which half as wide registers
/// have no room.
#[inline(always)]
pub fn project_boxes<S: Simd>(
    simd: S,
    set: &BoxSet,
    min: &[[f32; 16]; 3],
    max: &[[f32; 16]; 3],
    window: Rect,
    boxes: &mut ProjectedBoxes,
) {
    if !set.in_range {
        *boxes = everywhere(window);
        return;
    }
    boxes.alive = 0;
    let mut from = 0;
    while from < 16 {
        let (lo, hi) = (axes(simd, min, from), axes(simd, max, from));
        project_some(simd, set, &lo, &hi, window, from, boxes);
        from += S::f32s::LEN;
    }
}

// A kernel, long because its steps share the corners' coordinates.
/// Projects a vector's worth of boxes, and puts them at lanes `from` and on.
#[inline(always)]
fn project_some<S: Simd>(
    simd: S,
    set: &BoxSet,
    lo: &[S::f32s; 3],
    hi: &[S::f32s; 3],
    window: Rect,
    from: usize,
    boxes: &mut ProjectedBoxes,
) {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let (lowest, depth, safe, before_near);
    let mut low = [splat(0.0); 2];
    let mut high = [splat(0.0); 2];
    if set.perspective {
        let w = corners(&set.w, lo, hi);
        lowest = smallest(&w) - set.error[2];
        let highest = largest(&w) + set.error[2];
        let near = splat(set.d[3]);
        // Relative error of W below 1/8, else the box counts as crossing the near plane.
        safe = lowest.simd_gt(near.max(splat(set.error[2] * 8.0)));
        before_near = highest.simd_ge(near * 0.999_999);
        depth = near / lowest * 1.000_001;
        let (x, y) = (corners(&set.x, lo, hi), corners(&set.y, lo, hi));
        for c in 0..8 {
            let reciprocal = splat(1.0) / w[c];
            let (qx, qy) = (x[c] * reciprocal, y[c] * reciprocal);
            if c == 0 {
                (low, high) = ([qx, qy], [qx, qy]);
            } else {
                low = [low[0].min(qx), low[1].min(qy)];
                high = [high[0].max(qx), high[1].max(qy)];
            }
        }
    } else {
        let d = corners(&set.d, lo, hi);
        let nearest = largest(&d) + set.error[3];
        lowest = splat(1.0);
        safe = nearest.simd_le(splat(1.0));
        let farthest = smallest(&d) - set.error[3];
        before_near = farthest.simd_le(splat(1.0)) & nearest.simd_gt(splat(0.0));
        depth = nearest;
        let (x, y) = (corners(&set.x, lo, hi), corners(&set.y, lo, hi));
        low = [smallest(&x), smallest(&y)];
        high = [largest(&x), largest(&y)];
    }
    let mut edges = [splat(0.0); 4];
    let mut meets = before_near;
    let sizes = [(window.left, window.right), (window.top, window.bottom)];
    for k in 0..2 {
        let (first, last) = (sizes[k].0 as f32, (sizes[k].1 - 1) as f32);
        let farthest_off = low[k].abs().max(high[k].abs());
        let margin =
            (farthest_off * set.error[2] + set.error[k]) / lowest + farthest_off * (1.0 / (1 << 21) as f32);
        // Pixel p's centre is p + 1/2; 1/256 covers snapping.
        let begin = (low[k] - margin - (0.5 + 1.0 / 256.0)).ceil().max(splat(first));
        let end = (high[k] + margin - (0.5 - 1.0 / 256.0)).floor().min(splat(last));
        // The whole window where the box may cross the near plane.
        edges[k] = safe.select(begin, splat(first)) - first;
        edges[k + 2] = safe.select(end, splat(last)) - first;
        meets &= edges[k].simd_le(edges[k + 2]);
    }
    // Boxes that cross the near plane are still tested against the window's four sides.
    let crossing = !safe & meets;
    let mut alive = meets.to_bitmask() as u16;
    if crossing.any_true() {
        alive &= !outside_sides(simd, set, lo, hi, window) | !(crossing.to_bitmask() as u16);
    }
    boxes.alive |= alive << from;
    let to = from + S::f32s::LEN;
    edges[0].to_int::<S::i32s>().store_slice(&mut boxes.left[from..to]);
    edges[1].to_int::<S::i32s>().store_slice(&mut boxes.top[from..to]);
    edges[2].to_int::<S::i32s>().store_slice(&mut boxes.right[from..to]);
    edges[3].to_int::<S::i32s>().store_slice(&mut boxes.bottom[from..to]);
    safe.select(depth, splat(f32::INFINITY)).store_slice(&mut boxes.depth[from..to]);
}

/// The answer that is always safe.
#[inline(never)]
fn everywhere(window: Rect) -> ProjectedBoxes {
    ProjectedBoxes {
        left: [0; 16],
        top: [0; 16],
        right: [window.right - window.left - 1; 16],
        bottom: [window.bottom - window.top - 1; 16],
        depth: [f32::INFINITY; 16],
        alive: 0xFFFF,
    }
}

/// Boxes that lie wholly beyond one of the window's sides (planes through the eye). Rarely asked, so that it finds
/// the corners again, in a function of its own: kept for it, they would take the registers of what is asked always.
#[inline(never)]
fn outside_sides<S: Simd>(simd: S, set: &BoxSet, lo: &[S::f32s; 3], hi: &[S::f32s; 3], window: Rect) -> u16 {
    simd.vectorize(
        #[inline(always)]
        || {
            let w = if set.perspective { corners(&set.w, lo, hi) } else { [S::f32s::splat(simd, 1.0); 8] };
            let across = [set.error[0], window.left as f32, window.right as f32];
            let down = [set.error[1], window.top as f32, window.bottom as f32];
            beyond(simd, set, &corners(&set.x, lo, hi), &w, across)
                | beyond(simd, set, &corners(&set.y, lo, hi), &w, down)
        },
    )
}

/// Boxes that lie wholly before `first` or beyond `last`, with the corners' numerators `p` and their `error`.
#[inline(always)]
fn beyond<S: Simd>(
    simd: S,
    set: &BoxSet,
    p: &[S::f32s; 8],
    w: &[S::f32s; 8],
    [error, first, last]: [f32; 3],
) -> u16 {
    let mut outside = 0u16;
    for (bound, sign) in [(first, 1.0f32), (last, -1.0f32)] {
        let slack = error + bound.abs() * set.error[2];
        let mut most = S::f32s::splat(simd, f32::NEG_INFINITY);
        for c in 0..8 {
            most = most.max((p[c] - w[c] * bound) * sign);
        }
        // Twice the bound, for the rounding of the difference itself.
        outside |= most.simd_lt(S::f32s::splat(simd, -2.0 * slack)).to_bitmask() as u16;
    }
    outside
}
