//! A tile of 16×16 pixels: its columns, rows and blocks of 4×4, and planes of depth over it.

use fearless_simd::{Simd, f32x16, prelude::*};

/// Depth as a function of a tile's columns and rows, 0 to 15.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TilePlane {
    pub origin: f32,
    pub per_column: f32,
    pub per_row: f32,
}

impl TilePlane {
    pub const ZERO: TilePlane = TilePlane { origin: 0.0, per_column: 0.0, per_row: 0.0 };

    #[inline(always)]
    pub fn at(&self, column: i32, row: i32) -> f32 {
        (self.origin + row as f32 * self.per_row) + column as f32 * self.per_column
    }

    #[inline(always)]
    pub fn row<S: Simd>(&self, simd: S, row: i32) -> f32x16<S> {
        f32x16::from_slice(simd, &COLUMNS) * self.per_column + (self.origin + row as f32 * self.per_row)
    }

    /// The same for all rows.
    #[inline(always)]
    pub fn rows<S: Simd>(&self, simd: S) -> PlaneRows<S> {
        let columns = f32x16::from_slice(simd, &COLUMNS);
        PlaneRows { column: columns * self.per_column, origin: (columns * self.per_row + self.origin).into() }
    }

    /// Smallest value over a rectangle of columns and rows (inclusive): floating-point sums are monotonic.
    #[inline(always)]
    pub fn min(&self, x0: i32, y0: i32, x1: i32, y1: i32) -> f32 {
        self.at(if self.per_column < 0.0 { x1 } else { x0 }, if self.per_row < 0.0 { y1 } else { y0 })
    }

    /// Smallest value over each block of 4×4, as far as it lies between columns and rows (inclusive); anything for others.
    /// The bits of [`TilePlane::min`].
    #[inline(always)]
    pub fn block_mins<S: Simd>(&self, simd: S, [x0, y0, x1, y1]: [i32; 4]) -> f32x16<S> {
        let last = |slope: f32| if slope < 0.0 { 3.0 } else { 0.0 };
        let columns = f32x16::from_slice(simd, &BLOCK_COLUMNS) + last(self.per_column);
        let rows = f32x16::from_slice(simd, &BLOCK_ROWS) + last(self.per_row);
        let (columns, rows) = (columns.max(x0 as f32).min(x1 as f32), rows.max(y0 as f32).min(y1 as f32));
        columns * self.per_column + (rows * self.per_row + self.origin)
    }

    #[inline(always)]
    pub fn max(&self) -> f32 {
        self.at(if self.per_column < 0.0 { 0 } else { 15 }, if self.per_row < 0.0 { 0 } else { 15 })
    }

    /// Whether it is nowhere below `other`, roundings included: the difference of planes is least in a corner.
    #[inline(always)]
    pub fn above(&self, other: &TilePlane) -> bool {
        let roundings = (self.size() + other.size()) * 1e-6;
        let beats = |x: i32, y: i32| self.at(x, y) >= other.at(x, y) + roundings;
        beats(0, 0) && beats(15, 0) && beats(0, 15) && beats(15, 15)
    }

    /// No term or sum is larger.
    #[inline(always)]
    fn size(&self) -> f32 {
        self.origin.abs() + 15.0 * (self.per_column.abs() + self.per_row.abs())
    }
}

/// The plane over a tile of the image, lowered by more than the roundings of its use.
#[inline(always)]
pub(super) fn tile_plane([a, b, c]: [f64; 3], x: i32, y: i32) -> TilePlane {
    let (x, y) = (f64::from(x), f64::from(y));
    let origin = c + a * x + b * y;
    let size = origin.abs() + 16.0 * (a.abs() + b.abs());
    let size = size + (c.abs() + a.abs() * x.abs() + b.abs() * y.abs()) * 1e-12;
    let origin = (origin - size * (1.0 / f64::from(1 << 20))) as f32;
    TilePlane { origin, per_column: a as f32, per_row: b as f32 }
}

/// A plane over a tile, row by row: the bits of [`TilePlane::row`].
pub(super) struct PlaneRows<S: Simd> {
    column: f32x16<S>,
    origin: [f32; 16],
}

impl<S: Simd> PlaneRows<S> {
    #[inline(always)]
    pub fn row(&self, _simd: S, row: usize) -> f32x16<S> {
        self.column + self.origin[row]
    }
}

/// All columns and rows of a tile.
pub(super) const WHOLE: [i32; 4] = [0, 0, 15, 15];

pub(super) const COLUMNS: [f32; 16] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

/// First column, and first row, of each block of a tile.
pub(super) const BLOCK_COLUMNS: [f32; 16] =
    [0., 4., 8., 12., 0., 4., 8., 12., 0., 4., 8., 12., 0., 4., 8., 12.];
pub(super) const BLOCK_ROWS: [f32; 16] = [0., 0., 0., 0., 4., 4., 4., 4., 8., 8., 8., 8., 12., 12., 12., 12.];

/// The columns of four blocks beside each other, given a bit of each.
#[inline(always)]
pub(super) fn columns_of(blocks: u32) -> u32 {
    let blocks = blocks & 15;
    ((blocks | (blocks << 3) | (blocks << 6) | (blocks << 9)) & 0x1111) * 15
}

/// Those of four blocks beside each other of which all columns are given.
#[inline(always)]
pub(super) fn blocks_of(columns: u32) -> u32 {
    let pairs = columns & (columns >> 1);
    let whole = pairs & (pairs >> 2) & 0x1111;
    ((whole * 0x1248) >> 12) & 15
}

/// The bits of a tile's blocks in columns and rows (inclusive) of them, from 0 to 3; none where the last comes before
/// the first.
#[inline(always)]
pub(super) fn blocks_in([x0, y0, x1, y1]: [i32; 4]) -> u32 {
    let columns = (15u32 << x0) & (15 >> (3 - x1));
    let rows = (0xFFFFu32 << (y0 * 4)) & (0xFFFF >> ((3 - y1) * 4));
    ((columns & 15) * 0x1111) & rows
}

/// One row of a tile: a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Row(pub [f32; 16]);
