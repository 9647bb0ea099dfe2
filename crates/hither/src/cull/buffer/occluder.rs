//! An occluder made ready: its surface as connected patches of convex faces that know their neighbours.
//!
//! ```text
//! 1. weld vertices whose positions are the same bits; drop triangles with two equal corners
//! 2. pair edges that run in opposite directions, those that share indices before those that share positions
//! 3. patches: what is connected by pairs
//! 4. two triangles that are nearly coplanar and form a convex quadrilateral become one face
//! 5. lay out patch by patch, and sort the patches into a tree of boxes, those of one face sixteen together
//! 6. find large boxes inside the closed patches of many faces
//! ```
//!
//! Any triangles will do: open, closed, non-manifold, degenerate. What is paired decides only how *tight* the
//! coverage is; that it is never too large is proved in [`super`] for every pairing.

use super::convex::ConvexBody;
use super::fine::{Fine, FineFaces};
use super::inner::inner_boxes;
use super::loose::LooseFaces;
use super::parts::folds;
use super::round::{Round, RoundBodies};
use crate::index::{Box3, WideTree, blocks_of_boxes, tree_of_boxes};
use crate::scene::{AlphaMode, Material, Mesh};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Which sides of an occluder's triangles hide what is behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The side from which the corners run counter-clockwise. Right for closed surfaces.
    Front,
    /// Both.
    Both,
}

/// Why an [`Occluder`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OccluderError {
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, and there are {vertices}")]
    Index {
        /// The triangle.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
}

/// A surface that hides, prepared once and drawn from any eye, at any place, any number of times.
#[derive(Debug, Default)]
pub struct Occluder {
    pub(super) vertices: Vertices,
    pub(super) faces: Vec<Face>,
    pub(super) patches: Vec<Patch>,
    /// Its leaves are patches, but for those of one face, and after them the blocks of such.
    pub(super) tree: WideTree,
    /// Largest magnitudes of its coordinates.
    pub(super) reach: [f64; 3],
    /// Faces that are patches by themselves, in blocks.
    pub(super) loose: Vec<LooseFaces>,
    pub(super) fine: FineFaces,
    pub(super) convex: Vec<ConvexBody>,
    pub(super) round: RoundBodies,
    /// Boxes inside closed patches, each a patch without faces of its own.
    pub(super) inner: Vec<Patch>,
    triangles: usize,
}

/// What an occluder's tree has for leaves.
#[derive(Clone, Copy)]
pub(super) enum Part<'a> {
    Patch(&'a Patch),
    Loose(&'a LooseFaces),
}

/// Positions, patch by patch, each patch filled up to a multiple of eight.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
}

/// A connected piece of surface.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub first_vertex: u32,
    /// A multiple of eight.
    pub vertices: u32,
    pub first_face: u32,
    pub faces: u32,
    /// Where it lies among the fine patches, if it has many faces.
    pub fine: Option<Fine>,
    /// Its place among the convex bodies, if it is one of few faces, …
    pub convex: Option<u32>,
    /// … and where it lies among the round ones, if it is one of many.
    pub round: Option<Round>,
    /// The boxes inside of it.
    pub inner: Range<u32>,
    /// Whether some of it may lie before other parts of it.
    pub folds: bool,
}

/// A triangle, or two that share the edge from corner 0 to corner 2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// Vertices of the patch, counter-clockwise from the front; of a triangle the first three.
    pub corner: [u32; 4],
    /// For the edge from corner k to the next, the face of the patch across it, or [`ENDS`].
    pub across: [u32; 4],
    /// 3 or 4.
    pub corners: u8,
    pub two_sided: bool,
}

/// No face is across: the surface ends here.
pub(super) const ENDS: u32 = u32::MAX;

/// Triangles whose planes differ by less than this (1 − cosine) may become one face.
const NEARLY_COPLANAR: f64 = 2e-3;

