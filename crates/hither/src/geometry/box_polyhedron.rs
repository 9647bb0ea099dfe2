//! Whether an axis-aligned box meets a convex polyhedron or a convex polygon. It never misses: what touches
//! or overlaps is never called outside.
//!
//! [Greene 1995, appendix A; also Graphics Gems IV, 1994, pp. 74–82]. A box and a convex polyhedron are
//! apart exactly if a plane between them is parallel to a side of the box (type 1), to a face of the
//! polyhedron (type 2), or to an edge of each (type 3). Type 1 is a comparison of bounding boxes. Type 3 is
//! a line in one of the three orthographic views that has the polyhedron's silhouette on one side and the
//! box's rectangle on the other.
//!
//! Terms: for a direction n, the *n-vertex* of a box is its corner least far along n, the *p-vertex* the one
//! farthest. A *face-plane* has the polyhedron behind it; an *edge-line* is a silhouette edge in a view, its
//! direction pointing out of the silhouette.
//!
//! Departure: planes and lines are not taken through a face's or an edge's own points but through the
//! polyhedron's farthest vertex along the computed direction. Such a plane separates correctly however
//! rounded its direction is (or however bent a face is), so only the rounding of dot products matters, and
//! `ROUNDING` bounds that. The same rule finds silhouettes, without knowing which faces share an edge.

use super::Aabb;
use crate::conventions::{Projection, View};
use glam::{BVec3, DVec3};

/// A dot product of three terms, in f64, is off by at most 3 half-ulps of the sum of the terms' magnitudes
/// [Higham, Accuracy and Stability of Numerical Algorithms, §3.1]; 4 leave room for the bound's own rounding.
const ROUNDING: f64 = 2.0 * f64::EPSILON;

/// How a box lies to a convex polyhedron. Both are closed: to touch is to overlap, and to cross a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlap {
    /// No point in common. Never said of what touches.
    Outside,
    /// The box lies within, clear of every face-plane.
    Inside,
    /// Both have points in common, or are too near to tell, and bit i of `crossed` says that the box meets
    /// the plane of face i.
    Partial {
        /// A bit for each face, in the order they were given.
        crossed: u64,
    },
}

/// A direction and how far a convex body reaches along it.
#[derive(Clone, Copy, Debug)]
struct Support {
    direction: DVec3,
    /// Largest dot product with a vertex.
    offset: f64,
    /// Largest sum of magnitudes in such a dot product.
    magnitude: f64,
    /// Where the direction is positive, that is where the n-vertex takes the box's minimum.
    positive: BVec3,
}

/// The plane of a face.
#[derive(Clone, Copy, Debug)]
struct FacePlane {
    face: u32,
    support: Support,
    /// Smallest dot product with a corner of the face. What stays below it for every face lies within: the
    /// way to it from inside leaves the polyhedron nowhere, for at each point of a face it would be above.
    inner: f64,
}

impl Support {
    fn new(direction: DVec3, vertices: &[DVec3]) -> Support {
        let reach = vertices.iter().map(|v| direction.dot(*v)).fold(f64::NEG_INFINITY, f64::max);
        let magnitude = vertices.iter().map(|v| direction.abs().dot(v.abs())).fold(0.0, f64::max);
        Support { direction, offset: reach, magnitude, positive: direction.cmpgt(DVec3::ZERO) }
    }

    /// More than this, computed dot products with a vertex and with `corner` truly differ. Normal numbers
    /// are assumed; the smallest one covers those below.
    fn rounding(&self, corner: DVec3) -> f64 {
        ROUNDING * (self.magnitude + self.direction.abs().dot(corner.abs())) + f64::MIN_POSITIVE
    }

    /// Whether the whole box lies farther out than the body.
    fn separates(&self, b: &Aabb) -> bool {
        let n_vertex = DVec3::select(self.positive, b.min, b.max);
        self.direction.dot(n_vertex) - self.offset > self.rounding(n_vertex)
    }

    /// Whether `points` reach as far out as anything does, to within rounding.
    fn touches(&self, points: impl IntoIterator<Item = DVec3>) -> bool {
        // A direction itself is a difference of rounded products; allow for that twice over.
        points.into_iter().all(|p| self.direction.dot(p) >= self.offset - 4.0 * self.rounding(p))
    }
}

