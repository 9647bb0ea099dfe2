//! Filling triangles: hierarchical coverage and depth, sixteen cells at a time.
//!
//! ```text
//! large   64-pixel cells → 16 tiles each: edges and z-pyramid → a mask of tiles
//! medium  tiles → 16 blocks each: edges and z-pyramid → masks of touched and of covered blocks
//! small   (up to 2×2 blocks) straight to blocks
//! block   16 pixels: edges, depth, compare, write; ties to the smaller id
//! ```
//!
//! *Coverage.* An edge function is `E = A·(X − x) + B·(Y − y) + bias` on snapped coordinates, and a pixel
//! is inside where `E ≥ 0` for all three; `bias` is −1 on edges that are neither top nor left, else 0.
//! At pixel centres `X` steps by 256, so `e = ⌊E / 256⌋ = A·px + B·py + C` has the same sign and exact
//! integer steps. `C` needs 64 bits; within a tile the steps need 28, so a tile's origin is saturated to
//! ±2³⁰ without changing a sign.
//!
//! *Depth.* A block's origin is evaluated in f64 from the plane and rounded once; pixels add `a·dx + b·dy`
//! in f32 and are clamped to the corners' range. These operations depend on the block's place in the
//! image only, so every path gives the same bits. The bound used to skip a block or tile is the plane's
//! largest value there plus `plane_margin`, and never above the corners' largest depth.

use super::clip::clip;
use super::pyramid::{MIXED, Rect, Sixteen, Target, cell_mask};
use super::setup::{ScreenTriangle, TriangleBlock, set_up};
use super::transform::ScreenFromObject;
use crate::conventions::SurfaceId;
use fearless_simd::{Simd, f32x16, f64x8, i32x16, mask32x16, prelude::*, u32x16};

/// How a block of triangles is drawn.
pub struct Drawing<'a> {
    /// The instance its ids name.
    pub instance: u32,
    /// Its transform.
    pub at: &'a ScreenFromObject,
    /// Whether the z-pyramid may save work; else every covered pixel is visited.
    pub hierarchical: bool,
}

impl Drawing<'_> {
    #[inline(always)]
    fn of_lane(&self, block: &TriangleBlock, lane: usize) -> How {
        How {
            id: SurfaceId { instance: self.instance, triangle: block.triangle[lane] },
            hierarchical: self.hierarchical,
            masked: block.masked & (1 << lane) != 0,
        }
    }
}

/// What drawing one block of triangles came to.
#[derive(Clone, Copy, Debug, Default)]
pub struct BlockCounts {
    /// Triangles that face the eye.
    pub front_facing: u32,
    /// Triangles that were rasterised.
    pub drawn: u32,
    /// Whether a depth sample was written.
    pub wrote: bool,
}

/// Draws up to sixteen triangles. `is_hole(lane, x, y)` says whether a masked lane has a hole at an image
/// pixel's centre; it is asked only of pixels that would otherwise be written.
#[inline(always)]
pub fn draw_block<S: Simd>(
    simd: S,
    target: &mut Target,
    block: &TriangleBlock,
    drawing: &Drawing,
    is_hole: &mut dyn FnMut(usize, i32, i32) -> bool,
) -> BlockCounts {
    let window = Rect {
        left: target.left,
        top: target.top,
        right: target.left + target.width,
        bottom: target.top + target.height,
    };
    let mut lanes = target.lanes.take().unwrap_or_default();
    set_up(simd, block, drawing.at, window, &mut lanes);
    let mut counts = BlockCounts { front_facing: lanes.front_facing.count_ones(), drawn: 0, wrote: false };
    let mut rest = lanes.draw;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let triangle = lanes.get(lane);
        let how = drawing.of_lane(block, lane);
        if lanes.tiny & (1 << lane) != 0 {
            let covers = lanes.covers.map(|pixel| u32::from(pixel >> lane & 1));
            let filled = fill_tiny(simd, target, &triangle, how, covers, &mut |x, y| is_hole(lane, x, y));
            counts.drawn += u32::from(filled.rasterised);
            counts.wrote |= filled.wrote;
            continue;
        }
        if is_small(&triangle, target) {
            let filled = fill_small(simd, target, &triangle, how, &mut |x, y| is_hole(lane, x, y));
            counts.drawn += u32::from(filled.rasterised);
            counts.wrote |= filled.wrote;
            continue;
        }
        draw_lane(simd, target, block, drawing, lane, &triangle, is_hole, &mut counts);
    }
    if lanes.clip != 0 {
        draw_clipped(simd, target, block, drawing, lanes.clip, is_hole, &mut counts);
    }
    target.lanes = Some(lanes);
    counts
}

