//! Closed convex patches of few faces: boxes, wedges, prisms, pyramids. Coverage from the silhouette's half-planes,
//! depth from the planes of the faces that are seen.
//!
//! ```text
//! 1. which faces turn to the eye: their planes at once
//! 2. the silhouette: edges of exactly one such face, as bits
//! 3. each edge bounds the columns of a row, from the left or from the right, as in `loose`; level ones bound the rows
//! 4. a row covers the columns between its bounds; of each plane of a face that is seen, the least holds there
//! ```
//!
//! *Coverage.* Let q be a point strictly on the inner side of every edge of the silhouette, all of them endless lines.
//! Seen from q each edge runs the same way around, by more than nothing and less than half a turn. The edges are the
//! boundary of a chain of faces, so together they close: their turns add up to a multiple of a whole turn, which is
//! more than none. Hence N(q) ≥ 1, in the words of [`super`], and this rests neither on the silhouette being convex or
//! even in one piece, nor on which faces step 1 takes. Where a square, widened by the slack, lies inside all edges, no
//! edge touches it, and none does on the way from its snapped corners to the true ones.
//!
//! *Depth.* Each face that is taken stands for the larger of its plane, lowered as in [`fill`](super::fill), and its
//! farthest corner, wherever the patch is: a pixel that a face does not touch can only lose by that. It loses little
//! where the body is convex: there no plane of a face that is seen is beyond the surface, and lowered ones are so for
//! about a pixel beside their face.
//!
//! So convexity is what makes this good, not what makes it right, and what is called convex may be so roughly.

use super::fill::{first_pixel, last_pixel, plane_below};
use super::fine::plane_of;
use super::occluder::{ENDS, Face, Vertices};
use super::place::Placed;
use super::surface::Surface;
use super::tile::{COLUMNS, TilePlane, tile_plane};
use fearless_simd::{Simd, f32x8, f32x16, i32x16, mask32x16, prelude::*};
use glam::DVec3;

/// No convex body has more faces, vertices (with those that fill them up) or edges.
const FACES: usize = 8;
const VERTICES: usize = 16;
const EDGES: usize = 18;

/// How far a vertex may be in front of a face's plane, as a share of the body's size.
const ROUGHLY: f64 = 1e-4;

/// A closed convex patch.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct ConvexBody {
    /// `n·p = d`, n outwards: n's coordinates, then d. What is beyond the last face faces nobody.
    plane: [[f32; FACES]; 4],
    /// Corners of a face; of a triangle the last is the first again.
    corner: [[u8; 4]; FACES],
    /// A bit for each edge of a face …
    edges: [u32; FACES],
    /// … and for those that run from first to second vertex around it.
    along: [u32; FACES],
    edge: [[u8; 2]; EDGES],
}

impl ConvexBody {
    /// That of a patch, if it is closed, roughly convex and small enough.
    pub fn new(faces: &[Face], vertices: &Vertices, first_vertex: u32) -> Option<ConvexBody> {
        let count = vertices.x.len() - first_vertex as usize;
        let closed = faces.iter().all(|f| !f.across[..usize::from(f.corners)].contains(&ENDS));
        if !(4..=FACES).contains(&faces.len()) || count > VERTICES || !closed {
            return None;
        }
        let mut body = ConvexBody {
            plane: [[0.0; FACES]; 4],
            corner: [[0; 4]; FACES],
            edges: [0; FACES],
            along: [0; FACES],
            edge: [[0; 2]; EDGES],
        };
        let mut edges = 0;
        for (f, face) in faces.iter().enumerate() {
            let plane = plane_of(face, vertices, first_vertex);
            body.plane.iter_mut().zip(plane).for_each(|(list, v)| list[f] = v);
            body.corner[f] = face.corner.map(|v| v as u8);
            for k in 0..usize::from(face.corners) {
                let other = face.across[k] as usize;
                let [a, b] = [k, (k + 1) % usize::from(face.corners)].map(|k| face.corner[k] as u8);
                if other > f {
                    *body.edge.get_mut(edges)? = [a, b];
                    body.edges[f] |= 1 << edges;
                    body.along[f] |= 1 << edges;
                    edges += 1;
                } else {
                    // The face across came before; it has this edge the other way.
                    let there = (0..edges).find(|&e| {
                        body.edge[e] == [b, a]
                            && body.edges[other] >> e & 1 == 1
                            && body.edges[f] >> e & 1 == 0
                    });
                    body.edges[f] |= 1 << there?;
                }
            }
        }
        let taken = body.edges[..faces.len()].iter().fold(0, |all, e| all ^ e);
        (taken == 0 && body.is_roughly_convex(faces.len(), vertices, first_vertex as usize)).then_some(body)
    }

