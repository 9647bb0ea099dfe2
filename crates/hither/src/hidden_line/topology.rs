//! What does not change with the view: a mesh's edges, and which triangles meet at each.
//!
//! Vertices with the same position are one vertex here, whatever their normals and colours, so that a seam
//! of texture coordinates is no boundary. Triangles without area are left out, and those that are wholly
//! transparent: they show nothing and hide nothing.

use super::bodies::Bodies;
use super::crew::Crew;
use super::grid::{Places, Sorted};
use super::junctions;
use super::seams::{Seams, Sides};
use super::slivers;
use crate::scene::{AlphaMode, Mesh, Scene};
use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};
use std::hash::BuildHasher;
use std::ops::Range;

/// No triangle, or no vertex.
pub(super) const NONE: u32 = u32::MAX;

/// What an edge is, whatever the view.
pub(super) mod trait_of {
    /// More than two triangles meet here.
    pub const NON_MANIFOLD: u8 = 1;
    /// The two triangles have different materials.
    pub const BORDER: u8 = 2;
    /// The two triangles wind in opposite senses: what is front of one is back of the other.
    pub const FLIPPED: u8 = 4;
    /// The model draws a line here, or the user asked for one.
    pub const MARKED: u8 = 8;
    /// No triangle has it as a whole edge: planes must cut it by itself.
    pub const LOOSE: u8 = 16;
    /// One of the triangles is too thin to have a normal of its own; that of a neighbour counts.
    pub const THIN: u8 = 32;
}

/// Two vertices and the triangles between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// The smaller vertex first.
    pub vertices: [u32; 2],
    /// The triangles on both sides; the second is [`NONE`] at a boundary, both of a line without triangles.
    /// Of a non-manifold edge, two.
    pub triangles: [u32; 2],
    /// How much the surface bends here, 1 − cos of the angle between the normals, in the mesh's own space:
    /// 0 is flat, 2 is folded back.
    pub bend: f32,
    /// Bits of [`trait_of`].
    pub traits: u8,
}

/// A mesh as drawings need it.
#[derive(Clone, Debug)]
pub(super) struct Topology {
    /// Vertices; no two are the same point.
    pub positions: Vec<Vec3>,
    /// Corners of each of the mesh's triangles, numbered as the mesh numbers them; [`NONE`] thrice for one
    /// that shows nothing.
    pub triangles: Vec<[u32; 3]>,
    /// The triangle across the edge from corner k to k + 1; [`NONE`] at a boundary or non-manifold edge.
    pub neighbours: Vec<[u32; 3]>,
    /// For each triangle, bit k is set where the neighbour at k winds in the opposite sense.
    pub flips: Vec<u8>,
    /// All edges, by their smaller vertex.
    pub edges: Vec<Edge>,
    /// Closed bodies among the triangles.
    pub bodies: Bodies,
    /// Triangles, the smaller first, that meet along a part of an edge and go on as one surface.
    pub abutting: HashSet<[u32; 2], Mix>,
    /// Triangles that hide nothing if blended materials do not; empty where there are none.
    pub see_through: Vec<bool>,
    /// Opacity of each triangle; empty where no material blends.
    pub opacity: Vec<f32>,
    /// Ends of the runs of triangles with one material, and its colour, linear.
    colors: Vec<(u32, Vec3)>,
    /// A factor for each triangle; empty where there are none.
    tints: Vec<Vec3>,
}

impl Topology {
    /// Finds the edges of `mesh`. `marked` are pairs of its vertices. Cost: linear, and hashing of the
    /// positions.
    pub fn of(crew: Crew, scene: &Scene, mesh: &Mesh, marked: &[[u32; 2]]) -> Topology {
        let (positions, name) = weld(crew, &mesh.positions);
        let corner = |v: u32| name.as_ref().map_or(v, |n| n[v as usize]);
        let alphas = alphas(scene, mesh);
        let clear = clear(&alphas);
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        crew.extend(&mut triangles, mesh.triangles.len(), |i| {
            let t = mesh.triangles[i].map(corner);
            let shows = !clear.get(i).is_some_and(|&clear| clear);
            if shows && is_solid(t, &positions) { t } else { [NONE; 3] }
        });
        let mut normals = Vec::new();
        crew.extend(&mut normals, triangles.len(), |i| match triangles[i] {
            [NONE, ..] => Vec3::ZERO,
            t => across(t, &positions).normalize_or_zero().as_vec3(),
        });
        let mut topology = Topology {
            neighbours: Vec::new(),
            flips: Vec::new(),
            edges: Vec::new(),
            bodies: Bodies::default(),
            abutting: HashSet::default(),
            see_through: see_through(&alphas),
            opacity: opacity(&alphas),
            colors: colors(scene, mesh),
            tints: tints(mesh),
            positions,
            triangles,
        };
        let materials = materials(mesh);
        topology.find_edges(crew, &normals, &materials);
        if topology.drop_twins() {
            topology.find_edges(crew, &normals, &materials);
        }
        slivers::smooth(&mut topology, &mut normals);
        topology.bodies = Bodies::find(crew, &topology);
        junctions::mend(&mut topology, &normals, &materials);
        let marked: Vec<[u32; 2]> = marked.iter().map(|&[a, b]| [corner(a), corner(b)]).collect();
        topology.mark(&marked, &mesh.lines);
        topology
    }