impl FacePlane {
    /// Whether the whole box lies behind the plane, clear of it.
    fn is_before(&self, b: &Aabb) -> bool {
        let p_vertex = DVec3::select(self.support.positive, b.max, b.min);
        self.inner - self.support.direction.dot(p_vertex) > self.support.rounding(p_vertex)
    }
}

/// A convex polyhedron prepared for being compared with many boxes. It may be flat, a segment, or a point.
#[derive(Clone, Debug)]
pub struct ConvexPolyhedron {
    bounds: Aabb,
    /// Of a flat polyhedron, one on either side.
    faces: Vec<FacePlane>,
    edges: Vec<Support>,
    all_faces: u64,
}

impl ConvexPolyhedron {
    /// The convex hull of `vertices`, given with its `faces`: at most 64 lists of vertex indices, each around
    /// its face in either sense. Faces without area are allowed; they separate nothing.
    ///
    /// For a flat polyhedron give one face at least.
    ///
    /// # Panics
    /// If there are more than 64 faces, or an index names no vertex.
    pub fn new<F: AsRef<[usize]>>(vertices: &[DVec3], faces: &[F]) -> ConvexPolyhedron {
        assert!(faces.len() <= 64, "a polyhedron of {} faces; at most 64 are supported", faces.len());
        let mut planes = Vec::new();
        let mut edges: Vec<Support> = Vec::new();
        for (i, face) in faces.iter().enumerate() {
            let corners = face.as_ref().iter().map(|&v| vertices[v]);
            let normal = polygon_normal(corners.clone());
            for direction in [normal, -normal] {
                let support = Support::new(direction, vertices);
                if direction != DVec3::ZERO && support.touches(corners.clone()) {
                    let inner = corners.clone().map(|c| direction.dot(c)).fold(f64::INFINITY, f64::min);
                    planes.push(FacePlane { face: i as u32, support, inner });
                }
            }
            for [from, to] in sides(corners) {
                for direction in line_directions(to - from) {
                    if direction == DVec3::ZERO || edges.iter().any(|e| e.direction == direction) {
                        continue;
                    }
                    let line = Support::new(direction, vertices);
                    if line.touches([from, to]) {
                        edges.push(line);
                    }
                }
            }
        }
        let all_faces = if faces.len() == 64 { u64::MAX } else { (1 << faces.len()) - 1 };
        ConvexPolyhedron { bounds: Aabb::around(vertices.iter().copied()), faces: planes, edges, all_faces }
    }

    /// What a view sees up to distance `far` along its axis, in world space. `far` must lie beyond the near
    /// plane; an orthographic view ends at its own far plane if that is nearer.
    ///
    /// Its faces are, in order: left, right, bottom, top, near, far.
    pub fn view_frustum(view: &View, far: f64) -> ConvexPolyhedron {
        let half_height = f64::from(view.height) * 0.5 / view.pixels_per_unit();
        let half_width = f64::from(view.width) * 0.5 / view.pixels_per_unit();
        let (near, far) = match view.projection {
            Projection::Perspective { near, .. } => (near, far),
            Projection::Orthographic { near, far: own, .. } => (near, far.min(own)),
        };
        let world_from_view = view.view_from_world.inverse();
        // Bit 0 is right, bit 1 is top, bit 2 is far.
        let corners: [DVec3; 8] = std::array::from_fn(|i| {
            let distance = if i & 4 == 0 { near } else { far };
            let spread = match view.projection {
                Projection::Perspective { .. } => distance,
                Projection::Orthographic { .. } => 1.0,
            };
            let x = if i & 1 == 0 { -half_width } else { half_width };
            let y = if i & 2 == 0 { -half_height } else { half_height };
            world_from_view.transform_point3(DVec3::new(x * spread, y * spread, -distance))
        });
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        ConvexPolyhedron::new(&corners, &faces)
    }

    /// The smallest box around the polyhedron.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// How `b` lies to the polyhedron. Cost: from one comparison to one dot product for each side of the box,
    /// each face and each silhouette edge (6 + 6 + 18 for a frustum), and half as many again for `Inside`.
    pub fn classify(&self, b: &Aabb) -> Overlap {
        self.classify_within(b, self.all_faces)
    }

