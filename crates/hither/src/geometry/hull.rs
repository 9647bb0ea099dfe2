//! Convex hulls of points in space: the extreme vertices, who neighbours whom, and hill climbing.
//!
//! A [`Hull`] answers one question fast: which vertex lies farthest in a direction? [`Hull::climb`] walks from
//! vertex to neighbour while that gains height; on a convex surface a local summit is the summit
//! [Snyder & Lengyel 1997, §5.1; Cohen et al. 1995]. Started from the last answer it takes a step or two.
//! The same holds for the quotient of two affine functions where the divisor is positive, which is what a
//! tangent of a viewing angle is ([`Hull::climb_ratio`]): its level sets are planes, too.
//!
//! The hull itself comes from the library `parry3d-f64`. Points on a plane, on a line or all at one place are
//! told apart first and get a polygon, a segment or a point. What the library returns is checked against every
//! input point (or, where that would take too long, along many directions); a hull that leaves a point out is
//! not used: then all points are kept and the farthest is found by looking at each.

use super::Aabb;
use glam::{DAffine3, DVec2, DVec3};
use parry3d_f64::transformation::try_convex_hull;
use std::collections::HashSet;

/// Fewer vertices than this are looked at one by one instead of climbed.
const SCANNED: usize = 12;
/// A point set thinner than this share of its length counts as flat. Single-precision input has 2⁻²⁴.
const FLAT: f64 = 1e-10;
/// A hull may leave a point out by this share of its size; extents are padded by more.
const TOLERANCE: f64 = 1e-9;
/// A hull so many times as long as it is wide is a needle.
const NEEDLE: f64 = 3.0;
/// Beyond this many (point, face) pairs a hull is checked along directions instead.
const MOST_CHECKS: usize = 40_000_000;

/// A convex polyhedron, polygon, segment or point given by its extreme points.
#[derive(Clone, Debug, PartialEq)]
pub struct Hull {
    vertices: Vec<DVec3>,
    /// Where each vertex's neighbours begin, and the end of the last; empty if vertices are looked at one by one.
    starts: Vec<u32>,
    neighbors: Vec<u32>,
    /// Outward, counter-clockwise; empty unless the hull has a volume.
    triangles: Vec<[u32; 3]>,
    bounds: Aabb,
    radius: f64,
    roundness: f64,
    needle: Option<usize>,
    /// For directions all around a summit nearby; empty where vertices are looked at one by one.
    summits: Vec<u32>,
    /// Cells along a side of a face of the cube that these directions go through.
    side: usize,
}

impl Default for Hull {
    fn default() -> Self {
        let (vertices, starts) = (Vec::new(), Vec::new());
        Hull {
            vertices,
            starts,
            neighbors: Vec::new(),
            triangles: Vec::new(),
            bounds: Aabb::EMPTY,
            radius: 0.0,
            roundness: 0.0,
            needle: None,
            summits: Vec::new(),
            side: 0,
        }
    }
}

impl Hull {
    /// The hull of `points`, all finite; `None` if there are none. Cost: n log n on the whole.
    pub fn around(points: &[DVec3]) -> Option<Hull> {
        let distinct = distinct(points);
        let box_ = Aabb::around(distinct.iter().copied());
        if distinct.is_empty() {
            return None;
        }
        let size = box_.size().max_element();
        let hull = match shape(&distinct, size * FLAT) {
            Shape::Thin(kept) => Hull::scanned(kept),
            Shape::Flat(ring) => Hull::polygon(ring),
            Shape::Solid => solid(&distinct, size).unwrap_or_else(|| Hull::scanned(distinct)),
        };
        Some(hull)
    }

    fn scanned(vertices: Vec<DVec3>) -> Hull {
        Hull { vertices, ..Hull::default() }.with_sphere()
    }

    fn polygon(ring: Vec<DVec3>) -> Hull {
        let n = ring.len() as u32;
        if (n as usize) < SCANNED {
            return Hull::scanned(ring);
        }
        let starts = (0..=n).map(|v| 2 * v).collect();
        let neighbors = (0..n).flat_map(|v| [(v + n - 1) % n, (v + 1) % n]).collect();
        Hull { vertices: ring, starts, neighbors, ..Hull::default() }.with_sphere()
    }

    fn with_sphere(mut self) -> Hull {
        self.bounds = Aabb::around(self.vertices.iter().copied());
        let center = self.center();
        self.radius = self.vertices.iter().map(|v| v.distance(center)).fold(0.0, f64::max);
        let half = self.bounds.size() * 0.5;
        // A flat hull has no extent along an axis, and no vertex off the middle there.
        let in_box = |v: &DVec3| ((*v - center) / half.max(DVec3::splat(f64::MIN_POSITIVE))).length();
        self.roundness = self.vertices.iter().map(in_box).fold(0.0, f64::max) * (1.0 + TOLERANCE);
        let size = self.bounds.size();
        let is_long = |&k: &usize| size[k] > NEEDLE * size[(k + 1) % 3].max(size[(k + 2) % 3]);
        self.needle = (0..3).find(is_long);
        if !self.starts.is_empty() {
            self.list_summits();
        }
        self
    }

