//! What may hide: convex polygons as large as coplanar neighbours allow, and how they hang together.
//!
//! Edges are *winged* [Baumgart 1975; Coorg & Teller 1996, §2]: an edge knows the occluders on it and in
//! which direction each has it, an occluder knows its edges in order, which gives the next and the last
//! edge round it. Any number of occluders may meet at an edge, so that nothing need be a manifold.
//!
//! An occluder need not be quite flat nor quite convex. It is a set of triangles with one outline, and all
//! that is used of it is: each triangle turns the same side to the eye (checked triangle by triangle), the
//! outline bounds them, and they lie between two parallel planes.

use super::ROUNDING;
use super::merge::{Cell, merge, sides};
use super::model::PolygonModel;
use crate::geometry::Aabb;
use glam::DVec3;
use std::collections::HashMap;

/// Static occluders of a model.
#[derive(Clone, Debug, Default)]
pub(super) struct Occluders {
    /// Vertices: the model's, then those of virtual occluders.
    pub vertices: Vec<DVec3>,
    pub all: Vec<Occluder>,
    /// Sides of all occluders; an occluder has a run.
    pub sides: Vec<Side>,
    /// Edges of all sides; a side has a run.
    pub loops: Vec<LoopEdge>,
    /// Triangles of all occluders; an occluder has a run.
    pub triangles: Vec<[u32; 3]>,
    edge_numbers: HashMap<(u32, u32), u32>,
}

/// A nearly flat, nearly convex polygon.
#[derive(Clone, Debug)]
pub(super) struct Occluder {
    pub double_sided: bool,
    /// Unit normal of its front.
    pub normal: DVec3,
    /// Least and greatest `normal · v` of its vertices.
    pub slab: [f64; 2],
    /// Middle, and area times normal.
    pub centre: DVec3,
    pub area: DVec3,
    pub bounds: Aabb,
    /// Runs in [`Occluders::sides`] and [`Occluders::triangles`].
    pub sides: (u32, u32),
    pub triangles: (u32, u32),
    /// For a virtual occluder, the box around the solid that it stands in: it hides only from outside.
    pub solid: Option<Aabb>,
}

/// A straight stretch of an outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub from: u32,
    pub to: u32,
    /// Run in [`Occluders::loops`].
    pub edges: (u32, u32),
}

/// An edge as an occluder has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopEdge {
    /// Number of the edge, the same for all occluders on it.
    pub edge: u32,
    /// Whether the occluder has it from the smaller vertex to the larger.
    pub forward: bool,
}

/// An outline of more straight stretches is not used.
pub(super) const MOST_SIDES: usize = 32;

impl Occluders {
    /// The opaque polygons of `model`, coplanar neighbours joined.
    pub fn new(model: &PolygonModel) -> Occluders {
        let mut made = Occluders { vertices: model.vertices.clone(), ..Occluders::default() };
        let (mut cells, mut polygons, mut turned) = (Vec::new(), Vec::new(), Vec::new());
        for (number, polygon) in model.polygons().iter().enumerate() {
            let mut corners = model.corner_numbers(number as u32).to_vec();
            let area = area(&made.vertices, &corners);
            let Some(normal) = area.try_normalize().filter(|_| polygon.opaque && is_simple(&corners)) else {
                continue;
            };
            // Two-sided neighbours may be wound either way: turn them all towards the same half of space.
            let turn = polygon.double_sided && normal.dot(DVec3::new(0.81, 0.53, 0.25)) < 0.0;
            if turn {
                corners.reverse();
            }
            let normal = if turn { -normal } else { normal };
            cells.push(Cell { corners, normal, kind: u64::from(polygon.double_sided) });
            polygons.push(number as u32);
            turned.push(turn);
        }
        let kinds: Vec<u64> = cells.iter().map(|c| c.kind).collect();
        for outline in merge(&model.vertices, cells) {
            let mut triangles = Vec::new();
            for &cell in &outline.members {
                let of_cell = model.triangles(polygons[cell as usize]).iter();
                let turn = turned[cell as usize];
                triangles.extend(of_cell.map(|&[a, b, c]| if turn { [a, c, b] } else { [a, b, c] }));
            }
            made.push(&outline.corners, &triangles, kinds[outline.members[0] as usize] == 1, None);
        }
        made
    }