#[inline(never)]
fn draw_clipped<S: Simd>(
    simd: S,
    target: &mut Target,
    block: &TriangleBlock,
    drawing: &Drawing,
    mut lanes: u16,
    is_hole: &mut dyn FnMut(usize, i32, i32) -> bool,
    counts: &mut BlockCounts,
) {
    let window = Rect {
        left: target.left,
        top: target.top,
        right: target.left + target.width,
        bottom: target.top + target.height,
    };
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let two_sided = block.two_sided & (1 << lane) != 0;
        let pieces = clip(&block.corners(lane), drawing.at, two_sided, window);
        counts.front_facing += u32::from(pieces.faces_eye);
        for piece in pieces.triangles() {
            simd.vectorize(
                #[inline(always)]
                || draw_lane(simd, target, block, drawing, lane, piece, is_hole, counts),
            );
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "the inner step of one loop, split off to be called twice")]
#[inline(always)]
fn draw_lane<S: Simd>(
    simd: S,
    target: &mut Target,
    block: &TriangleBlock,
    drawing: &Drawing,
    lane: usize,
    triangle: &ScreenTriangle,
    is_hole: &mut dyn FnMut(usize, i32, i32) -> bool,
    counts: &mut BlockCounts,
) {
    let how = drawing.of_lane(block, lane);
    let mut hole = |x: i32, y: i32| is_hole(lane, x, y);
    // A function of its own: one copy of the code for each instruction set.
    let drawn = simd.vectorize(
        #[inline(always)]
        || fill(simd, target, triangle, how, &mut hole),
    );
    counts.drawn += u32::from(drawn.rasterised);
    counts.wrote |= drawn.wrote;
}

/// What a triangle's pixels get, and what may save work on the way.
#[derive(Clone, Copy)]
struct How {
    id: SurfaceId,
    hierarchical: bool,
    masked: bool,
}

#[derive(Default)]
struct Filled {
    rasterised: bool,
    wrote: bool,
}

/// An edge as a function of window pixels: inside where `a·x + b·y + c ≥ 0`.
#[derive(Clone, Copy)]
struct Edge {
    a: i32,
    b: i32,
    c: i64,
}

impl Edge {
    #[inline(always)]
    fn at(&self, x: i32, y: i32) -> i64 {
        i64::from(self.a) * i64::from(x) + i64::from(self.b) * i64::from(y) + self.c
    }

    /// The value at a window pixel, saturated so that a tile's steps cannot overflow.
    #[inline(always)]
    fn at_saturated(&self, x: i32, y: i32) -> i32 {
        self.at(x, y).clamp(-(1 << 30), (1 << 30) - 1) as i32
    }

    /// Largest step from a cell's origin pixel to one of its pixels.
    #[inline(always)]
    fn reach_up(&self, last: i32) -> i32 {
        (self.a.max(0) + self.b.max(0)) * last
    }

    /// Smallest (most negative) such step.
    #[inline(always)]
    fn reach_down(&self, last: i32) -> i32 {
        (self.a.min(0) + self.b.min(0)) * last
    }
}

#[inline(always)]
fn edges(t: &ScreenTriangle, target: &Target) -> [Edge; 3] {
    [edge(t, target, 0, 1), edge(t, target, 1, 2), edge(t, target, 2, 0)]
}

#[inline(always)]
fn edge(t: &ScreenTriangle, target: &Target, i: usize, j: usize) -> Edge {
    let (dx, dy) = (t.x[j] - t.x[i], t.y[j] - t.y[i]);
    let (a, b) = (-dy, dx);
    // Clockwise on a y-down screen: left edges go up, top edges go right.
    let owned = dy < 0 || (dy == 0 && dx > 0);
    let x = i64::from(128 + 256 * target.left - t.x[i]);
    let y = i64::from(128 + 256 * target.top - t.y[i]);
    let e = i64::from(a) * x + i64::from(b) * y - i64::from(!owned);
    Edge { a, b, c: e >> 8 }
}

/// A triangle while it is filled: everything that stays the same from block to block.
struct Filling<S: Simd> {
    edges: [Edge; 3],
    edge_steps: [i32x16<S>; 3],
    paint: Paint<S>,
    /// What the plane rises at most from a block's first pixel to another.
    block_rise: f32,
}

