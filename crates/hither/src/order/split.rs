//! Pre-splitting: large and hollow meshes cut into pieces whose hulls hold little air, so that what is inside of
//! them, or flies through them, need not be merged with them [Snyder & Lengyel 1997, §9].
//!
//! Space is halved by planes again and again. Each piece keeps a margin of its neighbours' surface, so that no gap
//! shows at a seam. Where two pieces overlap both show the same, so either may be in front: the plane on which their
//! paths parted is the [`Seam`] to tell the sort of ([`Known::Plane`](super::Known::Plane)). Only where surfaces blend
//! must pieces not overlap: each of them would tint what is behind.
//!
//! Beside the paper's grids there is the splitting that it leaves to the future: the piece whose hull reaches
//! farthest from its surface is halved next, along the axis and at the place that bring the halves closest to
//! their hulls.

use crate::geometry::{Aabb, Hull};
use crate::scene::{Mesh, Primitive};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Where a mesh is cut, in its own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SplitBy {
    /// A grid over x and z, for height fields.
    HeightField {
        /// Cells along x.
        columns: u32,
        /// Cells along z.
        rows: u32,
    },
    /// Sectors about the upright axis through the middle, and heights, for cups and the like. An odd number of
    /// sectors becomes even.
    Cylinder {
        /// Sectors, at least 2.
        sectors: u32,
        /// Cells along y.
        heights: u32,
    },
    /// A grid over x, y and z.
    Boxes([u32; 3]),
    /// The least convex piece is halved next.
    Adaptive {
        /// Until there are so many …
        pieces: u32,
        /// … or no surface is deeper than this inside its hull, metres.
        depth: f64,
    },
}

/// A plane n·p = d between two pieces, in the mesh's space; the first is where n·p ≤ d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// The piece below.
    pub first: u32,
    /// The piece above.
    pub second: u32,
    /// Unit normal.
    pub normal: DVec3,
    /// Its distance from the origin, metres.
    pub offset: f64,
}

/// A mesh in pieces.
#[derive(Clone, Debug, Default)]
pub struct SplitMesh {
    /// None is empty.
    pub pieces: Vec<Mesh>,
    /// Between pieces that overlap.
    pub seams: Vec<Seam>,
}

/// Cuts a mesh. `overlap` is the share by which a cell is larger than without it: 0.2 adds a tenth of a cell on
/// each side. With 0 no two pieces share any of the surface, which a mesh that blends wants. Cost: triangles times the
/// depth of the halving; the adaptive way makes hulls at every step.
pub fn split(mesh: &Mesh, by: &SplitBy, overlap: f64) -> SplitMesh {
    let bounds = mesh.bounds();
    let mut out = Output { cuts: 0, split: SplitMesh::default(), paths: Vec::new() };
    if bounds.is_empty() {
        return out.split;
    }
    let soup = soup(mesh);
    match *by {
        SplitBy::HeightField { columns, rows } => out.grid(soup, &bounds, [columns, 1, rows], overlap),
        SplitBy::Boxes(cells) => out.grid(soup, &bounds, cells, overlap),
        SplitBy::Cylinder { sectors, heights } => out.cylinder(soup, &bounds, sectors, heights, overlap),
        SplitBy::Adaptive { pieces, depth } => out.adaptive(soup, pieces.max(1) as usize, depth, overlap),
    }
    out.seams();
    out.split
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Corner {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
    color: Vec4,
}

/// A triangle with its corners' attributes and its material.
type Face = ([Corner; 3], Option<u32>);

/// A piece that may be halved further: how hollow it is, its faces, and the cuts that led to it.
type Candidate = (f64, Vec<Face>, Vec<Cut>);

/// A cut on the way to a piece, and on which side of it the piece is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cut {
    /// The same for both sides of one cut, different for every cut.
    id: u32,
    normal: DVec3,
    offset: f64,
    above: bool,
}

