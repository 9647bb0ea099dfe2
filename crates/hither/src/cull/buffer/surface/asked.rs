//! What is said of rectangles of a surface.

use super::super::tile::{blocks_in, columns_of};
use super::{Kind, Surface};
use fearless_simd::{Simd, f32x16, prelude::*};

impl Surface {
    /// Whether a block of 4×4 pixels that columns and rows (inclusive) of a tile meet may hold less than `depth`; for
    /// certain if the tile is not stale.
    #[inline(always)]
    pub fn may_gain<S: Simd>(&self, simd: S, tile: usize, rect: [i32; 4], depth: f32) -> bool {
        if self.tile_min(tile) >= depth {
            return false;
        }
        match self.kind[tile] {
            Kind::Empty => true,
            Kind::Plane => self.plane[tile].min(rect[0], rect[1], rect[2], rect[3]) < depth,
            Kind::Pixels if self.is_stale[tile] => true,
            Kind::Blocks | Kind::Pixels => {
                let farther = f32x16::from_slice(simd, &self.blocks[tile].0).simd_lt(depth).to_bitmask();
                farther as u32 & blocks_in([rect[0] >> 2, rect[1] >> 2, rect[2] >> 2, rect[3] >> 2]) != 0
            }
        }
    }

    /// Which tiles of a cell hold something that is not nearer than `depth`, of those that meet `rect`.
    #[inline(always)]
    pub fn tiles_beyond<S: Simd>(&self, simd: S, x: i32, y: i32, rect: [i32; 4], depth: f32) -> u32 {
        let cell = y as usize * self.cells_x + x as usize;
        if self.cell_min[cell] >= depth {
            return 0;
        }
        let farther = f32x16::from_slice(simd, &self.min[cell].0).simd_lt(depth).to_bitmask() as u32;
        farther & tiles_that_meet(x, y, rect)
    }

    /// Which tiles of a cell, of those that meet `rect`, do not hold more than `depth` everywhere, as their minima say.
    #[inline(always)]
    fn tiles_not_nearer<S: Simd>(&self, simd: S, x: i32, y: i32, rect: [i32; 4], depth: f32) -> u32 {
        let cell = y as usize * self.cells_x + x as usize;
        if self.cell_min[cell] > depth {
            return 0;
        }
        // Asked this way round, a depth that is no number is nearer than nothing.
        let nearer = f32x16::from_slice(simd, &self.min[cell].0).simd_gt(depth).to_bitmask() as u32;
        !nearer & tiles_that_meet(x, y, rect)
    }