/// What a triangle's pixels get: depths, and a surface.
struct Paint<S: Simd> {
    /// Depth plane over image pixels.
    plane: [f64; 3],
    /// From a block's first pixel to the others.
    depth_steps: f32x16<S>,
    /// The least of them.
    least_step: f32,
    /// Every depth is clamped to this range.
    depth_min: f32,
    depth_max: f32,
    slot: u32,
    how: How,
    wrote: bool,
}

impl<S: Simd> Paint<S> {
    #[inline(always)]
    fn new(simd: S, target: &Target, t: &ScreenTriangle, how: How) -> Paint<S> {
        let [a, b] = [t.plane[0] as f32, t.plane[1] as f32];
        let least = |slope: f32| if slope < 0.0 { 3.0 * slope } else { 0.0 };
        Paint {
            plane: t.plane,
            depth_steps: f32x16::from_slice(simd, &COLUMN_F) * a + f32x16::from_slice(simd, &ROW_F) * b,
            least_step: least(a) + least(b),
            depth_min: t.depth_min,
            depth_max: t.depth_max,
            slot: target.surfaces.len() as u32,
            how,
            wrote: false,
        }
    }

    /// The plane at a window pixel, rounded once. Blocks pass their first pixel.
    ///
    /// The bits must not depend on the window: `plane` is shifted by whole multiples of 16 pixels, which
    /// is not exact in f64, so the shift happens here, on the integer.
    #[inline(always)]
    fn plane_at(&self, target: &Target, x: i32, y: i32) -> f32 {
        let (x, y) = (f64::from(x + target.left), f64::from(y + target.top));
        ((self.plane[0] * x + self.plane[1] * y) + self.plane[2]) as f32
    }

    /// More than any pixel's rounding error over a cell whose origin has plane value `origin`: at most
    /// four roundings of 2⁻²⁴ each of the origin and of steps up to `last` pixels.
    #[inline(always)]
    fn plane_margin(&self, origin: f32, last: f32) -> f32 {
        let slope = (self.plane[0].abs() + self.plane[1].abs()) as f32;
        (origin.abs() + slope * last) * (1.0 / (1 << 20) as f32)
    }

    /// [`Paint::plane_at`] for the first pixels of the sixteen blocks of the tile at window pixel (x, y): the
    /// same operations, so the same bits.
    #[inline(always)]
    fn plane_at_blocks(&self, simd: S, target: &Target, x: i32, y: i32) -> f32x16<S> {
        let (x, y) = (f64::from(x + target.left), f64::from(y + target.top));
        // Written out: closures are not always inlined into code for one instruction set.
        let columns = (f64x8::from_slice(simd, &BLOCK_COLUMN) + x) * self.plane[0];
        let upper = (f64x8::from_slice(simd, &BLOCK_ROW[0]) + y) * self.plane[1];
        let lower = (f64x8::from_slice(simd, &BLOCK_ROW[1]) + y) * self.plane[1];
        let halves = [(columns + upper) + self.plane[2], (columns + lower) + self.plane[2]];
        simd.narrow_f64x8(halves[0], halves[1])
    }

    /// [`Paint::plane_margin`] over blocks.
    #[inline(always)]
    fn plane_margins(&self, simd: S, origins: f32x16<S>) -> f32x16<S> {
        let slope = (self.plane[0].abs() + self.plane[1].abs()) as f32;
        (origins.abs() + f32x16::splat(simd, slope * 3.0)) * (1.0 / (1 << 20) as f32)
    }

    #[inline(always)]
    fn plane_rise(&self, last: f64) -> f32 {
        ((self.plane[0].max(0.0) + self.plane[1].max(0.0)) * last) as f32
    }
}

/// The blocks (inclusive) that a triangle's bounds meet, of the window.
#[inline(always)]
fn blocks_of(t: &ScreenTriangle, target: &Target) -> Rect {
    Rect {
        left: (t.bounds.left - target.left) >> 2,
        top: (t.bounds.top - target.top) >> 2,
        right: (t.bounds.right - 1 - target.left) >> 2,
        bottom: (t.bounds.bottom - 1 - target.top) >> 2,
    }
}