    /// Colour of a triangle, linear, without its texture.
    pub fn color(&self, triangle: u32) -> Vec3 {
        let run = self.colors.partition_point(|c| c.0 <= triangle);
        let color = self.colors.get(run).map_or(Vec3::ONE, |c| c.1);
        color * self.tints.get(triangle as usize).copied().unwrap_or(Vec3::ONE)
    }

    /// Finds all edges, and who is whose neighbour.
    fn find_edges(&mut self, crew: Crew, normals: &[Vec3], materials: &[u32]) {
        let sorted = Sorted::new(crew, self.positions.len(), 1, &Sides(&self.triangles));
        let seams = Seams::new(&self.triangles, normals, materials);
        let found =
            crew.map(crew.shares(self.positions.len(), 1), |vertices| seams.edges_from(vertices, &sorted));
        (self.neighbours, self.flips) = seams.close();
        let mut found = found.into_iter();
        self.edges = found.next().unwrap_or_default();
        found.for_each(|more| self.edges.extend(more));
    }

    /// Marks edges: those between pairs of vertices, and those that lines run along. Other lines become edges
    /// without triangles.
    fn mark(&mut self, pairs: &[[u32; 2]], lines: &[[Vec3; 2]]) {
        if pairs.is_empty() && lines.is_empty() {
            return;
        }
        let mut wanted: HashSet<[u32; 2], Mix> = pairs.iter().map(|&[a, b]| ordered(a, b)).collect();
        let mut free: Vec<[u32; 2]> = Vec::new();
        if !lines.is_empty() {
            let mut numbers: HashMap<[u32; 3], u32, Mix> =
                self.positions.iter().enumerate().map(|(i, p)| (key(p), i as u32)).collect();
            for line in lines {
                let [a, b] = line.map(|p| {
                    *numbers.entry(key(&p)).or_insert_with(|| {
                        self.positions.push(p + 0.0);
                        self.positions.len() as u32 - 1
                    })
                });
                if a != b && wanted.insert(ordered(a, b)) {
                    free.push(ordered(a, b));
                }
            }
        }
        let mut found: HashSet<[u32; 2], Mix> = HashSet::default();
        for edge in self.edges.iter_mut().filter(|e| wanted.contains(&e.vertices)) {
            edge.traits |= trait_of::MARKED;
            found.insert(edge.vertices);
        }
        let loose = trait_of::MARKED | trait_of::LOOSE;
        let without = free.into_iter().filter(|v| !found.contains(v));
        self.edges.extend(without.map(|vertices| Edge {
            vertices,
            triangles: [NONE; 2],
            bend: 2.0,
            traits: loose,
        }));
    }

    /// Takes out triangles that have the same corners as another; whether there were any. Only where more
    /// than two triangles meet in an edge, or where two face each other folded flat, can there be twins.
    fn drop_twins(&mut self) -> bool {
        let suspect = |e: &Edge| {
            e.traits & trait_of::NON_MANIFOLD != 0
                || (e.triangles[1] != NONE && (e.bend > 1.9 || e.traits & trait_of::FLIPPED != 0))
        };
        if !self.edges.iter().any(suspect) {
            return false;
        }
        let mut known: HashMap<[u32; 3], (), Mix> = HashMap::default();
        let mut found = false;
        for t in &mut self.triangles {
            let mut key = *t;
            key.sort_unstable();
            if t[0] != NONE && known.insert(key, ()).is_some() {
                *t = [NONE; 3];
                found = true;
            }
        }
        found
    }
}

