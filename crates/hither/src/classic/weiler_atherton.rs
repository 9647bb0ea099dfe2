//! Weiler and Atherton: clip polygons against polygons, and show what is in front.
//!
//! [`clip`] splits a concave polygon with holes by another into the part inside and the part outside. All
//! crossings of their outlines go into both outlines in order. From a crossing where the first outline enters
//! the second, one follows the first to where it leaves, then the second to where the first enters again, and
//! so on round to the start: that is a piece inside. Outside pieces start where the first leaves, and follow
//! the second backwards.
//!
//! [`weiler_atherton`] takes the nearest polygon, splits all others by it, drops what is behind it, and starts
//! again with any that turns out to be in front. Polygons must not pass through each other.

use super::newell::Facet;
use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// A closed line of corners; the inside is to its left, for x to the right and y up.
pub type Contour = Vec<DVec2>;

/// Outlines and holes together, in any order.
pub type Region = Vec<Contour>;

/// A region in two parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clipped {
    /// What is in the other region.
    pub inside: Region,
    /// What is not.
    pub outside: Region,
}

/// Area of a region; holes count as negative.
pub fn area(region: &Region) -> f64 {
    let twice = |c: &Contour| (0..c.len()).map(|i| c[i].perp_dot(c[(i + 1) % c.len()])).sum::<f64>();
    region.iter().map(twice).sum::<f64>() * 0.5
}

/// Splits `subject` by `other`. `None` if a corner of one lies on the outline of the other, or corners or
/// edges coincide: move one of them a little.
pub fn clip(subject: &Region, other: &Region) -> Option<Clipped> {
    let walk = Outlines::new(subject, other)?;
    let mut clipped = walk.pieces();
    for (ring, contour) in subject.iter().enumerate() {
        if walk.subject[ring].iter().all(|node| node.crossing.is_none()) {
            let part = if contains(other, contour[0]) { &mut clipped.inside } else { &mut clipped.outside };
            part.push(contour.clone());
        }
    }
    for (ring, contour) in other.iter().enumerate() {
        if walk.other[ring].iter().all(|node| node.crossing.is_none()) && contains(subject, contour[0]) {
            clipped.inside.push(contour.clone());
            clipped.outside.push(contour.iter().rev().copied().collect());
        }
    }
    Some(clipped)
}

/// A corner, or a crossing by its number.
#[derive(Clone, Copy, Debug)]
struct Node {
    point: DVec2,
    crossing: Option<usize>,
}

/// Where two outlines cross.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    point: DVec2,
    /// Whether the subject comes into the other region here.
    enters: bool,
    /// Edge and place along it, of the subject and of the other.
    on_subject: (usize, usize, f64),
    on_other: (usize, usize, f64),
}

/// Both sets of outlines with their crossings, and where each crossing is in them.
struct Outlines {
    subject: Vec<Vec<Node>>,
    other: Vec<Vec<Node>>,
    enters: Vec<bool>,
    at_subject: Vec<(usize, usize)>,
    at_other: Vec<(usize, usize)>,
}

impl Outlines {
    fn new(subject: &Region, other: &Region) -> Option<Outlines> {
        let mut crossings = Vec::new();
        for (i, s) in subject.iter().enumerate() {
            for (j, o) in other.iter().enumerate() {
                for m in 0..s.len() {
                    for n in 0..o.len() {
                        let [p, q] = [s[m], s[(m + 1) % s.len()]];
                        let [a, b] = [o[n], o[(n + 1) % o.len()]];
                        if let Some((t, u, enters)) = cross(p, q, a, b)? {
                            let (on_subject, on_other) = ((i, m, t), (j, n, u));
                            crossings.push(Crossing { point: p.lerp(q, t), enters, on_subject, on_other });
                        }
                    }
                }
            }
        }
        let (subject, at_subject) = rings(subject, &crossings, |c| c.on_subject);
        let (other, at_other) = rings(other, &crossings, |c| c.on_other);
        let enters = crossings.iter().map(|c| c.enters).collect();
        Some(Outlines { subject, other, enters, at_subject, at_other })
    }

