//! A closed silhouette as bounds of columns: a row of pixels covers those between the rightmost bound from the left
//! and the leftmost from the right, as in [`loose`](super::loose), where the rounding of bounds is accounted for.
//!
//! *Coverage.* Let q be a point strictly on the inner side of every edge, all of them endless lines. Seen from q each
//! edge runs the same way around, by more than nothing and less than half a turn. The edges are closed ways, so together
//! their turns add up to a multiple of a whole turn, which is more than none. Hence N(q) ≥ 1, in the words of [`super`],
//! for any chain of faces that has these edges for its boundary; and this rests neither on the silhouette being convex
//! nor on its being in one piece. Where a square, widened by the slack, lies inside all edges, no edge touches it, and
//! none does on the way from its snapped corners to the true ones.

use super::fill::{first_pixel, last_pixel};
use super::surface::Surface;
use super::tile::{COLUMNS, TilePlane};
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*};

/// No silhouette has more edges.
pub(super) const MOST_EDGES: usize = 256;

/// Bounds of columns, kept from body to body: those from the left in the first lanes, those from the right in the
/// last of as many as there is room for. In row y of the image a bound is `base + per_row·(y − y0)`.
#[derive(Clone, Debug)]
pub(super) struct Silhouette {
    sixteen: Vec<Sixteen>,
    /// How many there is room for.
    room: usize,
    lefts: usize,
    rights: usize,
    /// Columns and rows (inclusive) of the image outside of which nothing is covered.
    rect: [i32; 4],
}

/// Sixteen edges: first their ends, later what they bound.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Sixteen {
    from: [[i32; 16]; 2],
    to: [[i32; 16]; 2],
    base: [f32; 16],
    per_row: [f32; 16],
    y0: [f32; 16],
}

impl Sixteen {
    const NONE: Sixteen = Sixteen {
        from: [[0; 16]; 2],
        to: [[0; 16], [1; 16]],
        base: [0.0; 16],
        per_row: [0.0; 16],
        y0: [0.0; 16],
    };
}

impl Default for Silhouette {
    fn default() -> Silhouette {
        Silhouette {
            sixteen: vec![Sixteen::NONE; MOST_EDGES / 16],
            room: 0,
            lefts: 0,
            rights: 0,
            rect: [0; 4],
        }
    }
}

/// No column of an image is so far away.
const FAR: f32 = 65536.0;

/// The part of a silhouette in a tile.
pub(super) struct InTile<S: Simd> {
    /// Its first column and row, pixels of the surface.
    pub at: [i32; 2],
    /// First and last column of each row that are covered, counted from the tile's first.
    pub spans: [f32x16<S>; 2],
    /// The rows where some are.
    pub rows: u32,
    /// Columns and rows (inclusive) of the tile outside of which nothing is covered.
    pub inner: [i32; 4],
    /// Whether the whole tile is covered.
    pub whole: bool,
}

impl<S: Simd> InTile<S> {
    /// Raises what is covered of the tile to the least of some planes, each no lower than the depth beside it. No depth
    /// is above `highest`.
    #[inline(always)]
    pub fn raise(&self, simd: S, surface: &mut Surface, planes: &[(TilePlane, f32)], highest: f32) {
        let tile = surface.tile(self.at[0] >> 4, self.at[1] >> 4);
        if let (true, &[(plane, farthest)]) = (self.whole, planes)
            && plane.min(0, 0, 15, 15) >= farthest.max(0.0)
        {
            surface.cover(simd, tile, plane);
            return;
        }
        surface.raise_spans(
            simd,
            tile,
            self.spans,
            self.rows,
            #[inline(always)]
            |row| {
                let mut least = f32x16::splat(simd, highest);
                for (plane, farthest) in planes {
                    least = least.min(plane.row(simd, row as i32).max(*farthest));
                }
                least
            },
            highest,
        );
    }
}

impl Silhouette {
    /// Finds what edges bound: 1/256 pixel, the inner side where a front face's would be. There is room for so many, a
    /// multiple of sixteen. False if they are more, or cover no pixel for certain.
    #[inline(always)]
    pub fn set<S: Simd>(
        &mut self,
        simd: S,
        room: usize,
        slack: i32,
        edges: impl Iterator<Item = [[i32; 2]; 2]>,
    ) -> bool {
        let sixteen = &mut self.sixteen[..room / 16];
        let (mut lefts, mut rights) = (0, 0);
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        let (mut top, mut bottom) = (i32::MIN, i32::MAX);
        for [p, q] in edges {
            low = [low[0].min(p[0]), low[1].min(p[1])];
            high = [high[0].max(p[0]), high[1].max(p[1])];
            let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
            if dy == 0 {
                match dx.signum() {
                    1 => top = top.max((p[1] + slack + 255) >> 8),
                    -1 => bottom = bottom.min(((p[1] - slack) >> 8) - 1),
                    _ => {}
                }
                continue;
            }
            if lefts + rights == room {
                return false;
            }
            let at = if dy < 0 { lefts } else { room - 1 - rights };
            (lefts, rights) = (lefts + usize::from(dy < 0), rights + usize::from(dy > 0));
            let (sixteen, lane) = (&mut sixteen[at / 16], at % 16);
            (sixteen.from[0][lane], sixteen.from[1][lane]) = (p[0], p[1]);
            (sixteen.to[0][lane], sixteen.to[1][lane]) = (q[0], q[1]);
        }
        if lefts == 0 || rights == 0 {
            return false;
        }
        // It ends where its corners do.
        let top = top.max((low[1] + slack + 255) >> 8);
        let bottom = bottom.min(((high[1] - slack) >> 8) - 1);
        let [first, last] = [first_pixel(low[0], slack), last_pixel(high[0], slack)];
        if top > bottom || last - first < 2 {
            return false;
        }
        (self.room, self.lefts, self.rights) = (room, lefts, rights);
        self.rect = [first, top, last, bottom];
        let rows = ((high[1] - low[1]) >> 8) as f32 + 3.0;
        for at in 0..room / 16 {
            let [lefts, rights] = self.in_sixteen(at);
            if lefts > 0 || rights < 16 {
                self.sixteen[at].set_bounds(simd, lefts, slack, rows);
            }
        }
        true
    }

