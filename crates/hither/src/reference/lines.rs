//! Which points of which lines are seen: every edge and every meeting of two triangles, sampled densely, each
//! sample judged by a ray against every triangle.
//!
//! Nothing is sorted, stored or left out, and topology is found by comparing positions. Cost: lines × samples
//! × triangles, and the square of the triangles. Surfaces hide whichever side is seen, as in a line drawing.

use crate::conventions::{Projection, View};
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// A point nearer to a triangle's outline than this part of its size is not judged.
const OUTLINE: f64 = 1e-6;

/// What a ray says of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is in front.
    Visible,
    /// So many triangles are in front.
    Hidden(u32),
    /// Too near to an outline, or to a surface, to be told.
    Unsure,
}

/// A line in view space, and the triangles that it is part of.
#[derive(Clone, Debug)]
pub struct Line {
    /// Its ends, clipped to what the view shows of depth.
    pub ends: [DVec3; 2],
    own: Vec<usize>,
}

/// All triangles and lines of a scene, in view space.
pub struct LineOracle {
    projection: Projection,
    scale: f64,
    middle: DVec2,
    tolerance: f64,
    triangles: Vec<([DVec3; 3], usize)>,
}

impl LineOracle {
    /// Collects the triangles. What is nearer than `tolerance`, metres, is at the same place.
    pub fn new(scene: &Scene, view: &View, tolerance: f64) -> LineOracle {
        let mut triangles = Vec::new();
        for (part, instance) in scene.instances().iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh as usize];
            let map = view.view_from_world * instance.world_from_mesh;
            for t in &mesh.triangles {
                let at = |v: u32| mesh.positions[v as usize].as_dvec3();
                let flat = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])) == DVec3::ZERO;
                if !flat {
                    triangles.push((t.map(|v| map.transform_point3(at(v))), part));
                }
            }
        }
        let middle = DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5;
        LineOracle {
            projection: view.projection,
            scale: view.pixels_per_unit(),
            middle,
            tolerance,
            triangles,
        }
    }

    /// Every edge that is not between two neighbours in a plane (normals within `flat` radians).
    pub fn edges(&self, flat: f64) -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        for (i, (t, part)) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let ends = [t[k], t[(k + 1) % 3]];
                let shares = |other: &&(usize, &([DVec3; 3], usize))| {
                    let (_, (corners, theirs)) = other;
                    theirs == part && ends.iter().all(|e| corners.contains(e))
                };
                let own: Vec<usize> =
                    self.triangles.iter().enumerate().filter(|o| shares(&o)).map(|(j, _)| j).collect();
                if own[0] != i {
                    continue;
                }
                if own.len() == 2 && self.is_flat(own[0], own[1], flat) {
                    continue;
                }
                lines.extend(self.clipped(ends, own));
            }
        }
        lines
    }

    /// Every segment in which two triangles meet that share no edge and are not in one plane.
    pub fn meetings(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        for i in 0..self.triangles.len() {
            for j in 0..i {
                let (a, b) = (&self.triangles[i], &self.triangles[j]);
                let shared = a.0.iter().filter(|c| b.0.contains(c)).count();
                if a.1 == b.1 && shared > 1 {
                    continue;
                }
                if let Some(ends) = meeting(&a.0, &b.0, self.tolerance) {
                    lines.extend(self.clipped(ends, vec![i, j]));
                }
            }
        }
        lines
    }

    fn is_flat(&self, a: usize, b: usize, flat: f64) -> bool {
        let normal = |t: usize| {
            let [p, q, r] = self.triangles[t].0;
            (q - p).cross(r - p).normalize_or_zero()
        };
        let (m, n) = (normal(a), normal(b));
        // Of neighbours that wind differently the normals are opposed; folded back is told by the corners.
        let corners = |t: usize| self.triangles[t].0;
        let lone = |t: usize, o: usize| corners(t).into_iter().find(|c| !corners(o).contains(c));
        let (Some(p), Some(q)) = (lone(a, b), lone(b, a)) else { return false };
        let shared: Vec<DVec3> = corners(a).into_iter().filter(|c| corners(b).contains(c)).collect();
        let axis = (shared[1] - shared[0]).normalize_or_zero();
        let aside = |c: DVec3| (c - shared[0]) - axis * (c - shared[0]).dot(axis);
        m.cross(n).length() < flat && aside(p).dot(aside(q)) < 0.0
    }

    /// The part of a line within the view's range of depth.
    fn clipped(&self, mut ends: [DVec3; 2], own: Vec<usize>) -> Option<Line> {
        let (near, far) = match self.projection {
            Projection::Perspective { near, .. } => (near, f64::INFINITY),
            Projection::Orthographic { near, far, .. } => (near, far),
        };
        for (limit, sign) in [(near, 1.0), (far, -1.0)] {
            let side = |p: DVec3| (-p.z - limit) * sign;
            if limit.is_infinite() {
                continue;
            }
            let (a, b) = (side(ends[0]), side(ends[1]));
            if a < 0.0 && b < 0.0 {
                return None;
            }
            let cut = ends[0] + (ends[1] - ends[0]) * (a / (a - b));
            if a < 0.0 {
                ends[0] = cut;
            } else if b < 0.0 {
                ends[1] = cut;
            }
        }
        Some(Line { ends, own })
    }

    /// Where a point is drawn, pixels.
    pub fn on_paper(&self, p: DVec3) -> DVec2 {
        let scale = match self.projection {
            Projection::Perspective { .. } => self.scale / -p.z,
            Projection::Orthographic { .. } => self.scale,
        };
        self.middle + DVec2::new(p.x, -p.y) * scale
    }

    /// What is seen at a point of the paper: the part, or `None` inside for nothing; `None` outside if it is
    /// too near to an outline, or to a tie in depth, to be told. A tie goes to the smaller part.
    pub fn seen_at(&self, p: DVec2) -> Option<Option<u32>> {
        let across = (p - self.middle) / self.scale;
        let (origin, direction, near, far) = match self.projection {
            Projection::Perspective { near, .. } => {
                (DVec3::ZERO, DVec3::new(across.x, -across.y, -1.0).normalize(), near, f64::INFINITY)
            }
            Projection::Orthographic { near, far, .. } => {
                (DVec3::new(across.x, -across.y, 0.0), DVec3::NEG_Z, near, far)
            }
        };
        let mut hits: Vec<(f64, f64, u32)> = Vec::new();
        let mut unsure_from = f64::INFINITY;
        for (t, part) in &self.triangles {
            let Some((at, inside)) = pierce(t, origin, direction) else { continue };
            let depth = -(origin + direction * at).z;
            if inside < -OUTLINE || depth < near * (1.0 - 1e-9) || depth > far {
                continue;
            }
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
            let slack = self.tolerance / n.dot(direction).abs().max(1e-3);
            if inside < OUTLINE || depth < near * (1.0 + 1e-9) {
                unsure_from = unsure_from.min(at - 2.0 * slack);
            } else {
                hits.push((at, slack, *part as u32));
            }
        }
        let Some(first) = hits.iter().map(|h| h.0).min_by(f64::total_cmp) else {
            return if unsure_from.is_finite() { None } else { Some(None) };
        };
        if unsure_from < first {
            return None;
        }
        let mut part = u32::MAX;
        for (at, slack, theirs) in &hits {
            let apart = at - first;
            if apart <= 0.5 * slack {
                part = part.min(*theirs);
            } else if apart < 2.0 * slack {
                return None;
            }
        }
        Some(Some(part))
    }

    /// Looks at the point at `u`, 0 to 1, of a line.
    pub fn look(&self, line: &Line, u: f64) -> Verdict {
        let point = line.ends[0].lerp(line.ends[1], u);
        let (eye, near, far) = match self.projection {
            Projection::Perspective { near, .. } => (None, near, f64::INFINITY),
            Projection::Orthographic { near, far, .. } => (Some(()), near, far),
        };
        // Lines of sight: from the eye, or parallel. Both in metres along `direction`.
        let (origin, direction) = match eye {
            None => (DVec3::ZERO, point.normalize()),
            Some(()) => (DVec3::new(point.x, point.y, 0.0), DVec3::NEG_Z),
        };
        let distance = (point - origin).dot(direction);
        let (mut covers, mut unsure) = (0, false);
        for (i, (t, _)) in self.triangles.iter().enumerate() {
            if line.own.contains(&i) {
                continue;
            }
            let Some((at, inside)) = pierce(t, origin, direction) else { continue };
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
            let apart = (distance - at) * n.dot(direction).abs().max(1e-3);
            let depth = -(origin + direction * at).z;
            if inside < -OUTLINE || apart < 0.5 * self.tolerance || depth > far {
                continue;
            }
            if depth < near {
                unsure |= depth > near * (1.0 - 1e-9);
                continue;
            }
            if inside > OUTLINE && apart > 2.0 * self.tolerance {
                covers += 1;
            } else {
                unsure = true;
            }
        }
        match (covers, unsure) {
            (_, true) => Verdict::Unsure,
            (0, false) => Verdict::Visible,
            (n, false) => Verdict::Hidden(n),
        }
    }
}

