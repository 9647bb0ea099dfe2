//! Filling triangles of a few pixels, most of what is far away: no tiles, no 64-bit edges, and where setup has
//! settled the coverage, no edges at all.

use super::fill::{Filled, blocks_of};
use super::paint::{COLUMN, How, Paint, ROW, fill_block};
use super::pyramid::{Rect, Target, cell_mask};
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
    let mut pieces = pieces_in_blocks(x, y, covers);
    if x < 0 || y < 0 || x + 1 >= target.width || y + 1 >= target.height {
        pieces = inside(pieces, x, y, target);
    }
    let mut paint = Paint::new(simd, target, t, how);
    let mut rasterised = false;
    // Most lie in one block.
    let mut rest = (0..4).fold(0u32, |bits, i| bits | u32::from(pieces[i] != 0) << i);
    while rest != 0 {
        let i = rest.trailing_zeros() as i32 & 3;
        rest &= rest - 1;
        let (bx, by) = ((x + (i & 1)) >> 2, (y + (i >> 1)) >> 2);
        let tile = (by >> 2) as usize * target.tiles_x + (bx >> 2) as usize;
        let block = ((by & 3) * 4 + (bx & 3)) as usize;
        if how.hierarchical && t.depth_max < target.block_minima(tile)[block] {
            continue;
        }
        rasterised = true;
        target.touch(tile);
        let origin = paint.plane_at(target, bx * 4, by * 4);
        let covered = pieces[i as usize];
        if fill_block(simd, target, &mut paint, tile, block, (bx * 4, by * 4), origin, covered, is_hole) {
            target.mark_stale(tile);
        }
    }
    if paint.wrote {
        target.surfaces.push(how.id);
    }
    Filled { rasterised, wrote: paint.wrote }
}

/// 2×2 pixels from window pixel (x, y) on as bits of the blocks they lie in: piece `i` is of the block of pixel
/// `i` (bit 0 right, bit 1 below), and where two share a block, the first speaks for both.
#[inline(always)]
fn pieces_in_blocks(x: i32, y: i32, covers: [u32; 4]) -> [u32; 4] {
    let (column, row) = ([x & 3, (x + 1) & 3], [(y & 3) * 4, ((y + 1) & 3) * 4]);
    let [mut a, mut b, mut c, mut d] = covers;
    (a, b) = (a << (column[0] + row[0]), b << (column[1] + row[0]));
    (c, d) = (c << (column[0] + row[1]), d << (column[1] + row[1]));
    // All ones where the neighbour lies in a block of its own. Without a branch: it cannot be foreseen.
    let own = |v: i32| ((v & 3 != 3) as u32).wrapping_sub(1);
    let (right, below) = (own(x), own(y));
    (a, b) = (a | b & !right, b & right);
    (c, d) = (c | d & !right, d & right);
    (a, c) = (a | c & !below, c & below);
    (b, d) = (b | d & !below, d & below);
    [a, b, c, d]
}

/// Of the pieces of 2×2 pixels from window pixel (x, y) on, what lies in the window. Its border runs between
/// tiles, or along the image's, so that pixels that share a block may lie on either side of it.
#[inline(never)]
fn inside(pieces: [u32; 4], x: i32, y: i32, target: &Target) -> [u32; 4] {
    let mut kept = [0; 4];
    for (i, piece) in (0i32..).zip(pieces) {
        let (bx, by) = (((x + (i & 1)) >> 2) * 4, ((y + (i >> 1)) >> 2) * 4);
        let pixels = cell_mask(
            (-bx).clamp(0, 4),
            (-by).clamp(0, 4),
            (target.width - 1 - bx).clamp(-1, 3),
            (target.height - 1 - by).clamp(-1, 3),
        );
        kept[i as usize] = piece & pixels;
    }
    kept
}

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

#[cfg(test)]
mod tests {
    use super::*;

    /// The window pixels that pieces stand for, whichever way they are put together.
    fn pixels(pieces: [u32; 4], x: i32, y: i32) -> Vec<(i32, i32)> {
        let mut pixels = Vec::new();
        for (i, piece) in (0i32..).zip(pieces) {
            let (bx, by) = ((x + (i & 1)) >> 2, (y + (i >> 1)) >> 2);
            let covered = (0..16).filter(|p| piece >> p & 1 == 1);
            pixels.extend(covered.map(|p| (bx * 4 + p % 4, by * 4 + p / 4)));
        }
        pixels.sort_unstable();
        pixels
    }

    #[test]
    fn tiny_triangles_keep_their_pixels_wherever_blocks_and_windows_end() {
        let target = Target::new(16, 0, 21, 18);
        for (x, y) in (-1..21).flat_map(|x| (-1..18).map(move |y| (x, y))) {
            for bits in 0..16u32 {
                let covers = [0, 1, 2, 3].map(|i| bits >> i & 1);
                let own = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                let mut expected: Vec<_> = (0..4).filter(|&i| covers[i] == 1).map(|i| own[i]).collect();
                expected.sort_unstable();
                let pieces = pieces_in_blocks(x, y, covers);
                assert_eq!(pixels(pieces, x, y), expected, "({x}, {y}), {bits:04b}");
                expected.retain(|p| p.0 >= 0 && p.1 >= 0 && p.0 < 21 && p.1 < 18);
                let kept = inside(pieces, x, y, &target);
                assert_eq!(pixels(kept, x, y), expected, "({x}, {y}), {bits:04b}, in the window");
            }
        }
    }
}
