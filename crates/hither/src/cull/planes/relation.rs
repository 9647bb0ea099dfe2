//! How one occluder stands to one occludee: the two tests of the paper [Coorg & Teller 1996, §2.1], for
//! boxes and for pieces of polygons.
//!
//! **Full.** All supporting planes are satisfied: the whole occludee is inside the plane of the eye and each
//! side, and beyond the occluder. **Partial.** All separating planes are: some of it is inside each, and
//! some beyond. **None** otherwise.
//!
//! *Corners by table.* Of a box's corners, the one that lies least far along a normal n has, on each axis,
//! the greater coordinate where n is negative there and the smaller one where it is positive, and the one
//! that lies farthest the other way round: eight entries for the eight patterns of signs. With n split into
//! its positive part p and its negative part m, that is `p · min + m · max` and `p · max + m · min`.
//!
//! *What makes "beyond" sound.* A plane with the eye and the occluder on one side and the occludee on the
//! other: a sight line leaves the first side only once, and the occluder is met before. The occluder's own
//! plane serves, or, where it fails (an occludee round the corner of a room), one across an axis.
//!
//! *How long it holds.* If the plane of the eye and a side's line, which is ℓ away, leaves a point at
//! distance d, and the point is ρ from the line, then the plane turned about the line reaches it when the
//! eye has moved ℓ d / ρ. While the eye has moved less than that from where the test was made, no plane has
//! been crossed, and nothing need be tested. The same bound answers for all eyes within a distance at once.

use super::ROUNDING;
use super::frame::{Active, Frame, SidePlane};
use crate::geometry::Aabb;
use glam::DVec3;

/// A convex occludee, relative to the eye.
pub(super) trait Occludee {
    /// Least and greatest distance from the eye along `plane`'s normal.
    fn extent(&self, plane: &SidePlane) -> (f64, f64);
    /// Least and greatest `normal · v`.
    fn along(&self, normal: DVec3) -> (f64, f64);
    /// Box around it.
    fn corners(&self) -> (DVec3, DVec3);
    /// Middle and radius of a ball around it, and how far the ball reaches from the eye.
    fn ball(&self) -> Ball;
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub centre: DVec3,
    pub radius: f64,
    pub farthest: f64,
}

impl Ball {
    fn around(min: DVec3, max: DVec3) -> Ball {
        let (centre, radius) = ((min + max) * 0.5, (max - min).length() * 0.5);
        Ball { centre, radius, farthest: centre.length() + radius }
    }
}

/// A box.
pub(super) struct BoxAt {
    pub min: DVec3,
    pub max: DVec3,
    ball: Ball,
}

impl BoxAt {
    pub fn new(bounds: &Aabb, eye: DVec3) -> BoxAt {
        let (min, max) = (bounds.min - eye, bounds.max - eye);
        BoxAt { min, max, ball: Ball::around(min, max) }
    }
}

impl Occludee for BoxAt {
    #[inline]
    fn extent(&self, plane: &SidePlane) -> (f64, f64) {
        let (p, m) = (plane.positive, plane.negative);
        (p.dot(self.min) + m.dot(self.max), p.dot(self.max) + m.dot(self.min))
    }

    fn along(&self, normal: DVec3) -> (f64, f64) {
        let (p, m) = (normal.max(DVec3::ZERO), normal.min(DVec3::ZERO));
        (p.dot(self.min) + m.dot(self.max), p.dot(self.max) + m.dot(self.min))
    }

    fn corners(&self) -> (DVec3, DVec3) {
        (self.min, self.max)
    }

    fn ball(&self) -> Ball {
        self.ball
    }
}

/// The convex hull of some points.
pub(super) struct Points<'a> {
    points: &'a [DVec3],
    ball: Ball,
}

impl Points<'_> {
    /// `points` and the middle of the ball around them are relative to the eye.
    pub fn new(points: &[DVec3], centre: DVec3, radius: f64) -> Points<'_> {
        Points { points, ball: Ball { centre, radius, farthest: centre.length() + radius } }
    }
}

