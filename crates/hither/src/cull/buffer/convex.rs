//! Closed convex patches of few faces: boxes, wedges, prisms, pyramids. Coverage from the silhouette's half-planes,
//! depth from the planes of the faces that are seen.
//!
//! ```text
//! 1. which faces turn to the eye: their planes at once
//! 2. the silhouette: edges of exactly one such face, as bits
//! 3. each edge bounds the columns of a row, from the left or from the right; level ones bound the rows
//! 4. a row covers the columns between its bounds; of each plane of a face that is seen, the least holds there
//! ```
//!
//! *Coverage* is as [`silhouette`](super::silhouette) says, whichever faces step 1 takes: the edges are the boundary of a
//! chain of faces, so together they close.
//!
//! *Depth.* Each face that is taken stands for the larger of its plane, lowered as in [`fill`](super::fill), and its
//! farthest corner, wherever the patch is: a pixel that a face does not touch can only lose by that. It loses little
//! where the body is convex: there no plane of a face that is seen is beyond the surface, and lowered ones are so for
//! about a pixel beside their face.
//!
//! So convexity is what makes this good, not what makes it right, and what is called convex may be so roughly.

use super::fill::plane_below;
use super::fine::plane_of;
use super::occluder::{ENDS, Face, Vertices};
use super::place::Placed;
use super::silhouette::{InTile, Silhouette};
use super::surface::Surface;
use super::tile::{TilePlane, tile_plane};
use fearless_simd::{Simd, f32x8, prelude::*};
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
        are_roughly_convex(
            &points,
            (0..faces).map(|f| {
                let [x, y, z, d] = [0, 1, 2, 3].map(|k| f64::from(self.plane[k][f]));
                (DVec3::new(x, y, z), d)
            }),
        )
    }
}

/// Whether faces, of which the planes' normals and offsets are given, bound a body: no point is far in front of one, and
/// each has some far behind it. What is flat has no body: its outline may be anything.
pub(super) fn are_roughly_convex(points: &[DVec3], mut planes: impl Iterator<Item = (DVec3, f64)>) -> bool {
    let size = points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max);
    planes.all(|(normal, d)| {
        // Coordinates in f32 bound how well the plane is known.
        let slack = size * ROUGHLY + d.abs() * 1e-6;
        let (mut behind, mut in_front) = (0.0f64, 0.0f64);
        for p in points {
            let side = normal.dot(*p) - d;
            (behind, in_front) = (behind.min(side), in_front.max(side));
        }
        normal != DVec3::ZERO && in_front <= slack && behind < -slack
    })
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

/// Planes of the faces that are seen, over pixels of the image.
struct Seen {
    plane: [[f64; 3]; FACES],
    farthest: [f32; FACES],
    count: usize,
    nearest: f32,
}

/// Draws a body. Returns how many of its faces are seen, none if it is too small to cover anything.
#[inline(always)]
pub(super) fn draw<S: Simd>(
    simd: S,
    surface: &mut Surface,
    silhouette: &mut Silhouette,
    drawing: &Drawing,
) -> u64 {
    let faces = turned_to(simd, drawing.body, drawing.eye);
    if !find(simd, silhouette, drawing, faces) {
        return 0;
    }
    let seen = planes(drawing, faces);
    silhouette.for_each_tile(
        simd,
        surface,
        seen.nearest,
        #[inline(always)]
        |surface, covered| fill(simd, surface, &covered, &seen),
    );
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

/// Finds the silhouette around `faces`. False if it covers no pixel for certain.
#[inline(always)]
fn find<S: Simd>(simd: S, silhouette: &mut Silhouette, drawing: &Drawing, faces: u32) -> bool {
    let &Drawing { body, placed, front_sign, slack, .. } = drawing;
    let (mut rest, mut along) = (0u32, 0);
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
    let edges = std::iter::from_fn(
        #[inline(always)]
        || {
            let e = rest.trailing_zeros() as usize;
            rest &= rest.checked_sub(1)?;
            let [a, b] = body.edge[e.min(EDGES - 1)].map(|v| placed.corner[usize::from(v)]);
            let (p, q) = if along >> e & 1 == 1 { (a, b) } else { (b, a) };
            Some([[p[0], p[1]], [q[0], q[1]]])
        },
    );
    silhouette.set(simd, 16, slack, edges)
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

/// Fills what is covered of a tile.
#[inline(always)]
fn fill<S: Simd>(simd: S, surface: &mut Surface, covered: &InTile<S>, seen: &Seen) {
    let [x, y] = covered.at;
    let tile = surface.tile(x >> 4, y >> 4);
    let over = over_tile(seen, x, y + surface.top);
    surface.refresh_tile(simd, tile);
    if !surface.may_gain(simd, tile, covered.inner, over.highest) {
        return;
    }
    covered.raise(simd, surface, &over.planes[..over.count.min(FACES)], over.highest);
}

/// The planes that are the least somewhere in a tile. One that is nowhere below `highest` is left out: where its face
/// covers some of a pixel, the plane, lowered, is no nearer there than the nearest corner, so that face covers nothing
/// of the tile.
struct OverTile {
    /// Each with the depth of its face's farthest corner.
    planes: [(TilePlane, f32); FACES],
    count: usize,
    /// No depth is larger.
    highest: f32,
}

#[inline(always)]
fn over_tile(seen: &Seen, x: i32, y: i32) -> OverTile {
    let mut over = OverTile { planes: [(TilePlane::ZERO, 0.0); FACES], count: 0, highest: seen.nearest };
    let mut over_all = [(TilePlane::ZERO, 0.0); FACES];
    let count = seen.count.min(FACES);
    for ((to, plane), &farthest) in over_all[..count].iter_mut().zip(&seen.plane).zip(&seen.farthest) {
        let plane = tile_plane(*plane, x, y);
        over.highest = over.highest.min(plane.max().max(farthest));
        *to = (plane, farthest);
    }
    for &(plane, farthest) in &over_all[..count] {
        if plane.min(0, 0, 15, 15).max(farthest) <= over.highest {
            over.planes[over.count & 7] = (plane, farthest);
            over.count += 1;
        }
    }
    over
}