    /// Finds the summit in the middle of each cell, about as many as vertices.
    fn list_summits(&mut self) {
        self.summits.clear();
        let side = (self.vertices.len() as f64 / 6.0).sqrt().ceil().min(16.0);
        self.side = side as usize;
        let half = self.bounds.size() * 0.5;
        let mut summit = 0;
        for face in 0..6 {
            let (k, sign) = (face % 3, if face < 3 { 1.0 } else { -1.0 });
            for cell in 0..self.side * self.side {
                let middle = |i: usize| (2.0 * i as f64 + 1.0) / side - 1.0;
                let mut direction = DVec3::ZERO;
                direction[k] = sign;
                direction[(k + 1) % 3] = middle(cell % self.side);
                direction[(k + 2) % 3] = middle(cell / self.side);
                summit = self.climb(direction / half.max(DVec3::splat(f64::MIN_POSITIVE)), summit);
                self.summits.push(summit);
            }
        }
    }

    /// A vertex near the one that is farthest along `direction`. Cells are of directions as they are where the box
    /// around the hull is a cube: of a needle's summits most lie in directions nearly across it.
    fn listed(&self, direction: DVec3) -> Option<u32> {
        let d = (direction * self.bounds.size()).to_array();
        let k = if d[0].abs() >= d[1].abs() { 0 } else { 1 };
        let k = if d[k].abs() >= d[2].abs() { k } else { 2 };
        let scale = 0.5 * self.side as f64 / d[k].abs();
        // A cast takes NaN and what is negative for 0.
        let cell = |i: usize| ((d[(k + i) % 3] * scale + 0.5 * self.side as f64) as usize).min(self.side - 1);
        let face = if d[k] > 0.0 { k } else { k + 3 };
        self.summits.get((face * self.side + cell(2)) * self.side + cell(1)).copied()
    }

    /// The extreme points; at least one.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Its faces as triangles, outward and counter-clockwise; none unless the hull has a volume.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The centre of a sphere around it.
    pub fn center(&self) -> DVec3 {
        self.bounds.center()
    }

    /// The smallest box around it, along its own axes.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// By how much the half sides of [`Hull::bounds`] are multiplied to be the semiaxes of an ellipsoid around the
    /// hull: from 1, for an ellipsoid, to √3, where a corner of the box is a vertex.
    pub fn roundness(&self) -> f64 {
        self.roundness
    }

    /// The axis along which it is several times as long as across, if there is one.
    pub fn needle(&self) -> Option<usize> {
        self.needle
    }

    /// The radius of that sphere.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Volume, cubic metres; 0 for a flat one, and for one whose faces are not known.
    pub fn volume(&self) -> f64 {
        let center = self.center();
        let corner = |v: u32| self.vertices[v as usize] - center;
        self.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
    }

    /// The hull seen through `outer_from_inner`, vertex for vertex.
    pub fn transformed(&self, outer_from_inner: &DAffine3) -> Hull {
        let vertices = self.vertices.iter().map(|&v| outer_from_inner.transform_point3(v)).collect();
        let mut triangles = self.triangles.clone();
        if outer_from_inner.matrix3.determinant() < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Hull { vertices, triangles, ..self.clone() }.with_sphere()
    }

    /// The vertex farthest along `direction`, from vertex `start` uphill. Any `start` below the number of
    /// vertices gives a summit; a good one saves steps. One that is not the summit is followed by what is listed for
    /// such directions.
    #[inline]
    pub fn climb(&self, direction: DVec3, start: u32) -> u32 {
        let height = |v: u32| self.vertices[v as usize].dot(direction);
        let (mut at, mut best) = (start, height(start));
        if self.starts.is_empty() {
            for v in 0..self.vertices.len() as u32 {
                let here = height(v);
                if here > best {
                    (at, best) = (v, here);
                }
            }
            return at;
        }
        loop {
            let from = at;
            let ring = self.starts[from as usize] as usize..self.starts[from as usize + 1] as usize;
            for &v in &self.neighbors[ring] {
                let here = height(v);
                if here > best {
                    (at, best) = (v, here);
                }
            }
            if at == from {
                return at;
            }
            if from == start
                && let Some(listed) = self.listed(direction)
            {
                let here = height(listed);
                if here > best {
                    (at, best) = (listed, here);
                }
            }
        }
    }