    fn pieces(&self) -> Clipped {
        Clipped { inside: self.round(true), outside: self.round(false) }
    }

    /// The pieces that begin where the subject enters (or leaves) the other region.
    fn round(&self, inside: bool) -> Region {
        let mut done = vec![false; self.enters.len()];
        let mut region = Region::new();
        for start in 0..self.enters.len() {
            if self.enters[start] != inside || done[start] {
                continue;
            }
            let mut contour = Contour::new();
            let mut at = start;
            loop {
                done[at] = true;
                let turn = follow(&self.subject, self.at_subject[at], true, &mut contour);
                at = follow(&self.other, self.at_other[turn], inside, &mut contour);
                if at == start || done[at] {
                    break;
                }
            }
            region.push(contour);
        }
        region
    }
}

/// Walks along an outline from a crossing to the next; notes the points on the way but the last.
fn follow(rings: &[Vec<Node>], (ring, from): (usize, usize), forward: bool, contour: &mut Contour) -> usize {
    let nodes = &rings[ring];
    let mut at = from;
    loop {
        contour.push(nodes[at].point);
        at = if forward { (at + 1) % nodes.len() } else { (at + nodes.len() - 1) % nodes.len() };
        if let Some(crossing) = nodes[at].crossing {
            return crossing;
        }
    }
}

/// Outlines with the crossings on them in order; and the place of each crossing.
fn rings(
    region: &Region,
    crossings: &[Crossing],
    on: impl Fn(&Crossing) -> (usize, usize, f64),
) -> (Vec<Vec<Node>>, Vec<(usize, usize)>) {
    let mut places = vec![(0, 0); crossings.len()];
    let mut all = Vec::new();
    for (ring, contour) in region.iter().enumerate() {
        let mut nodes = Vec::new();
        for (edge, &point) in contour.iter().enumerate() {
            nodes.push(Node { point, crossing: None });
            let here = |c: &&(usize, &Crossing)| (on(c.1).0, on(c.1).1) == (ring, edge);
            let numbered: Vec<(usize, &Crossing)> = crossings.iter().enumerate().collect();
            let mut found: Vec<_> = numbered.iter().filter(here).collect();
            found.sort_by(|a, b| on(a.1).2.total_cmp(&on(b.1).2));
            for &&(number, crossing) in &found {
                places[number] = (ring, nodes.len());
                nodes.push(Node { point: crossing.point, crossing: Some(number) });
            }
        }
        all.push(nodes);
    }
    (all, places)
}

/// Where the edges p–q and a–b cross: places along both, and whether q is to the left of a–b. Outer `None`
/// if three of the points are on a line where that matters.
fn cross(p: DVec2, q: DVec2, a: DVec2, b: DVec2) -> Option<Option<(f64, f64, bool)>> {
    let apart = |x: [f64; 2], y: [f64; 2]| x[0].max(x[1]) < y[0].min(y[1]) || y[0].max(y[1]) < x[0].min(x[1]);
    if apart([p.x, q.x], [a.x, b.x]) || apart([p.y, q.y], [a.y, b.y]) {
        return Some(None);
    }
    let turn = |a: DVec2, b: DVec2, c: DVec2| {
        let at = |p: DVec2| Coord { x: p.x, y: p.y };
        orient2d(at(a), at(b), at(c))
    };
    let (sp, sq) = (turn(a, b, p), turn(a, b, q));
    let (sa, sb) = (turn(p, q, a), turn(p, q, b));
    if (sp > 0.0 && sq > 0.0) || (sp < 0.0 && sq < 0.0) || (sa > 0.0 && sb > 0.0) || (sa < 0.0 && sb < 0.0) {
        return Some(None);
    }
    if [sp, sq, sa, sb].contains(&0.0) {
        return None;
    }
    Some(Some((sp / (sp - sq), sa / (sa - sb), sq > 0.0)))
}

fn contains(region: &Region, p: DVec2) -> bool {
    let mut inside = false;
    for c in region {
        for (i, &a) in c.iter().enumerate() {
            let b = c[(i + 1) % c.len()];
            if (a.y <= p.y) != (b.y <= p.y) && a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)) > p.x {
                inside = !inside;
            }
        }
    }
    inside
}