    /// How many of sixteen edges bound from the left, and the first of those that bound from the right.
    #[inline(always)]
    fn in_sixteen(&self, at: usize) -> [usize; 2] {
        [self.lefts, self.room - self.rights].map(|edges| edges.saturating_sub(at * 16).min(16))
    }

    /// First and last column that each of sixteen rows covers, from row `y` of the image on: of those in `inside`.
    #[inline(always)]
    fn spans<S: Simd>(&self, simd: S, y: f32, inside: u32) -> [f32x16<S>; 2] {
        let rows = f32x16::from_slice(simd, &COLUMNS) + y;
        let (mut from, mut to) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, FAR));
        for (at, sixteen) in self.sixteen[..self.room / 16].iter().enumerate() {
            let [lefts, rights] = self.in_sixteen(at);
            for lane in 0..lefts {
                from = from.max(sixteen.bound(simd, lane, rows));
            }
            for lane in rights..16 {
                to = to.min(sixteen.bound(simd, lane, rows));
            }
        }
        let far = f32x16::splat(simd, FAR);
        let inside = mask32x16::from_bitmask(simd, u64::from(inside));
        [inside.select(from.min(far).ceil(), far), to.max(f32x16::splat(simd, -1.0)).floor()]
    }

    /// Calls `fill` with each tile of which some is covered and where something is farther than `nearest`.
    #[inline(always)]
    pub fn for_each_tile<S: Simd>(
        &self,
        simd: S,
        surface: &mut Surface,
        nearest: f32,
        mut fill: impl FnMut(&mut Surface, InTile<S>),
    ) {
        let [first, top, last, bottom] = self.rect;
        let top = (top - surface.top).max(0);
        let bottom = (bottom - surface.top).min(surface.height - 1);
        let (first, last) = (first.max(0), last.min(surface.width - 1));
        if top > bottom || first > last {
            return;
        }
        let rect = [first, top, last, bottom];
        for cell_y in top >> 6..(bottom >> 6) + 1 {
            for cell_x in first >> 6..(last >> 6) + 1 {
                let mut open = surface.tiles_beyond(simd, cell_x, cell_y, rect, nearest);
                while open != 0 {
                    let tile_row = open.trailing_zeros() as i32 >> 2;
                    let mut columns = open >> (tile_row * 4) & 15;
                    open &= !(15 << (tile_row * 4));
                    let y = cell_y * 64 + tile_row * 16;
                    let inside = (0xFFFFu32 << (top - y).max(0)) & (0xFFFF >> (15 - (bottom - y).min(15)));
                    let [from, to] = self.spans(simd, (y + surface.top) as f32, inside);
                    while columns != 0 {
                        let x = cell_x * 64 + columns.trailing_zeros() as i32 * 16;
                        columns &= columns - 1;
                        let (x_first, x_last) = (x as f32, (x + 15) as f32);
                        let meets = from.simd_le(x_last) & to.simd_ge(x_first) & from.simd_le(to);
                        let rows = meets.to_bitmask() as u32;
                        if rows == 0 {
                            continue;
                        }
                        let whole = rows == 0xFFFF && (from.simd_le(x_first) & to.simd_ge(x_last)).all_true();
                        let inner =
                            [(first - x).max(0), (top - y).max(0), (last - x).min(15), (bottom - y).min(15)];
                        let spans = [from - x_first, to - x_first];
                        fill(surface, InTile { at: [x, y], spans, rows, inner, whole });
                    }
                }
            }
        }
    }
}

impl Sixteen {
    /// What one of them bounds in rows of the image.
    #[inline(always)]
    fn bound<S: Simd>(&self, _simd: S, lane: usize, rows: f32x16<S>) -> f32x16<S> {
        (rows - self.y0[lane]) * self.per_row[lane] + self.base[lane]
    }

    /// The first of them bound from the left.
    #[inline(always)]
    fn set_bounds<S: Simd>(&mut self, simd: S, lefts: usize, slack: i32, rows: f32) {
        let (x, y) = (i32x16::from_slice(simd, &self.from[0]), i32x16::from_slice(simd, &self.from[1]));
        let (to_x, to_y) = (i32x16::from_slice(simd, &self.to[0]), i32x16::from_slice(simd, &self.to[1]));
        let (dx, dy) = ((to_x - x).to_float::<f32x16<S>>(), (to_y - y).to_float::<f32x16<S>>());
        let sub = 1.0 / 256.0;
        let (x, y) = (x.to_float::<f32x16<S>>() * sub, y.to_float::<f32x16<S>>() * sub);
        let m = dx / dy;
        // As in `loose`: over all rows of the body, no term is larger than these together.
        let half = (m.abs() + 1.0) * ((128 + slack) as f32 * sub);
        let off = (x.abs() + 1.0 + half + m.abs() * rows) * (1.0 / (1 << 20) as f32);
        let inwards = half + off;
        let from_left = mask32x16::from_bitmask(simd, (1 << lefts) - 1);
        let zero = f32x16::splat(simd, 0.0);
        (x - 0.5 + from_left.select(inwards, zero - inwards)).store_slice(&mut self.base);
        m.store_slice(&mut self.per_row);
        (y - 0.5).store_slice(&mut self.y0);
    }
}