/// Whether a triangle meets at most 2×2 blocks, and its edge functions there fit into 32 bits: sides of 64
/// pixels, seen from 72 pixels away, make products below 2²⁹.
#[inline(always)]
fn is_small(t: &ScreenTriangle, target: &Target) -> bool {
    let blocks = blocks_of(t, target);
    let extent = |v: &[i32; 3]| v[0].max(v[1]).max(v[2]) - v[0].min(v[1]).min(v[2]);
    blocks.right - blocks.left < 2
        && blocks.bottom - blocks.top < 2
        && extent(&t.x) <= 64 * 256
        && extent(&t.y) <= 64 * 256
}

/// Fills a triangle whose bounds hold at most 2×2 pixels, of which it covers those that `covers` names with a
/// 1: left and right at the top, left and right at the bottom.
#[inline(always)]
fn fill_tiny<S: Simd>(
    simd: S,
    target: &mut Target,
    t: &ScreenTriangle,
    how: How,
    covers: [u32; 4],
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) -> Filled {
    // Unclipped: the bounds may begin beyond the window.
    let first = |v: &[i32; 3]| (v[0].min(v[1]).min(v[2]) + 127) >> 8;
    let (x, y) = (first(&t.x) - target.left, first(&t.y) - target.top);
    let (right, bottom) = (x & 3 == 3, y & 3 == 3);
    let [a, b, c, d] = covers;
    let at = (x & 3) + (y & 3) * 4;
    // Most lie in one block; else in two or four.
    let pieces = match (right, bottom) {
        (false, false) => [(x, y, (a | b << 1 | c << 4 | d << 5) << at), NONE, NONE, NONE],
        (true, false) => {
            let row = (y & 3) * 4;
            [(x, y, (a | c << 4) << at), (x + 1, y, (b | d << 4) << row), NONE, NONE]
        }
        (false, true) => [(x, y, (a | b << 1) << at), (x, y + 1, (c | d << 1) << (x & 3)), NONE, NONE],
        (true, true) => [(x, y, a << 15), (x + 1, y, b << 12), (x, y + 1, c << 3), (x + 1, y + 1, d)],
    };
    let mut paint = Paint::new(simd, target, t, how);
    let mut rasterised = false;
    for (x, y, covered) in pieces {
        let inside = x >= 0 && y >= 0 && x < target.width && y < target.height;
        if covered == 0 || !inside {
            continue;
        }
        let (bx, by) = (x >> 2, y >> 2);
        let tile = (by >> 2) as usize * target.tiles_x + (bx >> 2) as usize;
        let block = ((by & 3) * 4 + (bx & 3)) as usize;
        if how.hierarchical && t.depth_max < target.block_minima(tile)[block] {
            continue;
        }
        rasterised = true;
        let origin = paint.plane_at(target, bx * 4, by * 4);
        if fill_block(simd, target, &mut paint, tile, block, (bx * 4, by * 4), origin, covered, is_hole) {
            target.mark_stale(tile);
        }
    }
    if paint.wrote {
        target.surfaces.push(how.id);
    }
    Filled { rasterised, wrote: paint.wrote }
}

/// No part of a tiny triangle.
const NONE: (i32, i32, u32) = (0, 0, 0);

/// Fills a triangle that [`is_small`].
#[inline(always)]
fn fill_small<S: Simd>(
    simd: S,
    target: &mut Target,
    t: &ScreenTriangle,
    how: How,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) -> Filled {
    let blocks = blocks_of(t, target);
    // One that every block it meets hides is dropped before anything else is computed.
    let mut open = open_corners(target, &blocks, t.depth_max, how.hierarchical);
    if open == 0 {
        return Filled::default();
    }
    let column = i32x16::from_slice(simd, &COLUMN);
    let row = i32x16::from_slice(simd, &ROW);
    let mut steps = [column; 3];
    let mut edges = [(0, 0, 0); 3];
    let from_x = 128 + 256 * (target.left + blocks.left * 4);
    let from_y = 128 + 256 * (target.top + blocks.top * 4);
    for k in 0..3 {
        let next = (k + 1) % 3;
        let (dx, dy) = (t.x[next] - t.x[k], t.y[next] - t.y[k]);
        let owned = dy < 0 || (dy == 0 && dx > 0);
        let c = (dx * (from_y - t.y[k]) - dy * (from_x - t.x[k]) - i32::from(!owned)) >> 8;
        steps[k] = row * dx - column * dy;
        edges[k] = (-dy * 4, dx * 4, c);
    }
    let mut paint = Paint::new(simd, target, t, how);
    while open != 0 {
        let i = open.trailing_zeros() as i32;
        open &= open - 1;
        let (bx, by) = corner_block(&blocks, i);
        let mut outside = i32x16::splat(simd, 0);
        for k in 0..3 {
            let (a, b, c) = edges[k];
            outside |= steps[k] + (c + a * (i & 1) + b * (i >> 1));
        }
        let covered = !(outside.simd_lt(i32x16::splat(simd, 0)).to_bitmask() as u32) & 0xFFFF;
        let tile = (by >> 2) as usize * target.tiles_x + (bx >> 2) as usize;
        let block = ((by & 3) * 4 + (bx & 3)) as usize;
        let origin = paint.plane_at(target, bx * 4, by * 4);
        let corner = (bx * 4, by * 4);
        if fill_block(simd, target, &mut paint, tile, block, corner, origin, covered, is_hole) {
            target.mark_stale(tile);
        }
    }
    if paint.wrote {
        target.surfaces.push(how.id);
    }
    Filled { rasterised: true, wrote: paint.wrote }
}

