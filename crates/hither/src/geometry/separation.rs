//! Whether two convex bodies are disjoint, with a witness that is kept for the next time.
//!
//! Chung's iteration first: a direction is tried, and reflected while it fails; for needles seen from the eye the planes
//! through the eye and a needle are tried instead, for of two segments on the screen that do not cross, the line of one
//! parts them. After four failures Gilbert's:
//! the point nearest to the origin in the Minkowski difference, on a simplex of at most four points
//! [Snyder & Lengyel 1997, app. B; Chung & Wang 1996; Gilbert, Johnson & Keerthi 1988]. Both only ever ask for
//! a body's farthest vertex in a direction. One body may be extended by the origin, where the eye is: the hull
//! of both is never made.
//!
//! The answer errs on one side: [`disjoint`] says yes only with a direction along which the gap exceeds the
//! margin. Bodies that touch, and doubtful cases, are not disjoint.

use super::Hull;
use glam::{DAffine3, DVec3};

/// A hull somewhere, perhaps extended by the origin.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// The hull in its own space.
    pub hull: &'a Hull,
    /// Where it is.
    pub outer_from_hull: &'a DAffine3,
    /// Whether the body is the hull together with all segments from it to the origin.
    pub with_origin: bool,
}

/// What is worth remembering of a pair: a direction that separates, or nearly does, and where on the bodies; of
/// bodies that intersect a tetrahedron of the Minkowski difference around the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Witness {
    /// From the first body to the second; any length, zero if nothing is known.
    pub direction: [f32; 3],
    /// The vertices found last.
    pub vertices: [u32; 2],
    /// For each corner of the tetrahedron a vertex of either body; [`ORIGIN`] stands for the origin. The first
    /// corner of none is of two origins.
    tetrahedron: [[u16; 2]; 4],
}

impl Default for Witness {
    fn default() -> Self {
        Witness { direction: [0.0; 3], vertices: [0; 2], tetrahedron: NO_TETRAHEDRON }
    }
}

/// The origin among a body's vertices; also, a vertex whose number is too large to be remembered.
const ORIGIN: u16 = u16::MAX;
const NO_TETRAHEDRON: [[u16; 2]; 4] = [[ORIGIN; 2]; 4];

/// Chung's directions that are tried before Gilbert's iteration.
const CHUNG_STEPS: usize = 4;
/// Gilbert's iteration ends after a few steps, or wanders on the last bits.
const GILBERT_STEPS: usize = 48;
/// Two bodies whose distance is below this share of their coordinates touch.
const TOUCHING: f64 = 1e-12;

impl Body<'_> {
    /// The farthest point along `direction`, from the vertex `hint` uphill.
    #[inline]
    fn farthest(&self, direction: DVec3, hint: &mut u32) -> (DVec3, u16) {
        let inner = self.outer_from_hull.matrix3.transpose() * direction;
        *hint = self.hull.climb(inner, *hint);
        let point = self.outer_from_hull.transform_point3(self.hull.vertices()[*hint as usize]);
        let is_origin = self.with_origin && point.dot(direction) <= 0.0;
        if is_origin { (DVec3::ZERO, ORIGIN) } else { (point, u16::try_from(*hint).unwrap_or(ORIGIN)) }
    }

    /// The point that a corner of a remembered tetrahedron stands for.
    fn corner(&self, number: u16) -> Option<DVec3> {
        if number == ORIGIN {
            return self.with_origin.then_some(DVec3::ZERO);
        }
        self.hull.vertices().get(usize::from(number)).map(|&v| self.outer_from_hull.transform_point3(v))
    }

    /// Of the sphere around the hull, where the hull is.
    pub fn center(&self) -> DVec3 {
        self.outer_from_hull.transform_point3(self.hull.center())
    }
}