fn soup(mesh: &Mesh) -> Vec<Face> {
    let corner = |v: u32| {
        let v = v as usize;
        Corner {
            position: mesh.positions[v],
            normal: mesh.normals.get(v).copied().unwrap_or(Vec3::ZERO),
            uv: mesh.uvs.get(v).copied().unwrap_or(Vec2::ZERO),
            color: mesh.colors.get(v).copied().unwrap_or(Vec4::ONE),
        }
    };
    let faces = mesh.triangles.iter().enumerate();
    faces.map(|(t, triangle)| (triangle.map(corner), mesh.material_of(t as u32))).collect()
}

/// The faces where n·p ≤ d.
fn clipped(faces: &[Face], normal: DVec3, offset: f64) -> Vec<Face> {
    let mut kept = Vec::new();
    let height = |c: &Corner| normal.dot(c.position.as_dvec3()) - offset;
    for (corners, material) in faces {
        let heights = [0, 1, 2].map(|i| height(&corners[i]));
        if heights.iter().all(|&h| h <= 0.0) {
            kept.push((*corners, *material));
            continue;
        }
        let mut polygon: Vec<Corner> = Vec::with_capacity(4);
        for i in 0..3 {
            let (a, b) = (&corners[i], &corners[(i + 1) % 3]);
            let (ha, hb) = (heights[i], heights[(i + 1) % 3]);
            if ha <= 0.0 {
                polygon.push(*a);
            }
            if (ha < 0.0 && hb > 0.0) || (ha > 0.0 && hb < 0.0) {
                polygon.push(between(a, b, (ha / (ha - hb)) as f32));
            }
        }
        for i in 1..polygon.len().saturating_sub(1) {
            let triangle = [polygon[0], polygon[i], polygon[i + 1]];
            let [a, b, c] = triangle.map(|c| c.position);
            if (b - a).cross(c - a) != Vec3::ZERO {
                kept.push((triangle, *material));
            }
        }
    }
    kept
}

fn between(a: &Corner, b: &Corner, t: f32) -> Corner {
    Corner {
        position: a.position.lerp(b.position, t),
        // Not unit: so it is interpolated as if the triangle were whole.
        normal: a.normal.lerp(b.normal, t),
        uv: a.uv.lerp(b.uv, t),
        color: a.color.lerp(b.color, t),
    }
}

struct Output {
    /// Cuts made so far.
    cuts: u32,
    split: SplitMesh,
    /// For each piece the cuts that led to it.
    paths: Vec<Vec<Cut>>,
}

impl Output {
    fn halves(
        &mut self,
        faces: &[Face],
        path: &[Cut],
        normal: DVec3,
        offset: f64,
        margin: f64,
    ) -> [(Vec<Face>, Vec<Cut>); 2] {
        let id = self.cuts;
        self.cuts += 1;
        let with = |above| path.iter().copied().chain([Cut { id, normal, offset, above }]).collect();
        let below = clipped(faces, normal, offset + margin);
        let mut above = clipped(faces, -normal, -(offset - margin));
        if margin == 0.0 {
            // What lies in the plane is below.
            above.retain(|(corners, _)| {
                corners.iter().any(|c| normal.dot(c.position.as_dvec3()) - offset != 0.0)
            });
        }
        [(below, with(false)), (above, with(true))]
    }

    fn finish(&mut self, faces: &[Face], path: Vec<Cut>) {
        if !faces.is_empty() {
            self.split.pieces.push(mesh_of(faces));
            self.paths.push(path);
        }
    }

    /// Halves ranges of cells until each holds one.
    fn grid(&mut self, faces: Vec<Face>, bounds: &Aabb, cells: [u32; 3], overlap: f64) {
        let cells = cells.map(|c| c.max(1));
        let step = bounds.size() / DVec3::from(cells.map(f64::from));
        let mut work = vec![(faces, Vec::new(), [0; 3], cells)];
        while let Some((faces, path, from, to)) = work.pop() {
            let axis = (0..3).max_by_key(|&k| to[k] - from[k]).unwrap_or(0);
            if to[axis] - from[axis] == 1 || faces.is_empty() {
                self.finish(&faces, path);
                continue;
            }
            let middle = (from[axis] + to[axis]) / 2;
            let normal = DVec3::AXES[axis];
            let offset = bounds.min[axis] + step[axis] * f64::from(middle);
            let [below, above] = self.halves(&faces, &path, normal, offset, 0.5 * overlap * step[axis]);
            let (mut end, mut start) = (to, from);
            (end[axis], start[axis]) = (middle, middle);
            work.push((above.0, above.1, start, to));
            work.push((below.0, below.1, from, end));
        }
    }

