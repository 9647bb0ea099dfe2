//! Sixteen boxes at a time onto the screen: which pixels each may touch, and how near it may come.
//!
//! *Bound.* A row's dot product in f32 with rounded coefficients differs from the exact one by at most
//! `8·2⁻²⁴·(|r₀|·X + |r₁|·Y + |r₂|·Z + |r₃|)`, where X, Y, Z are the box's largest coordinates: four rounded
//! coefficients, three products and three sums; what f64 lost of the constant on its way here is added. It is taken for
//! each box by itself. With errors eₓ of a numerator, e_w of W and a quotient q, a screen coordinate is off by at most
//! `(eₓ + |q|·e_w) / (W − e_w)` plus four roundings of q, where W is at least nine times e_w and beyond the near
//! plane. Of a box that reaches nearer than that, or farther than f32 can tell, the quotients say nothing: it may
//! touch every pixel, at any depth, unless it lies wholly beyond a plane through the eye and a side of the image.
//! Each comparison of a number that is not one fails on the side of *visible*.

use crate::raster::{ScreenFromObject, axes, corner_sums, corners, largest, smallest};
use fearless_simd::{Simd, prelude::*};
use std::ops::Range;

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
    /// What an orthographic depth changes by over so far: what lies before the near plane, or beyond the far one, by no
    /// more than that may come into view.
    pub depth_margin: f32,
    /// Pixels on each side that are not of the image: there is what may come into view.
    pub border: f32,
    /// What f64 lost of the rows' constants on the way here, pixels and units of W and of depth.
    lost: [f32; 4],
}

/// Where sixteen boxes lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxesOnScreen {
    /// First column each may touch, clipped to the image; then first row, last column, last row. All of the image
    /// where `depth` is +∞.
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

impl BoxesOnScreen {
    pub const NONE: BoxesOnScreen = BoxesOnScreen {
        left: [0; 16],
        top: [0; 16],
        right: [0; 16],
        bottom: [0; 16],
        depth: [f32::INFINITY; 16],
        farthest: [0.0; 16],
        inside: 0,
        clear: 0,
        uncut: 0,
    };
}

impl BoxView {
    pub fn new(at: &ScreenFromObject, width: u32, height: u32) -> BoxView {
        let pixels = |r: [f64; 4]| r.map(|c| (c / 256.0) as f32);
        let plain = |r: [f64; 4]| r.map(|c| c as f32);
        let below = [at.x, at.y, at.w, at.d].as_flattened().iter().all(|c| c.abs() < 1e18);
        // What is smaller than f32's normal numbers is not rounded to a share of itself.
        let above = !at.perspective || at.w[..3].iter().any(|c| c.abs() > 1e-30);
        let in_range = below && above;
        let [x, y, third] = at.lost().map(|lost| (lost as f32).next_up());
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
            depth_margin: 0.0,
            border: 0.0,
            lost: [x * (1.0 / 256.0), y * (1.0 / 256.0), third, third],
        }
    }
}

/// Pixels that snapping moves a corner by, at most, and as much again.
const SNAP: f32 = 1.0 / 256.0;

/// Eight times half a unit in the last place, and a little for the rounding of the bound itself.
const ROUNDING: f32 = 8.1 / (1 << 24) as f32;

/// Projects boxes given as `min` and `max` (axis, lane).
#[inline(always)]
pub(crate) fn project<S: Simd>(
    simd: S,
    view: &BoxView,
    min: &[[f32; 16]; 3],
    max: &[[f32; 16]; 3],
) -> BoxesOnScreen {
    let mut boxes = BoxesOnScreen::NONE;
    project_lanes(simd, view, [min, max], 0..16, &mut boxes);
    boxes
}

/// Projects some of sixteen boxes into `boxes`; no others are inside. The first of them is the first of a register.
///
/// As many at once as a register holds: sixteen have more corners' coordinates than half as wide registers have room
/// for, and many a node of a tree has no more than a few boxes.
#[inline(always)]
pub(crate) fn project_lanes<S: Simd>(
    simd: S,
    view: &BoxView,
    [min, max]: [&[[f32; 16]; 3]; 2],
    lanes: Range<u32>,
    boxes: &mut BoxesOnScreen,
) {
    (boxes.inside, boxes.clear, boxes.uncut) = (0, 0, 0);
    let (mut from, to) = (lanes.start as usize, lanes.end.min(16) as usize);
    while from < to {
        project_some(simd, view, [&axes(simd, min, from), &axes(simd, max, from)], from, boxes);
        from += S::f32s::LEN;
    }
    boxes.inside &= ((1u32 << to) - (1 << (lanes.start & 15))) as u16;
}

