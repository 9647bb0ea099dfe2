//! What is kept of an image: for each pixel the farthest depth of what covers all of it, in tiles of 16×16.
//!
//! A tile is empty, or one plane of depth (a face covers all of it), or sixteen floors, one for each block of 4×4
//! pixels, or floors and 256 depths: a pixel then holds the larger of its own and its block's floor. Depths only ever
//! rise. What covers whole blocks raises floors alone, a cache line for a tile instead of sixteen; depths are spelled
//! out where part of a block is covered.
//!
//! Sixteen tiles make a cell of 64×64 pixels; a cell's minimum is the least of its tiles'. A tile's is exact whenever no
//! tile is stale; that of a plane at the image's border may be too far. Floors rise to the minima of what lies on them: one
//! comparison settles all blocks that a rectangle holds whole, and only at its border pixels are looked at. Else pixels
//! beyond the image hold +∞ and never hold a minimum down.

mod asked;

use super::tile::{BLOCK_COLUMNS, BLOCK_ROWS, COLUMNS, Row, TilePlane, WHOLE, blocks_of, columns_of};
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};

/// How a tile is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Empty,
    Plane,
    /// Floors alone.
    Blocks,
    /// Floors, and depths that may be above them.
    Pixels,
}

/// The depths of an image.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    pub width: i32,
    pub height: i32,
    /// First image row: a band of an image is a surface of its own. A multiple of 64.
    pub top: i32,
    cells_x: usize,
    cells_y: usize,
    kind: Vec<Kind>,
    plane: Vec<TilePlane>,
    rows: Vec<Row>,
    /// Which rows of a tile of depths are written; the others hold 0.
    written: Vec<u16>,
    /// The floor of each block of 4×4 of a tile, row by row; of a tile of depths that is not stale, the smallest depth.
    blocks: Vec<Row>,
    /// By cell, sixteen tiles each: smallest depth, and a bound on the largest.
    min: Vec<Row>,
    max: Vec<f32>,
    cell_min: Vec<f32>,
    is_stale: Vec<bool>,
    stale: Vec<u32>,
    /// Who raised a tile last, of those who said that they draw.
    raised_by: Vec<u32>,
    /// Who draws now.
    pub drawing: u32,
}

impl Surface {
    pub fn new(width: u32, top: u32, height: u32) -> Surface {
        assert!(top.is_multiple_of(64) && width > 0 && height > 0);
        let (cells_x, cells_y) = (width.div_ceil(64) as usize, height.div_ceil(64) as usize);
        let tiles = cells_x * cells_y * 16;
        let mut surface = Surface {
            width: width as i32,
            height: height as i32,
            top: top as i32,
            cells_x,
            cells_y,
            kind: vec![Kind::Empty; tiles],
            plane: vec![TilePlane::ZERO; tiles],
            rows: vec![Row([0.0; 16]); tiles * 16],
            written: vec![0; tiles],
            blocks: vec![Row([0.0; 16]); tiles],
            min: vec![Row([0.0; 16]); cells_x * cells_y],
            max: vec![0.0; tiles],
            cell_min: vec![0.0; cells_x * cells_y],
            is_stale: vec![false; tiles],
            stale: Vec::new(),
            raised_by: vec![0; tiles],
            drawing: 0,
        };
        surface.clear();
        surface
    }

    /// Makes everything empty. Cost: the tiles, not the pixels.
    pub fn clear(&mut self) {
        self.kind.fill(Kind::Empty);
        self.max.fill(0.0);
        self.cell_min.fill(0.0);
        self.is_stale.fill(false);
        self.stale.clear();
        self.min.fill(Row([0.0; 16]));
        let (tiles_x, tiles_y) =
            (self.width.cast_unsigned().div_ceil(16), self.height.cast_unsigned().div_ceil(16));
        for cell in 0..self.min.len() {
            let (x, y) = ((cell % self.cells_x * 4) as u32, (cell / self.cells_x * 4) as u32);
            if x + 4 > tiles_x || y + 4 > tiles_y {
                for c in 0..16u32 {
                    if x + c % 4 >= tiles_x || y + c / 4 >= tiles_y {
                        self.min[cell].0[c as usize] = f32::INFINITY;
                    }
                }
            }
        }
    }

    /// Tiles in a row of them, those of incomplete cells too.
    pub fn tiles_x(&self) -> i32 {
        self.cells_x as i32 * 4
    }

    pub fn tiles_y(&self) -> i32 {
        self.cells_y as i32 * 4
    }

