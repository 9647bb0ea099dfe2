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

use super::clip::clip;
use super::paint::{COLUMN, How, Paint, ROW, fill_block};
use super::pyramid::{Rect, Target, cell_mask};
use super::setup::{ScreenTriangle, TriangleBlock, set_up};
use super::small::{fill_small, fill_tiny, is_small};
use super::transform::ScreenFromObject;
use crate::conventions::SurfaceId;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

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

#[derive(Default)]
pub(super) struct Filled {
    pub rasterised: bool,
    pub wrote: bool,
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

/// The blocks (inclusive) that a triangle's bounds meet, of the window.
#[inline(always)]
pub(super) fn blocks_of(t: &ScreenTriangle, target: &Target) -> Rect {
    Rect {
        left: (t.bounds.left - target.left) >> 2,
        top: (t.bounds.top - target.top) >> 2,
        right: (t.bounds.right - 1 - target.left) >> 2,
        bottom: (t.bounds.bottom - 1 - target.top) >> 2,
    }
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
