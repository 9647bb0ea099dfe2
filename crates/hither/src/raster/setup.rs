//! Triangle setup, a vector's worth at a time: transform, facing, bounds, depth plane.
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
use fearless_simd::{Simd, prelude::*};

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
    plane: [Doubles; 3],
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
struct Doubles([f64; 16]);

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
            plane: [Doubles([0.0; 16]); 3],
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
        let plane = |i: usize| self.plane[i].0[lane];
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

/// Half a chunk of triangles half-way through setup: as many as f64 numbers fit a register.
struct Half<S: Simd> {
    x: [S::f64s; 3],
    y: [S::f64s; 3],
    d: [S::f64s; 3],
    snapped_x: [S::f64s; 3],
    snapped_y: [S::f64s; 3],
    /// Triangles in front of the near plane and within the guard band.
    inside: S::mask64s,
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
    lanes.clip = 0;
    lanes.front_facing = 0;
    lanes.draw = 0;
    lanes.tiny = 0;
    lanes.covers = [0; 4];
    let mut from = 0;
    // In chunks as wide as the machine's registers: more would not fit into them.
    while from < 16 {
        set_up_chunk(simd, block, at, window, from, lanes);
        from += S::f32s::LEN;
    }
}

/// Sets up the triangles in lanes `from` and on, one register's worth.
#[inline(always)]
fn set_up_chunk<S: Simd>(
    simd: S,
    block: &TriangleBlock,
    at: &ScreenFromObject,
    window: Rect,
    from: usize,
    lanes: &mut Lanes,
) {
    let splat = |v: i32| S::i32s::splat(simd, v);
    let all = (1 << S::f32s::LEN) - 1;
    let used = u32::from(block.lanes) >> from & all;
    if used == 0 {
        return;
    }
    let [low, high] = widen_corners(simd, block, from);
    let (low, high) = (project(simd, &low, at), project(simd, &high, at));
    let inside = low.inside.narrow(high.inside).to_bitmask() as u32;

    // Exact: coordinates have 24 bits, products 48, and f64 holds 53.
    let zero = S::f64s::splat(simd, 0.0);
    let (area_low, area_high) = (low.area(), high.area());
    let positive = area_low.simd_gt(zero).narrow(area_high.simd_gt(zero)).to_bitmask() as u32;
    let swap = area_low.simd_lt(zero).narrow(area_high.simd_lt(zero));
    let negative = swap.to_bitmask() as u32;
    let front = if at.front_sign > 0.0 { positive } else { negative };
    let two_sided = u32::from(block.two_sided) >> from;
    let facing = (front | ((positive | negative) & two_sided)) & used & inside;
    lanes.clip |= ((used & !inside) << from) as u16;
    lanes.front_facing |= (facing << from) as u16;

    let x = to_i32(simd, &low.snapped_x, &high.snapped_x);
    let y = to_i32(simd, &low.snapped_y, &high.snapped_y);
    let (first_x, last_x, first_y, last_y) =
        (first_pixel(&x), last_pixel(&x), first_pixel(&y), last_pixel(&y));
    let left = first_x.max(splat(window.left));
    let top = first_y.max(splat(window.top));
    let right = last_x.min(splat(window.right - 1));
    let bottom = last_y.min(splat(window.bottom - 1));
    let holds_a_centre = (left.simd_le(right) & top.simd_le(bottom)).to_bitmask() as u32;
    let mut draw = facing & holds_a_centre;
    if draw == 0 {
        return;
    }

    // Corners 1 and 2 change places where that makes the area positive.
    let x = [x[0], swap.select(x[2], x[1]), swap.select(x[1], x[2])];
    let y = [y[0], swap.select(y[2], y[1]), swap.select(y[1], y[2])];
    let few = (last_x - first_x).simd_le(splat(1)) & (last_y - first_y).simd_le(splat(1));
    let mut tiny = few.to_bitmask() as u32 & draw;
    if tiny != 0 {
        let covers = covered_pixels(simd, &x, &y, first_x, first_y);
        draw &= !tiny | (covers[0] | covers[1] | covers[2] | covers[3]);
        tiny &= draw;
        if draw == 0 {
            return;
        }
        for (all, these) in lanes.covers.iter_mut().zip(covers) {
            *all |= ((these & tiny) << from) as u16;
        }
    }
    lanes.draw |= (draw << from) as u16;
    lanes.tiny |= (tiny << from) as u16;
    store_shapes(&x, &y, [left, top, right, bottom], from, lanes);
    store_depths(simd, &low, &high, from, lanes);
}

