//! Filling a face: which pixels it covers wholly, and what its part is in those that its patch covers with
//! several faces together. The proof is in [`super`].
//!
//! ```text
//! face     plane of depth, lowered until it is below every corner; edges as functions of pixels
//! small    (up to 16×16 pixels, with an edge shared) into the joint
//! large    tile by tile: outside; wholly inside, a plane; else the edges that cross the tile:
//!            all of them ends   → pixels wholly inside, row by row, to the surface
//!            one of them shared → blocks wholly inside to the surface, what is touched into the joint
//! joint    blocks touched take the least depth; pixels, row by row, count how often they are covered
//! patch    of the joint the pixels whose count is at least one get the least depth of all faces that touch their block
//! ```
//!
//! Where all pixels of the blocks that a face may touch in a tile hold more than the patch's nearest depth already, the
//! face is left out there: whatever the joint comes to, it raises none of them.
//!
//! An edge is `E = A·(X − x) + B·(Y − y)`, positive inside, on snapped coordinates; at pixel centres
//! `e = ⌊(E + bias) / 256⌋ = A·px + B·py + C` is a whole number with whole steps, and `e ≥ 0` is the fill
//! rule exactly. A pixel's square, widened by the slack, reaches `h = (|A| + |B|)·(128 + slack)` from there.

use super::pass::erode;
use super::surface::Surface;
use super::tile::{Row, TilePlane, blocks_in, blocks_of, tile_plane};
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*};

/// A corner on the screen: 1/256 pixel, and a depth that is no larger than the true one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub x: i32,
    pub y: i32,
    pub depth: f32,
}

impl Corner {
    /// As a patch's vertices are kept.
    pub fn bits(&self) -> [i32; 4] {
        [self.x, self.y, self.depth.to_bits().cast_signed(), 0]
    }

    /// The reverse of [`Corner::bits`].
    #[inline(always)]
    pub fn of_bits([x, y, depth, _]: [i32; 4]) -> Corner {
        Corner { x, y, depth: f32::from_bits(depth.cast_unsigned()) }
    }
}

/// A convex polygon of three or four corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub corner: [Corner; 4],
    pub corners: usize,
    /// 1 if the corners run so that E is positive inside, −1 if they run the other way.
    pub turn: i32,
    /// Bit k: the surface ends at the edge from corner k to the next.
    pub ends: u32,
}

impl Outline {
    /// Whether it is a tile's size or more, both ways.
    #[inline(always)]
    pub fn is_large(&self) -> bool {
        let ([a, b, c, d], tile) = (&self.corner, 16 * 256);
        let (left, right) = (a.x.min(b.x).min(c.x.min(d.x)), a.x.max(b.x).max(c.x.max(d.x)));
        let (top, bottom) = (a.y.min(b.y).min(c.y.min(d.y)), a.y.max(b.y).max(c.y.max(d.y)));
        right - left >= tile && bottom - top >= tile
    }
}

/// Sixteen counts: a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Counts([i32; 16]);

/// What a patch covers jointly, pixel by pixel, until it is finished. Tiles take their room from a pool when they
/// are first touched, so that a small patch works in the nearest cache, wherever in the image it is.
#[derive(Clone, Debug, Default)]
pub(super) struct Joint {
    /// For each tile its place in the pool, or [`NO_ROOM`].
    place: Vec<u32>,
    /// The tiles that have a place, in the order of their places.
    dirty: Vec<u32>,
    pool: Vec<JointTile>,
}

const NO_ROOM: u32 = u32::MAX;

#[derive(Clone, Debug)]
struct JointTile {
    /// Least depth of the faces that touch a block.
    depth: Row,
    /// How often the faces cover a pixel's centre, less what may be lost on the way to its other points.
    count: [Counts; 16],
}

impl JointTile {
    const EMPTY: JointTile = JointTile { depth: Row([f32::INFINITY; 16]), count: [Counts([0; 16]); 16] };
}

impl Joint {
    pub fn new(surface: &Surface) -> Joint {
        let tiles = (surface.tiles_x() * surface.tiles_y()) as usize;
        Joint { place: vec![NO_ROOM; tiles], dirty: Vec::new(), pool: Vec::new() }
    }