impl Occluder {
    /// Prepares triangles. Triangles with a corner that is not finite are left out. Cost: n log n.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], sides: Sides) -> Result<Occluder, OccluderError> {
        let two_sided = sides == Sides::Both;
        check_indices(positions, triangles)?;
        Ok(prepare(positions, triangles.iter().map(|&t| (t, two_sided))))
    }

    /// What of a mesh hides: its opaque triangles, both sides of those whose material says so. Masked and
    /// transparent ones never hide.
    pub fn of_mesh(mesh: &Mesh, materials: &[Material]) -> Occluder {
        let runs = mesh.primitives.iter().filter_map(|run| {
            let material = run.material.map(|m| &materials[m as usize]);
            let opaque = material.is_none_or(|m| m.alpha == AlphaMode::Opaque);
            opaque.then_some((run.triangles.clone(), material.is_some_and(|m| m.double_sided)))
        });
        let triangles =
            runs.flat_map(|(range, two_sided)| range.map(move |t| (mesh.triangles[t as usize], two_sided)));
        prepare(&mesh.positions, triangles)
    }

    /// Its triangles, whether both sides hide.
    pub(super) fn triangles(&self) -> impl Iterator<Item = ([[f32; 3]; 3], bool)> + '_ {
        let v = &self.vertices;
        let point = |i: usize| [v.x[i], v.y[i], v.z[i]];
        self.patches.iter().flat_map(move |patch| {
            let first = patch.first_vertex as usize;
            let faces = &self.faces[patch.first_face as usize..][..patch.faces as usize];
            faces.iter().flat_map(move |face| {
                let c = face.corner.map(|v| point(first + v as usize));
                let second = (face.corners == 4).then_some([c[0], c[2], c[3]]);
                [Some([c[0], c[1], c[2]]), second].into_iter().flatten().map(|t| (t, face.two_sided))
            })
        })
    }

    /// How many triangles it was made of, those that can hide nothing left out.
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// How many connected pieces it has.
    pub fn patch_count(&self) -> usize {
        self.patches.len()
    }

    /// What a leaf of its tree is.
    pub(super) fn part(&self, leaf: u32) -> Part<'_> {
        match (leaf as usize).checked_sub(self.patches.len()) {
            None => Part::Patch(&self.patches[leaf as usize]),
            Some(block) => Part::Loose(&self.loose[block]),
        }
    }

    /// Whether it can hide nothing.
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// Bytes it holds.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.vertices.x.as_slice()) * 3
            + size_of_val(self.faces.as_slice())
            + size_of_val(self.patches.as_slice())
            + size_of_val(self.tree.nodes.as_slice())
            + size_of_val(self.loose.as_slice())
            + self.fine.memory_bytes()
            + size_of_val(self.convex.as_slice())
            + self.round.memory_bytes()
            + size_of_val(self.inner.as_slice())
    }
}

/// Whether all triangles name vertices that are there.
pub(super) fn check_indices(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), OccluderError> {
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= positions.len()) {
            return Err(OccluderError::Index { triangle, vertex, vertices: positions.len() });
        }
    }
    Ok(())
}

/// A triangle being prepared, with indices of welded vertices.
struct Piece {
    corner: [u32; 3],
    /// Triangle and edge across each edge.
    across: [Option<(u32, u8)>; 3],
    two_sided: bool,
}

fn prepare(positions: &[Vec3], triangles: impl Iterator<Item = ([u32; 3], bool)>) -> Occluder {
    let (welded, points) = weld(positions);
    let mut pieces = Vec::new();
    let mut original = Vec::new();
    for (corners, two_sided) in triangles {
        let corner = corners.map(|v| welded[v as usize]);
        let [a, b, c] = corner;
        if corner.contains(&ENDS) || a == b || b == c || c == a {
            continue;
        }
        pieces.push(Piece { corner, across: [None; 3], two_sided });
        original.push(corners);
    }
    pair_edges(&mut pieces, |t, k| original[t][k]);
    let ids: Vec<[u32; 3]> = pieces.iter().map(|p| p.corner).collect();
    pair_edges(&mut pieces, |t, k| ids[t][k]);
    lay_out(&points, &pieces)
}

/// For each position the number of the first with the same bits ([`ENDS`] if it is not finite), and these.
fn weld(positions: &[Vec3]) -> (Vec<u32>, Vec<Vec3>) {
    let mut numbers = HashMap::with_capacity(positions.len());
    let mut points = Vec::new();
    let welded = positions.iter().map(|p| {
        if !p.is_finite() {
            return ENDS;
        }
        // Adding zero makes −0 the same as 0.
        let p = *p + Vec3::ZERO;
        *numbers.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
            points.push(p);
            points.len() as u32 - 1
        })
    });
    (welded.collect(), points)
}

/// Pairs edges that have no partner yet and run between the same two vertices in opposite directions.
fn pair_edges(pieces: &mut [Piece], vertex: impl Fn(usize, usize) -> u32) {
    let mut edges = Vec::new();
    for (t, piece) in pieces.iter().enumerate() {
        for k in 0..3 {
            if piece.across[k].is_none() {
                let (a, b) = (vertex(t, k), vertex(t, (k + 1) % 3));
                edges.push((a.min(b), a.max(b), a > b, t as u32, k as u8));
            }
        }
    }
    edges.sort_unstable();
    for run in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (there, back) = run.split_at(run.partition_point(|e| !e.2));
        for (e, f) in there.iter().zip(back) {
            pieces[e.3 as usize].across[e.4 as usize] = Some((f.3, f.4));
            pieces[f.3 as usize].across[f.4 as usize] = Some((e.3, e.4));
        }
    }
}