    fn cylinder(&mut self, faces: Vec<Face>, bounds: &Aabb, sectors: u32, heights: u32, overlap: f64) {
        let sectors = sectors.max(2).next_multiple_of(2);
        let middle = bounds.center();
        let radius = bounds.size().with_y(0.0).length() * 0.5;
        let margin = 0.5 * overlap * radius * (TAU / f64::from(sectors)).min(1.0);
        let mut work = vec![(faces, Vec::new(), 0, sectors)];
        while let Some((faces, path, from, to)) = work.pop() {
            if to - from == 1 || faces.is_empty() {
                self.heights(faces, path, bounds, heights, overlap);
                continue;
            }
            // The first plane makes two halves; a plane within a half cuts that half only.
            let whole = to - from == sectors;
            let at = if whole { from } else { (from + to) / 2 };
            let (sin, cos) = (TAU * f64::from(at) / f64::from(sectors)).sin_cos();
            // Sectors before `at` lie where this normal points away from.
            let normal = DVec3::new(-sin, 0.0, cos);
            let [below, above] = self.halves(&faces, &path, normal, normal.dot(middle), margin);
            let cut = if whole { sectors / 2 } else { at };
            let (first, second) = if whole { (above, below) } else { (below, above) };
            work.push((second.0, second.1, cut, to));
            work.push((first.0, first.1, from, cut));
        }
    }

    fn heights(&mut self, faces: Vec<Face>, path: Vec<Cut>, bounds: &Aabb, cells: u32, overlap: f64) {
        let step = bounds.size().y / f64::from(cells.max(1));
        let (mut faces, mut path) = (faces, path);
        for i in 1..cells.max(1) {
            let offset = bounds.min.y + step * f64::from(i);
            let [below, above] = self.halves(&faces, &path, DVec3::Y, offset, 0.5 * overlap * step);
            self.finish(&below.0, below.1);
            (faces, path) = above;
        }
        self.finish(&faces, path);
    }

    fn adaptive(&mut self, faces: Vec<Face>, pieces: usize, depth: f64, overlap: f64) {
        let first = (hollowness(&faces), faces, Vec::new());
        let mut all = vec![first];
        while all.len() < pieces {
            let deepest = (0..all.len()).max_by(|&a, &b| all[a].0.total_cmp(&all[b].0)).unwrap_or(0);
            if all[deepest].0 <= depth {
                break;
            }
            let (was, faces, path) = all.swap_remove(deepest);
            match self.best_cut(&faces, &path, overlap) {
                Some(halves) => all.extend(halves),
                None => {
                    // Nothing to be gained: it is finished, and the rest goes on.
                    all.push((f64::min(was, 0.0), faces, path));
                }
            }
        }
        for (_, faces, path) in all {
            self.finish(&faces, path);
        }
    }

    /// The halves whose worse one is closest to its hull, over three axes and three places on each.
    fn best_cut(&mut self, faces: &[Face], path: &[Cut], overlap: f64) -> Option<[Candidate; 2]> {
        let points = faces.iter().flat_map(|f| f.0.iter().map(|c| c.position.as_dvec3()));
        let bounds = Aabb::around(points);
        let mut best: Option<(f64, [Candidate; 2])> = None;
        for axis in 0..3 {
            for share in [0.5, 0.35, 0.65] {
                let size = bounds.size()[axis];
                let offset = bounds.min[axis] + size * share;
                let halves = self.halves(faces, path, DVec3::AXES[axis], offset, 0.25 * overlap * size);
                if halves.iter().any(|h| h.0.is_empty() || size <= 0.0) {
                    continue;
                }
                let halves = halves.map(|(faces, path)| (hollowness(&faces), faces, path));
                let worse = halves[0].0.max(halves[1].0);
                if best.as_ref().is_none_or(|b| worse < b.0) {
                    best = Some((worse, halves));
                }
            }
        }
        best.map(|b| b.1)
    }