/// Fills a triangle of any size.
#[inline(always)]
fn fill<S: Simd>(
    simd: S,
    target: &mut Target,
    t: &ScreenTriangle,
    how: How,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) -> Filled {
    let edges = edges(t, target);
    let column = i32x16::from_slice(simd, &COLUMN);
    let row = i32x16::from_slice(simd, &ROW);
    let paint = Paint::new(simd, target, t, how);
    let mut filling = Filling {
        edges,
        edge_steps: [
            column * edges[0].a + row * edges[0].b,
            column * edges[1].a + row * edges[1].b,
            column * edges[2].a + row * edges[2].b,
        ],
        block_rise: paint.plane_rise(3.0),
        paint,
    };
    fill_cells(simd, target, &mut filling, t.depth_max, &blocks_of(t, target), is_hole);
    let wrote = filling.paint.wrote;
    if wrote {
        target.surfaces.push(how.id);
    }
    Filled { rasterised: true, wrote }
}

/// Block `i` of a rectangle (inclusive) of at most 2×2 blocks: bit 0 right, bit 1 bottom.
#[inline(always)]
fn corner_block(blocks: &Rect, i: i32) -> (i32, i32) {
    let x = if i & 1 == 0 { blocks.left } else { blocks.right };
    let y = if i & 2 == 0 { blocks.top } else { blocks.bottom };
    (x, y)
}

/// Which of at most 2×2 blocks do not hide `depth`, each once.
#[inline(always)]
fn open_corners(target: &mut Target, blocks: &Rect, depth: f32, hierarchical: bool) -> u32 {
    let mut open = 0u32;
    for i in 0..4 {
        let repeated =
            (i & 1 != 0 && blocks.right == blocks.left) || (i & 2 != 0 && blocks.bottom == blocks.top);
        if repeated {
            continue;
        }
        let (bx, by) = corner_block(blocks, i);
        let tile = (by >> 2) as usize * target.tiles_x + (bx >> 2) as usize;
        let block = ((by & 3) * 4 + (bx & 3)) as usize;
        if !hierarchical || depth >= target.block_minima(tile)[block] {
            open |= 1 << i;
        }
        if hierarchical && target.visits.is_some() {
            target.count_polygon_visit((bx * 4, by * 4), 4, 1);
        }
    }
    open
}

/// Fills a triangle that meets more than 2×2 blocks, tile by tile; where there are many tiles, 64-pixel
/// cells choose among theirs first.
#[inline(always)]
fn fill_cells<S: Simd>(
    simd: S,
    target: &mut Target,
    f: &mut Filling<S>,
    depth_max: f32,
    blocks: &Rect,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) {
    let (left, top, right, bottom) =
        (blocks.left >> 2, blocks.top >> 2, blocks.right >> 2, blocks.bottom >> 2);
    let choose = (right - left + 1) * (bottom - top + 1) > CHOOSE;
    for cell_y in top >> 2..=bottom >> 2 {
        for cell_x in left >> 2..=right >> 2 {
            let mut tiles = cell_mask(
                (left - cell_x * 4).max(0),
                (top - cell_y * 4).max(0),
                (right - cell_x * 4).min(3),
                (bottom - cell_y * 4).min(3),
            );
            if choose {
                tiles &= tiles_of_cell(simd, target, f, depth_max, cell_x, cell_y);
            }
            while tiles != 0 {
                let c = tiles.trailing_zeros() as i32;
                tiles &= tiles - 1;
                let (x, y) = (cell_x * 4 + (c & 3), cell_y * 4 + (c >> 2));
                fill_tile(simd, target, f, depth_max, x, y, is_hole);
            }
        }
    }
}