    /// The vertex where (x·p + x0) / (z·p + z0) is largest, and the quotient; z·p + z0 must be positive at every
    /// vertex.
    ///
    /// Dinkelbach's method (1967): where q is the quotient at a vertex, a vertex with a larger one is one where
    /// x·p + x0 − q (z·p + z0) is above zero, and that is climbed. From a good `start` the first climb stays
    /// where it is, and costs what [`Hull::climb`] does.
    #[inline]
    pub fn climb_ratio(&self, x: (DVec3, f64), z: (DVec3, f64), start: u32) -> (u32, f64) {
        let ratio = |v: u32| {
            let p = self.vertices[v as usize];
            (p.dot(x.0) + x.1) / (p.dot(z.0) + z.1)
        };
        let (mut at, mut best) = (start, ratio(start));
        loop {
            let next = self.climb(x.0 - z.0 * best, at);
            let value = ratio(next);
            if next == at || value <= best {
                return (at, best);
            }
            (at, best) = (next, value);
        }
    }
}

/// Each point once, in order of first appearance. Zero has one sign.
fn distinct(points: &[DVec3]) -> Vec<DVec3> {
    let mut seen = HashSet::with_capacity(points.len());
    let clean = points.iter().map(|&p| p + DVec3::ZERO);
    clean.filter(|p| seen.insert(p.to_array().map(f64::to_bits))).collect()
}

/// What a set of points spans.
enum Shape {
    /// A point or a line: its ends.
    Thin(Vec<DVec3>),
    /// A plane: the corners, in order.
    Flat(Vec<DVec3>),
    Solid,
}

fn shape(points: &[DVec3], tolerance: f64) -> Shape {
    let farthest = |from: &dyn Fn(DVec3) -> f64| {
        points.iter().copied().max_by(|&a, &b| from(a).total_cmp(&from(b))).unwrap_or_default()
    };
    let first = points[0];
    let a = farthest(&|p| p.distance_squared(first));
    let b = farthest(&|p| p.distance_squared(a));
    let Some(along) = (b - a).try_normalize() else { return Shape::Thin(vec![a]) };
    let aside = |p: DVec3| (p - a) - along * (p - a).dot(along);
    let c = farthest(&|p| aside(p).length_squared());
    let Some(across) = aside(c).try_normalize().filter(|_| aside(c).length() > tolerance) else {
        return Shape::Thin(vec![a, b]);
    };
    let normal = along.cross(across);
    let off = farthest(&|p| (p - a).dot(normal).abs());
    if (off - a).dot(normal).abs() > tolerance {
        return Shape::Solid;
    }
    let flat = points.iter().map(|&p| DVec2::new((p - a).dot(along), (p - a).dot(across)));
    Shape::Flat(corners(flat.collect()).into_iter().map(|i| points[i]).collect())
}