// long because its steps share a register's worth of boxes
/// Projects a register's worth of boxes, and puts them at lanes `from` and on.
#[inline(always)]
fn project_some<S: Simd>(
    simd: S,
    view: &BoxView,
    [lo, hi]: [&[S::f32s; 3]; 2],
    from: usize,
    boxes: &mut BoxesOnScreen,
) {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let reach = reach::<S>(lo, hi);
    let x_error = error::<S>(&reach, &view.x, view.lost[0]);
    let y_error = error::<S>(&reach, &view.y, view.lost[1]);
    let (mut low, mut high) = ([splat(0.0); 2], [splat(0.0); 2]);
    let (least_w, w_error, depth, farthest, clear, mut inside);
    if view.perspective {
        let (x, y) = (corner_sums(&view.x, lo, hi), corner_sums(&view.y, lo, hi));
        let w = corner_sums(&view.w, lo, hi);
        let (mut w_low, mut w_high) = (splat(0.0), splat(0.0));
        for c in 0..8 {
            let (xy, z) = (c & 3, c >> 2);
            let w = w.0[xy] + w.1[z];
            let reciprocal = splat(1.0) / w;
            let (qx, qy) = ((x.0[xy] + x.1[z]) * reciprocal, (y.0[xy] + y.1[z]) * reciprocal);
            if c == 0 {
                (low, high, w_low, w_high) = ([qx, qy], [qx, qy], w, w);
            } else {
                low = [low[0].min(qx), low[1].min(qy)];
                high = [high[0].max(qx), high[1].max(qy)];
                (w_low, w_high) = (w_low.min(w), w_high.max(w));
            }
        }
        w_error = error::<S>(&reach, &view.w, view.lost[2]);
        least_w = w_low - w_error;
        let near = splat(view.d[3] * 1.000_001);
        clear = least_w.simd_gt(near) & least_w.simd_gt(w_error * 8.0);
        let most_w = w_high + w_error;
        inside = most_w.simd_ge(splat(view.d[3] * 0.999_999 - view.margin[0]));
        depth = near / least_w * 1.000_001;
        farthest = near / most_w * 0.999_997;
    } else {
        let d = corners(&view.d, lo, hi);
        let d_error = error::<S>(&reach, &view.d, view.lost[3]);
        (least_w, w_error) = (splat(1.0), splat(0.0));
        let most = largest(&d) + d_error;
        clear = most.simd_le(splat(1.0));
        farthest = smallest(&d) - d_error;
        let beyond = splat(view.depth_margin);
        inside = farthest.simd_le(beyond + 1.0) & most.simd_gt(beyond * -1.0);
        // What is drawn holds more than 0, and hides what lies beyond the far plane.
        depth = most.max(splat(0.0));
        let (x, y) = (corners(&view.x, lo, hi), corners(&view.y, lo, hi));
        low = [smallest(&x), smallest(&y)];
        high = [largest(&x), largest(&y)];
    }
    let mut ring = splat(0.0);
    if view.margin[0] > 0.0 {
        ring = splat(view.margin[0] * view.margin[1] * 1.000_001) / least_w;
    }
    let mut rect = [splat(0.0); 4];
    let (mut within, mut uncut, mut certain) = (clear, clear, clear);
    for (k, (size, error)) in [(view.width, x_error), (view.height, y_error)].into_iter().enumerate() {
        let farthest = low[k].abs().max(high[k].abs());
        let margin = (farthest * w_error + error) / least_w + farthest * (1.0 / (1 << 21) as f32);
        // A square touched in its border alone counts.
        let from = low[k] - margin - 1e-6;
        let to = high[k] + margin + 1e-6;
        within &= from.simd_gt(splat(-8000.0)) & to.simd_lt(splat(24000.0));
        // What may come into view, and whether it is within the border.
        let (lowest, highest) = (ring * -1.0 + view.border, ring + (size - view.border));
        uncut &= (from.simd_gt(ring) & to.simd_lt(ring * -1.0 + size)) | ring.simd_lt(view.border);
        // Asked this way round, what is no number is seen.
        let unseen = from.simd_gt(highest) | to.simd_lt(lowest);
        inside &= !(unseen & clear);
        let far = splat(1e30);
        certain &= from.abs().simd_lt(far) & to.abs().simd_lt(far);
        let (mut first, mut last) = (from.floor(), to.floor());
        if view.centres {
            first = (from - (0.5 + SNAP)).ceil().max(splat(0.0));
            last = (to - (0.5 - SNAP)).floor().min(splat(size - 1.0));
            inside &= !(first.simd_gt(last) & clear);
        }
        if view.border > 0.0 {
            (first, last) = (first.max(lowest.floor()), last.min(highest.floor()));
        }
        rect[k] = first.max(splat(0.0)).min(splat(size - 1.0));
        rect[k + 2] = last.min(splat(size - 1.0)).max(splat(0.0));
    }
    let ordered = ordered::<S>(lo, hi);
    let mut ordered_bits = ordered.to_bitmask() as u16;
    let (mut inside_bits, clear_bits) = (inside.to_bitmask() as u16, clear.to_bitmask() as u16);
    let crossing = inside_bits & !clear_bits & ordered_bits;
    if crossing != 0 {
        inside_bits &= !(crossing & beyond_a_side(simd, view, lo, hi));
    }
    let mut known = certain & ordered;
    if !view.in_range {
        (ordered_bits, known) = (0, splat(0.0).simd_gt(splat(0.0)));
    }
    let whole = [splat(0.0), splat(0.0), splat(view.width - 1.0), splat(view.height - 1.0)];
    for (side, whole) in rect.iter_mut().zip(whole) {
        *side = known.select(*side, whole);
    }
    let to = from + S::f32s::LEN;
    rect[0].to_int::<S::i32s>().store_slice(&mut boxes.left[from..to]);
    rect[1].to_int::<S::i32s>().store_slice(&mut boxes.top[from..to]);
    rect[2].to_int::<S::i32s>().store_slice(&mut boxes.right[from..to]);
    rect[3].to_int::<S::i32s>().store_slice(&mut boxes.bottom[from..to]);
    known.select(depth, splat(f32::INFINITY)).store_slice(&mut boxes.depth[from..to]);
    known.select(farthest, splat(0.0)).store_slice(&mut boxes.farthest[from..to]);
    let lanes = (0xFFFFu32 >> (16 - S::f32s::LEN)) as u16;
    // What is no box may be anywhere.
    boxes.inside |= ((inside_bits | !ordered_bits) & lanes) << from;
    boxes.clear |= (within.to_bitmask() as u16 & ordered_bits) << from;
    boxes.uncut |= (uncut.to_bitmask() as u16 & ordered_bits) << from;
}