/// As [`clip`], with `other` moved by a few millionths, each region in a direction of its own: pieces of one
/// facet share edges to the last bit or nearly, and an outline that runs along another has no crossings that
/// can be put in order.
fn clip_anyway(subject: &Region, other: &Region) -> Clipped {
    let bits = other.iter().flatten().fold(0u64, |h, p| {
        (h ^ p.x.to_bits().rotate_left(17) ^ p.y.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    });
    for attempt in 0..32u32 {
        let turn = (bits.rotate_left(attempt) >> 11) as f64;
        let aside = DVec2::from_angle(turn) * (2e-6 + 1e-7 * f64::from(attempt));
        let moved: Region = other.iter().map(|c| c.iter().map(|p| *p + aside).collect()).collect();
        if let Some(clipped) = clip(subject, &moved) {
            return clipped;
        }
    }
    Clipped { inside: Region::new(), outside: subject.clone() }
}

/// The outline of a facet on the paper, inside to the left.
fn outline(facet: &Facet) -> Region {
    let mut contour: Contour = facet.points.iter().map(|p| p.truncate()).collect();
    if area(&vec![contour.clone()]) < 0.0 {
        contour.reverse();
    }
    vec![contour]
}

/// A part of a facet that is still to be shown.
#[derive(Clone, Debug)]
struct Fragment {
    of: usize,
    region: Region,
}

/// The visible part of each facet, by their number. Facets must not pass through each other.
pub fn weiler_atherton(facets: &[Facet]) -> Vec<Region> {
    let mut fragments: Vec<Fragment> = facets
        .iter()
        .enumerate()
        .map(|(of, f)| Fragment { of, region: outline(f) })
        .filter(|f| area(&f.region) > 0.0)
        .collect();
    let nearest = |of: usize| facets[of].points.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
    fragments.sort_by(|a, b| nearest(b.of).total_cmp(&nearest(a.of)));
    let mut shown = vec![Region::new(); facets.len()];
    while !fragments.is_empty() {
        let first = fragments[0].of;
        fragments = subdivide(facets, first, fragments, &mut vec![first], &mut shown);
    }
    shown
}

/// Shows what is seen within the outline of facet `first`; returns what is outside of it.
fn subdivide(
    facets: &[Facet],
    first: usize,
    fragments: Vec<Fragment>,
    busy: &mut Vec<usize>,
    shown: &mut [Region],
) -> Vec<Fragment> {
    let frame = outline(&facets[first]);
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for fragment in fragments {
        if fragment.of == first {
            inside.push(fragment);
            continue;
        }
        let clipped = clip_anyway(&fragment.region, &frame);
        for (region, list) in [(clipped.inside, &mut inside), (clipped.outside, &mut outside)] {
            if area(&region).abs() > 1e-12 {
                list.push(Fragment { of: fragment.of, region });
            }
        }
    }
    inside.retain(|f| f.of == first || !is_behind(facets, f, first));
    // What is in front although its nearest point is not is shown first.
    while let Some(offender) = inside.iter().map(|f| f.of).find(|of| *of != first && !busy.contains(of)) {
        busy.push(offender);
        inside = subdivide(facets, offender, inside, busy, shown);
        busy.pop();
    }
    for fragment in inside {
        shown[fragment.of].extend(fragment.region);
    }
    outside
}

/// Whether a fragment lies behind a facet: judged where the difference of their planes is largest.
fn is_behind(facets: &[Facet], fragment: &Fragment, first: usize) -> bool {
    let depth = |of: usize, p: DVec2| {
        let f = &facets[of];
        let n = f.normal();
        f.points[0].z - n.truncate().dot(p - f.points[0].truncate()) / n.z
    };
    let corners = fragment.region.iter().flatten();
    let differences = corners.map(|&p| depth(fragment.of, p) - depth(first, p));
    differences.max_by(|a, b| a.abs().total_cmp(&b.abs())).is_none_or(|d| d < 0.0)
}

/// The visible part of each facet of a list that is drawn from first to last, each over those before it.
pub fn painted(order: &[Facet]) -> Vec<Region> {
    let mut regions = Vec::new();
    for (i, facet) in order.iter().enumerate() {
        let mut region = outline(facet);
        for later in &order[i + 1..] {
            region = clip_anyway(&region, &outline(later)).outside;
        }
        regions.push(region);
    }
    regions
}

impl Facet {
    /// Perpendicular to the facet, as long as twice its area (Newell).
    pub(super) fn normal(&self) -> DVec3 {
        let n = self.points.len();
        (0..n)
            .map(|i| (self.points[i] - self.points[0]).cross(self.points[(i + 1) % n] - self.points[0]))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contour(points: &[[f64; 2]]) -> Contour {
        points.iter().map(|&p| p.into()).collect()
    }

    /// The lecture's example: S is A 1 4 B 2 6 C D 5 3 E, T is a 4 2 b 6 c 5 d e 3 1.
    #[test]
    fn the_lecture_clips_to_6_c_5_3_1_4_2() {
        let s = vec![contour(&[[0., 0.], [10., 0.], [10., 10.], [5., 12.], [0., 10.]])];
        let t = vec![contour(&[[3., -2.], [13., 4.], [6., 7.], [4., 14.], [1., 13.]])];
        let walk = Outlines::new(&s, &t).unwrap();
        let kinds = |ring: &Vec<Node>| ring.iter().map(|n| n.crossing.is_some()).collect::<Vec<bool>>();
        let [x, o] = [true, false];
        assert_eq!(kinds(&walk.subject[0]), [o, x, x, o, x, x, o, o, x, x, o]);
        assert_eq!(kinds(&walk.other[0]), [o, x, x, o, x, o, x, o, o, x, x]);
        let clipped = clip(&s, &t).unwrap();
        assert_eq!((clipped.inside.len(), clipped.inside[0].len()), (1, 7));
        // c is the only corner of either that is left; the six others are crossings.
        let corners: Vec<&DVec2> =
            s[0].iter().chain(&t[0]).filter(|p| clipped.inside[0].contains(p)).collect();
        assert_eq!(corners, [&DVec2::new(6., 7.)]);
        let whole = area(&clipped.inside) + area(&clipped.outside);
        assert!((whole - area(&s)).abs() < 1e-9);
        assert_eq!(clipped.outside.len(), 3);
    }

    #[test]
    fn holes_are_clipped_too() {
        let ring = vec![
            contour(&[[0., 0.], [10., 0.], [10., 10.], [0., 10.]]),
            contour(&[[3., 3.], [3., 7.], [7., 7.], [7., 3.]]),
        ];
        let bar = vec![contour(&[[-1., 4.], [11., 4.2], [11., 6.], [-1., 6.1]])];
        let clipped = clip(&ring, &bar).unwrap();
        assert_eq!(clipped.inside.len(), 2);
        assert!((area(&clipped.inside) + area(&clipped.outside) - 84.0).abs() < 1e-9);
        // A frame that holds all, and a spot in the hole.
        let frame = vec![contour(&[[-5., -5.], [15., -5.], [15., 15.], [-5., 15.]])];
        assert_eq!(area(&clip(&ring, &frame).unwrap().outside), 0.0);
        let spot = vec![contour(&[[4., 4.], [6., 4.], [6., 6.], [4., 6.]])];
        assert_eq!(area(&clip(&ring, &spot).unwrap().inside), 0.0);
        let island = vec![contour(&[[1., 1.], [2., 1.], [2., 2.], [1., 2.]])];
        assert_eq!(area(&clip(&ring, &island).unwrap().outside), 83.0);
    }

    #[test]
    fn what_is_not_in_general_position_is_refused() {
        let square = |x: f64| vec![contour(&[[x, 0.], [x + 1., 0.], [x + 1., 1.], [x, 1.]])];
        assert!(clip(&square(0.0), &square(1.0)).is_none());
        assert!(clip(&square(0.0), &square(0.0)).is_none());
        assert!(clip(&square(0.0), &square(3.0)).is_some());
    }
}