/// Where a ray meets a triangle's plane, and how far inside the triangle (smallest barycentric coordinate).
/// Seen nearly edge-on, it is taken as met on its outline wherever the ray comes near it.
fn pierce(t: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
    let n = (t[1] - t[0]).cross(t[2] - t[0]);
    let across = n.dot(direction);
    if across == 0.0 {
        return None;
    }
    let at = n.dot(t[0] - origin) / across;
    let p = origin + direction * at;
    let area = n.length_squared();
    let inside = (0..3).map(|k| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        (b - a).cross(p - a).dot(n) / area
    });
    let inside = inside.fold(f64::INFINITY, f64::min);
    let edge_on = across.abs() / n.length() < 1e-6;
    Some((at, if edge_on && inside > -1e-2 { 0.0 } else { inside }))
}

/// The segment in which two triangles meet.
fn meeting(a: &[DVec3; 3], b: &[DVec3; 3], tolerance: f64) -> Option<[DVec3; 2]> {
    let normal = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
    let (m, n) = (normal(a), normal(b));
    let axis = m.cross(n);
    if axis.length() < 1e-7 {
        return None;
    }
    let axis = axis.normalize();
    // Of each triangle: the smallest and the largest place along the axis where it is in the other's plane.
    let reach = |t: &[DVec3; 3], point: DVec3, normal: DVec3| -> Option<[DVec3; 2]> {
        let side = |p: DVec3| {
            let s = normal.dot(p - point);
            if s.abs() <= tolerance { 0.0 } else { s }
        };
        let mut at: Vec<DVec3> = t.iter().copied().filter(|&p| side(p) == 0.0).collect();
        for k in 0..3 {
            let (p, q) = (t[k], t[(k + 1) % 3]);
            if side(p) * side(q) < 0.0 {
                at.push(p + (q - p) * (side(p) / (side(p) - side(q))));
            }
        }
        if at.len() == 3 && at.iter().all(|&p| t.contains(&p)) {
            return None;
        }
        at.sort_by(|p, q| p.dot(axis).total_cmp(&q.dot(axis)));
        Some([*at.first()?, *at.last()?])
    };
    let (of_a, of_b) = (reach(a, b[0], n)?, reach(b, a[0], m)?);
    let from = if of_a[0].dot(axis) > of_b[0].dot(axis) { of_a[0] } else { of_b[0] };
    let to = if of_a[1].dot(axis) < of_b[1].dot(axis) { of_a[1] } else { of_b[1] };
    ((to - from).dot(axis) > tolerance).then_some([from, to])
}