/// The corners of the hull of points in the plane, counter-clockwise (Andrew's monotone chain).
fn corners(points: Vec<DVec2>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by(|&i, &j| {
        let (p, q) = (points[i], points[j]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
    });
    let mut ring: Vec<usize> = Vec::new();
    for half in 0..2 {
        let base = ring.len();
        for k in 0..order.len() {
            let i = order[if half == 0 { k } else { order.len() - 1 - k }];
            while ring.len() >= base + 2 {
                let (p, q) = (points[ring[ring.len() - 2]], points[ring[ring.len() - 1]]);
                if (q - p).perp_dot(points[i] - q) > 0.0 {
                    break;
                }
                ring.pop();
            }
            ring.push(i);
        }
        ring.pop();
    }
    ring
}

/// The library's hull with adjacency, or `None` where it fails or leaves a point out.
fn solid(points: &[DVec3], size: f64) -> Option<Hull> {
    if points.len() <= 4 {
        return Some(Hull::scanned(points.to_vec()).with_faces_of_tetrahedron());
    }
    let (vertices, triangles) = try_convex_hull(points).ok()?;
    let mut edges: Vec<(u32, u32)> =
        triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut starts = vec![0u32; vertices.len() + 1];
    for &(from, _) in &edges {
        starts[from as usize + 1] += 1;
    }
    for v in 0..vertices.len() {
        starts[v + 1] += starts[v];
    }
    let neighbors = edges.into_iter().map(|(_, to)| to).collect();
    let mut hull = Hull { vertices, starts, neighbors, triangles, ..Hull::default() };
    if hull.vertices.len() < SCANNED {
        (hull.starts, hull.neighbors) = (Vec::new(), Vec::new());
    }
    let hull = hull.with_sphere();
    hull.holds(points, size * TOLERANCE).then_some(hull)
}

impl Hull {
    fn with_faces_of_tetrahedron(mut self) -> Hull {
        if let &[a, b, c, d] = self.vertices.as_slice() {
            let outward = (b - a).cross(c - a).dot(d - a) < 0.0;
            let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
            self.triangles = faces.map(|[i, j, k]| if outward { [i, j, k] } else { [i, k, j] }).to_vec();
        }
        self
    }

    /// Whether no point lies outside by more than `tolerance`, and climbing finds every summit.
    fn holds(&self, points: &[DVec3], tolerance: f64) -> bool {
        let corner = |v: u32| self.vertices[v as usize];
        let planes = self.triangles.iter().filter_map(|&[a, b, c]| {
            let normal = (corner(b) - corner(a)).cross(corner(c) - corner(a)).try_normalize()?;
            Some((normal, normal.dot(corner(a))))
        });
        let planes: Vec<(DVec3, f64)> = planes.collect();
        if planes.is_empty() {
            return false;
        }
        let checked: Vec<DVec3> = if points.len() * planes.len() <= MOST_CHECKS {
            if points.iter().any(|&p| planes.iter().any(|&(n, d)| n.dot(p) > d + tolerance)) {
                return false;
            }
            planes.iter().step_by(planes.len().div_ceil(64)).map(|&(n, _)| n).collect()
        } else {
            planes.iter().step_by(planes.len().div_ceil(256)).map(|&(n, _)| n).collect()
        };
        checked.iter().flat_map(|&n| [n, -n]).all(|n| {
            let highest = points.iter().map(|p| p.dot(n)).fold(f64::NEG_INFINITY, f64::max);
            corner(self.climb(n, 0)).dot(n) >= highest - tolerance
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sphere(n: usize) -> Vec<DVec3> {
        (0..n)
            .map(|i| {
                let z = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
                let (s, c) = (i as f64 * 2.399_963).sin_cos();
                DVec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), z)
            })
            .collect()
    }

    fn summit(points: &[DVec3], d: DVec3) -> f64 {
        points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn degenerate_sets_have_hulls_too() {
        let line: Vec<DVec3> = (0..9).map(|i| DVec3::new(1.0, 2.0, 3.0) * f64::from(i)).collect();
        assert_eq!(Hull::around(&line).unwrap().vertices().len(), 2);
        assert_eq!(Hull::around(&[DVec3::ONE; 7]).unwrap().vertices(), [DVec3::ONE]);
        assert!(Hull::around(&[]).is_none());
        let grid: Vec<DVec3> = (0..25).map(|i| DVec3::new(f64::from(i % 5), f64::from(i / 5), 7.0)).collect();
        // Rounding may leave points on an edge among the corners.
        let hull = Hull::around(&grid).unwrap();
        assert!([grid[0], grid[4], grid[20], grid[24]].iter().all(|c| hull.vertices().contains(c)));
        assert!(hull.vertices().len() <= 16);
        let ring: Vec<DVec3> =
            (0..90).map(|i| f64::from(i) / 14.0).map(|t| DVec3::new(t.cos(), t.sin(), t.cos())).collect();
        let hull = Hull::around(&ring).unwrap();
        assert!(!hull.starts.is_empty());
        for d in sphere(50) {
            let found = hull.vertices()[hull.climb(d, 3) as usize].dot(d);
            assert!((found - summit(&ring, d)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_box_has_its_volume() {
        let corners: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2) * 3.0))
            .collect();
        assert!((Hull::around(&corners).unwrap().volume() - 6.0).abs() < 1e-12);
        let simplex = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        assert!((Hull::around(&simplex).unwrap().volume() - 1.0 / 6.0).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn climbing_finds_what_looking_at_all_finds(
            squeeze in prop::sample::select(vec![1.0, 1e-3, 1e-7, 1e-12, 0.0]),
            scale in prop::sample::select(vec![1.0, 1e-15, 1e12]),
            count in 5usize..300, turn: u64, start: u32,
        ) {
            let angle = turn as f64 / u64::MAX as f64 * 6.0;
            let pose = glam::DMat3::from_rotation_x(angle) * glam::DMat3::from_rotation_y(3.0 * angle);
            let points: Vec<DVec3> =
                sphere(count).iter().map(|p| pose * (*p * DVec3::new(1.0, 0.4, squeeze)) * scale).collect();
            let hull = Hull::around(&points).unwrap();
            let start = start % hull.vertices().len() as u32;
            for d in sphere(40) {
                let found = hull.vertices()[hull.climb(d, start) as usize].dot(d);
                prop_assert!((found - summit(&points, d)).abs() <= 2.0 * TOLERANCE * scale);
                let (x, z) = ((d, 0.1 * scale), (DVec3::Z, 2.0 * scale));
                let ratio = |p: DVec3| (p.dot(x.0) + x.1) / (p.dot(z.0) + z.1);
                let best = points.iter().map(|&p| ratio(p)).fold(f64::NEG_INFINITY, f64::max);
                let (at, found) = hull.climb_ratio(x, z, start);
                prop_assert_eq!(found, ratio(hull.vertices()[at as usize]));
                prop_assert!((found - best).abs() <= 1e-8);
            }
        }
    }
}