    /// A tile's room.
    #[inline(always)]
    fn tile(&mut self, tile: usize) -> &mut JointTile {
        let mut place = self.place[tile];
        if place == NO_ROOM {
            place = self.dirty.len() as u32;
            self.place[tile] = place;
            self.dirty.push(tile as u32);
            if self.pool.len() < self.dirty.len() {
                self.pool.push(JointTile::EMPTY);
            }
        }
        &mut self.pool[place as usize]
    }

    /// Writes what the patch covers to the surface and empties the joint.
    #[inline(always)]
    pub fn finish<S: Simd>(&mut self, simd: S, surface: &mut Surface, nearest: f32) {
        let one = i32x16::splat(simd, 1);
        for place in 0..self.dirty.len() {
            let tile = self.dirty[place] as usize;
            self.place[tile] = NO_ROOM;
            let joint = &mut self.pool[place];
            if surface.tile_min(tile) < nearest {
                let mut covered = [0; 16];
                for (row, covered) in joint.count.iter().zip(&mut covered) {
                    *covered = i32x16::from_slice(simd, &row.0).simd_ge(one).to_bitmask() as u16;
                }
                let depth = f32x16::from_slice(simd, &joint.depth.0);
                surface.raise_covered(simd, tile, &covered, depth, nearest);
            }
            *joint = JointTile::EMPTY;
        }
        self.dirty.clear();
    }

    /// As [`Joint::finish`], but a block of 4×4 pixels gets the least depth of all within `radius` pixels, and nothing
    /// where one of these is not covered or not in the image: of blocks, that are within a fourth as many of them.
    #[inline(always)]
    pub fn finish_eroded<S: Simd>(&mut self, simd: S, surface: &mut Surface, nearest: f32, radius: i32) {
        let (mut left, mut top, mut right, mut bottom) = (i32::MAX, i32::MAX, 0, 0);
        for &tile in &self.dirty {
            let (x, y) = surface.corner(tile as usize);
            (left, top, right, bottom) = (left.min(x), top.min(y), right.max(x + 16), bottom.max(y + 16));
        }
        if left >= right {
            return;
        }
        let width = ((right - left) >> 2) as usize;
        let mut depths = vec![0.0; width * ((bottom - top) >> 2) as usize];
        let first_of = |(x, y): (i32, i32)| ((y - top) >> 2) as usize * width + ((x - left) >> 2) as usize;
        let one = i32x16::splat(simd, 1);
        for (joint, &tile) in self.pool.iter().zip(&self.dirty) {
            let at = first_of(surface.corner(tile as usize));
            for (quarter, rows) in joint.count.as_chunks::<4>().0.iter().enumerate() {
                let mut covered = 0xFFFF;
                for row in rows {
                    covered &= i32x16::from_slice(simd, &row.0).simd_ge(one).to_bitmask() as u32;
                }
                let whole = blocks_of(covered);
                for block in (0..4).filter(|block| whole >> block & 1 == 1) {
                    depths[at + quarter * width + block] = joint.depth.0[quarter * 4 + block];
                }
            }
        }
        let radius = (radius as usize).div_ceil(4);
        for row in depths.chunks_exact_mut(width) {
            let mut values = row.to_vec();
            erode(&mut values, 1, radius);
            row.copy_from_slice(&values);
        }
        erode(&mut depths, width, radius);
        for (joint, &tile) in self.pool.iter_mut().zip(&self.dirty) {
            let at = first_of(surface.corner(tile as usize));
            *joint = JointTile::EMPTY;
            let tile = tile as usize;
            self.place[tile] = NO_ROOM;
            let mut floors = [0.0; 16];
            for (quarter, four) in floors.chunks_exact_mut(4).enumerate() {
                four.copy_from_slice(&depths[at + quarter * width..][..4]);
            }
            let floors = f32x16::from_slice(simd, &floors);
            let covered = floors.simd_gt(0.0).to_bitmask() as u32;
            surface.raise_blocks(simd, tile, covered, floors, nearest);
        }
        self.dirty.clear();
    }
}