/// For each triangle a number of its connected piece, in the order of their first triangles.
fn patches_of(pieces: &[Piece]) -> (Vec<u32>, usize) {
    let mut patch = vec![ENDS; pieces.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    for start in 0..pieces.len() {
        if patch[start] != ENDS {
            continue;
        }
        patch[start] = count;
        stack.push(start);
        while let Some(t) = stack.pop() {
            for (next, _) in pieces[t].across.iter().flatten() {
                if patch[*next as usize] == ENDS {
                    patch[*next as usize] = count;
                    stack.push(*next as usize);
                }
            }
        }
        count += 1;
    }
    (patch, count as usize)
}

/// For each triangle the edge at which it is merged with the one across, if it is.
fn merge(points: &[Vec3], pieces: &[Piece]) -> Vec<Option<u8>> {
    let at = |v: u32| points[v as usize].as_dvec3();
    let mut merged = vec![None; pieces.len()];
    // The longest edge first: the diagonal of a quadrilateral.
    for t in 0..pieces.len() {
        let mut edges: Vec<usize> = (0..3).collect();
        let length = |k: usize| at(pieces[t].corner[k]).distance_squared(at(pieces[t].corner[(k + 1) % 3]));
        edges.sort_by(|&i, &j| length(j).total_cmp(&length(i)));
        for k in edges {
            let Some((u, j)) = pieces[t].across[k] else { continue };
            let (u, j) = (u as usize, usize::from(j));
            let free = merged[t].is_none() && merged[u].is_none() && u != t;
            let [a, b, c] = [0, 1, 2].map(|i| at(pieces[t].corner[(k + i) % 3]));
            let d = at(pieces[u].corner[(j + 2) % 3]);
            let alike = pieces[t].two_sided == pieces[u].two_sided;
            if free && alike && forms_a_face([a, d, b, c]) {
                merged[t] = Some(k as u8);
                merged[u] = Some(j as u8);
            }
        }
    }
    merged
}

/// Whether the triangles (a, b, c) and (b, a, d), given as a, d, b, c, are nearly coplanar and the corners'
/// turns all go the same way.
fn forms_a_face([a, d, b, c]: [DVec3; 4]) -> bool {
    let (m, n) = ((b - a).cross(c - a), (a - b).cross(d - b));
    let (Some(m), Some(n)) = (m.try_normalize(), n.try_normalize()) else { return false };
    if 1.0 - m.dot(n) > NEARLY_COPLANAR {
        return false;
    }
    let turn = |p: DVec3, q: DVec3, r: DVec3| {
        (q - p).cross(r - q).dot(m + n) > 1e-3 * (q - p).length() * (r - q).length()
    };
    turn(c, a, d) && turn(d, b, c)
}

fn lay_out(points: &[Vec3], pieces: &[Piece]) -> Occluder {
    let (patch_of, patches) = patches_of(pieces);
    let merged = merge(points, pieces);
    let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
    order.sort_by_key(|&t| patch_of[t as usize]);
    let mut occluder = Occluder { triangles: pieces.len(), ..Occluder::default() };
    // Face of the patch that each triangle is part of, and where its edge k went: found in two passes.
    let mut face_of = vec![ENDS; pieces.len()];
    let mut local = HashMap::new();
    let mut boxes = Vec::with_capacity(patches);
    for group in order.chunk_by(|&t, &u| patch_of[t as usize] == patch_of[u as usize]) {
        let first_face = occluder.faces.len() as u32;
        let mut heads = Vec::new();
        for &t in group {
            let t = t as usize;
            if face_of[t] != ENDS {
                continue;
            }
            face_of[t] = heads.len() as u32;
            if let Some((u, _)) = merged[t].and_then(|k| pieces[t].across[usize::from(k)]) {
                face_of[u as usize] = heads.len() as u32;
            }
            heads.push(t);
        }
        local.clear();
        let first_vertex = occluder.vertices.x.len() as u32;
        let mut bounds = Box3::EMPTY;
        for t in heads {
            let mut face = face(pieces, &face_of, t, merged[t]);
            for v in &mut face.corner[..usize::from(face.corners)] {
                let next = local.len() as u32;
                let p = points[*v as usize];
                *v = *local.entry(*v).or_insert_with(|| {
                    occluder.vertices.push(p);
                    bounds = bounds.union(&Box3 { min: p.to_array(), max: p.to_array() });
                    next
                });
            }
            if face.corners == 3 {
                face.corner[3] = face.corner[0];
            }
            occluder.faces.push(face);
        }
        while !occluder.vertices.x.len().is_multiple_of(8) {
            occluder.vertices.repeat_last();
        }
        let convex = add_convex(&mut occluder, first_face, first_vertex);
        let (these, vertices) = (&occluder.faces[first_face as usize..], &occluder.vertices);
        let round = occluder.round.push(these, vertices, first_vertex);
        occluder.patches.push(Patch {
            first_vertex,
            vertices: vertices.x.len() as u32 - first_vertex,
            first_face,
            faces: these.len() as u32,
            fine: occluder.fine.push(these, vertices, first_vertex),
            convex,
            inner: 0..0,
            folds: convex.is_none() && round.is_none() && folds(these, vertices, first_vertex),
            round,
        });
        boxes.push(bounds);
    }
    add_inner_boxes(&mut occluder);
    add_tree(&mut occluder, boxes);
    occluder
}

/// Sorts the patches, given the boxes around them: those of one face into blocks, and these and the others into a tree.
fn add_tree(occluder: &mut Occluder, mut boxes: Vec<Box3>) {
    let mut loose = Vec::new();
    for (number, (patch, bounds)) in occluder.patches.iter().zip(&mut boxes).enumerate() {
        if patch.faces == 1 {
            loose.push((std::mem::replace(bounds, Box3::EMPTY), number as u32));
        }
    }
    for block in blocks_of_boxes(&loose, 16) {
        let block = LooseFaces::new(&block, &occluder.patches, &occluder.faces, &occluder.vertices);
        boxes.push(block.bounds());
        occluder.loose.push(block);
    }
    occluder.tree = tree_of_boxes(&boxes);
    occluder.reach = occluder.tree.bounds().reach();
}

/// Keeps the last patch as a convex body, if it is one.
fn add_convex(occluder: &mut Occluder, first_face: u32, first_vertex: u32) -> Option<u32> {
    let body = ConvexBody::new(&occluder.faces[first_face as usize..], &occluder.vertices, first_vertex)?;
    occluder.convex.push(body);
    Some(occluder.convex.len() as u32 - 1)
}

/// A closed patch of fewer triangles is drawn as soon as the boxes inside of it.
const LEAST_AROUND_BOXES: usize = 32;

/// A patch is drawn as no more boxes than these.
const MOST_INNER_BOXES: usize = 8;

/// Finds the boxes inside the patches that are closed and have many faces.
fn add_inner_boxes(occluder: &mut Occluder) {
    let found: Vec<_> = occluder.patches.par_iter().map(|patch| boxes_inside(occluder, patch)).collect();
    let faces = faces_of_a_box();
    for (p, boxes) in found.into_iter().enumerate() {
        let first = occluder.inner.len() as u32;
        for corners in boxes {
            let first_vertex = occluder.vertices.x.len() as u32;
            corners.into_iter().for_each(|corner| occluder.vertices.push(corner));
            if let Some(body) = ConvexBody::new(&faces, &occluder.vertices, first_vertex) {
                occluder.convex.push(body);
                let convex = Some(occluder.convex.len() as u32 - 1);
                let (first_face, faces, fine) = (0, 0, None);
                let (inner, folds, round) = (0..0, false, None);
                let vertices = 8;
                let box_patch =
                    Patch { first_vertex, vertices, first_face, faces, fine, convex, round, inner, folds };
                occluder.inner.push(box_patch);
            }
        }
        occluder.patches[p].inner = first..occluder.inner.len() as u32;
    }
}

/// Corners of the boxes inside a patch, none if they would not be worth it.
fn boxes_inside(occluder: &Occluder, patch: &Patch) -> Vec<[Vec3; 8]> {
    let faces = &occluder.faces[patch.first_face as usize..][..patch.faces as usize];
    let triangles: Vec<[u32; 3]> = faces
        .iter()
        .flat_map(|f| {
            let [a, b, c, d] = f.corner;
            [Some([a, b, c]), (f.corners == 4).then_some([a, c, d])].into_iter().flatten()
        })
        .collect();
    let ends = |f: &Face| f.across[..usize::from(f.corners)].contains(&ENDS);
    if triangles.len() < LEAST_AROUND_BOXES || faces.iter().any(ends) {
        return Vec::new();
    }
    let v = &occluder.vertices;
    let range = patch.first_vertex as usize..(patch.first_vertex + patch.vertices) as usize;
    let points: Vec<DVec3> = range.map(|i| DVec3::new(v.x[i].into(), v.y[i].into(), v.z[i].into())).collect();
    inner_boxes(&points, &triangles, MOST_INNER_BOXES).into_iter().map(|found| found.corners).collect()
}

/// The six faces of a box whose corner k is at the far end of axis i if bit i of k is set.
fn faces_of_a_box() -> [Face; 6] {
    let corners: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let has =
        |quad: &[u32; 4], from: u32, to: u32| (0..4).any(|k| (quad[k], quad[(k + 1) % 4]) == (from, to));
    corners.map(|corner| {
        let across = [0, 1, 2, 3].map(|k| {
            let (from, to) = (corner[k], corner[(k + 1) % 4]);
            corners.iter().position(|other| has(other, to, from)).map_or(ENDS, |f| f as u32)
        });
        Face { corner, across, corners: 4, two_sided: false }
    })
}

/// The face that triangle `t`, merged across edge `k` or not, becomes; corners are still points.
fn face(pieces: &[Piece], face_of: &[u32], t: usize, k: Option<u8>) -> Face {
    let piece = &pieces[t];
    let across = |p: &Piece, k: usize| p.across[k % 3].map_or(ENDS, |(u, _)| face_of[u as usize]);
    let mut face = Face {
        corner: [piece.corner[0], piece.corner[1], piece.corner[2], piece.corner[0]],
        across: [across(piece, 0), across(piece, 1), across(piece, 2), ENDS],
        corners: 3,
        two_sided: piece.two_sided,
    };
    let other = k.and_then(|k| piece.across[usize::from(k)].map(|o| (usize::from(k), o)));
    if let Some((k, (u, j))) = other {
        let (other, j) = (&pieces[u as usize], usize::from(j));
        // a, d, b, c: the shared edge runs from corner 0 to corner 2.
        let [a, b, c] = [0, 1, 2].map(|i| piece.corner[(k + i) % 3]);
        face.corner = [a, other.corner[(j + 2) % 3], b, c];
        face.across =
            [across(other, j + 1), across(other, j + 2), across(piece, k + 1), across(piece, k + 2)];
        face.corners = 4;
    }
    face
}

impl Vertices {
    fn push(&mut self, p: Vec3) {
        self.x.push(p.x);
        self.y.push(p.y);
        self.z.push(p.z);
    }

    fn repeat_last(&mut self) {
        for list in [&mut self.x, &mut self.y, &mut self.z] {
            list.extend(list.last().copied());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of eight corners and twelve triangles.
    fn cuboid() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let corner = |k: u32| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2 & 1) as f32);
        let quads = [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        ((0..8).map(corner).collect(), triangles)
    }

    #[test]
    fn a_box_is_one_patch_of_six_faces_that_know_their_neighbours() {
        let (positions, triangles) = cuboid();
        let made = Occluder::new(&positions, &triangles, Sides::Front).unwrap();
        assert_eq!((made.patches.len(), made.faces.len(), made.vertices.x.len()), (1, 6, 8));
        for (f, face) in made.faces.iter().enumerate() {
            assert_eq!(face.corners, 4);
            for &other in &face.across {
                assert!(made.faces[other as usize].across.contains(&(f as u32)));
            }
        }
    }

    #[test]
    fn corners_stored_three_times_over_are_welded() {
        let (positions, triangles) = cuboid();
        let loose: Vec<Vec3> = triangles.as_flattened().iter().map(|&v| positions[v as usize]).collect();
        let indices: Vec<[u32; 3]> = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let made = Occluder::new(&loose, &indices, Sides::Front).unwrap();
        assert_eq!((made.patches.len(), made.faces.len()), (1, 6));
    }

    #[test]
    fn what_cannot_hide_is_left_out_and_what_is_not_there_is_refused() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::splat(f32::NAN)];
        let made = Occluder::new(&p, &[[0, 1, 1], [0, 1, 3], [0, 1, 2]], Sides::Both).unwrap();
        assert_eq!((made.triangle_count(), made.patch_count()), (1, 1));
        assert!(Occluder::new(&[], &[], Sides::Front).unwrap().is_empty());
        let error = Occluder::new(&p, &[[0, 1, 2], [0, 1, 9]], Sides::Front).unwrap_err();
        assert_eq!(error.to_string(), "triangle 1 names vertex 9, and there are 4");
    }
}