/// Whether a plane separates `a` from `b` with a gap of more than `margin`, metres.
///
/// `witness` says where to begin and is left as it is best for the next time. Cost: with a good witness two
/// climbs, without one some ten.
pub fn disjoint(a: &Body, b: &Body, witness: &mut Witness, margin: f64) -> bool {
    if still_intersect(a, b, &witness.tetrahedron) {
        return false;
    }
    let mut search = Search { a, b, hints: witness.vertices, margin, simplex: Simplex::default() };
    let mut direction = DVec3::from(witness.direction.map(f64::from));
    if direction == DVec3::ZERO {
        direction = first_guess(a, b);
    }
    let result = search.chung(&mut direction) || search.gilbert(&mut direction);
    witness.direction = direction.as_vec3().to_array();
    witness.vertices = search.hints;
    witness.tetrahedron = search.simplex.around_origin.unwrap_or(NO_TETRAHEDRON);
    result
}

/// Whether the tetrahedron of the last time is around the origin again.
fn still_intersect(a: &Body, b: &Body, tetrahedron: &[[u16; 2]; 4]) -> bool {
    if tetrahedron[0] == [ORIGIN; 2] {
        return false;
    }
    let mut corners = [DVec3::ZERO; 4];
    for (corner, &[on_a, on_b]) in corners.iter_mut().zip(tetrahedron) {
        let (Some(p), Some(q)) = (a.corner(on_a), b.corner(on_b)) else { return false };
        *corner = q - p;
    }
    on_tetrahedron(corners).is_none()
}

/// For bodies seen from the origin: across the line of sight where they are beside each other.
fn first_guess(a: &Body, b: &Body) -> DVec3 {
    let (from, to) = (a.center(), b.center());
    let across = match a.with_origin {
        true => to - from * (to.dot(from) / from.length_squared().max(f64::MIN_POSITIVE)),
        false => to - from,
    };
    across.try_normalize().or((to - from).try_normalize()).unwrap_or(DVec3::X)
}

struct Search<'a> {
    a: &'a Body<'a>,
    b: &'a Body<'a>,
    hints: [u32; 2],
    margin: f64,
    simplex: Simplex,
}

/// A point of the Minkowski difference b − a, and the vertices it is of.
type Difference = (DVec3, [u16; 2]);

impl Search<'_> {
    /// The point of b − a that lies least far along `direction`, a unit vector.
    #[inline]
    fn least(&mut self, direction: DVec3) -> Difference {
        let [on_a, on_b] = &mut self.hints;
        let (p, on_a) = self.a.farthest(direction, on_a);
        let (q, on_b) = self.b.farthest(-direction, on_b);
        (q - p, [on_a, on_b])
    }

    fn chung(&mut self, direction: &mut DVec3) -> bool {
        let mut guesses = [None; 2].into_iter();
        for step in 0..CHUNG_STEPS {
            let Some(unit) = direction.try_normalize() else { return false };
            *direction = unit;
            let (least, of) = self.least(unit);
            if unit.dot(least) > self.margin {
                return true;
            }
            if step == 0 && self.a.with_origin {
                guesses = [self.beside(self.b), self.beside(self.a)].into_iter();
            }
            let guess = guesses.by_ref().flatten().next();
            let known = self.simplex.holds(least);
            if !known {
                self.simplex.add((least, of));
            }
            if let Some(guess) = guess {
                *direction = guess;
                continue;
            }
            if known {
                return false;
            }
            let Some(along) = least.try_normalize() else { return false };
            *direction = unit - along * (2.0 * along.dot(unit));
        }
        false
    }

    /// Across the plane through the origin and a needle, towards `b`.
    fn beside(&self, needle: &Body) -> Option<DVec3> {
        let axis = needle.outer_from_hull.matrix3.col(needle.hull.needle()?);
        let across = axis.cross(needle.center());
        let side = across.dot(self.b.center() - self.a.center());
        Some(across * side.signum())
    }

    fn gilbert(&mut self, direction: &mut DVec3) -> bool {
        if self.simplex.count == 0 {
            let first = self.least(direction.try_normalize().unwrap_or(DVec3::X));
            self.simplex.add(first);
        }
        let mut last = f64::INFINITY;
        for _ in 0..GILBERT_STEPS {
            let Some(nearest) = self.simplex.reduce() else { return false };
            let reach = self.simplex.reach();
            let distance = nearest.length();
            if distance <= reach * TOUCHING || distance >= last {
                return false;
            }
            last = distance;
            let unit = nearest / distance;
            let (least, of) = self.least(unit);
            *direction = unit;
            if unit.dot(least) > self.margin {
                return true;
            }
            // No point lies nearer than the plane through `least`: the gap is known, and too small.
            if distance - unit.dot(least) <= distance * 1e-10 || self.simplex.holds(least) {
                return false;
            }
            self.simplex.add((least, of));
        }
        false
    }
}