    /// A seam for each two pieces whose boxes meet: the cut on which their paths part.
    fn seams(&mut self) {
        let boxes: Vec<Aabb> = self.split.pieces.iter().map(Mesh::bounds).collect();
        for second in 0..self.paths.len() {
            for first in 0..second {
                let (a, b) = (&boxes[first], &boxes[second]);
                if a.min.cmpgt(b.max).any() || b.min.cmpgt(a.max).any() {
                    continue;
                }
                let parting = self.paths[first].iter().zip(&self.paths[second]).find(|(a, b)| a != b);
                if let Some((a, b)) = parting.filter(|(a, b)| a.id == b.id) {
                    let (below, above) = if a.above { (second, first) } else { (first, second) };
                    self.split.seams.push(Seam {
                        first: below as u32,
                        second: above as u32,
                        normal: b.normal,
                        offset: b.offset,
                    });
                }
            }
        }
    }
}

/// How deep the deepest point of a surface is inside its hull, metres: corners and middles of faces.
fn hollowness(faces: &[Face]) -> f64 {
    let corners: Vec<DVec3> = faces.iter().flat_map(|f| f.0.iter().map(|c| c.position.as_dvec3())).collect();
    let Some(hull) = Hull::around(&corners) else { return 0.0 };
    let vertex = |v: u32| hull.vertices()[v as usize];
    let planes = hull.triangles().iter().filter_map(|&[a, b, c]| {
        let normal = (vertex(b) - vertex(a)).cross(vertex(c) - vertex(a)).try_normalize()?;
        Some((normal, normal.dot(vertex(a))))
    });
    let planes: Vec<(DVec3, f64)> = planes.collect();
    if planes.is_empty() {
        return 0.0;
    }
    // A few thousand points tell enough.
    let stride = corners.len().div_ceil(3000).max(1);
    let middles = corners.chunks_exact(3).map(|f| (f[0] + f[1] + f[2]) / 3.0);
    let points = corners.iter().copied().step_by(stride).chain(middles.step_by(stride));
    let inside = |p: DVec3| planes.iter().map(|(n, d)| d - n.dot(p)).fold(f64::INFINITY, f64::min);
    points.map(inside).fold(0.0, f64::max)
}