/// What an edge of a face is near pixels, e being as above.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    a: i32,
    b: i32,
    /// e at pixel (0, 0) of the surface.
    c: i64,
    /// All of a pixel is inside if e is at least this …
    inside: i32,
    /// … and some of it may be if e is at least minus this.
    touch: i32,
    /// Whether the surface ends here.
    ends: bool,
}

/// Where an edge at which the surface ends takes a layer off.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    /// The true edge may pass before a pixel's centre if e is at least this …
    least: i32,
    /// … and touch the pixel if e is at most this …
    most: i32,
    /// … and these are the pixels around it: left, top, right, bottom.
    around: [i32; 4],
}

/// A face being filled.
#[derive(Clone, Copy)]
struct Face<'a> {
    outline: &'a Outline,
    slack: i32,
    /// First image row of the surface. Planes count from the image's, so that bands hold the same bits.
    band: i32,
    /// Pixels of the surface that the face may touch: left, top, right, bottom, not clipped.
    around: [i32; 4],
    /// Depth is nowhere in pixel (x, y) of the image and the face less than
    /// `plane[0]·x + plane[1]·y + plane[2]`, nor than `farthest`.
    plane: [f64; 3],
    farthest: f32,
    nearest: f32,
    /// No face of the patch is nearer.
    patch_nearest: f32,
}

