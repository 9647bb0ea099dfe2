//! Filling triangles: hierarchical coverage and depth, sixteen cells at a time.
//!
//! ```text
//! large   64-pixel cells → 16 tiles each: edges and z-pyramid → a mask of tiles
//! medium  tiles → 16 blocks each: edges and z-pyramid → masks of touched and of covered blocks
//! small   (up to 2×2 blocks) straight to blocks
//! block   16 pixels: edges, depth, compare, write; ties to the smaller id
//! cover   a whole tile that is still empty: depth, write
//! ```
//!
//! See `coverage` for the edges, `paint` for the depths.

use super::clip::clip;
use super::coverage::Coverage;
use super::paint::{How, Paint, fill_block};
use super::pyramid::{Rect, Target, cell_mask};
use super::setup::{ScreenTriangle, TriangleBlock, set_up};
use super::small::{fill_small, fill_tiny, is_small};
use super::transform::ScreenFromObject;
use crate::conventions::SurfaceId;
use fearless_simd::{Simd, f32x16, prelude::*};

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

/// A triangle while it is filled: everything that stays the same from block to block.
struct Filling<S: Simd> {
    coverage: Coverage<S>,
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
    let paint = Paint::new(simd, target, t, how);
    let block_rise = paint.plane_rise(3.0);
    let mut filling = Filling { coverage: Coverage::new(simd, t, target), paint, block_rise };
    fill_cells(simd, target, &mut filling, &blocks_of(t, target), is_hole);
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
                tiles &= tiles_of_cell(simd, target, f, cell_x, cell_y);
            }
            while tiles != 0 {
                let c = tiles.trailing_zeros() as i32;
                tiles &= tiles - 1;
                let (x, y) = (cell_x * 4 + (c & 3), cell_y * 4 + (c >> 2));
                fill_tile(simd, target, f, x, y, is_hole);
            }
        }
    }
}

/// With more tiles than this in a triangle's rectangle, it pays to ask first which of them it meets.
const CHOOSE: i32 = 3;

/// Which of a 64-pixel cell's tiles the triangle may show in.
#[inline(always)]
fn tiles_of_cell<S: Simd>(simd: S, target: &mut Target, f: &Filling<S>, cell_x: i32, cell_y: i32) -> u32 {
    let mut tiles = f.coverage.of_cell(simd, cell_x * 64, cell_y * 64);
    if f.paint.how.hierarchical {
        if target.visits.is_some() {
            target.count_polygon_visit((cell_x * 64, cell_y * 64), 16, tiles);
        }
        let z = f.paint.plane_at(target, cell_x * 64, cell_y * 64);
        let bound = z + f.paint.plane_rise(15.0) + f.paint.plane_margin(z, 63.0);
        let bounds = f.paint.clamped(simd, f.paint.depth_steps * 16.0 + bound);
        if let Some(minima) = target.tile_minima(simd, cell_x as usize, cell_y as usize) {
            let minima = f32x16::from_slice(simd, minima);
            tiles &= bounds.simd_ge(minima).to_bitmask() as u32;
        }
    }
    tiles
}

#[inline(always)]
fn fill_tile<S: Simd>(
    simd: S,
    target: &mut Target,
    f: &mut Filling<S>,
    tile_x: i32,
    tile_y: i32,
    is_hole: &mut dyn FnMut(i32, i32) -> bool,
) {
    let tile = tile_y as usize * target.tiles_x + tile_x as usize;
    let (x, y) = (tile_x * 16, tile_y * 16);
    let covers = f.coverage.of_tile(simd, x, y);
    let mut blocks = covers.met;
    if blocks == 0 {
        return;
    }
    let origins = f.paint.plane_at_blocks(simd, target, x, y);
    if f.paint.how.hierarchical {
        let bounds = origins + f.paint.plane_margins(simd, origins) + f.block_rise;
        let bounds = f.paint.clamped(simd, bounds);
        let minima = f32x16::from_slice(simd, target.block_minima(tile));
        if target.visits.is_some() {
            target.count_polygon_visit((x, y), 4, blocks);
        }
        blocks &= bounds.simd_ge(minima).to_bitmask() as u32;
        if blocks == 0 {
            return;
        }
    }
    if covers.whole == 0xFFFF && f.paint.can_cover() && target.is_fresh(tile) {
        cover_tile(simd, target, f, tile, origins);
        return;
    }
    target.touch(tile);
    let mut at_origins = [0f32; 16];
    origins.store_slice(&mut at_origins);
    let mut raised = false;
    while blocks != 0 {
        let c = blocks.trailing_zeros() as usize & 15;
        blocks &= blocks - 1;
        let covered = f.coverage.of_block(simd, &covers, c);
        let corner = (x + (c as i32 & 3) * 4, y + (c as i32 >> 2) * 4);
        raised |= fill_block(simd, target, &mut f.paint, tile, c, corner, at_origins[c], covered, is_hole);
    }
    if raised {
        target.mark_stale(tile);
    }
}

/// Writes a tile that nothing was drawn in and that the triangle covers whole: nothing is read or compared.
#[inline(always)]
fn cover_tile<S: Simd>(simd: S, target: &mut Target, f: &mut Filling<S>, tile: usize, origins: f32x16<S>) {
    let mut at_origins = [0f32; 16];
    origins.store_slice(&mut at_origins);
    let blocks = &mut target.depth[tile * 16..tile * 16 + 16];
    for c in 0..16 {
        let z = f.paint.clamped(simd, f.paint.depth_steps + at_origins[c]);
        z.store_slice(&mut blocks[c].0);
    }
    target.block_id[tile * 16..tile * 16 + 16].copy_from_slice(&[f.paint.slot; 16]);
    target.touched[tile] = true;
    target.counters.pixels_written += 256;
    f.paint.wrote = true;
    if target.visits.is_some() {
        let (x, y) = ((tile % target.tiles_x) as i32 * 16, (tile / target.tiles_x) as i32 * 16);
        for c in 0..16 {
            target.count_polygon_visit((x + c % 4 * 4, y + c / 4 * 4), 1, 0xFFFF);
        }
    }
    if f.paint.how.hierarchical {
        let least = f.paint.clamped(simd, origins + f.paint.least_step);
        least.store_slice(&mut target.levels[0].min[tile].0);
        target.mark_stale(tile);
    }
}

#[cfg(test)]
mod tests;
