//! Occluders that do not touch and hide together: what the paper leaves to the future (§5), where a sound
//! test is cheap.
//!
//! Seen from the eye, an occludee is a convex polygon. The planes of an occluder's sides cut it into the
//! part inside all of them, which is hidden if the occludee is beyond the occluder, and convex parts outside
//! one of them, which are left to the next occluder. If nothing is left, the occludee is hidden. This is the
//! clipping of the paper's figure 2, of one occludee against the few occluders that partially hide it; the
//! number of parts is bounded, and where it is exceeded, the occludee counts as seen.
//!
//! *Not monotone.* Only the first [`MOST_OCCLUDERS`] are tried, and at most [`MOST_PARTS`] parts looked at. One more
//! occluder may take the place of one that was needed, or cut what is left into more parts: with more occluders in
//! use, a polygon that was found hidden may count as seen again. More are hidden nearly always, and none wrongly.
//!
//! *Rounding.* What is dropped as inside must be inside by more than a margin; what is kept as outside is
//! cut with twice that margin, so that the two overlap. Points are cut on segments between points of the
//! occludee, so they stay in it.

use super::frame::{Active, Frame, SidePlane};
use super::relation::{Occludee, Relation};
use glam::DVec3;
use std::sync::LazyLock;

/// Parts examined before giving up.
const MOST_PARTS: u32 = 48;
/// Occluders tried, those with the fewest unsatisfied planes first.
const MOST_OCCLUDERS: usize = 12;

/// Memory that is used again.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    parts: Vec<(Vec<DVec3>, usize)>,
    spare: Vec<Vec<DVec3>>,
    order: Vec<(u32, u16)>,
    /// Parts that the last call looked at.
    pub examined: u32,
}

/// Whether the occludee, whose `outline` is given in order as seen from the eye, is hidden by `candidates`
/// together. Holds for this eye only.
pub(super) fn hides(
    frame: &Frame,
    candidates: &[(u16, Relation)],
    occludee: &impl Occludee,
    outline: &[DVec3],
    scratch: &mut Scratch,
    used: &mut Vec<u16>,
) -> bool {
    let Scratch { parts, spare, order, examined } = scratch;
    *examined = 0;
    order.clear();
    let usable = candidates.iter().filter(|(_, r)| r.beyond);
    order.extend(usable.map(|(slot, r)| (r.violated.count_ones(), *slot)));
    if order.len() < 2 || outline.len() < 3 || frame.reach > 0.0 {
        return false;
    }
    order.sort_unstable();
    order.truncate(MOST_OCCLUDERS);
    let farthest = occludee.ball().farthest;
    // Each corner, and the middle, must be inside some occluder: most occludees end here.
    let covered = |p: &DVec3| {
        order.iter().any(|(_, slot)| {
            let active = &frame.active[usize::from(*slot)];
            let mut sides = frame.sides[active.sides.0 as usize..active.sides.1 as usize].iter();
            sides.all(|s| p.dot(s.normal) > s.margin * farthest)
        })
    };
    if !covered(&occludee.ball().centre) || !outline.iter().all(covered) {
        return false;
    }
    spare.extend(parts.drain(..).map(|p| p.0));
    push(parts, spare, outline, 0);
    while let Some((part, at)) = parts.pop() {
        *examined += 1;
        let Some(&(_, slot)) = order.get(at) else {
            spare.push(part);
            return false;
        };
        if *examined > MOST_PARTS {
            return false;
        }
        subtract(frame, &frame.active[usize::from(slot)], &part, at + 1, farthest, parts, spare);
        spare.push(part);
    }
    used.clear();
    used.extend(order.iter().map(|o| o.1));
    true
}

fn push(parts: &mut Vec<(Vec<DVec3>, usize)>, spare: &mut Vec<Vec<DVec3>>, points: &[DVec3], next: usize) {
    let mut part = spare.pop().unwrap_or_default();
    part.clear();
    part.extend_from_slice(points);
    parts.push((part, next));
}