impl<'a> Face<'a> {
    #[inline(always)]
    fn new(outline: &'a Outline, slack: i32, band: i32, patch_nearest: f32) -> Face<'a> {
        let c = &outline.corner;
        let (mut left, mut top, mut right, mut bottom) = (c[0].x, c[0].y, c[0].x, c[0].y);
        let (mut farthest, mut nearest) = (c[0].depth, c[0].depth);
        // The fourth corner of a triangle is one of the others.
        for corner in &c[1..] {
            (left, right) = (left.min(corner.x), right.max(corner.x));
            (top, bottom) = (top.min(corner.y), bottom.max(corner.y));
            (farthest, nearest) = (farthest.min(corner.depth), nearest.max(corner.depth));
        }
        let around = [
            first_pixel(left, slack),
            first_pixel(top, slack) - band,
            last_pixel(right, slack),
            last_pixel(bottom, slack) - band,
        ];
        Face { outline, slack, band, around, plane: [0.0; 3], farthest, nearest, patch_nearest }
    }

    #[inline(always)]
    fn set_plane(&mut self) {
        let size = self.nearest.abs().max(self.farthest.abs());
        self.plane = plane_below(&self.outline.corner, self.outline.corners == 4, self.slack, size);
    }

    /// The plane over a tile, lowered by more than the roundings of its use.
    #[inline(always)]
    fn tile_plane(&self, x: i32, y: i32) -> TilePlane {
        tile_plane(self.plane, x, y + self.band)
    }

    #[inline(always)]
    fn edge(&self, k: usize) -> Edge {
        let (p, q) = self.ends_of_edge(k);
        let turn = self.outline.turn;
        let (dx, dy) = ((q.x - p.x) * turn, (q.y - p.y) * turn);
        let (a, b) = (-dy, dx);
        // Of an edge and its reverse exactly one owns a point on it.
        let owned = dy < 0 || (dy == 0 && dx > 0);
        let (x, y) = (i64::from(128 - p.x), i64::from(128 + 256 * self.band - p.y));
        let e = i64::from(a) * x + i64::from(b) * y - i64::from(!owned);
        let h = (i64::from(a.abs()) + i64::from(b.abs())) * i64::from(128 + self.slack);
        let (inside, touch) = (((h + 255) >> 8) as i32, ((h + 256) >> 8) as i32);
        Edge { a, b, c: e >> 8, inside, touch, ends: self.outline.ends >> k & 1 == 1 }
    }

    /// Columns and rows of the blocks of the tile at (x, y) that the face may touch; there are some.
    #[inline(always)]
    fn within(&self, x: i32, y: i32) -> [i32; 4] {
        let [left, top, right, bottom] = self.around;
        [(left - x).max(0) & !3, (top - y).max(0) & !3, (right - x).min(15) | 3, (bottom - y).min(15) | 3]
    }

    /// Edge k of a face of at most sixteen pixels each way, and e at a pixel in or beside it: 32 bits hold all.
    #[inline(always)]
    fn edge_nearby(&self, k: usize, x: i32, y: i32) -> (Edge, i32) {
        let (p, q) = self.ends_of_edge(k);
        let turn = self.outline.turn;
        let (dx, dy) = ((q.x - p.x) * turn, (q.y - p.y) * turn);
        let owned = dy < 0 || (dy == 0 && dx > 0);
        let (from_x, from_y) = (256 * x + 128 - p.x, 256 * (y + self.band) + 128 - p.y);
        let e = dx * from_y - dy * from_x - i32::from(!owned);
        let touch = ((dx.abs() + dy.abs()) * (128 + self.slack) + 256) >> 8;
        (Edge { a: -dy, b: dx, c: 0, inside: 0, touch, ends: self.outline.ends >> k & 1 == 1 }, e >> 8)
    }

    /// What edge k takes off where the surface ends at it; else nothing anywhere.
    #[inline(always)]
    fn end(&self, k: usize) -> End {
        let (p, q) = self.ends_of_edge(k);
        let size = i64::from((q.x - p.x).abs()) + i64::from((q.y - p.y).abs());
        let slack = i64::from(self.slack);
        End {
            least: -((size * slack + 256) >> 8) as i32,
            most: ((size * (128 + slack)) >> 8) as i32,
            around: [
                first_pixel(p.x.min(q.x), self.slack),
                first_pixel(p.y.min(q.y), self.slack) - self.band,
                last_pixel(p.x.max(q.x), self.slack),
                last_pixel(p.y.max(q.y), self.slack) - self.band,
            ],
        }
    }

    #[inline(always)]
    fn ends_of_edge(&self, k: usize) -> (&Corner, &Corner) {
        let next = if k + 1 == self.outline.corners { 0 } else { k + 1 };
        (&self.outline.corner[k], &self.outline.corner[next])
    }
}

/// A plane through three corners of a face of three or four, lowered until no corner lies below it, then by what it
/// falls within a pixel: where the face is, any plane is at most the largest of its excesses at the corners too high.
/// No depth is larger than `size`. Depth at pixel (x, y) of the image is `plane[0]·x + plane[1]·y + plane[2]`.
#[inline(always)]
pub(super) fn plane_below(c: &[Corner; 4], four: bool, slack: i32, size: f32) -> [f64; 3] {
    let (r1, r2, r3) = (from_first(c, 1), from_first(c, 2), from_first(c, 3));
    // The larger of the two triangles along the diagonal from corner 0.
    let (area, other) = (r1.0 * r2.1 - r2.0 * r1.1, r2.0 * r3.1 - r3.0 * r2.1);
    let ((x1, y1, d1), (x2, y2, d2), area) =
        if other.abs() > area.abs() { (r2, r3, other) } else { (r1, r2, area) };
    let per = 1.0 / area;
    let (mut a, mut b) = ((d1 * y2 - d2 * y1) * per, (d2 * x1 - d1 * x2) * per);
    if !(a.abs() < 1e6 && b.abs() < 1e6) {
        (a, b) = (0.0, 0.0);
    }
    let mut excess = (a * r1.0 + b * r1.1 - r1.2).max(a * r2.0 + b * r2.1 - r2.2).max(0.0);
    if four {
        excess = excess.max(a * r3.0 + b * r3.1 - r3.2);
    }
    let sub = 1.0 / 256.0;
    let fall = (a.abs() + b.abs()) * (0.5 + f64::from(slack) * sub) + f64::from(size) * 1e-12;
    // From corner 0 to the centre of pixel (0, 0).
    let (x0, y0) = (f64::from(c[0].x) * sub - 0.5, f64::from(c[0].y) * sub - 0.5);
    [a, b, f64::from(c[0].depth) - a * x0 - b * y0 - excess - fall]
}

/// Pixels and depth from corner 0 to corner k.
#[inline(always)]
fn from_first(c: &[Corner; 4], k: usize) -> (f64, f64, f64) {
    let sub = 1.0 / 256.0;
    let (x, y) = (f64::from(c[k].x - c[0].x), f64::from(c[k].y - c[0].y));
    (x * sub, y * sub, f64::from(c[k].depth) - f64::from(c[0].depth))
}

/// First pixel whose square, widened by the slack, reaches a coordinate.
#[inline(always)]
pub(super) fn first_pixel(v: i32, slack: i32) -> i32 {
    (v - slack - 1) >> 8
}

/// Last one.
#[inline(always)]
pub(super) fn last_pixel(v: i32, slack: i32) -> i32 {
    (v + slack) >> 8
}

impl Edge {
    #[inline(always)]
    fn at(&self, x: i32, y: i32) -> i64 {
        i64::from(self.a) * i64::from(x) + i64::from(self.b) * i64::from(y) + self.c
    }