    /// As [`ConvexPolyhedron::classify`] for a box that lies within another whose answer was
    /// `Partial { crossed }`: planes that the other does not meet are not looked at again.
    pub fn classify_within(&self, b: &Aabb, crossed: u64) -> Overlap {
        if !meet(&self.bounds, b) {
            return Overlap::Outside;
        }
        if b.contains(self.bounds.min) && b.contains(self.bounds.max) {
            return Overlap::Partial { crossed };
        }
        let mut met = 0u64;
        for plane in self.faces.iter().filter(|plane| crossed >> plane.face & 1 == 1) {
            if plane.support.separates(b) {
                return Overlap::Outside;
            }
            if !plane.is_before(b) {
                met |= 1 << plane.face;
            }
        }
        if met == 0 && self.is_solid() {
            return Overlap::Inside;
        }
        if self.edges.iter().any(|line| line.separates(b)) {
            return Overlap::Outside;
        }
        Overlap::Partial { crossed: met }
    }

    /// Whether the two have a point in common, or are too near to tell.
    pub fn intersects(&self, b: &Aabb) -> bool {
        self.classify(b) != Overlap::Outside
    }

    /// Fewer planes bound nothing.
    fn is_solid(&self) -> bool {
        self.faces.len() >= 4
    }
}

/// Whether a box and a convex planar polygon have a point in common, or are too near to tell. Nothing is
/// kept; cost: a dot product for each corner, side and view. A polygon of two corners is a segment, of one a
/// point, and of none is met by nothing.
pub fn box_meets_polygon(b: &Aabb, corners: &[DVec3]) -> bool {
    if !meet(&Aabb::around(corners.iter().copied()), b) {
        return false;
    }
    let separates = |direction: DVec3| {
        let ends = [direction, -direction];
        direction != DVec3::ZERO && ends.iter().any(|&end| Support::new(end, corners).separates(b))
    };
    if separates(polygon_normal(corners.iter().copied())) {
        return false;
    }
    // Every side, for a polygon has no hidden edges; a line and its opposite are one test.
    !sides(corners.iter().copied()).any(|[from, to]| {
        let [x, _, y, _, z, _] = line_directions(to - from);
        separates(x) || separates(y) || separates(z)
    })
}

fn meet(a: &Aabb, b: &Aabb) -> bool {
    !a.is_empty() && !b.is_empty() && a.min.cmple(b.max).all() && a.max.cmpge(b.min).all()
}

/// Consecutive corners, the last with the first.
fn sides(corners: impl Iterator<Item = DVec3> + Clone) -> impl Iterator<Item = [DVec3; 2]> {
    let after = corners.clone().skip(1).chain(corners.clone().take(1));
    corners.zip(after).map(|(from, to)| [from, to])
}

/// The directions across an edge in the three orthographic views, each followed by its opposite; zero in a
/// view down the edge.
fn line_directions(edge: DVec3) -> [DVec3; 6] {
    let e = scaled(edge);
    let (x, y, z) = (DVec3::new(0.0, e.z, -e.y), DVec3::new(-e.z, 0.0, e.x), DVec3::new(e.y, -e.x, 0.0));
    [x, -x, y, -y, z, -z]
}

/// A normal of a polygon that may be slightly bent: the sum over a fan of triangles, scaled; zero without
/// area.
fn polygon_normal(corners: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let Some(first) = corners.clone().next() else { return DVec3::ZERO };
    let spread = corners.clone().map(|c| (c - first).abs()).fold(DVec3::ZERO, DVec3::max);
    let scale = power_of_two_below(spread.max_element());
    let arms = corners.map(|c| (c - first) * scale);
    let sum = arms.clone().zip(arms.skip(1)).map(|(a, b)| a.cross(b)).sum();
    scaled(sum)
}

/// `v` times a power of two that brings it near 1, so that products neither overflow nor vanish; exact.
fn scaled(v: DVec3) -> DVec3 {
    v * power_of_two_below(v.abs().max_element())
}

/// 2 to the power −⌊log₂ size⌋; 1 for what has no such power in range.
fn power_of_two_below(size: f64) -> f64 {
    if !size.is_normal() {
        return 1.0;
    }
    let exponent = (size.to_bits() >> 52) as i64 & 0x7ff;
    f64::from_bits((2046 - exponent).clamp(1, 2046) as u64 * (1 << 52))
}

#[cfg(test)]
mod tests;