/// With more tiles than this in a triangle's rectangle, it pays to ask first which of them it meets.
const CHOOSE: i32 = 3;

const COLUMN: [i32; 16] = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3];
const ROW: [i32; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3];
const BLOCK_COLUMN: [f64; 8] = [0., 4., 8., 12., 0., 4., 8., 12.];
const BLOCK_ROW: [[f64; 8]; 2] = [[0., 0., 0., 0., 4., 4., 4., 4.], [8., 8., 8., 8., 12., 12., 12., 12.]];
pub(super) const COLUMN_F: [f32; 16] = [0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3.];
pub(super) const ROW_F: [f32; 16] = [0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.];

/// Which of a 64-pixel cell's tiles the triangle may show in.
#[inline(always)]
fn tiles_of_cell<S: Simd>(
    simd: S,
    target: &mut Target,
    f: &Filling<S>,
    depth_max: f32,
    cell_x: i32,
    cell_y: i32,
) -> u32 {
    // A cell's steps need 30 bits, so edges are taken 1/16 as fine: sums of floors are at most 1 short.
    let mut outside = i32x16::splat(simd, 0);
    for k in 0..3 {
        let (edge, steps) = (&f.edges[k], f.edge_steps[k]);
        let origin = ((edge.at(cell_x * 64, cell_y * 64) >> 4) + (i64::from(edge.reach_up(15)) >> 4) + 2)
            .clamp(-(1 << 30), (1 << 30) - 1) as i32;
        outside |= steps + origin;
    }
    let mut tiles = !(outside.simd_lt(i32x16::splat(simd, 0)).to_bitmask() as u32) & 0xFFFF;
    if f.paint.how.hierarchical {
        let z = f.paint.plane_at(target, cell_x * 64, cell_y * 64);
        let bound = z + f.paint.plane_rise(15.0) + f.paint.plane_margin(z, 63.0);
        let bounds = (f.paint.depth_steps * 16.0 + bound).min(f32x16::splat(simd, depth_max));
        if let Some(minima) = target.tile_minima(simd, cell_x as usize, cell_y as usize) {
            let minima = f32x16::from_slice(simd, minima);
            tiles &= bounds.simd_ge(minima).to_bitmask() as u32;
        }
    }
    if target.visits.is_some() && f.paint.how.hierarchical {
        target.count_polygon_visit((cell_x * 64, cell_y * 64), 16, 0xFFFF);
    }
    tiles
}

#[inline(always)]
fn fill_tile<S: Simd>(
    simd: S,
    target: &mut Target,
    f: &mut Filling<S>,
    depth_max: f32,
    tile_x: i32,
    tile_y: i32,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) {
    let tile = tile_y as usize * target.tiles_x + tile_x as usize;
    let (x, y) = (tile_x * 16, tile_y * 16);
    let zero = i32x16::splat(simd, 0);
    let (mut outside, mut partial) = (zero, zero);
    let mut at_blocks = [[0i32; 16]; 3];
    for (k, at_edge) in at_blocks.iter_mut().enumerate() {
        let (edge, steps) = (&f.edges[k], f.edge_steps[k]);
        // Saturated at the tile's origin, and steps within a tile need 28 bits: signs stay right.
        let at = (steps << 2) + edge.at_saturated(x, y);
        outside |= at + edge.reach_up(3);
        partial |= at + edge.reach_down(3);
        at.store_slice(at_edge);
    }
    let mut blocks = !(outside.simd_lt(zero).to_bitmask() as u32) & 0xFFFF;
    let whole = !(partial.simd_lt(zero).to_bitmask() as u32);
    let origins = f.paint.plane_at_blocks(simd, target, x, y);
    if f.paint.how.hierarchical {
        let bounds = (origins + f.paint.plane_margins(simd, origins) + f.block_rise)
            .min(f32x16::splat(simd, depth_max));
        let minima = f32x16::from_slice(simd, target.block_minima(tile));
        blocks &= bounds.simd_ge(minima).to_bitmask() as u32;
        if target.visits.is_some() {
            target.count_polygon_visit((x, y), 4, 0xFFFF);
        }
    }
    let mut at_origins = [0f32; 16];
    origins.store_slice(&mut at_origins);
    let mut raised = false;
    while blocks != 0 {
        let c = blocks.trailing_zeros() as usize;
        blocks &= blocks - 1;
        let covered = if whole & (1 << c) != 0 {
            0xFFFF
        } else {
            let mut outside = zero;
            for (steps, at) in f.edge_steps.iter().zip(&at_blocks) {
                outside |= *steps + at[c];
            }
            !(outside.simd_lt(zero).to_bitmask() as u32) & 0xFFFF
        };
        let corner = (x + (c as i32 & 3) * 4, y + (c as i32 >> 2) * 4);
        raised |= fill_block(simd, target, &mut f.paint, tile, c, corner, at_origins[c], covered, is_hole);
    }
    if raised {
        target.mark_stale(tile);
    }
}