    #[inline(always)]
    pub fn tile(&self, x: i32, y: i32) -> usize {
        let cell = (y >> 2) as usize * self.cells_x + (x >> 2) as usize;
        cell * 16 + ((y & 3) * 4 + (x & 3)) as usize
    }

    /// First column and row of a tile, pixels of the surface.
    #[inline(always)]
    pub fn corner(&self, tile: usize) -> (i32, i32) {
        let (cell, c) = (tile / 16, tile as i32 % 16);
        let (x, y) = ((cell % self.cells_x) as i32, (cell / self.cells_x) as i32);
        (x * 64 + c % 4 * 16, y * 64 + c / 4 * 16)
    }

    #[inline(always)]
    pub fn tile_min(&self, tile: usize) -> f32 {
        self.min[tile / 16].0[tile % 16]
    }

    /// A plane covers all of a tile.
    #[inline(always)]
    pub fn cover<S: Simd>(&mut self, simd: S, tile: usize, plane: TilePlane) {
        let (low, high) = (plane.min(0, 0, 15, 15), plane.max());
        if self.tile_min(tile) >= high {
            return;
        }
        let replace = match self.kind[tile] {
            Kind::Empty => true,
            _ if self.max[tile] <= low => true,
            Kind::Plane if plane.above(&self.plane[tile]) => true,
            Kind::Plane if self.plane[tile].above(&plane) => return,
            Kind::Blocks => {
                let floors = f32x16::from_slice(simd, &self.blocks[tile].0);
                plane.block_mins(simd, WHOLE).simd_ge(floors).to_bitmask() == 0xFFFF
            }
            _ => false,
        };
        if replace {
            self.kind[tile] = Kind::Plane;
            self.plane[tile] = plane;
            self.max[tile] = high;
            self.raised_by[tile] = self.drawing;
            self.set_min(simd, tile, low);
            return;
        }
        self.open(simd, tile);
        for row in 0..16 {
            let depth = self.row(simd, tile, row).max(plane.row(simd, row as i32));
            depth.store_slice(&mut self.rows[tile * 16 + row].0);
        }
        self.written[tile] = 0xFFFF;
        self.raised(tile, high);
    }

    /// Whether some of a tile lies beyond the image.
    #[inline(always)]
    fn is_at_border(&self, tile: usize) -> bool {
        let (x, y) = self.corner(tile);
        x + 16 > self.width || y + 16 > self.height
    }

    /// Makes a tile one of depths, if it is not.
    #[inline(always)]
    pub fn open<S: Simd>(&mut self, simd: S, tile: usize) {
        if self.kind[tile] != Kind::Pixels {
            simd.vectorize(
                #[inline(always)]
                || self.spell_out(simd, tile),
            );
        }
    }

    /// Of an empty tile and of floors no row is written; of a plane, and at the image's border, all are.
    #[inline(always)]
    fn spell_out<S: Simd>(&mut self, simd: S, tile: usize) {
        let kind = std::mem::replace(&mut self.kind[tile], Kind::Pixels);
        let plane = if kind == Kind::Plane { self.plane[tile] } else { TilePlane::ZERO };
        if kind != Kind::Blocks {
            plane.block_mins(simd, WHOLE).max(0.0).store_slice(&mut self.blocks[tile].0);
        }
        let at_border = self.is_at_border(tile);
        if kind != Kind::Plane && !at_border {
            self.written[tile] = 0;
            return;
        }
        self.written[tile] = 0xFFFF;
        for (row, at) in self.rows[tile * 16..][..16].iter_mut().enumerate() {
            plane.row(simd, row as i32).store_slice(&mut at.0);
        }
        if at_border {
            let (x, y) = self.corner(tile);
            for (row, at) in (y..).zip(&mut self.rows[tile * 16..][..16]) {
                let columns = if row < self.height { (self.width - x).clamp(0, 16) as usize } else { 0 };
                at.0[columns..].fill(f32::INFINITY);
            }
        }
    }