    /// Adds an occluder, unless its outline is too ragged to be of use.
    pub fn push(&mut self, corners: &[u32], triangles: &[[u32; 3]], double_sided: bool, solid: Option<Aabb>) {
        let area = area(&self.vertices, corners);
        let Some(normal) = area.try_normalize() else { return };
        let stretches = straight(&self.vertices, corners);
        if stretches.len() > MOST_SIDES {
            return;
        }
        let (first_side, first_triangle) = (self.sides.len() as u32, self.triangles.len() as u32);
        for stretch in stretches {
            let first = self.loops.len() as u32;
            for pair in stretch.windows(2) {
                let (low, high) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
                let next = self.edge_numbers.len() as u32;
                let edge = *self.edge_numbers.entry((low, high)).or_insert(next);
                self.loops.push(LoopEdge { edge, forward: pair[0] == low });
            }
            let edges = (first, self.loops.len() as u32);
            self.sides.push(Side { from: stretch[0], to: stretch[stretch.len() - 1], edges });
        }
        self.triangles.extend(triangles);
        let points = || corners.iter().map(|&v| self.vertices[v as usize]);
        let heights = points().map(|p| p.dot(normal));
        let slab = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
        let bounds = Aabb::around(points());
        self.all.push(Occluder {
            double_sided,
            normal,
            slab,
            centre: points().sum::<DVec3>() / corners.len() as f64,
            area,
            bounds,
            sides: (first_side, self.sides.len() as u32),
            triangles: (first_triangle, self.triangles.len() as u32),
            solid,
        });
    }

    /// Whether every triangle of an occluder turns its front (`side` 1) or its back (−1) to all eyes
    /// within `reach` of `eye`.
    pub fn faces(&self, occluder: &Occluder, side: f64, eye: DVec3, reach: f64) -> bool {
        // The eye is above the whole slab that the triangles lie in …
        let height = eye.dot(occluder.normal) * side;
        let top = if side > 0.0 { occluder.slab[1] } else { -occluder.slab[0] };
        let size =
            eye.abs().max_element() + occluder.bounds.min.abs().max(occluder.bounds.max.abs()).max_element();
        if height <= top + reach + ROUNDING * size {
            return false;
        }
        // … and above the plane of each.
        let (first, end) = occluder.triangles;
        self.triangles[first as usize..end as usize].iter().all(|t| {
            let [a, b, c] = t.map(|v| self.vertices[v as usize]);
            let n = (b - a).cross(c - a);
            let (height, size) = ((eye - a).dot(n) * side, n.length());
            // The cross product and the inner product each round; so did the vertices.
            let scale = (b - a).length() * (c - a).length();
            height > reach * size + ROUNDING * scale * ((eye - a).length() + a.abs().max_element())
        })
    }
}

/// Twice used: half the sum of cross products, whatever the origin.
fn area(points: &[DVec3], corners: &[u32]) -> DVec3 {
    let origin = points[corners[0] as usize];
    let half_cross =
        |(a, b): (u32, u32)| (points[a as usize] - origin).cross(points[b as usize] - origin) * 0.5;
    sides(corners).map(half_cross).sum()
}

/// Whether no vertex comes twice (vertices in the same place are one here).
fn is_simple(corners: &[u32]) -> bool {
    let mut sorted = corners.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

/// The outline cut at its bends: runs of vertices that lie in a straight line to within rounding.
fn straight(points: &[DVec3], corners: &[u32]) -> Vec<Vec<u32>> {
    let n = corners.len();
    let bends = |i: usize| {
        let [a, b, c] = [i + n - 1, i, i + 1].map(|k| points[corners[k % n] as usize]);
        let (back, on) = (b - a, c - b);
        back.dot(on) <= 0.0 || back.cross(on).length() > 1e-14 * back.length() * on.length()
    };
    let bends: Vec<usize> = (0..n).filter(|&i| bends(i)).collect();
    if bends.len() < 3 {
        return sides(corners).map(|(a, b)| vec![a, b]).collect();
    }
    let stretch = |k: usize| {
        let (from, to) = (bends[k], bends[(k + 1) % bends.len()]);
        let to = if to > from { to } else { to + n };
        (from..=to).map(|i| corners[i % n]).collect()
    };
    (0..bends.len()).map(stretch).collect()
}