/// Up to four points, and the part of them whose hull is nearest to the origin.
#[derive(Default)]
struct Simplex {
    points: [DVec3; 4],
    of: [[u16; 2]; 4],
    count: usize,
    /// Set when the origin is found inside.
    around_origin: Option<[[u16; 2]; 4]>,
}

impl Simplex {
    fn add(&mut self, (point, of): Difference) {
        (self.points[self.count], self.of[self.count]) = (point, of);
        self.count += 1;
    }

    fn holds(&self, point: DVec3) -> bool {
        self.points[..self.count].contains(&point)
    }

    fn reach(&self) -> f64 {
        self.points[..self.count].iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
    }

    /// Keeps the face nearest to the origin and returns its nearest point; `None` if the origin is inside.
    fn reduce(&mut self) -> Option<DVec3> {
        let (points, of) = (self.points, self.of);
        let [a, b, c, d] = points;
        let (kept, nearest) = match self.count {
            1 => (Face::of(&[0]), a),
            2 => on_segment([a, b], [0, 1]),
            3 => on_triangle([a, b, c], [0, 1, 2]),
            _ => match on_tetrahedron([a, b, c, d]) {
                Some(face) => face,
                None => {
                    self.around_origin = Some(of);
                    return None;
                }
            },
        };
        self.count = kept.count;
        for (slot, &from) in kept.corners[..kept.count].iter().enumerate() {
            (self.points[slot], self.of[slot]) = (points[from], of[from]);
        }
        Some(nearest)
    }
}

/// Which corners of a simplex span a face.
#[derive(Clone, Copy)]
struct Face {
    corners: [usize; 3],
    count: usize,
}

impl Face {
    fn of(corners: &[usize]) -> Face {
        let mut all = [0; 3];
        all[..corners.len()].copy_from_slice(corners);
        Face { corners: all, count: corners.len() }
    }
}

fn on_segment([a, b]: [DVec3; 2], [i, j]: [usize; 2]) -> (Face, DVec3) {
    let ab = b - a;
    let along = -a.dot(ab);
    let length = ab.length_squared();
    if along <= 0.0 {
        (Face::of(&[i]), a)
    } else if along >= length {
        (Face::of(&[j]), b)
    } else {
        (Face::of(&[i, j]), a + ab * (along / length))
    }
}

/// The regions of a triangle (Ericson 2005, §5.1.5), for the origin.
fn on_triangle([a, b, c]: [DVec3; 3], [i, j, k]: [usize; 3]) -> (Face, DVec3) {
    let normal = (b - a).cross(c - a);
    let edges = [([a, b], [i, j], c), ([b, c], [j, k], a), ([c, a], [k, i], b)];
    let outside = |p: DVec3, q: DVec3| (q - p).cross(normal).dot(p) < 0.0;
    // Outside of an edge or on a triangle without area: the nearest of the edges.
    let flat = normal.length_squared() <= 1e-28 * (b - a).length_squared() * (c - a).length_squared();
    if flat || edges.iter().any(|&([p, q], ..)| outside(p, q)) {
        let candidates = edges.map(|(ends, names, _)| on_segment(ends, names));
        let [first, rest @ ..] = candidates;
        return rest.into_iter().fold(first, |best, next| {
            if next.1.length_squared() < best.1.length_squared() { next } else { best }
        });
    }
    (Face::of(&[i, j, k]), normal * (a.dot(normal) / normal.length_squared()))
}