/// Pushes what of `part` is outside one of the occluder's sides.
fn subtract(
    frame: &Frame,
    active: &Active,
    part: &[DVec3],
    next: usize,
    farthest: f64,
    parts: &mut Vec<(Vec<DVec3>, usize)>,
    spare: &mut Vec<Vec<DVec3>>,
) {
    let sides = &frame.sides[active.sides.0 as usize..active.sides.1 as usize];
    // Wholly outside one of them: nothing is gained by cutting.
    if sides.iter().any(|s| part.iter().all(|p| p.dot(s.normal) <= s.margin * farthest)) {
        push(parts, spare, part, next);
        return;
    }
    let mut inside = part.to_vec();
    for side in sides {
        let margin = side.margin * farthest;
        if inside.iter().all(|p| p.dot(side.normal) > margin) {
            continue;
        }
        if !margin.is_finite() {
            push(parts, spare, part, next);
            return;
        }
        let outside = cut(&inside, side, |d| 2.0 * margin - d);
        if outside.len() >= 3 {
            push(parts, spare, &outside, next);
        }
        inside = cut(&inside, side, |d| d - margin);
        if inside.len() < 3 {
            return;
        }
    }
}

/// The part of a convex polygon where `height` of the distance from the side's plane is not negative.
fn cut(polygon: &[DVec3], side: &SidePlane, height: impl Fn(f64) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (hp, hq) = (height(p.dot(side.normal)), height(q.dot(side.normal)));
        if hp >= 0.0 {
            kept.push(*p);
        }
        if (hp >= 0.0) != (hq >= 0.0) {
            kept.push(p.lerp(*q, hp / (hp - hq)));
        }
    }
    kept
}

/// The outline of a box that does not hold the eye, as corners in order: four or six of them. `min` and
/// `max` are relative to the eye.
pub(super) fn box_outline(min: DVec3, max: DVec3, outline: &mut Vec<DVec3>) {
    outline.clear();
    let mut at = 0;
    for axis in 0..3 {
        let place = if min[axis] > 0.0 { 1 } else { 2 * usize::from(max[axis] < 0.0) };
        at = at * 3 + place;
    }
    outline.extend(OUTLINES[at].iter().map(|corner| {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    }));
}

/// For each of the 27 places of an eye (below, above or between the box's faces on each axis) the corners
/// of the outline in order; bit a of a corner's number says which end of axis a.
static OUTLINES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| (0..27).map(outline_from).collect());

fn outline_from(place: usize) -> Vec<u8> {
    // 1: the eye is below the box's lower face; 2: above the upper one.
    let of_axis = |axis: usize| place / 3usize.pow(2 - axis as u32) % 3;
    let seen = |axis: usize, upper: bool| of_axis(axis) == if upper { 2 } else { 1 };
    // An edge along an axis lies between two faces; it is on the outline if one of them is seen.
    let mut edges = Vec::new();
    for corner in 0..8u8 {
        for axis in (0..3).filter(|a| corner >> a & 1 == 0) {
            let faces = (0..3).filter(|&f| f != axis).filter(|&f| seen(f, corner >> f & 1 == 1)).count();
            if faces == 1 {
                edges.push((corner, corner | 1 << axis));
            }
        }
    }
    let Some(&(first, mut at)) = edges.first() else { return Vec::new() };
    let mut outline = vec![first];
    let mut last = first;
    while at != first {
        outline.push(at);
        let onward = edges.iter().find_map(|&(a, b)| match at {
            _ if a == at && b != last => Some(b),
            _ if b == at && a != last => Some(a),
            _ => None,
        });
        (last, at) = (at, onward.unwrap_or(first));
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_of_boxes_hold_all_corners() {
        let mut outline = Vec::new();
        for place in 0..27 {
            let of_axis =
                |axis: usize| [(-1.0, 1.0), (2.0, 5.0), (-4.0, -1.5)][place / 3usize.pow(axis as u32) % 3];
            let [x, y, z] = [0, 1, 2].map(of_axis);
            let (min, max) = (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1));
            box_outline(min, max, &mut outline);
            if place == 0 {
                assert!(outline.is_empty());
                continue;
            }
            assert!(outline.len() == 4 || outline.len() == 6, "{place}: {outline:?}");
            let middle = (min + max) * 0.5;
            let n = outline.len();
            let turn = outline[0].cross(outline[1]).dot(middle).signum();
            for i in 0..n {
                let normal = outline[i].cross(outline[(i + 1) % n]) * turn;
                for corner in 0..8 {
                    let pick = |a: usize| if corner >> a & 1 == 0 { min[a] } else { max[a] };
                    let corner = DVec3::new(pick(0), pick(1), pick(2));
                    assert!(normal.dot(corner) > -1e-9, "{place} {i}: {corner}");
                }
            }
        }
    }
}