    /// As [`Surface::all_nearer`], while minima may be stale (too far: still bounds): those that matter are
    /// brought up to date.
    #[inline(always)]
    pub fn all_nearer_now<S: Simd>(&mut self, simd: S, rect: [i32; 4], depth: f32) -> bool {
        let [left, top, right, bottom] = rect;
        for y in top >> 6..(bottom >> 6) + 1 {
            for x in left >> 6..(right >> 6) + 1 {
                let mut open = self.tiles_not_nearer(simd, x, y, rect, depth);
                while open != 0 {
                    let (tile, place) = self.first_of(x, y, open);
                    open &= open - 1;
                    self.refresh_tile(simd, tile);
                    if !self.tile_is_nearer(simd, tile, place, rect, depth) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Whether every pixel of `[left, top, right, bottom]` (inclusive, inside the surface) holds more than
    /// `depth`. Exact.
    #[inline(always)]
    pub fn all_nearer<S: Simd>(&self, simd: S, rect: [i32; 4], depth: f32) -> bool {
        let [left, top, right, bottom] = rect;
        if (right >> 4) - (left >> 4) <= 1 && (bottom >> 4) - (top >> 4) <= 1 {
            return self.tiles_are_nearer(simd, rect, depth);
        }
        for y in top >> 6..(bottom >> 6) + 1 {
            for x in left >> 6..(right >> 6) + 1 {
                let mut open = self.tiles_not_nearer(simd, x, y, rect, depth);
                // The minima of tiles that lie in it are exact: they end at no border of the image.
                if open & tiles_within(x, y, rect) != 0 {
                    return false;
                }
                while open != 0 {
                    let (tile, place) = self.first_of(x, y, open);
                    open &= open - 1;
                    if !self.tile_is_nearer(simd, tile, place, rect, depth) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// The same, of few tiles.
    #[inline(always)]
    fn tiles_are_nearer<S: Simd>(&self, simd: S, rect: [i32; 4], depth: f32) -> bool {
        let [left, top, right, bottom] = rect;
        for y in top >> 4..(bottom >> 4) + 1 {
            for x in left >> 4..(right >> 4) + 1 {
                if !self.tile_is_nearer(simd, self.tile(x, y), [x, y], rect, depth) {
                    return false;
                }
            }
        }
        true
    }

    /// The first of some tiles of a cell: its number, and its column and row among all.
    #[inline(always)]
    fn first_of(&self, x: i32, y: i32, tiles: u32) -> (usize, [i32; 2]) {
        let first = tiles.trailing_zeros() as usize & 15;
        let tile = (y as usize * self.cells_x + x as usize) * 16 + first;
        (tile, [x * 4 + (first as i32 & 3), y * 4 + (first as i32 >> 2)])
    }

    /// Whether nothing in the tiles that a rectangle (inclusive) meets is as near as `depth`.
    #[inline(always)]
    pub fn is_behind(&self, [left, top, right, bottom]: [i32; 4], depth: f32) -> bool {
        for y in top >> 4..(bottom >> 4) + 1 {
            for x in left >> 4..(right >> 4) + 1 {
                if self.max[self.tile(x, y)] >= depth {
                    return false;
                }
            }
        }
        true
    }

    /// Whether all that lies of `rect` in a tile holds more than `depth`.
    #[inline(always)]
    fn tile_is_nearer<S: Simd>(
        &self,
        simd: S,
        tile: usize,
        [x, y]: [i32; 2],
        rect: [i32; 4],
        depth: f32,
    ) -> bool {
        if self.tile_min(tile) > depth {
            return true;
        }
        let (x, y) = (x * 16, y * 16);
        let inner =
            [(rect[0] - x).max(0), (rect[1] - y).max(0), (rect[2] - x).min(15), (rect[3] - y).min(15)];
        match self.kind[tile] {
            Kind::Empty => false,
            Kind::Plane => self.plane[tile].min(inner[0], inner[1], inner[2], inner[3]) > depth,
            Kind::Blocks | Kind::Pixels => self.pixels_are_nearer(simd, tile, inner, depth),
        }
    }

    /// As [`Surface::tile_is_nearer`] for columns and rows (inclusive) of a tile of floors and maybe depths.
    #[inline(always)]
    fn pixels_are_nearer<S: Simd>(&self, simd: S, tile: usize, rect: [i32; 4], depth: f32) -> bool {
        let [x0, y0, x1, y1] = rect;
        let threshold = f32x16::splat(simd, depth);
        // Asked this way round, a depth that is no number is nearer than nothing.
        let nearer = f32x16::from_slice(simd, &self.blocks[tile].0).simd_gt(threshold).to_bitmask() as u32;
        let open = !nearer & blocks_in([x0 >> 2, y0 >> 2, x1 >> 2, y1 >> 2]);
        if open == 0 {
            return true;
        }
        if self.kind[tile] == Kind::Blocks
            || open & blocks_in([(x0 + 3) >> 2, (y0 + 3) >> 2, ((x1 + 1) >> 2) - 1, ((y1 + 1) >> 2) - 1]) != 0
        {
            return false;
        }
        let columns = (0xFFFFu32 << x0) & (0xFFFF >> (15 - x1));
        for y in y0..y1 + 1 {
            let columns = columns & columns_of(open >> (y & 12));
            if columns == 0 {
                continue;
            }
            let row = self.row(simd, tile, y as usize & 15);
            let nearer = row.simd_gt(threshold).to_bitmask() as u32;
            if nearer & columns != columns {
                return false;
            }
        }
        true
    }
}

/// The tiles of a cell that a rectangle (inclusive) meets; some must.
#[inline(always)]
fn tiles_that_meet(x: i32, y: i32, [left, top, right, bottom]: [i32; 4]) -> u32 {
    let first = [(left >> 4) - x * 4, (top >> 4) - y * 4].map(|at| at.max(0));
    let last = [(right >> 4) - x * 4, (bottom >> 4) - y * 4].map(|at| at.min(3));
    blocks_in([first[0], first[1], last[0], last[1]])
}

/// The tiles of a cell that lie in a rectangle (inclusive) that meets it.
#[inline(always)]
fn tiles_within(x: i32, y: i32, [left, top, right, bottom]: [i32; 4]) -> u32 {
    let first = [((left + 15) >> 4) - x * 4, ((top + 15) >> 4) - y * 4].map(|at| at.max(0));
    let last = [((right + 1) >> 4) - 1 - x * 4, ((bottom + 1) >> 4) - 1 - y * 4].map(|at| at.min(3));
    blocks_in([first[0], first[1], last[0], last[1]])
}