    /// Saturated so that steps within a tile cannot overflow and no sign or comparison changes.
    #[inline(always)]
    fn at_saturated(&self, x: i32, y: i32) -> i32 {
        self.at(x, y).clamp(-(1 << 30), (1 << 30) - 1) as i32
    }
}

/// Where what a face covers goes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Goes {
    /// To the surface, but into the joint what shared edges cross.
    Apart,
    /// All into the joint: the patch is to be eroded.
    Jointly,
    /// To the surface what it covers of whole blocks; the rest is drawn in another way.
    InBlocks,
}

/// Fills one convex face of a patch no point of which is nearer than `patch_nearest`. `slack` is how far a corner may
/// be from its true place, 1/256 pixel.
#[inline(always)]
pub(super) fn fill<S: Simd>(
    simd: S,
    surface: &mut Surface,
    joint: &mut Joint,
    outline: &Outline,
    slack: i32,
    patch_nearest: f32,
    goes: Goes,
) {
    let mut face = Face::new(outline, slack, surface.top, patch_nearest);
    let [left, top, right, bottom] = face.around;
    if right < 0 || bottom < 0 || left >= surface.width || top >= surface.height {
        return;
    }
    let edges = (1 << outline.corners) - 1;
    let all_end = goes != Goes::Jointly && outline.ends & edges == edges;
    if all_end && (right - left < 2 || bottom - top < 2) {
        // It touches at most two columns or rows; one that covers a pixel touches its neighbours too.
        return;
    }
    if right - left < 16 && bottom - top < 16 && !all_end {
        if right - left < 4 && bottom - top < 4 {
            // Within so few pixels its farthest corner is as good a bound.
            face.plane = [0.0, 0.0, f64::from(face.farthest)];
        } else {
            face.set_plane();
        }
        if outline.corners == 3 {
            fill_small::<S, 3>(simd, surface, joint, &face, goes);
        } else {
            fill_small::<S, 4>(simd, surface, joint, &face, goes);
        }
    } else {
        face.set_plane();
        simd.vectorize(
            #[inline(always)]
            || fill_tiles(simd, surface, joint, &face, goes),
        );
    }
}

#[inline(always)]
fn columns_i32<S: Simd>(simd: S) -> i32x16<S> {
    i32x16::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
}

/// Bits `from` to `to` (inclusive, clipped to 0..16).
#[inline(always)]
fn column_bits(from: i32, to: i32) -> u64 {
    let (from, to) = (from.max(0), to.min(15));
    if from > to { 0 } else { (0xFFFFu64 << from) & (0xFFFF >> (15 - to)) }
}

#[inline(always)]
fn fill_small<S: Simd, const N: usize>(
    simd: S,
    surface: &Surface,
    joint: &mut Joint,
    face: &Face,
    goes: Goes,
) {
    let [left, top, right, bottom] = face.around;
    let (x0, y0) = (left.max(0), top.max(0));
    let (x1, y1) = (right.min(surface.width - 1), bottom.min(surface.height - 1));
    let numbers = [0, 1, 2, 3];
    let mut at_first = [0; N];
    let mut edges = [Edge::default(); N];
    for k in 0..N {
        (edges[k], at_first[k]) = face.edge_nearby(k, x0 & !15, y0);
    }
    for tile_x in x0 >> 4..(x1 >> 4) + 1 {
        let x = tile_x * 16;
        for tile_y in y0 >> 4..(y1 >> 4) + 1 {
            let tile = surface.tile(tile_x, tile_y);
            let within = face.within(x, tile_y * 16);
            if goes != Goes::Jointly && !surface.may_gain(simd, tile, within, face.patch_nearest) {
                continue;
            }
            let rows = [y0.max(tile_y * 16), y1.min(tile_y * 16 + 15)];
            let mut first = [0; N];
            for k in 0..N {
                first[k] = at_first[k] + edges[k].a * (x - (x0 & !15)) + edges[k].b * (rows[0] - y0);
            }
            let place = Place { tile, x, rows, columns: column_bits(x0 - x, x1 - x) };
            let plane = face.tile_plane(x, tile_y * 16);
            into_joint::<S, N>(simd, joint, face, &edges, first, numbers, place, plane);
        }
    }
}