/// Stores the lanes' corners, and the pixels (inclusive) that they bound.
#[inline(always)]
fn store_shapes<S: Simd, V: SimdInt<S, Element = i32>>(
    x: &[V; 3],
    y: &[V; 3],
    [left, top, right, bottom]: [V; 4],
    from: usize,
    lanes: &mut Lanes,
) {
    let to = from + V::LEN;
    for k in 0..3 {
        x[k].store_slice(&mut lanes.x[k].0[from..to]);
        y[k].store_slice(&mut lanes.y[k].0[from..to]);
    }
    left.store_slice(&mut lanes.left.0[from..to]);
    top.store_slice(&mut lanes.top.0[from..to]);
    right.store_slice(&mut lanes.right.0[from..to]);
    bottom.store_slice(&mut lanes.bottom.0[from..to]);
}

/// Stores the lanes' depth planes, and their corners' least and largest depths.
#[inline(always)]
fn store_depths<S: Simd>(simd: S, low: &Half<S>, high: &Half<S>, from: usize, lanes: &mut Lanes) {
    let (middle, to) = (from + S::f64s::LEN, from + S::f32s::LEN);
    let planes = [depth_plane(simd, low), depth_plane(simd, high)];
    for (i, plane) in lanes.plane.iter_mut().enumerate() {
        planes[0][i].store_slice(&mut plane.0[from..middle]);
        planes[1][i].store_slice(&mut plane.0[middle..to]);
    }
    let d0 = low.d[0].narrow(high.d[0]);
    let d1 = low.d[1].narrow(high.d[1]);
    let d2 = low.d[2].narrow(high.d[2]);
    d0.min(d1).min(d2).store_slice(&mut lanes.depth_min.0[from..to]);
    d0.max(d1).max(d2).store_slice(&mut lanes.depth_max.0[from..to]);
}

/// Corners (corner, axis) of the lower and of the upper half of a chunk.
#[inline(always)]
fn widen_corners<S: Simd>(simd: S, block: &TriangleBlock, from: usize) -> [[[S::f64s; 3]; 3]; 2] {
    let zero = S::f64s::splat(simd, 0.0);
    let mut halves = [[[zero; 3]; 3]; 2];
    for (k, corner) in block.corner.iter().enumerate() {
        for (axis, lanes) in corner.iter().enumerate() {
            let (low, high) = S::f32s::from_slice(simd, &lanes[from..from + S::f32s::LEN]).widen();
            halves[0][k][axis] = low;
            halves[1][k][axis] = high;
        }
    }
    halves
}

#[inline(always)]
fn project<S: Simd>(simd: S, corners: &[[S::f64s; 3]; 3], at: &ScreenFromObject) -> Half<S> {
    let splat = |v: f64| S::f64s::splat(simd, v);
    let (mut x, mut y, mut d) = ([splat(0.0); 3], [splat(0.0); 3], [splat(0.0); 3]);
    let (mut snapped_x, mut snapped_y) = ([splat(0.0); 3], [splat(0.0); 3]);
    let (guard_min, guard_max) = (splat(GUARD_MIN * 256.0), splat(GUARD_MAX * 256.0));
    let mut inside = S::mask64s::splat(simd, true);
    for k in 0..3 {
        (x[k], y[k]) = (dot(simd, &at.x, &corners[k]), dot(simd, &at.y, &corners[k]));
        if at.perspective {
            let w = dot(simd, &at.w, &corners[k]);
            let reciprocal = splat(1.0) / w;
            x[k] *= reciprocal;
            y[k] *= reciprocal;
            d[k] = splat(at.d[3]) * reciprocal;
            // D ≤ W, and W > 0: behind the eye the quotient would be negative.
            inside &= splat(at.d[3]).simd_le(w);
        } else {
            d[k] = dot(simd, &at.d, &corners[k]);
            inside &= d[k].simd_le(splat(1.0));
        }
        inside &= x[k].simd_ge(guard_min) & x[k].simd_le(guard_max);
        inside &= y[k].simd_ge(guard_min) & y[k].simd_le(guard_max);
        snapped_x[k] = x[k] + splat(ROUND) - splat(ROUND);
        snapped_y[k] = y[k] + splat(ROUND) - splat(ROUND);
    }
    Half { x, y, d, snapped_x, snapped_y, inside }
}

