//! What does not change with the view: a mesh's edges, and which triangles meet at each.
//!
//! Vertices with the same position are one vertex here, whatever their normals and colours, so that a seam
//! of texture coordinates is no boundary. Triangles without area are left out, and those that are wholly
//! transparent: they show nothing and hide nothing.

use super::bodies::Bodies;
use super::junctions;
use crate::scene::{AlphaMode, Mesh, Scene};
use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};

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
    /// positions where some occur twice.
    pub fn of(scene: &Scene, mesh: &Mesh, marked: &[[u32; 2]]) -> Topology {
        let (positions, name) = weld(&mesh.positions);
        let corner = |v: u32| name.as_ref().map_or(v, |n| n[v as usize]);
        let mut triangles = Vec::with_capacity(mesh.triangles.len());
        let mut normals = Vec::with_capacity(mesh.triangles.len());
        let alphas = alphas(scene, mesh);
        let clear = clear(&alphas);
        for (i, t) in mesh.triangles.iter().enumerate() {
            let (mut t, normal) = solid(t.map(corner), &positions);
            if clear.get(i).is_some_and(|&clear| clear) {
                t = [NONE; 3];
            }
            triangles.push(t);
            normals.push(normal);
        }
        let mut topology = Topology {
            neighbours: vec![[NONE; 3]; triangles.len()],
            flips: vec![0; triangles.len()],
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
        topology.find_edges(&normals, &materials);
        if topology.drop_twins() {
            topology.edges.clear();
            topology.neighbours.fill([NONE; 3]);
            topology.flips.fill(0);
            topology.find_edges(&normals, &materials);
        }
        topology.bodies =
            Bodies::find(&topology.positions, &topology.triangles, &topology.neighbours, &topology.flips);
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

    /// Half-edges sorted by their smaller vertex (counting), then by the larger: runs are edges.
    fn find_edges(&mut self, normals: &[Vec3], materials: &[u32]) {
        let mut starts = vec![0u32; self.positions.len() + 1];
        let sides = |t: &[u32; 3]| [ordered(t[0], t[1]), ordered(t[1], t[2]), ordered(t[2], t[0])];
        for t in self.triangles.iter().filter(|t| t[0] != NONE) {
            for [low, _] in sides(t) {
                starts[low as usize + 1] += 1;
            }
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut halves = vec![(0u32, 0u32); starts[self.positions.len()] as usize];
        let mut next = starts.clone();
        for (i, t) in self.triangles.iter().enumerate().filter(|(_, t)| t[0] != NONE) {
            for (k, [low, high]) in sides(t).into_iter().enumerate() {
                let at = &mut next[low as usize];
                halves[*at as usize] = (high, (i * 3 + k) as u32);
                *at += 1;
            }
        }
        self.edges.reserve_exact(halves.len() / 2 + halves.len() / 16);
        for low in 0..self.positions.len() {
            let run = &mut halves[starts[low] as usize..starts[low + 1] as usize];
            run.sort_unstable();
            let mut rest = &run[..];
            while let Some(&(high, _)) = rest.first() {
                let count = rest.iter().take_while(|h| h.0 == high).count();
                let (same, others) = rest.split_at(count);
                self.add_edge([low as u32, high], same, normals, materials);
                rest = others;
            }
        }
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

    fn add_edge(&mut self, vertices: [u32; 2], halves: &[(u32, u32)], normals: &[Vec3], materials: &[u32]) {
        let triangle = |at: usize| halves.get(at).map_or(NONE, |h| h.1 / 3);
        let (a, b) = (triangle(0), triangle(1));
        let mut edge = Edge { vertices, triangles: [a, b], bend: 2.0, traits: 0 };
        if halves.len() > 2 {
            edge.traits |= trait_of::NON_MANIFOLD;
        } else if b != NONE {
            let (ka, kb) = (halves[0].1 % 3, halves[1].1 % 3);
            let forward = |t: u32, k: u32| self.triangles[t as usize][k as usize] == vertices[0];
            let flipped = forward(a, ka) == forward(b, kb);
            let sign = if flipped { -1.0 } else { 1.0 };
            // From the difference, not from the product: that would lose small angles.
            edge.bend = (normals[a as usize] - sign * normals[b as usize]).length_squared() * 0.5;
            edge.traits |= if flipped { trait_of::FLIPPED } else { 0 };
            if !materials.is_empty() && materials[a as usize] != materials[b as usize] {
                edge.traits |= trait_of::BORDER;
            }
            self.neighbours[a as usize][ka as usize] = b;
            self.neighbours[b as usize][kb as usize] = a;
            self.flips[a as usize] |= u8::from(flipped) << ka;
            self.flips[b as usize] |= u8::from(flipped) << kb;
        }
        self.edges.push(edge);
    }
}

pub(super) fn ordered(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The corners, or [`NONE`] where they lie on a line or two are the same; and the unit normal, or zero.
fn solid(t: [u32; 3], positions: &[Vec3]) -> ([u32; 3], Vec3) {
    let [a, b, c] = t.map(|v| positions[v as usize].as_dvec3());
    let normal = (b - a).cross(c - a);
    if normal == DVec3::ZERO || t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
        return ([NONE; 3], Vec3::ZERO);
    }
    (t, normal.normalize_or_zero().as_vec3())
}

/// Equal for equal positions; zero has one sign.
fn key(p: &Vec3) -> [u32; 3] {
    (*p + 0.0).to_array().map(f32::to_bits)
}

/// Distinct positions, and for each vertex its position's number; `None` where all are distinct.
fn weld(positions: &[Vec3]) -> (Vec<Vec3>, Option<Vec<u32>>) {
    // Sorting what is distinct anyway would cost more than drawing it: look for twins in a table of
    // fingerprints first.
    let mut seen: HashMap<[u32; 3], u32, Mix> = HashMap::with_capacity_and_hasher(positions.len(), Mix);
    let mut distinct = Vec::with_capacity(positions.len());
    let mut name = Vec::with_capacity(positions.len());
    for p in positions {
        let fresh = distinct.len() as u32;
        let found = *seen.entry(key(p)).or_insert(fresh);
        if found == fresh {
            distinct.push(*p + 0.0);
        }
        name.push(found);
    }
    let changed = distinct.len() != positions.len();
    (distinct, changed.then_some(name))
}

/// A fast hash for coordinates. A file made to collide slows itself down, and nothing else.
#[derive(Clone, Copy, Default)]
pub(super) struct Mix;

/// State of [`Mix`].
pub(super) struct Mixer(u64);

impl std::hash::BuildHasher for Mix {
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
        Topology::of(&Scene::new("t"), &mesh, &[[0, 1]])
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
