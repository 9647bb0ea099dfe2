//! T-junctions: where the edge of one triangle meets those of others part of the way.
//!
//! A surface whose neighbours do not share whole edges (a long side against several short ones, bricks in a
//! bond) is continuous all the same. Boundary edges are cut at the corners of others that lie on them, and the
//! pieces that then coincide are joined into edges like any other: flat, bent or turning. Edges without such
//! a partner stay whole. A corner lies on an edge if it is no farther from it than rounding in `f32` puts it.

use super::ROUNDING;
use super::topology::{Edge, Mix, NONE, Topology, bend, ordered, trait_of};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Meshes whose boundary edges have more corners on them, on average, are left as they are: so many edges on
/// one line would be compared each with each.
const MOST_CORNERS: usize = 16;

/// A piece of a boundary edge, as a triangle has it.
#[derive(Clone, Copy)]
struct Half {
    triangle: u32,
    /// Whether the triangle runs from the smaller vertex to the larger.
    forward: bool,
    /// The edge that it is a piece of.
    edge: u32,
}

/// Joins the boundary edges that meet part of the way. `normals` are the triangles' unit normals; `materials`
/// what they are made of, or empty.
/// Cost: n log n in the boundary edges.
pub(super) fn mend(topology: &mut Topology, normals: &[Vec3], materials: &[u32]) {
    let rims: Vec<u32> = (0..topology.edges.len() as u32)
        .filter(|&e| topology.edges[e as usize].triangles[1] == NONE)
        .filter(|&e| topology.edges[e as usize].traits & trait_of::NON_MANIFOLD == 0)
        .collect();
    let Some(corners) = corners_on(topology, &rims) else { return };
    let mut pieces: HashMap<[u32; 2], Vec<Half>, Mix> = HashMap::default();
    let mut inner = &corners[..];
    for &rim in &rims {
        let count = inner.iter().take_while(|c| c.0 == rim).count();
        let (of_rim, rest) = inner.split_at(count);
        inner = rest;
        add_pieces(topology, rim, of_rim, &mut pieces);
    }
    // An edge is taken apart only if some piece of it meets another edge.
    let mut apart = vec![false; topology.edges.len()];
    for halves in pieces.values().filter(|h| h.len() > 1) {
        for half in halves {
            apart[half.edge as usize] = true;
        }
    }
    if !apart.contains(&true) {
        return;
    }
    let mut at = 0;
    topology.edges.retain(|_| {
        at += 1;
        !apart[at - 1]
    });
    let mut fresh = Vec::new();
    for (vertices, halves) in pieces {
        if apart[halves[0].edge as usize] {
            fresh.push(joined(topology, vertices, &halves, normals, materials));
        }
    }
    topology.edges.extend(fresh);
    topology.edges.sort_unstable_by_key(|e| e.vertices);
}

/// The corners that lie within boundary edges, by edge and along it: edge, place, vertex. `None` if there are
/// none, or far too many.
fn corners_on(topology: &Topology, rims: &[u32]) -> Option<Vec<(u32, f64, u32)>> {
    let at = |v: u32| topology.positions[v as usize].as_dvec3();
    let mut vertices: Vec<u32> = rims.iter().flat_map(|&e| topology.edges[e as usize].vertices).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let reach = vertices.iter().fold(0.0f64, |m, &v| m.max(at(v).abs().max_element()));
    let tolerance = reach * ROUNDING;
    let tree = Tree::new(vertices.iter().map(|&v| (at(v), v)).collect());
    let mut corners = Vec::new();
    for &rim in rims {
        let Edge { vertices: ends, triangles: [triangle, _], .. } = topology.edges[rim as usize];
        // The third corner of a sliver may lie on its own edge.
        let own = topology.triangles[triangle as usize];
        let [a, b] = ends.map(at);
        let step = b - a;
        let length = step.length();
        let first = corners.len();
        tree.near([a, b], tolerance, &mut |p, v| {
            let along = (p - a).dot(step) / length;
            let inside = along > tolerance && along < length - tolerance;
            if inside && !own.contains(&v) && (p - a).cross(step).length() <= tolerance * length {
                corners.push((rim, along, v));
            }
        });
        corners[first..].sort_unstable_by(|x, y| x.1.total_cmp(&y.1).then(x.2.cmp(&y.2)));
        if corners.len() > MOST_CORNERS * (rims.len() + 64) {
            return None;
        }
    }
    (!corners.is_empty()).then_some(corners)
}

