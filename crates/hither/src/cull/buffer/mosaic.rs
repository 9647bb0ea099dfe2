//! Patches of many faces that are not large: coverage from the outline alone, depth from the rectangles around faces.
//!
//! ```text
//! 1. which faces turn to the eye: sixteen planes at a time
//! 2. depth: each face that is drawn lowers the blocks of 4×4 pixels that the rectangle around it meets to its plane,
//!    where that is nearer than its farthest corner; to that corner if the face is but a few pixels large
//! 3. the outline: edges between faces that are drawn and faces that are not, or that turn the other way
//! 4. the count of each pixel: going down a column of pixel centres, the outline's edges that are crossed, each
//!    +1 or −1; less one where an edge of the outline touches the pixel with its centre on the inner side
//! 5. pixels whose count is at least one get their depth
//! ```
//!
//! A patch that the near plane or the guard band cuts comes as what is left of its faces, with the edges at which it
//! ends: the count needs to know no more.
//!
//! *Depth.* A face's plane, lowered as in [`fill`](super::fill), is nowhere above the face in a pixel that the face
//! touches. In the other pixels of the rectangle, and of the blocks, it stands for nothing and can only lower what is
//! there.
//!
//! *Count.* How many faces of a chain cover a point, each with the sign of its turn, is how often the chain's
//! boundary winds around the point, and that is the sum of the boundary's crossings with a ray. So step 4
//! yields the N(c) of [`super`] without looking at a face, for any choice in step 1: an outline around what is
//! taken is all that it needs. What step 1 takes for a front and is none counts with its true sign, and only
//! lessens the count. An edge changes the count from one row to the next by 2 at most, and adds to it no less than −2 and
//! no more than 1: sixteen bits hold both for [`MOST_EDGES`].
//!
//! *Ties.* Crossings are taken as if every centre were moved by (ε, ε²), which is what the fill rule says:
//! columns from an edge's smallest x (inclusive) to its largest (exclusive), and a point on an edge inside if the
//! edge goes up, or level to the right.
//!
//! *Rows of crossings* are quotients of whole numbers below 2⁵³ by a step of at most 2²³, taken in f64. Such a
//! quotient that is not whole is at least 2⁻²³ from a whole number, and near the patch, at most 2²⁰ in
//! magnitude, the computed one is off by less than 2⁻³⁰: rounding it after moving it by 2⁻³⁰ is exact.

use super::fill::{Corner, first_pixel, last_pixel, plane_below};
use super::fine::FinePatch;
use super::place::{Placed, ROUND};
use super::surface::Surface;
use super::tile::{blocks_in, tile_plane};
use crate::raster::ScreenFromObject;
use fearless_simd::{Simd, f32x16, f64x4, i16x16, i32x4, i32x16, mask32x16, prelude::*, u64x4};

/// The eye in the space of an occluder: a point (1 at the end), or the direction towards it (0).
pub(super) fn eye_in_object(at: &ScreenFromObject) -> [f32; 4] {
    let row = |r: &[f64; 4]| glam::DVec3::new(r[0], r[1], r[2]);
    let (x, y, w) = (row(&at.x), row(&at.y), row(&at.w));
    if at.perspective {
        let sum = y.cross(w) * at.x[3] + w.cross(x) * at.y[3] + x.cross(y) * at.w[3];
        let eye = -sum / x.dot(y.cross(w));
        [eye.x as f32, eye.y as f32, eye.z as f32, 1.0]
    } else {
        let across = x.cross(y).normalize_or_zero();
        let towards = across * across.dot(row(&at.d)).signum();
        [towards.x as f32, towards.y as f32, towards.z as f32, 0.0]
    }
}

/// A patch in its place.
pub(super) struct Drawing<'a> {
    pub patch: FinePatch<'a>,
    pub placed: &'a Placed,
    /// Sign of the area of faces that are seen from the front.
    pub front_sign: i32,
    /// How far a corner may be from its true place, 1/256 pixel.
    pub slack: i32,
    /// Pixels of the surface that it may touch.
    pub rect: [i32; 4],
}

/// The blocks of a tile.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Blocks([i32; 16]);

/// Sixteen pixels of a row.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Steps([i16; 16]);