#[expect(clippy::too_many_arguments, reason = "the inner step of two loops, split off to be written once")]
/// Writes the pixels of block `block` of `tile` that are `covered` and nearer than what they hold; `origin` is
/// the plane at the block's first pixel, window pixel `corner`. Returns whether the block's minimum rose: what
/// lies above it in the pyramid is then to be marked stale.
#[inline(always)]
fn fill_block<S: Simd>(
    simd: S,
    target: &mut Target,
    paint: &mut Paint<S>,
    tile: usize,
    block: usize,
    corner: (i32, i32),
    origin: f32,
    covered: u32,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) -> bool {
    if target.visits.is_some() {
        target.count_polygon_visit(corner, 1, covered);
    }
    if covered == 0 {
        return false;
    }
    target.touch(tile);
    let at = tile * 16 + block;
    let z = (paint.depth_steps + origin)
        .max(f32x16::splat(simd, paint.depth_min))
        .min(f32x16::splat(simd, paint.depth_max));
    let old = f32x16::from_slice(simd, &target.depth[at].0);
    let mut write = z.simd_gt(old).to_bitmask() as u32 & covered;
    let tied = z.simd_eq(old).to_bitmask() as u32 & covered;
    if tied != 0 {
        write |=
            win_ties(target, paint.how.id, at, tied, z.simd_gt(f32x16::splat(simd, 0.0)).to_bitmask() as u32);
    }
    if paint.how.masked {
        let candidates = write;
        for p in (0..16).filter(|p| candidates & (1 << p) != 0) {
            if is_hole(target.left + corner.0 + (p & 3), target.top + corner.1 + (p >> 2)) {
                write &= !(1 << p);
            }
        }
    }
    if write == 0 {
        return false;
    }
    paint.wrote = true;
    target.counters.pixels_written += u64::from(write.count_ones());
    if write == 0xFFFF {
        z.store_slice(&mut target.depth[at].0);
        target.block_id[at] = paint.slot;
        if !paint.how.hierarchical {
            return false;
        }
        // Rounding is monotonic, so the least pixel is the one with the least step.
        let min = (origin + paint.least_step).max(paint.depth_min).min(paint.depth_max);
        return target.raise_block_minimum(tile, block, min);
    }
    let mask = mask32x16::from_bitmask(simd, u64::from(write));
    let new = mask.select(z, old);
    new.store_slice(&mut target.depth[at].0);
    let slots = u32x16::splat(simd, paint.slot);
    let ids: &mut Sixteen<u32> = &mut target.id[at];
    let shared = std::mem::replace(&mut target.block_id[at], MIXED);
    let old_ids =
        if shared == MIXED { u32x16::from_slice(simd, &ids.0) } else { u32x16::splat(simd, shared) };
    mask.select(slots, old_ids).store_slice(&mut ids.0);
    if !paint.how.hierarchical {
        return false;
    }
    // As long as one of the farthest pixels stays, so does the minimum.
    let least = target.block_minima(tile)[block];
    if old.simd_eq(f32x16::splat(simd, least)).to_bitmask() as u32 & !write & 0xFFFF != 0 {
        return false;
    }
    target.raise_block_minimum(tile, block, new.reduce_min())
}

/// Of the pixels that hold exactly this depth, those whose surface has a larger id.
#[inline(never)]
fn win_ties(target: &Target, id: SurfaceId, at: usize, tied: u32, drawn: u32) -> u32 {
    (0..16)
        .filter(|p| tied & drawn & (1 << p) != 0)
        .filter(|&p| id < target.surface_in(at, p))
        .fold(0, |won, p| won | 1 << p)
}
