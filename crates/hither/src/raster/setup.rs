//! Triangle setup, sixteen at a time: transform, facing, bounds, depth plane.
//!
//! ```text
//! 1. transform corners in f64        X Y W D, see `ScreenFromObject`
//! 2. set aside lanes that need clipping (near plane, guard band)
//! 3. project, snap to 1/256 pixel    exact integers held in f64
//! 4. area (exact), facing, pixel bounds: drop what faces away or holds no pixel centre
//! 5. depth plane of the unsnapped corners; clamp range
//! ```
//!
//! f64 throughout: a snapped coordinate is then within 2⁻³⁰ pixel of the true one before rounding, at any
//! scale from 1e-18 to 1e18, and the cost hides behind the divisions.

use super::guard::{GUARD_MAX, GUARD_MIN};
use super::pyramid::{Rect, Sixteen};
use super::transform::ScreenFromObject;
use fearless_simd::{Simd, f32x16, f64x8, i32x16, mask32x16, prelude::*};

/// Up to sixteen triangles as a structure of arrays: what a leaf of a mesh's tree holds.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct TriangleBlock {
    /// `corner[k][axis][lane]`, object space.
    pub corner: [[[f32; 16]; 3]; 3],
    /// Index of each triangle in its mesh.
    pub triangle: [u32; 16],
    /// Lanes in use.
    pub lanes: u16,
    /// Lanes whose back faces are drawn too.
    pub two_sided: u16,
    /// Lanes with an alpha mask: their texels may be holes.
    pub masked: u16,
}

impl TriangleBlock {
    /// A block without triangles.
    pub const EMPTY: TriangleBlock =
        TriangleBlock { corner: [[[0.0; 16]; 3]; 3], triangle: [0; 16], lanes: 0, two_sided: 0, masked: 0 };

    /// Corners of one lane.
    pub fn corners(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corner.map(|c| c.map(|axis| axis[lane]))
    }
}

/// Slopes beyond this belong to triangles seen edge-on; clamping keeps their arithmetic finite.
pub(super) const MAX_SLOPE: f64 = 1e30;

/// A triangle on the screen, ready to be filled.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScreenTriangle {
    /// Snapped corners, 1/256 pixel, in the order that makes the doubled area positive.
    pub x: [i32; 3],
    pub y: [i32; 3],
    /// Image pixels whose centres the snapped bounding box holds, clipped to the window; not empty.
    pub bounds: Rect,
    /// Depth at the centre of image pixel (x, y) is `plane[0]·x + plane[1]·y + plane[2]`.
    pub plane: [f64; 3],
    /// Depths of the corners: every pixel's depth is clamped to this range.
    pub depth_min: f32,
    pub depth_max: f32,
}