    fn is_roughly_convex(&self, faces: usize, vertices: &Vertices, first: usize) -> bool {
        let points: Vec<DVec3> = (first..vertices.x.len())
            .map(|v| DVec3::new(vertices.x[v].into(), vertices.y[v].into(), vertices.z[v].into()))
            .collect();
        let size = points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max);
        (0..faces).all(|f| {
            let [x, y, z, d] = [0, 1, 2, 3].map(|k| f64::from(self.plane[k][f]));
            let normal = DVec3::new(x, y, z);
            // Coordinates in f32 bound how well the plane is known.
            let slack = size * ROUGHLY + d.abs() * 1e-6;
            let (mut behind, mut in_front) = (0.0f64, 0.0f64);
            for p in &points {
                let side = normal.dot(*p) - d;
                (behind, in_front) = (behind.min(side), in_front.max(side));
            }
            // Something flat has no body: its outline may be anything.
            normal != DVec3::ZERO && in_front <= slack && behind < -slack
        })
    }
}

/// A convex body in its place.
pub(super) struct Drawing<'a> {
    pub body: &'a ConvexBody,
    pub placed: &'a Placed,
    /// The eye in its space, as [`mosaic`](super::mosaic) has it.
    pub eye: [f32; 4],
    pub front_sign: i32,
    /// How far a corner may be from its true place, 1/256 pixel.
    pub slack: i32,
}

/// Bounds of columns, kept from body to body: those from the left in the first lanes, those from the right in the
/// last. In row y of the image a bound is `base + per_row·(y − y0)`.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Bounds {
    base: [f32; 16],
    per_row: [f32; 16],
    y0: [f32; 16],
    lefts: usize,
    rights: usize,
    /// Columns and rows (inclusive) of the image outside of which nothing is covered.
    rect: [i32; 4],
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds { base: [0.0; 16], per_row: [0.0; 16], y0: [0.0; 16], lefts: 0, rights: 0, rect: [0; 4] }
    }
}

/// Planes of the faces that are seen, over pixels of the image.
struct Seen {
    plane: [[f64; 3]; FACES],
    farthest: [f32; FACES],
    count: usize,
    nearest: f32,
}

/// No column of an image is so far away.
const FAR: f32 = 65536.0;

/// Draws a body. Returns how many of its faces are seen, none if it is too small to cover anything.
#[inline(always)]
pub(super) fn draw<S: Simd>(simd: S, surface: &mut Surface, bounds: &mut Bounds, drawing: &Drawing) -> u64 {
    let faces = turned_to(simd, drawing.body, drawing.eye);
    if !set_bounds(simd, bounds, drawing, faces) {
        return 0;
    }
    let [first, top, last, bottom] = bounds.rect;
    let top = (top - surface.top).max(0);
    let bottom = (bottom - surface.top).min(surface.height - 1);
    let rect = [first.max(0), top, last.min(surface.width - 1), bottom];
    if top <= bottom && rect[0] <= rect[2] {
        let seen = planes(drawing, faces);
        fill(simd, surface, bounds, &seen, rect);
    }
    u64::from(faces.count_ones())
}

/// The faces that turn to the eye.
#[inline(always)]
fn turned_to<S: Simd>(simd: S, body: &ConvexBody, eye: [f32; 4]) -> u32 {
    let [nx, ny, nz, d] = &body.plane;
    let x = f32x8::from_slice(simd, nx) * eye[0];
    let y = f32x8::from_slice(simd, ny) * eye[1];
    let z = f32x8::from_slice(simd, nz) * eye[2];
    let w = f32x8::from_slice(simd, d) * eye[3];
    (x + y + z - w).simd_gt(f32x8::splat(simd, 0.0)).to_bitmask() as u32
}