/// Tiles around a patch, sixteen columns after another.
#[derive(Clone, Debug, Default)]
pub(super) struct Mosaic {
    /// Bits of the least depth of the faces that may touch a block, tile by tile downwards.
    depth: Vec<Blocks>,
    /// By how much a pixel's count differs from that of the pixel above, row by row.
    step: Vec<Steps>,
    /// Turn of each face: 1 front, −1 back, 0 not drawn; and one more 0, for where the surface ends.
    turn: Vec<i8>,
    /// Edges at which what is drawn ends: the corners, in the order of the face, and its turn on the screen.
    outline: Vec<([i32; 4], [i32; 4], i32)>,
}

/// What part of the surface a patch is drawn in.
#[derive(Clone, Copy)]
pub(super) struct Area {
    /// Columns and rows (inclusive) of the surface.
    rect: [i32; 4],
    /// Image row of the surface's first.
    band: i32,
    /// First column and row of the first tile.
    left: i32,
    top: i32,
    /// Rows from there to the rectangle's last, and the tiles that they meet.
    rows: usize,
    tiles: usize,
    /// How far a corner may be from its true place, 1/256 pixel.
    slack: i32,
}

impl Area {
    /// Sixteens that a column of sixteens takes: a row more than are seen, so that what ends below has a place.
    fn stride(&self) -> usize {
        self.rows + 1
    }
}

/// A patch with more edges in its outline is not drawn in this way: counts might not fit.
pub(super) const MOST_EDGES: usize = 10_000;

/// A face that touches no more pixels each way has its farthest corner for a plane: it is as good a bound.
const FEW_PX: i32 = 3;

/// The plane below a face, given its corners as they are placed.
#[inline(always)]
fn plane_of<S: Simd>(corners: [i32x4<S>; 4], four: bool, slack: i32) -> [f64; 3] {
    let [a, b, c, d]: [[i32; 4]; 4] =
        [corners[0].into(), corners[1].into(), corners[2].into(), corners[3].into()];
    let corner = [Corner::of_bits(a), Corner::of_bits(b), Corner::of_bits(c), Corner::of_bits(d)];
    let size = corner[0].depth.max(corner[1].depth).max(corner[2].depth.max(corner[3].depth));
    plane_below(&corner, four, slack, size)
}

/// A block that no face touches.
const NO_DEPTH: i32 = i32::MAX;

impl Mosaic {
    /// The turns of the patch whose were found last. What is not to be drawn may be set to 0.
    pub fn turns(&mut self) -> &mut [i8] {
        &mut self.turn
    }

    /// Draws the faces of a patch that have a turn. Returns how many there are; nothing, if their outline is too long.
    #[inline(always)]
    pub fn draw<S: Simd>(&mut self, simd: S, surface: &mut Surface, drawing: &Drawing) -> Option<u64> {
        let &Drawing { patch, placed, front_sign, slack, rect } = drawing;
        let area = self.begin(surface, rect, slack);
        let drawn = self.lower_depths(simd, &area, &patch, placed, front_sign);
        self.end(simd, surface, &area, placed.nearest).then_some(drawn)
    }

    /// Makes room for a patch that touches no pixels but those of a rectangle of the surface.
    pub fn begin(&mut self, surface: &Surface, rect: [i32; 4], slack: i32) -> Area {
        let (left, top) = (rect[0] & !15, rect[1] & !15);
        let rows = (rect[3] - top + 1) as usize;
        let area = Area { rect, band: surface.top, left, top, rows, tiles: rows.div_ceil(16), slack };
        let across = (((rect[2] - left) >> 4) + 1) as usize;
        if self.step.len() < area.stride() * across {
            self.step.resize(area.stride() * across, Steps([0; 16]));
        }
        if self.depth.len() < area.tiles * across {
            self.depth.resize(area.tiles * across, Blocks([NO_DEPTH; 16]));
        }
        self.outline.clear();
        area
    }

    /// Takes a face, of four corners or of three.
    #[inline(always)]
    pub fn face<S: Simd>(&mut self, simd: S, area: &Area, corner: &[Corner; 4], four: bool) {
        let load = |k: usize| i32x4::from_slice(simd, &corner[k].bits());
        self.lower(simd, area, [load(0), load(1), load(2), load(3)], four);
    }

