//! Which pixels a triangle covers: its edges over cells of tiles, tiles of blocks, blocks of pixels, sixteen at a
//! time.
//!
//! An edge function is `E = A·(X − x) + B·(Y − y) + bias` on snapped coordinates, and a pixel is inside where
//! `E ≥ 0` for all three; `bias` is −1 on edges that are neither top nor left, else 0. At pixel centres `X` steps
//! by 256, so `e = ⌊E / 256⌋ = A·px + B·py + C` has the same sign and exact integer steps. `C` needs 64 bits;
//! within a tile the steps need 28, so a tile's origin is saturated to ±2³⁰ without changing a sign.

use super::paint::{COLUMN, ROW};
use super::pyramid::{Sixteen, Target};
use super::setup::ScreenTriangle;
use fearless_simd::{Simd, i32x16, prelude::*};

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

/// A triangle's edges, and their steps, which are the same everywhere.
pub(super) struct Coverage<S: Simd> {
    edges: [Edge; 3],
    /// From a tile's first pixel to the largest value in each of its blocks.
    block_steps: [i32x16<S>; 3],
    /// From the largest value in a block to that of each of its pixels.
    pixel_steps: [i32x16<S>; 3],
    /// From the largest value in a block down to the smallest.
    falls: [i32; 3],
}

/// A tile's blocks as a triangle's edges see them.
pub(super) struct TileCoverage {
    /// Largest value of each edge in each block.
    largest: [Sixteen<i32>; 3],
    /// Blocks that the triangle may meet.
    pub met: u32,
    /// Blocks that it covers whole.
    pub whole: u32,
}

impl<S: Simd> Coverage<S> {
    #[inline(always)]
    pub fn new(simd: S, t: &ScreenTriangle, target: &Target) -> Coverage<S> {
        let column = i32x16::from_slice(simd, &COLUMN);
        let row = i32x16::from_slice(simd, &ROW);
        let edges = [edge(t, target, 0, 1), edge(t, target, 1, 2), edge(t, target, 2, 0)];
        let mut coverage =
            Coverage { edges, block_steps: [column; 3], pixel_steps: [column; 3], falls: [0; 3] };
        for (k, edge) in edges.iter().enumerate() {
            let steps = column * edge.a + row * edge.b;
            coverage.block_steps[k] = (steps << 2) + edge.reach_up(3);
            coverage.pixel_steps[k] = steps - edge.reach_up(3);
            coverage.falls[k] = edge.reach_up(3) - edge.reach_down(3);
        }
        coverage
    }

    /// Which tiles the triangle may meet of the 64-pixel cell at window pixel (x, y).
    #[inline(always)]
    pub fn of_cell(&self, simd: S, x: i32, y: i32) -> u32 {
        // A cell's steps need 30 bits, so edges are taken 1/16 as fine: sums of floors are at most 1 short.
        let mut outside = i32x16::splat(simd, 0);
        for k in 0..3 {
            let edge = &self.edges[k];
            let steps = self.pixel_steps[k] + edge.reach_up(3);
            let origin = ((edge.at(x, y) >> 4) + (i64::from(edge.reach_up(15)) >> 4) + 2)
                .clamp(-(1 << 30), (1 << 30) - 1) as i32;
            outside |= steps + origin;
        }
        !(outside.simd_lt(i32x16::splat(simd, 0)).to_bitmask() as u32) & 0xFFFF
    }

    /// The blocks of the tile at window pixel (x, y).
    #[inline(always)]
    pub fn of_tile(&self, simd: S, x: i32, y: i32) -> TileCoverage {
        let zero = i32x16::splat(simd, 0);
        // Saturated at the tile's origin, and steps within a tile need 28 bits: signs stay right.
        let a = self.block_steps[0] + self.edges[0].at_saturated(x, y);
        let b = self.block_steps[1] + self.edges[1].at_saturated(x, y);
        let c = self.block_steps[2] + self.edges[2].at_saturated(x, y);
        let outside = a | b | c;
        let partial = (a - self.falls[0]) | (b - self.falls[1]) | (c - self.falls[2]);
        let mut largest = [Sixteen([0; 16]); 3];
        a.store_slice(&mut largest[0].0);
        b.store_slice(&mut largest[1].0);
        c.store_slice(&mut largest[2].0);
        TileCoverage {
            largest,
            met: !(outside.simd_lt(zero).to_bitmask() as u32) & 0xFFFF,
            whole: !(partial.simd_lt(zero).to_bitmask() as u32) & 0xFFFF,
        }
    }

    /// The pixels of block `block` of a tile that the triangle covers.
    #[inline(always)]
    pub fn of_block(&self, simd: S, tile: &TileCoverage, block: usize) -> u32 {
        if tile.whole & (1 << block) != 0 {
            return 0xFFFF;
        }
        let [a, b, c] = &tile.largest;
        let outside = (self.pixel_steps[0] + a.0[block])
            | (self.pixel_steps[1] + b.0[block])
            | (self.pixel_steps[2] + c.0[block]);
        !(outside.simd_lt(i32x16::splat(simd, 0)).to_bitmask() as u32) & 0xFFFF
    }
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
