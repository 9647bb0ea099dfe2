//! Extents of hulls along any directions, spatial and angular, tracked from frame to frame by hill climbing
//! [Snyder & Lengyel 1997, §5.1].
//!
//! An angle is measured as its *pseudoangle*, which grows with it and needs no arc tangent: four quadrants of
//! length 1, within each y / (|x| + |y|). That is the paper's comparison by quadrants (app. A) as a number. The
//! summits of an angle are climbed as tangents against a direction in the middle of the hull, crosswise.
//!
//! Angles are periodic, and their intervals are: one that lies across the branch cut behind begins before it and
//! ends beyond a full turn, and meets what lies on both sides. (The paper compares them as intervals of the
//! line and misses occlusion behind the eye.) A hull around the axis, or that a half plane through the axis cannot
//! hold, has the full circle.

use crate::geometry::Hull;
use glam::{DAffine3, DVec3};

/// A full turn as a pseudoangle.
pub(super) const TURN: f64 = 4.0;
/// The branch cut.
pub(super) const CUT: f64 = -2.0;
/// Extents are widened by this share of a turn, or of their ends.
const PAD: f64 = 1e-9;

/// A direction in which hulls are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direction {
    /// How far along a vector, from the eye.
    Spatial(DVec3),
    /// The angle about the axis at right angles to both vectors, which are at right angles and of one length: 0
    /// along `zero`, growing towards `positive`.
    Angular {
        /// Angle 0.
        zero: DVec3,
        /// A quarter turn.
        positive: DVec3,
    },
}

/// From `low` to `high`. For an angle `low` is in [−2, 2) and `high` at most one turn beyond it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
}

const FULL: Interval = Interval { low: CUT, high: CUT + TURN };

impl Interval {
    /// Whether two intervals on the line meet.
    pub(super) fn meets(&self, other: &Interval) -> bool {
        self.low <= other.high && other.low <= self.high
    }

    /// Whether two intervals on the circle meet.
    pub(super) fn meets_around(&self, other: &Interval) -> bool {
        let reaches = |a: &Interval, b: &Interval| (b.low - a.low).rem_euclid(TURN) <= a.high - a.low;
        reaches(self, other) || reaches(other, self)
    }

    /// Enlarged to hold a point of the line.
    pub(super) fn with(&self, point: f64) -> Interval {
        Interval { low: self.low.min(point), high: self.high.max(point) }
    }
}

impl Direction {
    /// The extent of a hull whose pose is relative to the eye. `summits` is where the last climbs ended.
    pub(super) fn extent(&self, hull: &Hull, pose: &DAffine3, summits: &mut [u32; 2]) -> Interval {
        let local = |d: DVec3| (pose.matrix3.transpose() * d, pose.translation.dot(d));
        match *self {
            Direction::Spatial(direction) => {
                let (d, offset) = local(direction);
                let mut reach = |d: DVec3, at: usize| {
                    summits[at] = hull.climb(d, summits[at]);
                    hull.vertices()[summits[at] as usize].dot(d)
                };
                let (low, high) = (offset - reach(-d, 0), offset + reach(d, 1));
                let pad = PAD * (low.abs().max(high.abs()));
                Interval { low: low - pad, high: high + pad }
            }
            Direction::Angular { zero, positive } => {
                let center = pose.transform_point3(hull.center());
                let (x, y) = (center.dot(zero), center.dot(positive));
                let length = x.hypot(y);
                // A direction in the middle, and one across it.
                let middle = (zero * x + positive * y) / length;
                let across = (positive * x - zero * y) / length;
                let z = local(middle);
                let least = hull.climb(-z.0, summits[0]);
                let nearest = hull.vertices()[least as usize].dot(z.0) + z.1;
                if length.is_nan() || nearest <= 1e-9 * length {
                    return FULL;
                }
                let a = local(across);
                let (first, low) = hull.climb_ratio((-a.0, -a.1), z, summits[0]);
                let (last, high) = hull.climb_ratio(a, z, summits[1]);
                *summits = [first, last];
                let angle = |tangent: f64| {
                    let d = middle + across * tangent;
                    pseudoangle(d.dot(zero), d.dot(positive))
                };
                let (low, mut high) = (angle(-low), angle(high));
                if high < low {
                    high += TURN;
                }
                Interval { low: low - PAD, high: high + PAD }.after_cut()
            }
        }
    }
}

impl Interval {
    /// The same arc with `low` in [−2, 2).
    fn after_cut(self) -> Interval {
        let low = CUT + (self.low - CUT).rem_euclid(TURN);
        Interval { low, high: low + (self.high - self.low).min(TURN) }
    }
}

/// Grows with the angle of (x, y) from −2 at a half turn to 2; 0 along x.
fn pseudoangle(x: f64, y: f64) -> f64 {
    let part = y / (x.abs() + y.abs());
    if x >= 0.0 {
        part
    } else if y >= 0.0 {
        2.0 - part
    } else {
        -2.0 - part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn pseudoangles_sort_as_angles_do() {
        let mut last = f64::NEG_INFINITY;
        for i in -1799..1800 {
            let (y, x) = (f64::from(i) * 0.1f64.to_radians()).sin_cos();
            let here = pseudoangle(x, y);
            assert!(here > last && (-2.0..=2.0).contains(&here), "{i}");
            last = here;
        }
    }

    #[test]
    fn arcs_meet_across_the_cut() {
        let arc = |low, high| Interval { low, high };
        assert!(arc(1.8, 2.2).meets_around(&arc(-1.9, -1.5)));
        assert!(arc(-1.9, -1.5).meets_around(&arc(1.8, 2.2)));
        assert!(!arc(1.8, 2.2).meets_around(&arc(-1.7, -1.5)));
        assert!(FULL.meets_around(&arc(0.3, 0.3)) && arc(0.3, 0.3).meets_around(&FULL));
        assert!(!arc(-0.5, 0.5).meets_around(&arc(0.6, 1.9)));
    }

    proptest! {
        /// Every direction of every corner lies in the extent, and its ends are corners.
        #[test]
        fn an_extent_holds_every_corner_and_no_more(
            center in prop::array::uniform3(-3.0..3.0f64), size in 0.01..2.0f64, turn in 0.0..6.0f64,
        ) {
            let corners: Vec<DVec3> = (0..40).map(|i| {
                let t = f64::from(i);
                DVec3::new((t * 0.7).sin(), (t * 1.1).cos(), (t * 0.31).sin()) * size
            }).collect();
            let hull = Hull::around(&corners).unwrap();
            let pose = DAffine3::from_translation(DVec3::from(center)) * DAffine3::from_rotation_z(turn);
            let direction = Direction::Angular { zero: DVec3::NEG_Z, positive: DVec3::X };
            let mut summits = [0, 3];
            let extent = direction.extent(&hull, &pose, &mut summits);
            let angle = |p: &DVec3| {
                let p = pose.transform_point3(*p);
                pseudoangle(-p.z, p.x)
            };
            for corner in &corners {
                let at = angle(corner);
                prop_assert!(extent.meets_around(&Interval { low: at, high: at }), "{extent:?} {at}");
            }
            if extent != FULL {
                let at_end = |end: f64| corners.iter().any(|c| {
                    let off = (angle(c) - end).rem_euclid(TURN);
                    off.min(TURN - off) < 1e-6
                });
                prop_assert!(at_end(extent.low) && at_end(extent.high));
            }
            prop_assert_eq!(direction.extent(&hull, &pose, &mut summits), extent);
        }
    }
}