    /// Takes an edge at which the patch ends, as it runs around a face that turns so.
    #[inline(always)]
    pub fn edge(&mut self, from: &Corner, to: &Corner, turn: i32) {
        self.outline.push((from.bits(), to.bits(), turn));
    }

    /// Draws the patch whose faces and edges were taken; or says that there are too many edges.
    #[inline(always)]
    pub fn end<S: Simd>(&mut self, simd: S, surface: &mut Surface, area: &Area, nearest: f32) -> bool {
        let fits = self.outline.len() <= MOST_EDGES;
        for at in 0..if fits { self.outline.len() } else { 0 } {
            let (p, q, turn) = self.outline[at];
            self.count_edge(simd, area, p, q, turn);
        }
        self.finish(simd, surface, area, nearest);
        fits
    }

    /// Finds which faces of a patch turn to the eye.
    #[inline(always)]
    pub fn take_turns<S: Simd>(&mut self, simd: S, patch: &FinePatch, eye: [f32; 4]) {
        let faces = patch.face.len();
        self.turn.clear();
        self.turn.resize(faces + 1, 0);
        let zero = f32x16::splat(simd, 0.0);
        let back = i8::from(patch.two_sided);
        for (planes, turns) in patch.plane.iter().zip(self.turn.chunks_exact_mut(16)) {
            let [nx, ny, nz, d] = &planes.0;
            let x = f32x16::from_slice(simd, nx) * eye[0];
            let y = f32x16::from_slice(simd, ny) * eye[1];
            let z = f32x16::from_slice(simd, nz) * eye[2];
            let w = f32x16::from_slice(simd, d) * eye[3];
            let side = x + y + z - w;
            let (front, behind) = (side.simd_gt(zero).to_bitmask(), side.simd_lt(zero).to_bitmask());
            for (lane, turn) in turns.iter_mut().enumerate() {
                *turn = (front >> lane & 1) as i8 - (behind >> lane & 1) as i8 * back;
            }
        }
    }

    // long because its steps share the registers of four columns
    /// Counts an edge of the outline, that runs around a face of `turn`, in the columns that it touches.
    #[inline(always)]
    fn count_edge<S: Simd>(&mut self, simd: S, area: &Area, p: [i32; 4], q: [i32; 4], turn: i32) {
        let slack = area.slack;
        let (dx, dy) = ((q[0] - p[0]) * turn, (q[1] - p[1]) * turn);
        let (low, high) = (p[0].min(q[0]), p[0].max(q[0]));
        // Columns whose centres the edge passes over, and those that it touches.
        let passes = [(low + 127) >> 8, (high - 129) >> 8];
        let touches = [first_pixel(low, slack), last_pixel(high, slack)];
        let rows = [first_pixel(p[1].min(q[1]), slack), last_pixel(p[1].max(q[1]), slack)];
        let top = area.top + area.band;
        let [first_row, last_row] = [(rows[0] - top).max(0), (rows[1] - top).min(area.rows as i32 - 1)];
        let [first, last] = [touches[0].max(area.rect[0]), touches[1].min(area.rect[2])];
        if first > last || (first_row > last_row && rows[0] - top > area.rows as i32) {
            return;
        }
        // Positive inside, at centres: e = b·y − dy·x + c, in whole numbers.
        let owned = dy < 0 || (dy == 0 && dx > 0);
        let from = [i64::from(128 - p[0]), i64::from(256 * top + 128 - p[1])];
        let c = (i64::from(dx) * from[1] - i64::from(dy) * from[0] - i64::from(!owned)) >> 8;
        let size = i64::from(dx.abs()) + i64::from(dy.abs());
        let least = -((size * i64::from(slack) + 256) >> 8);
        let most = (size * i64::from(128 + slack)) >> 8;
        let stride = area.stride();
        let column = f64x4::from_slice(simd, &FOUR);
        let (bias, round) = (1.0 / f64::from(1 << 30), f64x4::splat(simd, ROUND));
        let (zero, end) = (f64x4::splat(simd, 0.0), f64x4::splat(simd, area.rows as f64));
        let (first_f, last_f) = (f64::from(first_row), f64::from(last_row));
        if dx == 0 {
            // No crossings; a column is touched or not.
            for x in first..last + 1 {
                let e = c - i64::from(dy) * i64::from(x);
                if e >= least && e <= most && first_row <= last_row {
                    let at = ((x - area.left) >> 4) as usize * stride;
                    let lane = (x & 15) as usize;
                    self.step[at + first_row as usize].0[lane] -= 1;
                    self.step[at + last_row as usize + 1].0[lane] += 1;
                }
            }
            return;
        }
        let inverse = 1.0 / f64::from(dx);
        let mut x = first;
        while x <= last {
            // e without its part in y.
            let rest = (column + f64::from(x)) * f64::from(-dy) + c as f64;
            let crossing = rest * -inverse;
            let (from, to) = if dx > 0 {
                ((rest * -1.0 + least as f64) * inverse, (rest * -1.0 + most as f64) * inverse)
            } else {
                ((rest * -1.0 + most as f64) * inverse, (rest * -1.0 + least as f64) * inverse)
            };
            // First row below the crossing: inside if the edge is entered there, else outside.
            let below = if dx > 0 { (crossing - bias).ceil() } else { (crossing + bias).floor() + 1.0 };
            let (from, to) = ((from - bias).ceil().max(first_f), (to + bias).floor().min(last_f));
            let below: [u64; 4] = whole(below.max(zero).min(end) + round);
            let some = from.simd_le(to).to_bitmask();
            let from: [u64; 4] = whole(from.min(end) + round);
            let to: [u64; 4] = whole(to.max(zero) + 1.0 + round);
            for lane in 0..(last - x + 1).min(4) as usize {
                let at_x = x + lane as i32;
                let at = ((at_x - area.left) >> 4) as usize * stride;
                let column = (at_x & 15) as usize;
                if at_x >= passes[0] && at_x <= passes[1] {
                    self.step[at + below[lane] as u32 as usize].0[column] += dx.signum() as i16;
                }
                if some >> lane & 1 == 1 {
                    self.step[at + from[lane] as u32 as usize].0[column] -= 1;
                    self.step[at + to[lane] as u32 as usize].0[column] += 1;
                }
            }
            x += 4;
        }
    }