/// Finds the silhouette around `faces` and what it bounds. False if it covers no pixel for certain.
#[inline(always)]
fn set_bounds<S: Simd>(simd: S, bounds: &mut Bounds, drawing: &Drawing, faces: u32) -> bool {
    let &Drawing { body, placed, front_sign, slack, .. } = drawing;
    let (mut rest, mut along) = (0, 0);
    let mut left = faces;
    while left != 0 {
        let f = left.trailing_zeros() as usize & 7;
        left &= left - 1;
        rest ^= body.edges[f];
        along |= body.along[f];
    }
    if front_sign < 0 {
        along = !along;
    }
    let (mut px, mut py, mut qx, mut qy) = ([0; 16], [0; 16], [0; 16], [1; 16]);
    let (mut lefts, mut rights) = (0, 0);
    let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
    let (mut top, mut bottom) = (i32::MIN, i32::MAX);
    while rest != 0 {
        let e = rest.trailing_zeros() as usize;
        let [a, b] = body.edge[e.min(EDGES - 1)].map(|v| placed.corner[usize::from(v)]);
        let (p, q) = if along >> e & 1 == 1 { (a, b) } else { (b, a) };
        rest &= rest - 1;
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
        if lefts + rights == 16 {
            return false;
        }
        let lane = if dy < 0 { lefts } else { 15 - rights };
        (lefts, rights) = (lefts + usize::from(dy < 0), rights + usize::from(dy > 0));
        (px[lane], py[lane], qx[lane], qy[lane]) = (p[0], p[1], q[0], q[1]);
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
    (bounds.lefts, bounds.rights, bounds.rect) = (lefts, rights, [first, top, last, bottom]);
    let load = |list: &[i32; 16]| i32x16::from_slice(simd, list);
    let (x, y) = (load(&px), load(&py));
    let (dx, dy) = ((load(&qx) - x).to_float::<f32x16<S>>(), (load(&qy) - y).to_float::<f32x16<S>>());
    let sub = 1.0 / 256.0;
    let (x, y) = (x.to_float::<f32x16<S>>() * sub, y.to_float::<f32x16<S>>() * sub);
    let m = dx / dy;
    // As in `loose`: over all rows of the body, no term is larger than these together.
    let half = (m.abs() + 1.0) * ((128 + slack) as f32 * sub);
    let rows = ((high[1] - low[1]) >> 8) as f32 + 3.0;
    let off = (x.abs() + 1.0 + half + m.abs() * rows) * (1.0 / (1 << 20) as f32);
    let inwards = half + off;
    let from_left = mask32x16::from_bitmask(simd, (1 << lefts) - 1);
    let zero = f32x16::splat(simd, 0.0);
    (x - 0.5 + from_left.select(inwards, zero - inwards)).store_slice(&mut bounds.base);
    m.store_slice(&mut bounds.per_row);
    (y - 0.5).store_slice(&mut bounds.y0);
    true
}

#[inline(always)]
fn planes(drawing: &Drawing, faces: u32) -> Seen {
    let &Drawing { body, placed, slack, .. } = drawing;
    let nearest = placed.nearest;
    let mut seen = Seen { plane: [[0.0; 3]; FACES], farthest: [0.0; FACES], count: 0, nearest };
    let mut rest = faces;
    while rest != 0 {
        let f = rest.trailing_zeros() as usize & 7;
        rest &= rest - 1;
        let [a, b, c, d] = body.corner[f];
        let corners = placed.corners(&body.corner[f].map(u32::from));
        let depths = corners.map(|c| c.depth);
        let four = d != a && d != b && d != c;
        let farthest = depths[0].min(depths[1]).min(depths[2].min(depths[3]));
        seen.plane[seen.count & 7] = plane_below(&corners, four, slack, nearest.max(-farthest));
        seen.farthest[seen.count & 7] = farthest;
        seen.count += 1;
    }
    seen
}

/// Fills what lies in `rect` of the surface.
#[inline(always)]
fn fill<S: Simd>(simd: S, surface: &mut Surface, bounds: &Bounds, seen: &Seen, rect: [i32; 4]) {
    let [first, top, last, bottom] = rect;
    for cell_y in top >> 6..(bottom >> 6) + 1 {
        for cell_x in first >> 6..(last >> 6) + 1 {
            let mut open = surface.tiles_beyond(simd, cell_x, cell_y, rect, seen.nearest);
            while open != 0 {
                let tile_row = open.trailing_zeros() as i32 >> 2;
                let columns = open >> (tile_row * 4) & 15;
                open &= !(15 << (tile_row * 4));
                let y = cell_y * 64 + tile_row * 16;
                let inside = (0xFFFFu32 << (top - y).max(0)) & (0xFFFF >> (15 - (bottom - y).min(15)));
                let spans = spans(simd, bounds, (y + surface.top) as f32, inside);
                fill_tiles(simd, surface, spans, columns, [cell_x * 64, y], rect, seen);
            }
        }
    }
}

/// First and last column that each of sixteen rows covers, from row `y` of the image on: of those in `inside`.
#[inline(always)]
fn spans<S: Simd>(simd: S, bounds: &Bounds, y: f32, inside: u32) -> [f32x16<S>; 2] {
    let rows = f32x16::from_slice(simd, &COLUMNS) + y;
    let (mut from, mut to) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, FAR));
    for k in 0..bounds.lefts.min(16) {
        from = from.max((rows - bounds.y0[k]) * bounds.per_row[k] + bounds.base[k]);
    }
    for k in 16 - bounds.rights.min(16)..16 {
        to = to.min((rows - bounds.y0[k]) * bounds.per_row[k] + bounds.base[k]);
    }
    let far = f32x16::splat(simd, FAR);
    let inside = mask32x16::from_bitmask(simd, u64::from(inside));
    [inside.select(from.min(far).ceil(), far), to.max(f32x16::splat(simd, -1.0)).floor()]
}