    /// The depths of a row of an open tile.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, tile: usize, row: usize) -> f32x16<S> {
        match self.written[tile] >> row & 1 {
            0 => f32x16::splat(simd, 0.0),
            _ => f32x16::from_slice(simd, &self.rows[tile * 16 + row].0),
        }
    }

    /// Raises the pixels of `mask` in a row of an open tile.
    #[inline(always)]
    pub fn raise<S: Simd>(&mut self, simd: S, tile: usize, row: i32, depth: f32x16<S>, mask: mask32x16<S>) {
        let old = self.row(simd, tile, row as usize);
        mask.select(old.max(depth), old).store_slice(&mut self.rows[tile * 16 + row as usize].0);
        self.written[tile] |= 1 << row;
    }

    /// Raises the pixels of a tile that lie in spans of its rows: first and last column. `rows` are those whose
    /// span is not empty. `depth` says a row's; none is above `highest`.
    #[inline(always)]
    pub fn raise_spans<S: Simd>(
        &mut self,
        simd: S,
        tile: usize,
        [from, to]: [f32x16<S>; 2],
        rows: u32,
        depth: impl Fn(usize) -> f32x16<S>,
        highest: f32,
    ) {
        self.open(simd, tile);
        let (from, to): ([f32; 16], [f32; 16]) = (from.into(), to.into());
        let columns = f32x16::from_slice(simd, &COLUMNS);
        let (first, last) =
            (rows.trailing_zeros() as usize & 15, (31 - (rows | 1).leading_zeros() as usize) & 15);
        let written = u32::from(self.written[tile]);
        let zero = f32x16::splat(simd, 0.0);
        let mut least = [f32x16::splat(simd, f32::INFINITY); 4];
        for (quarter, four) in self.rows[tile * 16..][..16].chunks_exact_mut(4).enumerate() {
            for (at, row) in four.iter_mut().enumerate() {
                let at = quarter * 4 + at;
                let old = if written >> at & 1 == 1 { f32x16::from_slice(simd, &row.0) } else { zero };
                let mut new = old;
                if at >= first && at <= last {
                    let covered = columns.simd_ge(from[at]) & columns.simd_le(to[at]);
                    new = covered.select(old.max(depth(at)), old);
                    new.store_slice(&mut row.0);
                }
                least[quarter] = least[quarter].min(new);
            }
        }
        self.written[tile] |= ((0xFFFFu32 << first) & (0xFFFF >> (15 - last))) as u16;
        self.max[tile] = self.max[tile].max(highest);
        self.raised_by[tile] = self.drawing;
        self.raise_floors(simd, tile, least);
    }

    /// Raises what a patch covers of a tile: in each row the columns that `covered` says, to what `depth` says of their
    /// block. No depth is above `highest`.
    #[inline(always)]
    pub fn raise_covered<S: Simd>(
        &mut self,
        simd: S,
        tile: usize,
        covered: &[u16; 16],
        depth: f32x16<S>,
        highest: f32,
    ) {
        let (covered, mut whole, mut some) = (covered.map(u32::from), 0, 0);
        for (at, [a, b, c, d]) in covered.as_chunks::<4>().0.iter().enumerate() {
            whole |= blocks_of(a & b & c & d) << (at * 4);
            some |= a | b | c | d;
        }
        if some == 0 {
            return;
        }
        if self.is_at_border(tile) {
            whole = self.whole_in_the_image(tile, &covered);
        }
        let gains = self.floors(simd, tile).simd_lt(depth).to_bitmask() as u32;
        let in_part = gains & !whole;
        let mut wrote = false;
        if in_part != 0 {
            let depths: [f32; 16] = depth.into();
            for (at, four) in covered.as_chunks::<4>().0.iter().enumerate() {
                let columns = columns_of(in_part >> (at * 4));
                if columns & (four[0] | four[1] | four[2] | four[3]) == 0 {
                    continue;
                }
                if !wrote {
                    self.open(simd, tile);
                    wrote = true;
                }
                let [a, b, c, d] = depths.as_chunks::<4>().0[at];
                let depth = f32x16::from_slice(simd, &[a, a, a, a, b, b, b, b, c, c, c, c, d, d, d, d]);
                for (row, covered) in four.iter().enumerate().filter(|(_, covered)| **covered & columns != 0)
                {
                    let mask = mask32x16::from_bitmask(simd, u64::from(covered & columns));
                    self.raise(simd, tile, (at * 4 + row) as i32, depth, mask);
                }
            }
        }
        if wrote {
            self.raised(tile, highest);
        }
        self.raise_blocks(simd, tile, whole, depth, highest);
    }

    /// The floors of a tile, whatever it is; anything for what lies beyond the image.
    #[inline(always)]
    fn floors<S: Simd>(&self, simd: S, tile: usize) -> f32x16<S> {
        match self.kind[tile] {
            Kind::Empty => f32x16::splat(simd, 0.0),
            Kind::Plane => self.plane[tile].block_mins(simd, WHOLE),
            Kind::Blocks | Kind::Pixels => f32x16::from_slice(simd, &self.blocks[tile].0),
        }
    }

    /// Blocks of a tile at the border that are covered, as far as they are in the image.
    #[inline(never)]
    fn whole_in_the_image(&self, tile: usize, covered: &[u32; 16]) -> u32 {
        let (x, y) = self.corner(tile);
        let right = 0xFFFF & (0xFFFFu32 << (self.width - x).clamp(0, 16));
        let (mut whole, mut some) = ([0xFFFF; 4], [0; 4]);
        for (at, (row, columns)) in (y..).zip(covered).enumerate() {
            let beyond = if row < self.height { right } else { 0xFFFF };
            whole[at / 4] &= columns | beyond;
            some[at / 4] |= columns;
        }
        let none = some.map(|columns: u32| blocks_of(!columns & 0xFFFF));
        (0..4).fold(0, |blocks, at| blocks | (blocks_of(whole[at]) & !none[at]) << (at * 4))
    }

    /// Raises the floors of some blocks of a tile. No depth is above `highest`.
    #[inline(always)]
    pub fn raise_blocks<S: Simd>(
        &mut self,
        simd: S,
        tile: usize,
        blocks: u32,
        depth: f32x16<S>,
        highest: f32,
    ) {
        if blocks & self.floors(simd, tile).simd_lt(depth).to_bitmask() as u32 == 0 {
            return;
        }
        // What covers all of it, and is nearer than all that was there, leaves nothing of that.
        let alone = blocks == 0xFFFF && self.max[tile] <= depth.reduce_min();
        let floors = if alone || self.kind[tile] == Kind::Empty {
            self.kind[tile] = Kind::Blocks;
            self.no_floors(simd, tile)
        } else {
            if self.kind[tile] == Kind::Plane {
                self.open(simd, tile);
                self.mark_stale(tile);
            }
            f32x16::from_slice(simd, &self.blocks[tile].0)
        };
        let raised = mask32x16::from_bitmask(simd, u64::from(blocks)).select(floors.max(depth), floors);
        raised.store_slice(&mut self.blocks[tile].0);
        self.max[tile] = self.max[tile].max(highest);
        self.raised_by[tile] = self.drawing;
        self.set_min(simd, tile, raised.reduce_min());
    }

    /// The floors of an empty tile.
    #[inline(always)]
    fn no_floors<S: Simd>(&self, simd: S, tile: usize) -> f32x16<S> {
        if !self.is_at_border(tile) {
            return f32x16::splat(simd, 0.0);
        }
        let (x, y) = self.corner(tile);
        let (columns, rows) = ((self.width - x) as f32, (self.height - y) as f32);
        let beyond = f32x16::from_slice(simd, &BLOCK_COLUMNS).simd_ge(f32x16::splat(simd, columns))
            | f32x16::from_slice(simd, &BLOCK_ROWS).simd_ge(f32x16::splat(simd, rows));
        beyond.select(f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, 0.0))
    }

    /// Says that pixels of an open tile were raised, none above `highest`.
    #[inline(always)]
    pub fn raised(&mut self, tile: usize, highest: f32) {
        self.max[tile] = self.max[tile].max(highest);
        self.raised_by[tile] = self.drawing;
        self.mark_stale(tile);
    }

    /// Who raised the tile in the middle of a rectangle last.
    #[inline(always)]
    pub fn raised_by(&self, [left, top, right, bottom]: [i32; 4]) -> u32 {
        self.raised_by[self.tile((left + right) >> 5, (top + bottom) >> 5)]
    }

    #[inline(always)]
    fn mark_stale(&mut self, tile: usize) {
        if !self.is_stale[tile] {
            self.is_stale[tile] = true;
            self.stale.push(tile as u32);
        }
    }

    /// Brings the minima of what was raised up to date.
    #[inline(always)]
    pub fn refresh<S: Simd>(&mut self, simd: S) {
        while let Some(tile) = self.stale.pop() {
            self.refresh_tile(simd, tile as usize);
        }
    }

    #[inline(always)]
    pub fn refresh_tile<S: Simd>(&mut self, simd: S, tile: usize) {
        if !self.is_stale[tile] {
            return;
        }
        self.is_stale[tile] = false;
        if self.kind[tile] != Kind::Pixels {
            return;
        }
        let mut least = [f32x16::splat(simd, 0.0); 4];
        for (at, (least, four)) in
            least.iter_mut().zip(self.rows[tile * 16..][..16].as_chunks::<4>().0).enumerate()
        {
            if self.written[tile] >> (at * 4) & 15 == 15 {
                let [a, b, c, d] = four;
                let (a, b) = (f32x16::from_slice(simd, &a.0), f32x16::from_slice(simd, &b.0));
                let (c, d) = (f32x16::from_slice(simd, &c.0), f32x16::from_slice(simd, &d.0));
                *least = a.min(b).min(c.min(d));
            }
        }
        self.raise_floors(simd, tile, least);
    }

    /// Raises the floors of a tile of depths to the minima on them, given those of each column of four rows.
    #[inline(always)]
    fn raise_floors<S: Simd>(&mut self, simd: S, tile: usize, [a, b, c, d]: [f32x16<S>; 4]) {
        let ((a, b), (c, d)) = (simd.deinterleave_f32x16(a, b), simd.deinterleave_f32x16(c, d));
        let (pairs, others) = simd.deinterleave_f32x16(a.min(b), c.min(d));
        let blocks = pairs.min(others).max(f32x16::from_slice(simd, &self.blocks[tile].0));
        blocks.store_slice(&mut self.blocks[tile].0);
        self.set_min(simd, tile, blocks.reduce_min());
    }

    #[inline(always)]
    fn set_min<S: Simd>(&mut self, simd: S, tile: usize, min: f32) {
        let cell = &mut self.min[tile / 16].0;
        if cell[tile % 16] != min {
            cell[tile % 16] = min;
            self.cell_min[tile / 16] = f32x16::from_slice(simd, cell).reduce_min();
        }
    }

    /// Depth at a pixel of the surface.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        assert!((x as i32) < self.width && (y as i32) < self.height, "({x}, {y}) is outside the image");
        let tile = self.tile(x as i32 >> 4, y as i32 >> 4);
        let (column, row) = (x & 15, y & 15);
        let floor = self.blocks[tile].0[((row & 12) | (column >> 2)) as usize];
        match self.kind[tile] {
            Kind::Empty => 0.0,
            Kind::Plane => self.plane[tile].at(column as i32, row as i32).max(0.0),
            Kind::Blocks => floor,
            Kind::Pixels if self.written[tile] >> row & 1 == 0 => floor,
            Kind::Pixels => self.rows[tile * 16 + row as usize].0[column as usize].max(floor),
        }
    }

    /// Each pixel gets the nearer of the two surfaces' depths. Both are of the same size.
    #[inline(always)]
    pub fn merge<S: Simd>(&mut self, simd: S, other: &Surface) {
        for tile in 0..self.kind.len() {
            match other.kind[tile] {
                Kind::Empty => {}
                Kind::Plane => self.cover(simd, tile, other.plane[tile]),
                Kind::Blocks | Kind::Pixels => {
                    let floors = f32x16::from_slice(simd, &other.blocks[tile].0);
                    self.raise_blocks(simd, tile, 0xFFFF, floors, other.max[tile]);
                    if other.kind[tile] == Kind::Blocks {
                        continue;
                    }
                    self.open(simd, tile);
                    for row in 0..16 {
                        let depth = self.row(simd, tile, row).max(other.row(simd, tile, row));
                        depth.store_slice(&mut self.rows[tile * 16 + row].0);
                    }
                    self.written[tile] = 0xFFFF;
                    self.raised(tile, other.max[tile]);
                }
            }
        }
        self.refresh(simd);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::levels;
    use crate::reference::trouble::Random;
    use fearless_simd::dispatch;

    /// A surface of planes, spans of rows and single rows, in any order.
    #[inline(always)]
    fn scribble<S: Simd>(simd: S, random: &mut Random) -> Surface {
        let mut surface = Surface::new(1 + random.below(150), 0, 1 + random.below(150));
        let (tiles_x, tiles_y) = ((surface.width + 15) >> 4, (surface.height + 15) >> 4);
        for _ in 0..random.below(60) {
            let [x, y] = [tiles_x, tiles_y].map(|n| random.below(n as u32) as i32);
            let tile = surface.tile(x, y);
            let mut slope = || random.between(-0.02, 0.02) as f32;
            let (per_column, per_row) = (slope(), slope());
            let plane = TilePlane { origin: random.between(0.31, 0.7) as f32, per_column, per_row };
            match random.below(4) {
                0 => surface.cover(simd, tile, plane),
                3 => {
                    let whole = if random.one_in(2) { 0xFFFF } else { random.below(0x10000) as u16 };
                    let covered = std::array::from_fn(|row| if row & 4 == 0 { whole } else { 0xFF0 | whole });
                    let depth = plane.block_mins(simd, WHOLE);
                    let at = |column: i32, row: i32| ((x * 16 + column) as u32, (y * 16 + row) as u32);
                    let pixels = (0..16).flat_map(|row| (0..16).map(move |column| (column, row)));
                    let seen = |&(column, row): &(i32, i32)| {
                        x * 16 + column < surface.width && y * 16 + row < surface.height
                    };
                    let pixels: Vec<_> = pixels.filter(seen).collect();
                    let holds = |s: &Surface, (c, r): (i32, i32)| s.depth(at(c, r).0, at(c, r).1);
                    let before: Vec<f32> = pixels.iter().map(|&p| holds(&surface, p)).collect();
                    surface.raise_covered(simd, tile, &covered, depth, plane.max());
                    let depths: [f32; 16] = depth.into();
                    for (&(c, r), before) in pixels.iter().zip(before) {
                        let new = depths[((r & 12) | (c >> 2)) as usize];
                        let raised = if covered[r as usize] >> c & 1 == 1 { before.max(new) } else { before };
                        assert_eq!(holds(&surface, (c, r)), raised, "({c}, {r}) of tile {x}, {y}");
                    }
                }
                1 => {
                    let from = f32x16::splat(simd, random.below(16) as f32);
                    let to = f32x16::splat(simd, random.below(16) as f32);
                    let depths = plane.rows(simd);
                    let (rows, depth) = (1 + random.below(0xFFFF), |row: usize| depths.row(simd, row));
                    surface.raise_spans(simd, tile, [from, to], rows, depth, plane.max());
                }
                _ => {
                    surface.open(simd, tile);
                    let (row, mask) = (random.below(16) as i32, u64::from(random.below(0x10000)));
                    let mask = mask32x16::from_bitmask(simd, mask);
                    surface.raise(simd, tile, row, plane.row(simd, row), mask);
                    surface.raised(tile, plane.max());
                }
            }
        }
        surface
    }

    #[inline(always)]
    fn ask_as_pixels_say<S: Simd>(simd: S, random: &mut Random) -> [u32; 3] {
        let mut surface = scribble(simd, random);
        let mut asked = [0; 3];
        let mut side = |size: i32| {
            let (a, b) = (random.below(size as u32) as i32, random.below(size as u32) as i32);
            // Often a few pixels only.
            let b = if random.one_in(2) { (a + b % 9).min(size - 1) } else { b };
            [a.min(b), a.max(b)]
        };
        for question in 0..200 {
            let ([left, right], [top, bottom]) = (side(surface.width), side(surface.height));
            let rect = [left, top, right, bottom];
            let depth = [0.0, 0.3, 0.45, 0.6][question & 3];
            let pixels = (top..=bottom).flat_map(|y| (left..=right).map(move |x| (x as u32, y as u32)));
            let truth = pixels.clone().all(|(x, y)| surface.depth(x, y) > depth);
            // The first half while minima are stale.
            if question < 100 {
                assert_eq!(surface.all_nearer_now(simd, rect, depth), truth, "{rect:?} {depth}");
            } else {
                surface.refresh(simd);
                assert_eq!(surface.all_nearer(simd, rect, depth), truth, "{rect:?} {depth}");
            }
            asked[usize::from(truth)] += 1;
            if surface.is_behind(rect, depth) {
                assert!(pixels.clone().all(|(x, y)| surface.depth(x, y) < depth), "{rect:?} {depth}");
                asked[2] += 1;
            }
            let (tile, inner) =
                (surface.tile(left >> 4, top >> 4), [left & 15, top & 15, left & 15, top & 15]);
            let farther = surface.depth(left as u32, top as u32) < depth;
            assert!(surface.may_gain(simd, tile, inner, depth) || !farther, "{rect:?} {depth}");
        }
        asked
    }

    #[test]
    fn what_is_said_of_rectangles_is_what_their_pixels_say() {
        for level in levels() {
            let random = &mut Random::new(5);
            let mut asked = [0; 3];
            for _ in 0..400 {
                let more = dispatch!(level, simd => ask_as_pixels_say(simd, random));
                asked.iter_mut().zip(more).for_each(|(sum, n)| *sum += n);
            }
            assert!(asked.iter().all(|&n| n > 1000), "{asked:?}");
        }
    }
}