/// Largest magnitudes of the coordinates.
#[inline(always)]
fn reach<S: Simd>(lo: &[S::f32s; 3], hi: &[S::f32s; 3]) -> [S::f32s; 3] {
    [lo[0].abs().max(hi[0].abs()), lo[1].abs().max(hi[1].abs()), lo[2].abs().max(hi[2].abs())]
}

/// What a row's products with the corners may be off by.
#[inline(always)]
fn error<S: Simd>(reach: &[S::f32s; 3], r: &[f32; 4], lost: f32) -> S::f32s {
    (reach[0] * r[0].abs() + reach[1] * r[1].abs() + reach[2] * r[2].abs() + r[3].abs()) * ROUNDING + lost
}

/// Coordinates beyond this, metres, could overflow on their way; such a box is seen everywhere.
const FARTHEST: f32 = 1e15;

/// Lanes whose corners are in order and not too far away.
#[inline(always)]
fn ordered<S: Simd>(lo: &[S::f32s; 3], hi: &[S::f32s; 3]) -> S::mask32s {
    let mut good = lo[0].simd_le(hi[0]);
    for k in 0..3 {
        let far = S::f32s::splat(lo[k].token(), FARTHEST);
        good = good & lo[k].simd_le(hi[k]) & lo[k].simd_ge(far * -1.0) & hi[k].simd_le(far);
    }
    good
}