pub(super) fn ordered(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// 1 − cos of the angle between two normals, one of them turned round if it is `flipped`.
#[inline(always)]
pub(super) fn bend(m: Vec3, n: Vec3, flipped: bool) -> f32 {
    // From the difference, not from the product: that would lose small angles.
    let difference = if flipped { m + n } else { m - n };
    difference.length_squared() * 0.5
}

/// Twice the area of a triangle, along its normal.
#[inline(always)]
pub(super) fn across(t: [u32; 3], positions: &[Vec3]) -> DVec3 {
    let at = |v: u32| positions[v as usize].as_dvec3();
    let a = at(t[0]);
    (at(t[1]) - a).cross(at(t[2]) - a)
}

/// Whether a triangle's corners are three, and not on a line.
fn is_solid(t: [u32; 3], positions: &[Vec3]) -> bool {
    across(t, positions) != DVec3::ZERO && t[0] != t[1] && t[1] != t[2] && t[2] != t[0]
}

/// Equal for equal positions; zero has one sign.
fn key(p: &Vec3) -> [u32; 3] {
    (*p + 0.0).to_array().map(f32::to_bits)
}

/// Distinct positions, and for each vertex its position's number; `None` where all are distinct.
fn weld(crew: Crew, positions: &[Vec3]) -> (Vec<Vec3>, Option<Vec<u32>>) {
    let twins = twins(crew, positions);
    if twins.is_empty() {
        return (positions.iter().map(|p| *p + 0.0).collect(), None);
    }
    let mut name = vec![NONE; positions.len()];
    for (twin, first) in twins {
        name[twin as usize] = first;
    }
    let mut distinct = Vec::new();
    for (v, p) in positions.iter().enumerate() {
        name[v] = match name[v] {
            NONE => {
                distinct.push(*p + 0.0);
                distinct.len() as u32 - 1
            }
            first => name[first as usize],
        };
    }
    (distinct, Some(name))
}

/// Vertices at the same position as one before, and the first there.
fn twins(crew: Crew, positions: &[Vec3]) -> Vec<(u32, u32)> {
    let places = Hashed { positions, count: positions.len().div_ceil(4096).next_power_of_two() };
    let sorted = Sorted::new(crew, places.count, 1, &places);
    let found = crew.map_with(crew.ranges(places.count, 4), HashMap::default, |seen, cells| {
        let mut twins = Vec::new();
        for cell in cells {
            let seen: &mut HashMap<[u32; 3], u32, Mix> = seen;
            seen.clear();
            for &v in sorted.in_cell(cell) {
                let first = *seen.entry(key(&positions[v as usize])).or_insert(v);
                if first != v {
                    twins.push((v, first));
                }
            }
        }
        twins
    });
    found.concat()
}

/// Vertices in cells by a hash of their position; so few in each that a table of them fits the processor's caches.
struct Hashed<'a> {
    positions: &'a [Vec3],
    /// A power of two.
    count: usize,
}

impl Places for Hashed<'_> {
    #[inline(always)]
    fn visit(&self, cells: &Range<usize>, mut visit: impl FnMut(usize, usize)) {
        for (v, p) in self.positions.iter().enumerate() {
            // The table inside a cell uses the ends of the hash.
            let cell = (Mix.hash_one(key(p)) >> 20) as usize & (self.count - 1);
            if cells.contains(&cell) {
                visit(cell - cells.start, v);
            }
        }
    }
}

/// A fast hash for coordinates. A file made to collide slows itself down, and nothing else.
#[derive(Clone, Copy, Default)]
pub(super) struct Mix;

/// State of [`Mix`].
pub(super) struct Mixer(u64);

impl BuildHasher for Mix {
    type Hasher = Mixer;
    fn build_hasher(&self) -> Mixer {
        Mixer(0)
    }
}

impl std::hash::Hasher for Mixer {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }
    fn write_u32(&mut self, n: u32) {
        self.write_u64(u64::from(n));
    }
    fn write_u64(&mut self, n: u64) {
        self.0 = (self.0.rotate_left(23) ^ n).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    fn write_usize(&mut self, n: usize) {
        self.write_u64(n as u64);
    }
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 29)
    }
}

/// Material of each triangle; empty where all have the same.
fn materials(mesh: &Mesh) -> Vec<u32> {
    let of = |p: &crate::scene::Primitive| p.material.unwrap_or(NONE);
    let mut kinds = mesh.primitives.iter().map(of);
    let first = kinds.next();
    if kinds.all(|m| Some(m) == first) {
        return Vec::new();
    }
    mesh.primitives.iter().flat_map(|p| p.triangles.clone().map(move |_| of(p))).collect()
}