/// Depth as a plane over image pixel centres, from the unsnapped corners.
#[inline(always)]
fn depth_plane<S: Simd>(simd: S, e: &Half<S>) -> [S::f64s; 3] {
    let (x1, y1, d1) = (e.x[1] - e.x[0], e.y[1] - e.y[0], e.d[1] - e.d[0]);
    let (x2, y2, d2) = (e.x[2] - e.x[0], e.y[2] - e.y[0], e.d[2] - e.d[0]);
    let per_pixel = S::f64s::splat(simd, 256.0) / (x1 * y2 - x2 * y1);
    let a = sane(simd, (d1 * y2 - d2 * y1) * per_pixel);
    let b = sane(simd, (d2 * x1 - d1 * x2) * per_pixel);
    let to_pixel = S::f64s::splat(simd, 1.0 / 256.0);
    let half = S::f64s::splat(simd, 0.5);
    // At pixel (0, 0)'s centre: from corner 0, back by its distance to that centre.
    let c = e.d[0] - a * (e.x[0] * to_pixel - half) - b * (e.y[0] * to_pixel - half);
    [a, b, c]
}

/// A slope, or 0 where it is too steep or no number: a triangle seen edge-on, whose depth is clamped anyway.
#[inline(always)]
fn sane<S: Simd>(simd: S, slope: S::f64s) -> S::f64s {
    slope.abs().simd_le(S::f64s::splat(simd, MAX_SLOPE)).select(slope, S::f64s::splat(simd, 0.0))
}

#[inline(always)]
fn dot<S: Simd>(simd: S, row: &[f64; 4], p: &[S::f64s; 3]) -> S::f64s {
    let xy = S::f64s::splat(simd, row[0]) * p[0] + S::f64s::splat(simd, row[1]) * p[1];
    (xy + S::f64s::splat(simd, row[2]) * p[2]) + S::f64s::splat(simd, row[3])
}

/// Which lanes cover the centre of pixel (px, py) and of its neighbours to the right, below, and below to the
/// right, by the fill rule; for triangles whose bounds hold no others (those of larger ones overflow and mean
/// nothing). Bits above the lanes mean nothing.
#[inline(always)]
fn covered_pixels<S: Simd>(
    simd: S,
    x: &[S::i32s; 3],
    y: &[S::i32s; 3],
    px: S::i32s,
    py: S::i32s,
) -> [u32; 4] {
    let zero = S::i32s::splat(simd, 0);
    let (cx, cy) = ((px << 8) + 128, (py << 8) + 128);
    let mut outside = [zero; 4];
    for k in 0..3 {
        let (dx, dy) = (x[(k + 1) % 3] - x[k], y[(k + 1) % 3] - y[k]);
        let owned = dy.simd_lt(zero) | (dy.simd_eq(zero) & dx.simd_gt(zero));
        let bias = owned.select(zero, S::i32s::splat(simd, -1));
        let here = dx * (cy - y[k]) - dy * (cx - x[k]) + bias;
        let (right, below) = (here - (dy << 8), dx << 8);
        outside[0] |= here;
        outside[1] |= right;
        outside[2] |= here + below;
        outside[3] |= right + below;
    }
    [
        !outside[0].simd_lt(zero).to_bitmask() as u32,
        !outside[1].simd_lt(zero).to_bitmask() as u32,
        !outside[2].simd_lt(zero).to_bitmask() as u32,
        !outside[3].simd_lt(zero).to_bitmask() as u32,
    ]
}

/// First pixel whose centre 256·p + 128 is not before a box's smallest coordinate.
#[inline(always)]
fn first_pixel<S: Simd, V: SimdInt<S, Element = i32>>(v: &[V; 3]) -> V {
    (v[0].min(v[1]).min(v[2]) + 127) >> 8
}

/// Last pixel whose centre is not beyond its largest.
#[inline(always)]
fn last_pixel<S: Simd, V: SimdInt<S, Element = i32>>(v: &[V; 3]) -> V {
    (v[0].max(v[1]).max(v[2]) - 128) >> 8
}

impl<S: Simd> Half<S> {
    /// Doubled area on the screen (y down), 1/65536 pixel, exact.
    #[inline(always)]
    fn area(&self) -> S::f64s {
        let (x, y) = (&self.snapped_x, &self.snapped_y);
        (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    }
}

#[inline(always)]
fn to_i32<S: Simd>(simd: S, low: &[S::f64s; 3], high: &[S::f64s; 3]) -> [S::i32s; 3] {
    let round = S::f64s::splat(simd, ROUND);
    let mut out = [S::i32s::splat(simd, 0); 3];
    for k in 0..3 {
        let (low, high): (S::i64s, S::i64s) = ((low[k] + round).bitcast(), (high[k] + round).bitcast());
        out[k] = low.narrow(high);
    }
    out
}