    /// Lowers the blocks around each face that is drawn, and notes its edges that belong to the outline. Returns how
    /// many there are.
    #[inline(always)]
    fn lower_depths<S: Simd>(
        &mut self,
        simd: S,
        area: &Area,
        patch: &FinePatch,
        placed: &Placed,
        front_sign: i32,
    ) -> u64 {
        let corner = placed.corner.as_slice();
        let mut drawn = 0;
        for (f, face) in patch.face.iter().enumerate() {
            let turn = self.turn[f];
            if turn == 0 {
                continue;
            }
            drawn += 1;
            let mut ends = 0u32;
            for k in 0..4 {
                ends |= u32::from(self.turn[usize::from(face.across[k])] != turn) << k;
            }
            while ends != 0 {
                let k = ends.trailing_zeros() as usize & 3;
                ends &= ends - 1;
                // Of a triangle the edge from corner 2 leads to corner 3, which is corner 0.
                let [p, q] = [k, (k + 1) & 3].map(|k| corner[usize::from(face.corner[k])]);
                self.outline.push((p, q, front_sign * i32::from(turn)));
            }
            let a = i32x4::from_slice(simd, &corner[usize::from(face.corner[0])]);
            let b = i32x4::from_slice(simd, &corner[usize::from(face.corner[1])]);
            let c = i32x4::from_slice(simd, &corner[usize::from(face.corner[2])]);
            let d = i32x4::from_slice(simd, &corner[usize::from(face.corner[3])]);
            self.lower(simd, area, [a, b, c, d], face.corner[3] != face.corner[0]);
        }
        drawn
    }