/// A mesh again, equal corners shared, faces by material.
fn mesh_of(faces: &[Face]) -> Mesh {
    let mut mesh = Mesh::default();
    let mut seen: HashMap<[u32; 12], u32> = HashMap::new();
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by_key(|&f| faces[f].1);
    for f in order {
        let (corners, material) = &faces[f];
        let triangle = corners.map(|c| {
            let mut key = [0; 12];
            let values = c.position.to_array().into_iter().chain(c.normal.to_array());
            let values = values.chain(c.uv.to_array()).chain(c.color.to_array());
            key.iter_mut().zip(values).for_each(|(k, v)| *k = v.to_bits());
            *seen.entry(key).or_insert_with(|| {
                mesh.positions.push(c.position);
                mesh.normals.push(c.normal);
                mesh.uvs.push(c.uv);
                mesh.colors.push(c.color);
                mesh.positions.len() as u32 - 1
            })
        });
        let at = mesh.triangles.len() as u32;
        mesh.triangles.push(triangle);
        match mesh.primitives.last_mut().filter(|p| p.material == *material) {
            Some(primitive) => primitive.triangles.end = at + 1,
            None => mesh.primitives.push(Primitive { triangles: at..at + 1, material: *material }),
        }
    }
    if mesh.normals.iter().all(|n| *n == Vec3::ZERO) {
        mesh.normals.clear();
    }
    if mesh.uvs.iter().all(|uv| *uv == Vec2::ZERO) {
        mesh.uvs.clear();
    }
    if mesh.colors.iter().all(|c| *c == Vec4::ONE) {
        mesh.colors.clear();
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl: a paraboloid over a square.
    fn bowl(n: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for z in 0..=n {
            for x in 0..=n {
                let (x, z) = (x as f32 / n as f32 * 2.0 - 1.0, z as f32 / n as f32 * 2.0 - 1.0);
                mesh.positions.push(Vec3::new(x, x * x + z * z, z));
            }
        }
        for z in 0..n {
            for x in 0..n {
                let a = z * (n + 1) + x;
                mesh.triangles.extend([[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]]);
            }
        }
        mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: None }];
        mesh
    }

    /// A plain with a steep hill.
    fn hill(n: u32) -> Mesh {
        let mut mesh = bowl(n);
        for p in &mut mesh.positions {
            p.y = 0.8 * (-12.0 * ((p.x - 0.4).powi(2) + (p.z + 0.3).powi(2))).exp();
        }
        mesh
    }

    fn area(mesh: &Mesh) -> f64 {
        let corner = |v: u32| mesh.positions[v as usize].as_dvec3();
        mesh.triangles
            .iter()
            .map(|&[a, b, c]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length() * 0.5)
            .sum()
    }

    #[test]
    fn a_flat_mesh_in_the_plane_of_a_cut_is_in_one_piece_only() {
        let mut mesh = bowl(17);
        mesh.positions.iter_mut().for_each(|p| p.y = 0.0);
        for by in [SplitBy::Boxes([2, 4, 1]), SplitBy::Cylinder { sectors: 2, heights: 3 }] {
            let total: f64 = split(&mesh, &by, 0.0).pieces.iter().map(area).sum();
            assert!((total - area(&mesh)).abs() < 1e-4, "{by:?}: {total} of {}", area(&mesh));
        }
    }

    #[test]
    fn pieces_without_overlap_have_the_whole_area_and_lie_on_their_sides() {
        let mesh = bowl(17);
        let ways = [
            SplitBy::HeightField { columns: 5, rows: 4 },
            SplitBy::Boxes([3, 2, 2]),
            SplitBy::Cylinder { sectors: 6, heights: 3 },
            SplitBy::Adaptive { pieces: 9, depth: 0.0 },
        ];
        for by in ways {
            let split = split(&mesh, &by, 0.0);
            let total: f64 = split.pieces.iter().map(area).sum();
            assert!((total - area(&mesh)).abs() < 1e-4, "{by:?}: {total}");
            assert!(split.pieces.len() >= 8, "{by:?}: {}", split.pieces.len());
            for seam in &split.seams {
                let side = |piece: u32, sign: f64| {
                    let mesh = &split.pieces[piece as usize];
                    mesh.positions
                        .iter()
                        .all(|p| sign * (seam.normal.dot(p.as_dvec3()) - seam.offset) <= 1e-5)
                };
                assert!(side(seam.first, 1.0) && side(seam.second, -1.0), "{by:?}: {seam:?}");
            }
        }
    }

    #[test]
    fn overlapping_pieces_have_seams_and_every_overlap_has_one() {
        let split = split(&bowl(20), &SplitBy::HeightField { columns: 4, rows: 4 }, 0.2);
        assert_eq!(split.pieces.len(), 16);
        // Neighbours along a side and across a corner: 2·4·3 + 2·3·3.
        assert_eq!(split.seams.len(), 24 + 18);
        assert!(split.pieces.iter().map(area).sum::<f64>() > area(&bowl(20)) * 1.2);
    }

    #[test]
    fn adaptive_splitting_comes_closer_to_the_hulls_than_a_grid_of_as_many() {
        let mesh = hill(24);
        let worst = |split: &SplitMesh| split.pieces.iter().map(|m| hollowness(&soup(m))).fold(0.0, f64::max);
        let adaptive = split(&mesh, &SplitBy::Adaptive { pieces: 16, depth: 0.0 }, 0.2);
        let boxes = split(&mesh, &SplitBy::Boxes([4, 1, 4]), 0.2);
        assert!(worst(&adaptive) <= worst(&boxes) * 1.05, "{} {}", worst(&adaptive), worst(&boxes));
    }
}