/// Boxes, crossing the near plane, that lie wholly beyond one of the image's sides (planes through the eye). Rarely
/// asked, so that it finds everything again, in a function of its own: kept for it, it would take the registers of
/// what is asked always.
#[inline(never)]
fn beyond_a_side<S: Simd>(simd: S, view: &BoxView, lo: &[S::f32s; 3], hi: &[S::f32s; 3]) -> u16 {
    if view.margin[0] > 0.0 {
        return 0;
    }
    simd.vectorize(
        #[inline(always)]
        || {
            let w = if view.perspective { corners(&view.w, lo, hi) } else { [S::f32s::splat(simd, 1.0); 8] };
            let (x, y) = (corners(&view.x, lo, hi), corners(&view.y, lo, hi));
            let reach = reach::<S>(lo, hi);
            let error = |row: &[f32; 4], k: usize| error::<S>(&reach, row, view.lost[k]);
            let (errors, w_error) = ([error(&view.x, 0), error(&view.y, 1)], error(&view.w, 2));
            let mut beyond = 0u16;
            for (p, own, size) in [(&x, errors[0], view.width), (&y, errors[1], view.height)] {
                for (bound, sign) in [(-0.01f32, 1.0f32), (size + 0.01, -1.0)] {
                    let slack = own + w_error * bound.abs();
                    let mut most = S::f32s::splat(simd, f32::NEG_INFINITY);
                    for c in 0..8 {
                        most = most.max((p[c] - w[c] * bound) * sign);
                    }
                    // Twice the bound, for the rounding of the difference itself.
                    beyond |= most.simd_lt(slack * -2.0).to_bitmask() as u16;
                }
            }
            beyond
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::levels;
    use crate::reference::trouble::{self, Random};
    use fearless_simd::dispatch;

    /// Boxes about the origin, some of which are none.
    fn boxes(random: &mut Random) -> [[[f32; 16]; 3]; 2] {
        let mut sides = [[[0.0; 16]; 3]; 2];
        let [min, max] = &mut sides;
        for (min, max) in min.as_flattened_mut().iter_mut().zip(max.as_flattened_mut()) {
            let (middle, size) = (random.between(-4.0, 4.0), [0.01, 0.5, 20.0][random.below(3) as usize]);
            let none = if random.one_in(40) { -1.0 } else { 1.0 };
            (*min, *max) = ((middle - size * none) as f32, (middle + size * none) as f32);
        }
        sides
    }

    #[inline(always)]
    fn project_eights<S: Simd>(
        simd: S,
        view: &BoxView,
        [min, max]: &[[[f32; 16]; 3]; 2],
        used: u32,
    ) -> [BoxesOnScreen; 2] {
        let all = project(simd, view, min, max);
        let at_once = S::f32s::LEN.max(8) as u32;
        let mut some = BoxesOnScreen::NONE;
        let (mut inside, mut uncut) = (0, 0);
        for from in (0..used).step_by(at_once as usize) {
            project_lanes(simd, view, [min, max], from..used.min(from + at_once), &mut some);
            (inside, uncut) = (inside | some.inside, uncut | some.uncut);
        }
        (some.inside, some.uncut) = (inside, uncut);
        [all, some]
    }

    #[test]
    fn some_boxes_are_where_they_are_among_all() {
        let random = &mut Random::new(3);
        let mut seen = 0;
        for seed in 0..300 {
            let camera = trouble::view(seed);
            let at = ScreenFromObject::of_view(&camera);
            let mut view = BoxView::new(&at, camera.width, camera.height);
            view.centres = random.one_in(3);
            view.margin = if random.one_in(3) { [0.1, 100.0] } else { [0.0; 2] };
            let (sides, used) = (boxes(random), random.below(17));
            for level in levels() {
                let [all, some] = dispatch!(level, simd => project_eights(simd, &view, &sides, used));
                assert_eq!(some.inside, all.inside & ((1u32 << used) - 1) as u16, "seed {seed}, {used}");
                for lane in (0..16).filter(|lane| some.inside >> lane & 1 == 1) {
                    let of = |b: &BoxesOnScreen| {
                        let depths = [b.depth[lane], b.farthest[lane]].map(f32::to_bits);
                        let rect = [b.left[lane], b.top[lane], b.right[lane], b.bottom[lane]];
                        (rect, depths, b.uncut >> lane & 1)
                    };
                    assert_eq!(of(&some), of(&all), "seed {seed}, lane {lane} of {used}");
                    seen += 1;
                }
            }
        }
        assert!(seen > 1000, "{seen}");
    }
}