/// A tile's columns, some of them, and some rows.
#[derive(Clone, Copy)]
struct Place {
    tile: usize,
    x: i32,
    rows: [i32; 2],
    columns: u64,
}

impl Place {
    /// First and last column and row of the tile (inclusive).
    #[inline(always)]
    fn within(&self) -> [i32; 4] {
        let [left, right] =
            [self.columns.trailing_zeros() as i32 & 15, 63 - (self.columns | 1).leading_zeros() as i32];
        [left, self.rows[0] & 15, right, self.rows[1] & 15]
    }

    /// No part of a face in one of the tile's blocks is farther.
    #[inline(always)]
    fn depth<S: Simd>(&self, simd: S, face: &Face, plane: TilePlane) -> f32x16<S> {
        plane.block_mins(simd, self.within()).max(f32x16::splat(simd, face.farthest))
    }
}

/// Blocks of a tile in which every edge is 0 or more at the first pixel, if so much is added. `first` is what they are at
/// the place's first pixel.
#[inline(always)]
fn blocks_where<S: Simd, const N: usize>(
    simd: S,
    edges: &[Edge; N],
    first: [i32; N],
    place: Place,
    add: impl Fn(&Edge) -> i32,
) -> mask32x16<S> {
    let (column, row) = (i32x16::from_slice(simd, &BLOCK_COLUMNS), i32x16::from_slice(simd, &BLOCK_ROWS));
    let zero = i32x16::splat(simd, 0);
    let mut outside = zero;
    for k in 0..N {
        let e = first[k] - edges[k].b * (place.rows[0] & 15) + add(&edges[k]);
        outside |= column * edges[k].a + row * edges[k].b + e;
    }
    outside.simd_ge(zero)
}

/// First column, and first row, of each block of a tile.
const BLOCK_COLUMNS: [i32; 16] = [0, 4, 8, 12, 0, 4, 8, 12, 0, 4, 8, 12, 0, 4, 8, 12];
const BLOCK_ROWS: [i32; 16] = [0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12];

/// Adds a face to the joint. `edges` are those of its edges that matter there, called `numbers`, which are
/// `first` at the first pixel.
#[expect(clippy::too_many_arguments, reason = "the inner step of one loop, split off to be specialised")]
#[inline(always)]
fn into_joint<S: Simd, const N: usize>(
    simd: S,
    joint: &mut Joint,
    face: &Face,
    edges: &[Edge; N],
    first: [i32; N],
    numbers: [usize; 4],
    place: Place,
    plane: TilePlane,
) {
    let zero = i32x16::splat(simd, 0);
    let column = columns_i32(simd);
    let mut e = [zero; N];
    let mut end = [End::default(); N];
    let mut any_end = false;
    for k in 0..N {
        e[k] = column * edges[k].a + first[k];
        if edges[k].ends {
            any_end = true;
            end[k] = face.end(numbers[k]);
        }
    }
    let columns = mask32x16::from_bitmask(simd, place.columns);
    let one = i32x16::splat(simd, 1);
    let joint = joint.tile(place.tile);
    let [x0, y0, x1, y1] = place.within().map(|px| px >> 2);
    let around = mask32x16::from_bitmask(simd, u64::from(blocks_in([x0, y0, x1, y1])));
    let touched =
        blocks_where::<S, N>(simd, edges, first, place, |e| (e.a.max(0) + e.b.max(0)) * 3 + e.touch);
    let touched = touched & around;
    let old = f32x16::from_slice(simd, &joint.depth.0);
    touched.select(old.min(place.depth(simd, face, plane)), old).store_slice(&mut joint.depth.0);
    for y in place.rows[0]..place.rows[1] + 1 {
        let mut centre = zero;
        for e in &e {
            centre |= *e;
        }
        let row = (y & 15) as usize;
        let counts = &mut joint.count[row].0;
        let covered = centre.simd_ge(zero) & columns;
        let mut count = i32x16::from_slice(simd, counts);
        count += covered.select(one, zero);
        if any_end {
            for k in 0..N {
                let [left, top, right, bottom] = end[k].around;
                if edges[k].ends && y >= top && y <= bottom {
                    let along = column_bits(left - place.x, right - place.x) & place.columns;
                    let lost = e[k].simd_ge(i32x16::splat(simd, end[k].least))
                        & e[k].simd_le(i32x16::splat(simd, end[k].most))
                        & mask32x16::from_bitmask(simd, along);
                    count -= lost.select(one, zero);
                }
            }
        }
        count.store_slice(counts);
        for k in 0..N {
            e[k] += edges[k].b;
        }
    }
}

