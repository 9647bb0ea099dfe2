//! Filling triangles of a few pixels, most of what is far away: no tiles, no 64-bit edges, and where setup has
//! settled the coverage, no edges at all.

use super::fill::{Filled, blocks_of};
use super::paint::{COLUMN, How, Paint, ROW, fill_block};
use super::pyramid::{Rect, Target};
use super::setup::ScreenTriangle;
use fearless_simd::{Simd, i32x16, prelude::*};

/// Whether a triangle meets at most 2×2 blocks, and its edge functions there fit into 32 bits: sides of 64
/// pixels, seen from 72 pixels away, make products below 2²⁹.
#[inline(always)]
pub(super) fn is_small(t: &ScreenTriangle, target: &Target) -> bool {
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
pub(super) fn fill_tiny<S: Simd>(
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
        target.touch(tile);
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
pub(super) const NONE: (i32, i32, u32) = (0, 0, 0);

/// Fills a triangle that [`is_small`].
#[inline(always)]
pub(super) fn fill_small<S: Simd>(
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
        target.touch(tile);
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

/// Block `i` of a rectangle (inclusive) of at most 2×2 blocks: bit 0 right, bit 1 bottom.
#[inline(always)]
pub(super) fn corner_block(blocks: &Rect, i: i32) -> (i32, i32) {
    let x = if i & 1 == 0 { blocks.left } else { blocks.right };
    let y = if i & 2 == 0 { blocks.top } else { blocks.bottom };
    (x, y)
}

/// Which of at most 2×2 blocks do not hide `depth`, each once.
#[inline(always)]
pub(super) fn open_corners(target: &mut Target, blocks: &Rect, depth: f32, hierarchical: bool) -> u32 {
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