impl Occludee for Points<'_> {
    fn extent(&self, plane: &SidePlane) -> (f64, f64) {
        self.along(plane.normal)
    }

    fn along(&self, normal: DVec3) -> (f64, f64) {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in self.points {
            let height = p.dot(normal);
            least = least.min(height);
            most = most.max(height);
        }
        (least, most)
    }

    fn corners(&self) -> (DVec3, DVec3) {
        let b = Aabb::around(self.points.iter().copied());
        (b.min, b.max)
    }

    fn ball(&self) -> Ball {
        self.ball
    }
}

/// How an occluder stands to an occludee, and for how far a motion of the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relation {
    pub kind: Kind,
    /// Bit i: side i's supporting plane is not satisfied.
    pub violated: u32,
    /// All of the occludee is beyond.
    pub beyond: bool,
    /// As long as the eye has moved less, all of this holds.
    pub holds: f64,
    /// As long as the eye has moved less, the satisfied supporting planes are, and it is beyond.
    pub satisfied_holds: f64,
}

/// The relations of §2.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    None,
    Partial,
    Full,
}

/// Sides whose extents are kept from the first pass to the second; of more, they are found again.
const KEPT: usize = 6;

/// Tests `active` against `occludee`. A supporting plane counts as satisfied only if it is by more than
/// rounding, and for every eye within the frame's reach.
pub(super) fn relate(frame: &Frame, active: &Active, occludee: &impl Occludee) -> Relation {
    let none =
        |holds| Relation { kind: Kind::None, violated: !0, beyond: false, holds, satisfied_holds: 0.0 };
    let (low, high) = occludee.along(active.normal);
    let ball = occludee.ball();
    let slack = ROUNDING * ball.farthest;
    if low > active.lowest - slack {
        // All of it is on the eye's side of the plane, whatever the eye: the plane does not move.
        return none(f64::INFINITY);
    }
    let (beyond, beyond_holds) = if high < active.lowest - slack {
        (true, f64::INFINITY)
    } else {
        let gap = axis_gap(active, occludee);
        (gap > slack, gap.abs())
    };
    let planes = &frame.sides[active.sides.0 as usize..active.sides.1 as usize];
    let off_line = |plane: &SidePlane| (ball.centre - plane.point).cross(plane.along).length() + ball.radius;
    // Most pairs end here, at a side that all of the occludee is outside of.
    let mut extents = [(0.0, 0.0); KEPT];
    for (i, plane) in planes.iter().enumerate() {
        let extent = occludee.extent(plane);
        if extent.1 <= 0.0 {
            return none(-extent.1 * plane.distance / off_line(plane));
        }
        if let Some(kept) = extents.get_mut(i) {
            *kept = extent;
        }
    }
    let (mut violated, mut holds, mut satisfied_holds) = (0u32, f64::INFINITY, f64::INFINITY);
    for (i, plane) in planes.iter().enumerate() {
        let (least, most) = extents.get(i).copied().unwrap_or_else(|| occludee.extent(plane));
        let off_line = off_line(plane);
        let per_metre = plane.distance / off_line;
        let turned = if frame.reach > 0.0 { frame.reach / per_metre } else { 0.0 };
        let needed = plane.margin * ball.farthest + turned;
        if least > needed && frame.reach < plane.distance {
            let room = (least - needed) * per_metre;
            satisfied_holds = satisfied_holds.min(room);
            holds = holds.min(room);
        } else {
            violated |= 1 << i;
            holds = holds.min((needed - least).abs() * per_metre).min(most * per_metre);
        }
    }
    let kind = if violated == 0 && beyond { Kind::Full } else { Kind::Partial };
    Relation {
        kind,
        violated,
        beyond,
        holds: holds.min(beyond_holds),
        satisfied_holds: satisfied_holds.min(beyond_holds),
    }
}

/// By how much an axis separates the occluder and the eye from the occludee; negative where none does.
fn axis_gap(active: &Active, occludee: &impl Occludee) -> f64 {
    let (min, max) = occludee.corners();
    (min - active.max).max(active.min - max).max_element()
}