fn colors(scene: &Scene, mesh: &Mesh) -> Vec<(u32, Vec3)> {
    let of = |m: Option<u32>| m.map_or(Vec3::ONE, |m| scene.materials[m as usize].base_color.truncate());
    mesh.primitives.iter().map(|p| (p.triangles.end, of(p.material))).collect()
}

/// The mean of the corners' colours.
fn tints(mesh: &Mesh) -> Vec<Vec3> {
    if mesh.colors.is_empty() {
        return Vec::new();
    }
    let mean = |t: &[u32; 3]| t.iter().map(|&v| mesh.colors[v as usize].truncate()).sum::<Vec3>() / 3.0;
    mesh.triangles.iter().map(mean).collect()
}

/// Mean alpha of each triangle, without its texture; empty where all materials are opaque.
fn alphas(scene: &Scene, mesh: &Mesh) -> Vec<(AlphaMode, f32)> {
    let material = |m: Option<u32>| m.map(|m| &scene.materials[m as usize]);
    let is_opaque = |m: Option<u32>| material(m).is_none_or(|m| m.alpha == AlphaMode::Opaque);
    if mesh.primitives.iter().all(|p| is_opaque(p.material)) {
        return Vec::new();
    }
    let tint = |t: u32| match mesh.colors.is_empty() {
        true => 1.0,
        false => mesh.triangles[t as usize].iter().map(|&v| mesh.colors[v as usize].w).sum::<f32>() / 3.0,
    };
    let of_run = |p: &crate::scene::Primitive| {
        let (mode, alpha) =
            material(p.material).map_or((AlphaMode::Opaque, 1.0), |m| (m.alpha, m.base_color.w));
        p.triangles.clone().map(move |t| (mode, alpha * tint(t)))
    };
    mesh.primitives.iter().flat_map(of_run).collect()
}

fn see_through(alphas: &[(AlphaMode, f32)]) -> Vec<bool> {
    let blends = alphas.iter().map(|a| a.0 == AlphaMode::Blend);
    if blends.clone().any(|b| b) { blends.collect() } else { Vec::new() }
}

fn opacity(alphas: &[(AlphaMode, f32)]) -> Vec<f32> {
    if alphas.iter().all(|a| a.0 != AlphaMode::Blend) {
        return Vec::new();
    }
    let opacity = |a: &(AlphaMode, f32)| if a.0 == AlphaMode::Blend { a.1.clamp(0.0, 1.0) } else { 1.0 };
    alphas.iter().map(opacity).collect()
}

/// Triangles of which nothing shows, whatever their texture: wholly transparent, or below the cutoff of their
/// mask; empty where there are none.
fn clear(alphas: &[(AlphaMode, f32)]) -> Vec<bool> {
    let clear = |&(mode, alpha): &(AlphaMode, f32)| match mode {
        AlphaMode::Opaque => false,
        AlphaMode::Mask { cutoff } => alpha < cutoff,
        AlphaMode::Blend => alpha <= 0.0,
    };
    let all: Vec<bool> = alphas.iter().map(clear).collect();
    if all.contains(&true) { all } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Primitive;

    fn topology(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Topology {
        let mesh = Mesh {
            positions: positions.iter().map(|&p| p.into()).collect(),
            triangles: triangles.to_vec(),
            primitives: vec![Primitive { triangles: 0..triangles.len() as u32, material: None }],
            ..Mesh::default()
        };
        Topology::of(Crew { threads: 1 }, &Scene::new("t"), &mesh, &[[0, 1]])
    }

    #[test]
    fn a_split_square_has_five_edges_one_of_them_flat() {
        // The second triangle repeats its corners and winds the other way.
        let at = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        let t = topology(&at, &[[0, 1, 2], [5, 4, 3]]);
        assert_eq!((t.positions.len(), t.edges.len()), (4, 5));
        let inner: Vec<&Edge> = t.edges.iter().filter(|e| e.triangles[1] != NONE).collect();
        assert_eq!(inner.len(), 1);
        assert_eq!(inner[0].bend, 0.0);
        assert_eq!(inner[0].traits & trait_of::FLIPPED, trait_of::FLIPPED);
        assert_eq!(t.edges.iter().filter(|e| e.traits & trait_of::MARKED != 0).count(), 1);
    }

    #[test]
    fn three_triangles_at_an_edge_are_no_neighbours() {
        let at = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.]];
        let t = topology(&at, &[[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 0, 1]]);
        assert!(t.neighbours.iter().all(|n| *n == [NONE; 3]));
        assert_eq!(t.edges.iter().filter(|e| e.traits & trait_of::NON_MANIFOLD != 0).count(), 1);
        assert_eq!(t.triangles[3], [NONE; 3]);
    }
}