/// Where one tile lies, and what of a face crosses it.
#[derive(Clone, Copy)]
struct Crossed {
    tile: usize,
    x: i32,
    y: i32,
    /// The edges that cross it, the first `count` of these.
    numbers: [usize; 4],
    count: usize,
    /// Whether one of them is shared with another face.
    shared: bool,
}

#[inline(always)]
fn fill_tiles<S: Simd>(simd: S, surface: &mut Surface, joint: &mut Joint, face: &Face, goes: Goes) {
    let jointly = goes == Goes::Jointly;
    let [left, top, right, bottom] = face.around;
    let (left, top) = (left.max(0) >> 4, top.max(0) >> 4);
    let (right, bottom) = (right.min(surface.width - 1) >> 4, bottom.min(surface.height - 1) >> 4);
    let edges_used = face.outline.corners;
    let mut edges = [Edge::default(); 4];
    // Least and largest step of e from a tile's first pixel to one of its pixels.
    let (mut up, mut down) = ([0i64; 4], [0i64; 4]);
    for k in 0..edges_used {
        let edge = face.edge(k);
        up[k] = i64::from(edge.a.max(0) + edge.b.max(0)) * 15 + i64::from(edge.touch);
        down[k] = i64::from(edge.a.min(0) + edge.b.min(0)) * 15 - i64::from(edge.inside);
        edges[k] = edge;
    }
    for tile_y in top..bottom + 1 {
        let mut was_inside = false;
        for tile_x in left..right + 1 {
            let (x, y) = (tile_x * 16, tile_y * 16);
            let tile = surface.tile(tile_x, tile_y);
            let mut crossed = Crossed { tile, x, y, numbers: [0; 4], count: 0, shared: false };
            let mut outside = false;
            for k in 0..edges_used {
                let e = edges[k].at(x, y);
                outside |= e + up[k] < 0;
                if e + down[k] < 0 {
                    crossed.numbers[crossed.count & 3] = k;
                    crossed.count += 1;
                    crossed.shared |= !edges[k].ends;
                }
            }
            if outside {
                if was_inside {
                    break;
                }
                continue;
            }
            was_inside = true;
            let most = if crossed.shared { face.patch_nearest } else { face.nearest };
            if !jointly && !surface.may_gain(simd, tile, face.within(x, y), most) {
                continue;
            }
            let plane = face.tile_plane(x, y);
            if crossed.count == 0 && !jointly {
                surface.cover(simd, tile, plane);
                continue;
            }
            match crossed.count {
                0 => fill_tile::<S, 0>(simd, surface, joint, face, &edges, crossed, plane, goes),
                1 => fill_tile::<S, 1>(simd, surface, joint, face, &edges, crossed, plane, goes),
                2 => fill_tile::<S, 2>(simd, surface, joint, face, &edges, crossed, plane, goes),
                3 => fill_tile::<S, 3>(simd, surface, joint, face, &edges, crossed, plane, goes),
                _ => fill_tile::<S, 4>(simd, surface, joint, face, &edges, crossed, plane, goes),
            }
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "the inner step of one loop, split off to be specialised")]
#[inline(always)]
fn fill_tile<S: Simd, const N: usize>(
    simd: S,
    surface: &mut Surface,
    joint: &mut Joint,
    face: &Face,
    all: &[Edge; 4],
    crossed: Crossed,
    plane: TilePlane,
    goes: Goes,
) {
    let Crossed { tile, x, y, numbers, .. } = crossed;
    let mut edges = [Edge::default(); N];
    for k in 0..N {
        edges[k] = all[numbers[k]];
    }
    let [left, top, right, bottom] = face.around;
    let (y0, y1) = (top.max(y), bottom.min(y + 15).min(surface.height - 1));
    let place = Place { tile, x, rows: [y0, y1], columns: column_bits(left - x, right - x) };
    let mut first = [0; N];
    for k in 0..N {
        first[k] = edges[k].at_saturated(x, y0);
    }
    if goes != Goes::InBlocks && (crossed.shared || goes == Goes::Jointly) {
        into_joint::<S, N>(simd, joint, face, &edges, first, numbers, place, plane);
    }
    if goes == Goes::Jointly || !surface.may_gain(simd, tile, face.within(x, y), face.nearest) {
        return;
    }
    if crossed.shared || goes == Goes::InBlocks {
        // The rest of what the face covers, its patch does.
        let inside =
            blocks_where::<S, N>(simd, &edges, first, place, |e| (e.a.min(0) + e.b.min(0)) * 3 - e.inside);
        let depth = place.depth(simd, face, plane);
        surface.raise_blocks(simd, tile, inside.to_bitmask() as u32, depth, face.nearest);
        return;
    }
    let zero = i32x16::splat(simd, 0);
    let column = columns_i32(simd);
    let mut e = [zero; N];
    for k in 0..N {
        e[k] = column * edges[k].a + (first[k] - edges[k].inside);
    }
    let mut covered = [0; 16];
    for row in &mut covered[(y0 - y) as usize..=(y1 - y) as usize] {
        let mut outside = zero;
        for k in 0..N {
            outside |= e[k];
            e[k] += edges[k].b;
        }
        *row = outside.simd_ge(zero).to_bitmask() as u16;
    }
    surface.raise_covered(simd, tile, &covered, place.depth(simd, face, plane), face.nearest);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::levels;
    use fearless_simd::dispatch;

    /// A face between two columns of pixels, given its depths there.
    fn upright([left, right]: [i32; 2], [at_left, at_right]: [f32; 2], ends: u32) -> Outline {
        let corner = |x: i32, y: i32, depth| Corner { x: x * 256, y: y * 256, depth };
        let (top, bottom) = (2, 14);
        let corner = [
            corner(left, top, at_left),
            corner(right, top, at_right),
            corner(right, bottom, at_right),
            corner(left, bottom, at_left),
        ];
        Outline { corner, corners: 4, turn: 1, ends }
    }

    #[inline(always)]
    fn drawn<S: Simd>(simd: S, plane_first: bool) -> Vec<f32> {
        let plane = TilePlane { origin: 0.5, per_column: -0.01, per_row: 0.0 };
        let mut surface = Surface::new(16, 0, 16);
        let mut joint = Joint::new(&surface);
        if plane_first {
            surface.cover(simd, 0, plane);
        }
        let (shared_right, shared_left) = (0b1101, 0b0111);
        let nearest = 0.475;
        for face in
            [upright([-4, 2], [0.4, nearest], shared_right), upright([2, 11], [nearest; 2], shared_left)]
        {
            fill(simd, &mut surface, &mut joint, &face, 1, nearest, Goes::Apart);
        }
        joint.finish(simd, &mut surface, nearest);
        if !plane_first {
            surface.cover(simd, 0, plane);
        }
        (0..256).map(|at| surface.depth(at & 15, at >> 4)).collect()
    }

    #[test]
    fn a_face_behind_a_plane_lowers_its_blocks_all_the_same() {
        for level in levels() {
            let [before, after] = [true, false].map(|first| dispatch!(level, simd => drawn(simd, first)));
            assert_eq!(before, after);
            // Behind the plane at its left, before it at its right.
            let row = &before[8 * 16..9 * 16];
            assert!(row[1] > 0.48 && row[3] < 0.471 && row[8] > 0.47, "{row:?}");
        }
    }
}