    /// Lowers the blocks around a face to its plane, but not below its farthest corner.
    #[inline(always)]
    fn lower<S: Simd>(&mut self, simd: S, area: &Area, [a, b, c, d]: [i32x4<S>; 4], four: bool) {
        let [left, top, right, bottom] = area.rect;
        let first = i32x4::from_slice(simd, &[left, top + area.band, 0, 0]);
        let last = i32x4::from_slice(simd, &[right, bottom + area.band, 0, 0]);
        let (least, most) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        let farthest: [i32; 4] = least.into();
        let (from, to) = ((least - (area.slack + 1)) >> 8, (most + area.slack) >> 8);
        // Asked of the whole face, so that all bands of an image hold the same.
        let [width, height, ..]: [i32; 4] = (to - from).into();
        let small = width < FEW_PX && height < FEW_PX;
        let [x0, y0, ..]: [i32; 4] = from.max(first).into();
        let [x1, y1, ..]: [i32; 4] = to.min(last).into();
        if x0 > x1 || y0 > y1 {
            return;
        }
        let nothing = i32x16::splat(simd, NO_DEPTH);
        let plane = if small { [0.0; 3] } else { plane_of([a, b, c, d], four, area.slack) };
        let farthest = i32x16::splat(simd, farthest[2]);
        for sixteen in x0 >> 4..(x1 >> 4) + 1 {
            let x = sixteen * 16;
            let above = ((x - area.left) >> 4) as usize * area.tiles;
            for tile in y0 >> 4..(y1 >> 4) + 1 {
                let y = tile * 16;
                let within = [(x0 - x).max(0), (y0 - y).max(0), (x1 - x).min(15), (y1 - y).min(15)];
                let blocks = mask32x16::from_bitmask(simd, u64::from(blocks_in(within.map(|px| px >> 2))));
                // Depths of 0 and more are ordered as their bits are, and what is below 0 comes before them.
                let depth = match small {
                    true => farthest,
                    false => {
                        tile_plane(plane, x, y).block_mins(simd, within).bitcast::<i32x16<S>>().max(farthest)
                    }
                };
                let row = &mut self.depth[above + ((y - area.band - area.top) >> 4) as usize].0;
                i32x16::from_slice(simd, row).min(blocks.select(depth, nothing)).store_slice(row);
            }
        }
    }

    /// Adds up the counts, raises the pixels of the surface that are covered, and leaves all empty.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S, surface: &mut Surface, area: &Area, nearest: f32) {
        let (zero, nothing) = (i16x16::splat(simd, 0), i32x16::splat(simd, NO_DEPTH));
        let highest = i32x16::splat(simd, nearest.to_bits().cast_signed());
        for sixteen in area.left >> 4..(area.rect[2] >> 4) + 1 {
            let at = ((sixteen * 16 - area.left) >> 4) as usize;
            let steps = &mut self.step[at * area.stride()..][..area.stride()];
            let mut count = zero;
            for (tile, steps) in steps[..area.rows].chunks_mut(16).enumerate() {
                let blocks = &mut self.depth[at * area.tiles + tile].0;
                let tile = surface.tile(sixteen, (area.top >> 4) + tile as i32);
                let covered = add_up(simd, &mut count, steps);
                if surface.tile_min(tile) < nearest {
                    let depth = i32x16::from_slice(simd, blocks).min(highest);
                    surface.raise_covered(simd, tile, &covered, depth.bitcast(), nearest);
                }
                nothing.store_slice(blocks);
            }
            zero.store_slice(&mut steps[area.rows].0);
        }
    }
}

/// Adds the steps of up to sixteen rows to the counts, leaves none, and says for each row which counts are 1 or more.
#[inline(always)]
fn add_up<S: Simd>(simd: S, count: &mut i16x16<S>, steps: &mut [Steps]) -> [u16; 16] {
    let zero = i16x16::splat(simd, 0);
    let (mut any, mut covered) = (zero, [0; 16]);
    for row in &*steps {
        any |= i16x16::from_slice(simd, &row.0);
    }
    if any.simd_eq(zero).all_true() {
        covered[..steps.len()].fill(count.simd_gt(zero).to_bitmask() as u16);
        return covered;
    }
    for (row, covered) in steps.iter_mut().zip(&mut covered) {
        *count += i16x16::from_slice(simd, &row.0);
        *covered = count.simd_gt(zero).to_bitmask() as u16;
        zero.store_slice(&mut row.0);
    }
    covered
}

const FOUR: [f64; 4] = [0., 1., 2., 3.];

/// Whole numbers from sums with [`ROUND`]: in the low 32 bits.
#[inline(always)]
fn whole<S: Simd>(v: f64x4<S>) -> [u64; 4] {
    v.bitcast::<u64x4<S>>().into()
}