fn on_tetrahedron([a, b, c, d]: [DVec3; 4]) -> Option<(Face, DVec3)> {
    let faces = [
        ([a, b, c], [0, 1, 2], d),
        ([a, c, d], [0, 2, 3], b),
        ([a, d, b], [0, 3, 1], c),
        ([b, d, c], [1, 3, 2], a),
    ];
    let mut best: Option<(Face, DVec3)> = None;
    for (corners, names, opposite) in faces {
        let [p, q, r] = corners;
        let normal = (q - p).cross(r - p);
        let (here, there) = (-p.dot(normal), (opposite - p).dot(normal));
        // The origin lies beyond this face, on it, or the tetrahedron is flat here.
        let flat = there * there <= 1e-28 * normal.length_squared() * (opposite - p).length_squared();
        if here * there > 0.0 && !flat {
            continue;
        }
        let candidate = on_triangle(corners, names);
        if best.is_none_or(|b| candidate.1.length_squared() < b.1.length_squared()) {
            best = Some(candidate);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn box_hull(half: DVec3) -> Hull {
        let corner = |i: u32| {
            let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            half * DVec3::new(sign(0), sign(1), sign(2))
        };
        Hull::around(&(0..8).map(corner).collect::<Vec<_>>()).unwrap()
    }

    fn at(x: f64, y: f64, z: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::new(x, y, z))
    }

    #[test]
    fn boxes_apart_touching_and_overlapping() {
        let cube = box_hull(DVec3::ONE);
        let meets = |dx: f64, margin: f64| {
            let (here, there) = (at(0.0, 0.0, 0.0), at(dx, 0.3, 0.2));
            let body = |pose| Body { hull: &cube, outer_from_hull: pose, with_origin: false };
            !disjoint(&body(&here), &body(&there), &mut Witness::default(), margin)
        };
        assert!(meets(1.0, 0.0) && meets(1.999_999, 0.0) && meets(2.0, 0.0) && !meets(2.000_001, 0.0));
        assert!(meets(2.05, 0.1) && !meets(2.15, 0.1) && meets(0.0, 0.0));
    }

    #[test]
    fn the_eye_is_folded_in() {
        let (cube, wide) = (box_hull(DVec3::ONE), box_hull(DVec3::new(9.0, 9.0, 0.1)));
        let occludes = |front: &DAffine3, behind: &DAffine3| {
            let shadow = Body { hull: &cube, outer_from_hull: behind, with_origin: true };
            let body = Body { hull: &wide, outer_from_hull: front, with_origin: false };
            !disjoint(&shadow, &body, &mut Witness::default(), 0.0)
        };
        assert!(occludes(&at(0.0, 0.0, -5.0), &at(0.0, 0.0, -20.0)));
        assert!(!occludes(&at(0.0, 0.0, -25.0), &at(0.0, 0.0, -20.0)));
        assert!(!occludes(&at(12.0, 0.0, -5.0), &at(0.0, 0.0, -20.0)));
        // The eye inside the body in front: it occludes everything.
        assert!(occludes(&at(0.0, 0.0, 0.0), &at(0.0, 0.0, 20.0)));
    }

    proptest! {
        /// Spheres know their distance; polyhedra of many corners come near them.
        #[test]
        fn balls_agree_with_their_distance(x in -3.0..3.0f64, y in -3.0..3.0f64, z in -3.0..3.0f64, r in 0.1..2.0f64) {
            let ball: Vec<DVec3> = (0..400).map(|i| {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 400.0;
                let (s, c) = (f64::from(i) * 2.399_963).sin_cos();
                DVec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), z)
            }).collect();
            let hull = Hull::around(&ball).unwrap();
            let (here, there) = (DAffine3::IDENTITY, DAffine3::from_scale_rotation_translation(
                DVec3::splat(r), glam::DQuat::from_rotation_x(x), DVec3::new(x, y, z)));
            let body = |pose| Body { hull: &hull, outer_from_hull: pose, with_origin: false };
            let mut witness = Witness::default();
            let found = disjoint(&body(&here), &body(&there), &mut witness, 0.0);
            let gap = DVec3::new(x, y, z).length() - 1.0 - r;
            if gap > 0.0 { prop_assert!(found) }
            if gap < -0.05 * (1.0 + r) { prop_assert!(!found) }
            prop_assert_eq!(disjoint(&body(&here), &body(&there), &mut witness, 0.0), found);
        }
    }
}
