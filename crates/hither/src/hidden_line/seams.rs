//! Which triangles of a mesh meet at which edge.
//!
//! The sides of all triangles are sorted by their smaller vertex (counting), then by the larger: runs of equal
//! ones are edges.

use super::grid::{Places, Sorted};
use super::topology::{Edge, NONE, bend, ordered, trait_of};
use glam::Vec3;
use std::ops::Range;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering::Relaxed};

/// The sides of triangles, by their smaller vertex. Side k of triangle t is 3t + k.
pub(super) struct Sides<'a>(pub &'a [[u32; 3]]);

impl Places for Sides<'_> {
    #[inline(always)]
    fn visit(&self, vertices: &Range<usize>, mut visit: impl FnMut(usize, usize)) {
        for (i, t) in self.0.iter().enumerate().filter(|(_, t)| t[0] != NONE) {
            for k in 0..3 {
                let low = t[k].min(t[(k + 1) % 3]) as usize;
                if vertices.contains(&low) {
                    visit(low - vertices.start, i * 3 + k);
                }
            }
        }
    }
}

/// A mesh whose edges are being found, by several threads.
pub(super) struct Seams<'a> {
    triangles: &'a [[u32; 3]],
    normals: &'a [Vec3],
    materials: &'a [u32],
    neighbours: Vec<[AtomicU32; 3]>,
    flips: Vec<AtomicU8>,
}

impl<'a> Seams<'a> {
    pub fn new(triangles: &'a [[u32; 3]], normals: &'a [Vec3], materials: &'a [u32]) -> Seams<'a> {
        let alone = || [(); 3].map(|()| AtomicU32::new(NONE));
        Seams {
            triangles,
            normals,
            materials,
            neighbours: triangles.iter().map(|_| alone()).collect(),
            flips: triangles.iter().map(|_| AtomicU8::new(0)).collect(),
        }
    }

    /// The edges whose smaller vertex is among these, in order.
    pub fn edges_from(&self, vertices: Range<usize>, sorted: &Sorted) -> Vec<Edge> {
        let sides = vertices.clone().map(|v| sorted.in_cell(v).len()).sum::<usize>();
        let mut edges = Vec::with_capacity(sides / 2 + sides / 16);
        let mut run: Vec<(u32, u32)> = Vec::new();
        for low in vertices {
            run.clear();
            run.extend(sorted.in_cell(low).iter().map(|&side| (self.larger(side), side)));
            run.sort_unstable();
            for same in run.chunk_by(|a, b| a.0 == b.0) {
                edges.push(self.edge([low as u32, same[0].0], same));
            }
        }
        edges
    }

    /// The larger vertex of a side.
    #[inline]
    fn larger(&self, side: u32) -> u32 {
        let t = self.triangles[side as usize / 3];
        let k = side as usize % 3;
        ordered(t[k], t[(k + 1) % 3])[1]
    }

    fn edge(&self, vertices: [u32; 2], sides: &[(u32, u32)]) -> Edge {
        let triangle = |at: usize| sides.get(at).map_or(NONE, |s| s.1 / 3);
        let (a, b) = (triangle(0), triangle(1));
        let mut edge = Edge { vertices, triangles: [a, b], bend: 2.0, traits: 0 };
        if sides.len() > 2 {
            edge.traits |= trait_of::NON_MANIFOLD;
        } else if b != NONE {
            let (ka, kb) = (sides[0].1 as usize % 3, sides[1].1 as usize % 3);
            let forward = |t: u32, k: usize| self.triangles[t as usize][k] == vertices[0];
            let flipped = forward(a, ka) == forward(b, kb);
            edge.bend = bend(self.normals[a as usize], self.normals[b as usize], flipped);
            if !self.materials.is_empty() && self.materials[a as usize] != self.materials[b as usize] {
                edge.traits |= trait_of::BORDER;
            }
            self.neighbours[a as usize][ka].store(b, Relaxed);
            self.neighbours[b as usize][kb].store(a, Relaxed);
            if flipped {
                edge.traits |= trait_of::FLIPPED;
                self.flips[a as usize].fetch_or(1 << ka, Relaxed);
                self.flips[b as usize].fetch_or(1 << kb, Relaxed);
            }
        }
        edge
    }

    /// Each triangle's neighbours, and which of them wind in the opposite sense, bit k for side k.
    pub fn close(self) -> (Vec<[u32; 3]>, Vec<u8>) {
        let neighbours = self.neighbours.into_iter().map(|n| n.map(AtomicU32::into_inner)).collect();
        (neighbours, self.flips.into_iter().map(AtomicU8::into_inner).collect())
    }
}