/// Fills those of four tiles of a row, from `x` on, that `columns` names.
#[inline(always)]
fn fill_tiles<S: Simd>(
    simd: S,
    surface: &mut Surface,
    [from, to]: [f32x16<S>; 2],
    columns: u32,
    [x, y]: [i32; 2],
    [left, top, right, bottom]: [i32; 4],
    seen: &Seen,
) {
    let mut rest = columns;
    while rest != 0 {
        let x = x + rest.trailing_zeros() as i32 * 16;
        rest &= rest - 1;
        let (x_first, x_last) = (x as f32, (x + 15) as f32);
        let meets = (from.simd_le(x_last) & to.simd_ge(x_first) & from.simd_le(to)).to_bitmask() as u32;
        if meets == 0 {
            continue;
        }
        let tile = surface.tile(x >> 4, y >> 4);
        let over = over_tile(seen, x, y + surface.top);
        let inner = [(left - x).max(0), (top - y).max(0), (right - x).min(15), (bottom - y).min(15)];
        surface.refresh_tile(simd, tile);
        if !surface.may_gain(simd, tile, inner, over.highest) {
            continue;
        }
        let whole = meets == 0xFFFF && (from.simd_le(x_first) & to.simd_ge(x_last)).all_true();
        if whole && over.is_one_plane() {
            surface.cover(simd, tile, over.plane[0]);
        } else {
            let (planes, farthest) = (&over.plane[..over.count.min(FACES)], &over.farthest);
            let spans = [from - x_first, to - x_first];
            surface.raise_spans(
                simd,
                tile,
                spans,
                meets,
                #[inline(always)]
                |row| {
                    let mut least = f32x16::splat(simd, over.highest);
                    for (plane, farthest) in planes.iter().zip(farthest) {
                        least = least.min(plane.row(simd, row as i32).max(*farthest));
                    }
                    least
                },
                over.highest,
            );
        }
    }
}

/// The planes that are the least somewhere in a tile. One that is nowhere below `highest` is left out: where its face
/// covers some of a pixel, the plane, lowered, is no nearer there than the nearest corner, so that face covers nothing
/// of the tile.
struct OverTile {
    plane: [TilePlane; FACES],
    farthest: [f32; FACES],
    count: usize,
    /// No depth is larger.
    highest: f32,
}

impl OverTile {
    /// Whether a single plane holds everywhere, nowhere below its face's farthest corner, nor behind everything.
    #[inline(always)]
    fn is_one_plane(&self) -> bool {
        self.count == 1 && self.plane[0].min(0, 0, 15, 15) >= self.farthest[0].max(0.0)
    }
}

#[inline(always)]
fn over_tile(seen: &Seen, x: i32, y: i32) -> OverTile {
    let mut over =
        OverTile { plane: [TilePlane::ZERO; FACES], farthest: [0.0; FACES], count: 0, highest: seen.nearest };
    let mut over_all = [(TilePlane::ZERO, 0.0); FACES];
    let count = seen.count.min(FACES);
    for ((to, plane), &farthest) in over_all[..count].iter_mut().zip(&seen.plane).zip(&seen.farthest) {
        let plane = tile_plane(*plane, x, y);
        over.highest = over.highest.min(plane.max().max(farthest));
        *to = (plane, farthest);
    }
    for &(plane, farthest) in &over_all[..count] {
        if plane.min(0, 0, 15, 15).max(farthest) <= over.highest {
            (over.plane[over.count & 7], over.farthest[over.count & 7]) = (plane, farthest);
            over.count += 1;
        }
    }
    over
}
