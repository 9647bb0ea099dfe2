//! Which points of which lines are seen: every edge and every meeting of two triangles, sampled densely, each
//! sample judged by a ray against every triangle.
//!
//! Nothing is sorted, stored or left out, and topology is found by comparing positions. Cost: lines × samples
//! × triangles, and the square of the triangles. Surfaces hide whichever side is seen, as in a line drawing.

use crate::conventions::{Projection, View};
use crate::scene::Scene;
use glam::{DAffine3, DVec2, DVec3};

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
    /// What rounding makes of a coordinate, as a part of it.
    rounding: f64,
    world_from_view: DAffine3,
    triangles: Vec<([DVec3; 3], usize)>,
    /// The number of each triangle in its mesh.
    numbers: Vec<u32>,
    /// The model's own lines.
    lines: Vec<[DVec3; 2]>,
}

impl LineOracle {
    /// Collects the triangles. What is nearer than `tolerance`, metres, is at the same place where the scene's
    /// coordinates are largest; elsewhere it is as much less as the coordinates are.
    pub fn new(scene: &Scene, view: &View, tolerance: f64) -> LineOracle {
        let (mut triangles, mut numbers, mut lines) = (Vec::new(), Vec::new(), Vec::new());
        for (part, instance) in scene.instances().iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh as usize];
            let map = view.view_from_world * instance.world_from_mesh;
            lines.extend(mesh.lines.iter().map(|l| l.map(|p| map.transform_point3(p.as_dvec3()))));
            for (number, t) in mesh.triangles.iter().enumerate() {
                let at = |v: u32| mesh.positions[v as usize].as_dvec3();
                let flat = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])) == DVec3::ZERO;
                if !flat {
                    triangles.push((t.map(|v| map.transform_point3(at(v))), part));
                    numbers.push(number as u32);
                }
            }
        }
        let middle = DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5;
        let reach = scene.bounds().map_or(1.0, |b| b.min.abs().max(b.max.abs()).max_element());
        LineOracle {
            projection: view.projection,
            scale: view.pixels_per_unit(),
            middle,
            tolerance,
            rounding: tolerance / reach,
            world_from_view: view.view_from_world.inverse(),
            triangles,
            numbers,
            lines,
        }
    }

    /// What counts as the same place at a point near a triangle: rounding of the point's coordinates, and of
    /// those of the corners as far as it moves the triangle's plane.
    fn tolerance_at(&self, t: &[DVec3; 3], p: DVec3) -> f64 {
        let world = |p: DVec3| self.world_from_view.transform_point3(p).abs();
        let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        let n = self.world_from_view.transform_vector3(n).abs();
        let of_plane = t.iter().map(|&c| world(c).dot(n)).fold(0.0, f64::max);
        (self.rounding * of_plane.max(world(p).max_element())).min(self.tolerance)
    }

    /// Every edge that is not between two neighbours in a plane (normals within `flat` radians), and the
    /// model's own lines. Of boundaries that meet part of the way, the pieces.
    pub fn edges(&self, flat: f64) -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        let mut rims: Vec<([DVec3; 2], usize)> = Vec::new();
        for (i, (t, part)) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let ends = [t[k], t[(k + 1) % 3]];
                let shares = |other: &&(usize, &([DVec3; 3], usize))| {
                    let (_, (corners, theirs)) = other;
                    theirs == part && ends.iter().all(|e| corners.contains(e))
                };
                let own: Vec<usize> =
                    self.triangles.iter().enumerate().filter(|o| shares(&o)).map(|(j, _)| j).collect();
                match own.len() {
                    1 => rims.push((ends, i)),
                    _ if own[0] != i => {}
                    2 if self.is_flat(ends, own[0], own[1], flat) => {}
                    _ => lines.extend(self.clipped(ends, own)),
                }
            }
        }
        self.add_boundaries(&rims, flat, &mut lines);
        lines.extend(self.lines.iter().filter_map(|&ends| self.clipped(ends, Vec::new())));
        lines
    }

    /// Boundary edges, each with its triangle: whole where nothing of them meets another, else in pieces.
    fn add_boundaries(&self, rims: &[([DVec3; 2], usize)], flat: f64, lines: &mut Vec<Line>) {
        let part = |t: usize| self.triangles[t].1;
        let mut pieces: Vec<([DVec3; 2], usize, usize)> = Vec::new();
        for (r, &([a, b], t)) in rims.iter().enumerate() {
            let step = b - a;
            let mut inner: Vec<DVec3> = Vec::new();
            for p in rims.iter().filter(|o| part(o.1) == part(t)).flat_map(|o| o.0) {
                let along = (p - a).dot(step) / step.length();
                let tolerance = self.tolerance;
                let within = along > tolerance
                    && along < step.length() - tolerance
                    && !self.triangles[t].0.contains(&p);
                if within && (p - a).cross(step).length() <= tolerance * step.length() && !inner.contains(&p)
                {
                    inner.push(p);
                }
            }
            inner.sort_by(|p, q| (*p - a).dot(step).total_cmp(&(*q - a).dot(step)));
            let corners: Vec<DVec3> = [a].into_iter().chain(inner).chain([b]).collect();
            pieces.extend(corners.windows(2).map(|w| ([w[0], w[1]], t, r)));
        }
        let same = |p: &[DVec3; 2], q: &[DVec3; 2]| p == q || *p == [q[1], q[0]];
        let owners = |ends: &[DVec3; 2], t: usize| -> Vec<usize> {
            let at = pieces.iter().filter(|o| same(&o.0, ends) && part(o.1) == part(t));
            at.map(|o| o.1).collect()
        };
        for (r, &(ends, t)) in rims.iter().enumerate() {
            let of_rim: Vec<_> = pieces.iter().filter(|p| p.2 == r).collect();
            if of_rim.iter().all(|p| owners(&p.0, t).len() == 1) {
                lines.extend(self.clipped(ends, vec![t]));
                continue;
            }
            for (ends, ..) in of_rim {
                let own = owners(ends, t);
                if own[0] == t && !(own.len() == 2 && self.is_flat(*ends, own[0], own[1], flat)) {
                    lines.extend(self.clipped(*ends, own));
                }
            }
        }
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
                if let Some(ends) = self.meeting(&a.0, &b.0) {
                    lines.extend(self.clipped(ends, vec![i, j]));
                }
            }
        }
        lines
    }

    /// Whether two triangles at a common line go on in one plane.
    fn is_flat(&self, [from, to]: [DVec3; 2], a: usize, b: usize, flat: f64) -> bool {
        let axis = (to - from).normalize_or_zero();
        // The corner that is farthest from the line. Of neighbours that wind differently the normals are
        // opposed; folded back is told by the corners.
        let aside = |t: usize| {
            let aside = self.triangles[t].0.map(|c| (c - from) - axis * (c - from).dot(axis));
            aside.into_iter().max_by(|p, q| p.length().total_cmp(&q.length())).unwrap_or_default()
        };
        let normal = |t: usize| {
            let [p, q, r] = self.triangles[t].0;
            (q - p).cross(r - p).normalize_or_zero()
        };
        normal(a).cross(normal(b)).length() < flat && aside(a).dot(aside(b)) < 0.0
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

    /// What is seen at a point of the paper: the part, and those of its mesh's triangles that may be; or `None`
    /// inside for nothing; `None` outside if it is too near to an outline, or to a tie in depth, to be told. A
    /// tie goes to the smaller part.
    pub fn seen_at(&self, p: DVec2) -> Option<Option<(u32, Vec<u32>)>> {
        let across = (p - self.middle) / self.scale;
        let (origin, direction, near, far) = match self.projection {
            Projection::Perspective { near, .. } => {
                (DVec3::ZERO, DVec3::new(across.x, -across.y, -1.0).normalize(), near, f64::INFINITY)
            }
            Projection::Orthographic { near, far, .. } => {
                (DVec3::new(across.x, -across.y, 0.0), DVec3::NEG_Z, near, far)
            }
        };
        let mut hits: Vec<(f64, f64, u32, u32)> = Vec::new();
        let mut unsure_from = f64::INFINITY;
        for ((t, part), number) in self.triangles.iter().zip(&self.numbers) {
            let Some((at, inside)) = pierce(t, origin, direction) else { continue };
            let depth = -(origin + direction * at).z;
            if inside < -OUTLINE || depth < near * (1.0 - 1e-9) || depth > far {
                continue;
            }
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
            let slack = self.tolerance_at(t, origin + direction * at) / n.dot(direction).abs().max(1e-3);
            if inside < OUTLINE || depth < near * (1.0 + 1e-9) {
                unsure_from = unsure_from.min(at - 2.0 * slack);
            } else {
                hits.push((at, slack, *part as u32, *number));
            }
        }
        let Some(first) = hits.iter().map(|h| h.0).min_by(f64::total_cmp) else {
            return if unsure_from.is_finite() { None } else { Some(None) };
        };
        if unsure_from < first {
            return None;
        }
        let mut part = u32::MAX;
        for (at, slack, theirs, _) in &hits {
            let apart = at - first;
            if apart <= 0.5 * slack {
                part = part.min(*theirs);
            } else if apart < 2.0 * slack {
                return None;
            }
        }
        let near = hits.iter().filter(|h| h.2 == part && h.0 - first <= 0.5 * h.1);
        Some(Some((part, near.map(|h| h.3).collect())))
    }

    /// Whether two triangles of a part's mesh lie in one plane, to within `angle` radians.
    pub fn in_one_plane(&self, part: u32, [a, b]: [u32; 2], angle: f64) -> bool {
        let find = |number: u32| {
            let all = self.triangles.iter().zip(&self.numbers);
            all.filter(|((_, p), n)| *p == part as usize && **n == number).map(|((t, _), _)| t).next()
        };
        let (Some(s), Some(t)) = (find(a), find(b)) else { return false };
        let n = (s[1] - s[0]).cross(s[2] - s[0]).normalize_or_zero();
        let size = s.iter().chain(t).map(|c| c.distance(s[0])).fold(0.0, f64::max);
        t.iter().all(|c| n.dot(*c - s[0]).abs() <= angle * size)
    }

    /// The segment in which two triangles meet.
    fn meeting(&self, a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<[DVec3; 2]> {
        let normal = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        let (m, n) = (normal(a), normal(b));
        let axis = m.cross(n);
        if axis.length() < 1e-7 {
            return None;
        }
        let axis = axis.normalize();
        // Of each triangle: the smallest and the largest place along the axis where it is in the other's plane.
        let reach = |t: &[DVec3; 3], plane: &[DVec3; 3], normal: DVec3| -> Option<[DVec3; 2]> {
            let side = |p: DVec3| {
                let s = normal.dot(p - plane[0]);
                if s.abs() <= self.tolerance_at(plane, p) { 0.0 } else { s }
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
        let (of_a, of_b) = (reach(a, b, n)?, reach(b, a, m)?);
        let from = if of_a[0].dot(axis) > of_b[0].dot(axis) { of_a[0] } else { of_b[0] };
        let to = if of_a[1].dot(axis) < of_b[1].dot(axis) { of_a[1] } else { of_b[1] };
        ((to - from).dot(axis) > self.tolerance_at(a, from)).then_some([from, to])
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
            let tolerance = self.tolerance_at(t, point);
            if inside < -OUTLINE || apart < 0.5 * tolerance || depth > far {
                continue;
            }
            if depth < near {
                unsure |= depth > near * (1.0 - 1e-9);
                continue;
            }
            if inside > OUTLINE && apart > 2.0 * tolerance {
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