/// Sixteen set-up triangles; lanes outside `draw` are meaningless. Kept from block to block: filling a
/// kilobyte with zeros first costs as much as a tenth of the setup.
#[derive(Debug)]
pub(super) struct Lanes {
    x: [Sixteen<i32>; 3],
    y: [Sixteen<i32>; 3],
    left: Sixteen<i32>,
    top: Sixteen<i32>,
    right: Sixteen<i32>,
    bottom: Sixteen<i32>,
    plane: [[Half; 2]; 3],
    depth_min: Sixteen<f32>,
    pub depth_max: Sixteen<f32>,
    /// Lanes to fill.
    pub draw: u16,
    /// Lanes whose unclipped bounds hold at most 2×2 pixels, of which they cover one at least.
    pub tiny: u16,
    /// Of those, the lanes that cover the pixel of their bounds at the left and top, right and top, left and
    /// bottom, right and bottom.
    pub covers: [u16; 4],
    /// Lanes to clip first.
    pub clip: u16,
    /// Lanes that face the eye (clipped ones not counted).
    pub front_facing: u16,
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Half([f64; 8]);

impl Default for Lanes {
    fn default() -> Lanes {
        let whole = Sixteen([0; 16]);
        Lanes {
            x: [whole; 3],
            y: [whole; 3],
            left: whole,
            top: whole,
            right: whole,
            bottom: whole,
            plane: [[Half([0.0; 8]); 2]; 3],
            depth_min: Sixteen([0.0; 16]),
            depth_max: Sixteen([0.0; 16]),
            draw: 0,
            tiny: 0,
            covers: [0; 4],
            clip: 0,
            front_facing: 0,
        }
    }
}

impl Lanes {
    #[inline(always)]
    pub fn get(&self, lane: usize) -> ScreenTriangle {
        let half = lane / 8;
        let plane = |i: usize| self.plane[i][half].0[lane % 8];
        ScreenTriangle {
            x: [self.x[0].0[lane], self.x[1].0[lane], self.x[2].0[lane]],
            y: [self.y[0].0[lane], self.y[1].0[lane], self.y[2].0[lane]],
            bounds: Rect {
                left: self.left.0[lane],
                top: self.top.0[lane],
                right: self.right.0[lane] + 1,
                bottom: self.bottom.0[lane] + 1,
            },
            plane: [plane(0), plane(1), plane(2)],
            depth_min: self.depth_min.0[lane],
            depth_max: self.depth_max.0[lane],
        }
    }
}

/// Eight triangles half-way through setup.
struct Eight<S: Simd> {
    x: [f64x8<S>; 3],
    y: [f64x8<S>; 3],
    d: [f64x8<S>; 3],
    snapped_x: [f64x8<S>; 3],
    snapped_y: [f64x8<S>; 3],
    clip: u16,
}

/// Adding and subtracting this rounds to a whole number, ties to even, for |v| < 2⁵¹, on every machine
/// alike; the sum's low 32 bits are that number.
const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

#[inline(always)]
pub(super) fn set_up<S: Simd>(
    simd: S,
    block: &TriangleBlock,
    at: &ScreenFromObject,
    window: Rect,
    lanes: &mut Lanes,
) {
    let halves = widen_corners(simd, block);
    let low = project(simd, &halves[0], at);
    let high = project(simd, &halves[1], at);
    let clip = (low.clip | high.clip << 8) & block.lanes;

    // Exact: coordinates have 24 bits, products 48, and f64 holds 53.
    let zero = f64x8::splat(simd, 0.0);
    let (area_low, area_high) = (low.area(), high.area());
    let positive = sixteen_bits(area_low.simd_gt(zero).to_bitmask(), area_high.simd_gt(zero).to_bitmask());
    let negative = sixteen_bits(area_low.simd_lt(zero).to_bitmask(), area_high.simd_lt(zero).to_bitmask());
    let front = if at.front_sign > 0.0 { positive } else { negative };
    let facing = (front | ((positive | negative) & block.two_sided)) & block.lanes & !clip;

    let x = to_i32(simd, &low.snapped_x, &high.snapped_x);
    let y = to_i32(simd, &low.snapped_y, &high.snapped_y);
    let (first_x, last_x, first_y, last_y) =
        (first_pixel(&x), last_pixel(&x), first_pixel(&y), last_pixel(&y));
    let left = first_x.max(i32x16::splat(simd, window.left));
    let top = first_y.max(i32x16::splat(simd, window.top));
    let right = last_x.min(i32x16::splat(simd, window.right - 1));
    let bottom = last_y.min(i32x16::splat(simd, window.bottom - 1));
    let holds_a_centre = (left.simd_le(right) & top.simd_le(bottom)).to_bitmask() as u16;
    let draw = facing & holds_a_centre;
    let tiny = ((last_x - first_x).simd_le(1) & (last_y - first_y).simd_le(1)).to_bitmask() as u16 & draw;

    lanes.clip = clip;
    lanes.front_facing = facing;
    lanes.draw = draw;
    lanes.tiny = 0;
    if draw == 0 {
        return;
    }

    // Corners 1 and 2 change places where that makes the area positive.
    let swap = mask32x16::from_bitmask(simd, u64::from(negative));
    let x = [x[0], swap.select(x[2], x[1]), swap.select(x[1], x[2])];
    let y = [y[0], swap.select(y[2], y[1]), swap.select(y[1], y[2])];
    if tiny != 0 {
        lanes.covers = covered_pixels(simd, &x, &y, first_x, first_y);
        let [a, b, c, d] = lanes.covers;
        lanes.draw &= !tiny | (a | b | c | d);
        lanes.tiny = tiny & lanes.draw;
        if lanes.draw == 0 {
            return;
        }
    }
    for k in 0..3 {
        x[k].store_slice(&mut lanes.x[k].0);
        y[k].store_slice(&mut lanes.y[k].0);
    }
    left.store_slice(&mut lanes.left.0);
    top.store_slice(&mut lanes.top.0);
    right.store_slice(&mut lanes.right.0);
    bottom.store_slice(&mut lanes.bottom.0);
    store_depths(simd, &low, &high, lanes);
}

/// Stores the lanes' depth planes, and their corners' least and largest depths.
#[inline(always)]
fn store_depths<S: Simd>(simd: S, low: &Eight<S>, high: &Eight<S>, lanes: &mut Lanes) {
    let planes = [depth_plane(simd, low), depth_plane(simd, high)];
    for (i, plane) in lanes.plane.iter_mut().enumerate() {
        for half in 0..2 {
            planes[half][i].store_slice(&mut plane[half].0);
        }
    }
    let d0 = simd.narrow_f64x8(low.d[0], high.d[0]);
    let d1 = simd.narrow_f64x8(low.d[1], high.d[1]);
    let d2 = simd.narrow_f64x8(low.d[2], high.d[2]);
    d0.min(d1).min(d2).store_slice(&mut lanes.depth_min.0);
    d0.max(d1).max(d2).store_slice(&mut lanes.depth_max.0);
}

#[inline(always)]
fn widen_corners<S: Simd>(simd: S, block: &TriangleBlock) -> [[[f64x8<S>; 3]; 3]; 2] {
    let zero = f64x8::splat(simd, 0.0);
    let mut halves = [[[zero; 3]; 3]; 2];
    for (k, corner) in block.corner.iter().enumerate() {
        for (axis, lanes) in corner.iter().enumerate() {
            let (low, high) = simd.widen_f32x16(f32x16::from_slice(simd, lanes));
            halves[0][k][axis] = low;
            halves[1][k][axis] = high;
        }
    }
    halves
}

#[inline(always)]
fn project<S: Simd>(simd: S, corners: &[[f64x8<S>; 3]; 3], at: &ScreenFromObject) -> Eight<S> {
    let zero = f64x8::splat(simd, 0.0);
    let (mut x, mut y, mut d) = ([zero; 3], [zero; 3], [zero; 3]);
    let (mut snapped_x, mut snapped_y) = ([zero; 3], [zero; 3]);
    let mut inside = 0xFFu64;
    let (guard_min, guard_max) =
        (f64x8::splat(simd, GUARD_MIN * 256.0), f64x8::splat(simd, GUARD_MAX * 256.0));
    for k in 0..3 {
        (x[k], y[k]) = (dot(simd, &at.x, &corners[k]), dot(simd, &at.y, &corners[k]));
        if at.perspective {
            let w = dot(simd, &at.w, &corners[k]);
            let reciprocal = f64x8::splat(simd, 1.0) / w;
            x[k] *= reciprocal;
            y[k] *= reciprocal;
            d[k] = f64x8::splat(simd, at.d[3]) * reciprocal;
            // D ≤ W, and W > 0: behind the eye the quotient would be negative.
            inside &= (f64x8::splat(simd, at.d[3]).simd_le(w)).to_bitmask();
        } else {
            d[k] = dot(simd, &at.d, &corners[k]);
            inside &= d[k].simd_le(f64x8::splat(simd, 1.0)).to_bitmask();
        }
        inside &= (x[k].simd_ge(guard_min) & x[k].simd_le(guard_max)).to_bitmask();
        inside &= (y[k].simd_ge(guard_min) & y[k].simd_le(guard_max)).to_bitmask();
        snapped_x[k] = x[k] + f64x8::splat(simd, ROUND) - f64x8::splat(simd, ROUND);
        snapped_y[k] = y[k] + f64x8::splat(simd, ROUND) - f64x8::splat(simd, ROUND);
    }
    Eight { x, y, d, snapped_x, snapped_y, clip: !inside as u16 & 0xFF }
}

/// Depth as a plane over image pixel centres, from the unsnapped corners.
#[inline(always)]
fn depth_plane<S: Simd>(simd: S, e: &Eight<S>) -> [f64x8<S>; 3] {
    let (x1, y1, d1) = (e.x[1] - e.x[0], e.y[1] - e.y[0], e.d[1] - e.d[0]);
    let (x2, y2, d2) = (e.x[2] - e.x[0], e.y[2] - e.y[0], e.d[2] - e.d[0]);
    let per_pixel = f64x8::splat(simd, 256.0) / (x1 * y2 - x2 * y1);
    let a = sane(simd, (d1 * y2 - d2 * y1) * per_pixel);
    let b = sane(simd, (d2 * x1 - d1 * x2) * per_pixel);
    let to_pixel = f64x8::splat(simd, 1.0 / 256.0);
    let half = f64x8::splat(simd, 0.5);
    // At pixel (0, 0)'s centre: from corner 0, back by its distance to that centre.
    let c = e.d[0] - a * (e.x[0] * to_pixel - half) - b * (e.y[0] * to_pixel - half);
    [a, b, c]
}

/// A slope, or 0 where it is too steep or no number: a triangle seen edge-on, whose depth is clamped anyway.
#[inline(always)]
fn sane<S: Simd>(simd: S, slope: f64x8<S>) -> f64x8<S> {
    slope.abs().simd_le(f64x8::splat(simd, MAX_SLOPE)).select(slope, f64x8::splat(simd, 0.0))
}

#[inline(always)]
fn dot<S: Simd>(simd: S, row: &[f64; 4], p: &[f64x8<S>; 3]) -> f64x8<S> {
    let xy = f64x8::splat(simd, row[0]) * p[0] + f64x8::splat(simd, row[1]) * p[1];
    (xy + f64x8::splat(simd, row[2]) * p[2]) + f64x8::splat(simd, row[3])
}

/// Which lanes cover the centre of pixel (px, py) and of its neighbours to the right, below, and below to the
/// right, by the fill rule; for triangles whose bounds hold no others (those of larger ones overflow and mean
/// nothing).
#[inline(always)]
fn covered_pixels<S: Simd>(
    simd: S,
    x: &[i32x16<S>; 3],
    y: &[i32x16<S>; 3],
    px: i32x16<S>,
    py: i32x16<S>,
) -> [u16; 4] {
    let zero = i32x16::splat(simd, 0);
    let (cx, cy) = ((px << 8) + 128, (py << 8) + 128);
    let mut outside = [zero; 4];
    for k in 0..3 {
        let (dx, dy) = (x[(k + 1) % 3] - x[k], y[(k + 1) % 3] - y[k]);
        let owned = dy.simd_lt(zero) | (dy.simd_eq(zero) & dx.simd_gt(zero));
        let bias = owned.select(zero, i32x16::splat(simd, -1));
        let here = dx * (cy - y[k]) - dy * (cx - x[k]) + bias;
        let (right, below) = (here - (dy << 8), dx << 8);
        outside[0] |= here;
        outside[1] |= right;
        outside[2] |= here + below;
        outside[3] |= right + below;
    }
    [
        !outside[0].simd_lt(zero).to_bitmask() as u16,
        !outside[1].simd_lt(zero).to_bitmask() as u16,
        !outside[2].simd_lt(zero).to_bitmask() as u16,
        !outside[3].simd_lt(zero).to_bitmask() as u16,
    ]
}

/// First pixel whose centre 256·p + 128 is not before a box's smallest coordinate.
#[inline(always)]
fn first_pixel<S: Simd>(v: &[i32x16<S>; 3]) -> i32x16<S> {
    (v[0].min(v[1]).min(v[2]) + 127) >> 8
}

/// Last pixel whose centre is not beyond its largest.
#[inline(always)]
fn last_pixel<S: Simd>(v: &[i32x16<S>; 3]) -> i32x16<S> {
    (v[0].max(v[1]).max(v[2]) - 128) >> 8
}

impl<S: Simd> Eight<S> {
    /// Doubled area on the screen (y down), 1/65536 pixel, exact.
    #[inline(always)]
    fn area(&self) -> f64x8<S> {
        let (x, y) = (&self.snapped_x, &self.snapped_y);
        (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    }
}

#[inline(always)]
fn to_i32<S: Simd>(simd: S, low: &[f64x8<S>; 3], high: &[f64x8<S>; 3]) -> [i32x16<S>; 3] {
    let round = f64x8::splat(simd, ROUND);
    let mut out = [i32x16::splat(simd, 0); 3];
    for k in 0..3 {
        out[k] = simd.narrow_i64x8((low[k] + round).bitcast(), (high[k] + round).bitcast());
    }
    out
}

#[inline(always)]
fn sixteen_bits(low: u64, high: u64) -> u16 {
    low as u16 | (high as u16) << 8
}