/// Adds an edge, cut at the corners that lie on it.
fn add_pieces(
    topology: &Topology,
    rim: u32,
    corners: &[(u32, f64, u32)],
    pieces: &mut HashMap<[u32; 2], Vec<Half>, Mix>,
) {
    let Edge { vertices: [a, b], triangles: [triangle, _], .. } = topology.edges[rim as usize];
    let t = topology.triangles[triangle as usize];
    let along = (0..3).any(|k| t[k] == a && t[(k + 1) % 3] == b);
    let mut from = a;
    for to in corners.iter().map(|c| c.2).chain([b]) {
        let half = Half { triangle, forward: along == (from < to), edge: rim };
        pieces.entry(ordered(from, to)).or_default().push(half);
        from = to;
    }
}

/// The edge that some pieces at the same place are together.
fn joined(
    topology: &mut Topology,
    vertices: [u32; 2],
    halves: &[Half],
    normals: &[Vec3],
    materials: &[u32],
) -> Edge {
    let (a, b) = (halves[0].triangle, halves.get(1).map_or(NONE, |h| h.triangle));
    let mut edge = Edge { vertices, triangles: [a.min(b), a.max(b)], bend: 2.0, traits: trait_of::LOOSE };
    if halves.len() > 2 {
        edge.traits |= trait_of::NON_MANIFOLD;
    } else if b != NONE {
        let flipped = halves[0].forward == halves[1].forward;
        edge.bend = bend(normals[a as usize], normals[b as usize], flipped);
        edge.traits |= if flipped { trait_of::FLIPPED } else { 0 };
        if !materials.is_empty() && materials[a as usize] != materials[b as usize] {
            edge.traits |= trait_of::BORDER;
        }
    }
    for (i, one) in halves.iter().enumerate() {
        for other in &halves[i + 1..] {
            topology.abutting.insert(ordered(one.triangle, other.triangle));
        }
    }
    edge
}

/// Points in a tree of boxes.
struct Tree {
    points: Vec<(DVec3, u32)>,
    nodes: Vec<Node>,
}

struct Node {
    min: DVec3,
    max: DVec3,
    points: std::ops::Range<usize>,
    /// The second child; the first follows its parent. 0 for a leaf.
    second: usize,
}

impl Tree {
    fn new(points: Vec<(DVec3, u32)>) -> Tree {
        let mut tree = Tree { points, nodes: Vec::new() };
        tree.add(0..tree.points.len());
        tree
    }

    fn add(&mut self, range: std::ops::Range<usize>) {
        const LEAF: usize = 8;
        let points = &mut self.points[range.clone()];
        let min = points.iter().fold(DVec3::INFINITY, |m, p| m.min(p.0));
        let max = points.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(p.0));
        let node = self.nodes.len();
        self.nodes.push(Node { min, max, points: range.clone(), second: 0 });
        if range.len() <= LEAF {
            return;
        }
        let axis = (max - min).max_position();
        let half = range.len() / 2;
        points.select_nth_unstable_by(half, |p, q| p.0[axis].total_cmp(&q.0[axis]).then(p.1.cmp(&q.1)));
        self.add(range.start..range.start + half);
        self.nodes[node].second = self.nodes.len();
        self.add(range.start + half..range.end);
    }

    /// Calls `visit` for the points near a segment, and some others.
    fn near(&self, [a, b]: [DVec3; 2], distance: f64, visit: &mut impl FnMut(DVec3, u32)) {
        let step = b - a;
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let Some(node) = self.nodes.get(at) else { continue };
            let (mut from, mut to) = (0.0f64, 1.0f64);
            for axis in 0..3 {
                let (low, high) = (node.min[axis] - distance - a[axis], node.max[axis] + distance - a[axis]);
                if step[axis] == 0.0 {
                    if low > 0.0 || high < 0.0 {
                        to = -1.0;
                    }
                } else {
                    let (s, t) = (low / step[axis], high / step[axis]);
                    (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
                }
            }
            if from > to + 1e-9 {
                continue;
            }
            if node.second == 0 {
                self.points[node.points.clone()].iter().for_each(|&(p, v)| visit(p, v));
            } else {
                stack.extend([at + 1, node.second]);
            }
        }
    }
}
