//! Polygons with any number of corners, also concave ones, cut into triangles of the same corners.
//!
//! By clipping ears in the polygon's plane, with exact orientation tests [Meisters 1975; Shewchuk 1997].
//! Why the result is right: a cut replaces two edges by the diagonal that closes the ear, so the edges of all
//! triangles cancel except for the outline, and at every point the triangles' winding numbers add up to the
//! outline's. Where they all turn counter-clockwise and the outline goes round each point at most once,
//! they therefore cover its inside exactly once and nothing else. So only the *turn* of each cut matters;
//! the search for corners inside an ear merely keeps the clipping from getting stuck.
//!
//! A corner in the middle of a straight side stays a corner of some triangle: no crack opens towards a
//! neighbour that has it too. Holes joined to the outline by a double edge are cut out.
//!
//! Time, for a simple outline of n corners: about n log n in practice. A corner is looked at again only when that may
//! change the answer: a neighbour of it was cut off, or the corner that forbade it no longer does. What forbids an
//! ear is found in a tree ([`blockers`]). Outlines that defeat both end at [`MAX_LOOKS`].

mod blockers;

use blockers::Blockers;
use glam::{DVec3, Vec3};
use robust::{Coord, orient2d};
use std::collections::VecDeque;

/// How well the triangles match the outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fit {
    /// They cover it exactly; there are none if it has no area.
    Exact,
    /// The outline crosses itself: the triangles are a guess.
    CrossesItself,
    /// The outline is too intricate for the time that one polygon may take; there are no triangles.
    TooIntricate,
}

/// Corners and boxes of the tree that may be looked at for one polygon: some tenths of a second.
const MAX_LOOKS: u64 = 1 << 25;

/// No corner.
const NOBODY: u32 = u32::MAX;

/// Cuts polygons; keeps its lists between them.
#[derive(Debug, Default)]
pub(crate) struct Triangulator {
    flat: Vec<Coord<f64>>,
    previous: Vec<u32>,
    next: Vec<u32>,
    /// Corners that do not turn left: only such a corner can block an ear.
    blockers: Blockers,
    /// Corners to be tried, by caution, each with its stamp; one whose stamp has changed since is no longer there.
    queues: [VecDeque<(u32, u32)>; 3],
    stamps: Vec<u32>,
    /// The queue that a corner is in, or [`ELSEWHERE`].
    queue_of: Vec<u8>,
    waiting: Waiting,
    looks: u64,
}

/// Of a corner: it is in no queue.
const ELSEWHERE: u8 = u8::MAX;

/// Which corners wait for which other to block no longer.
#[derive(Debug, Default)]
struct Waiting {
    /// For each corner the last entry of `list` that waits for it, or [`NOBODY`].
    last: Vec<u32>,
    /// A corner that waits, and the entry before.
    list: Vec<(u32, u32)>,
    /// What a corner waits for.
    waits_for: Vec<u32>,
    /// Corners that forbade an ear at its very tip, which depends on their neighbours.
    at_a_tip: Vec<bool>,
}

impl Waiting {
    fn reset(&mut self, corners: usize) {
        self.list.clear();
        for list in [&mut self.last, &mut self.waits_for] {
            list.clear();
            list.resize(corners, NOBODY);
        }
        self.at_a_tip.clear();
        self.at_a_tip.resize(corners, false);
    }

    fn wait(&mut self, corner: u32, blocker: u32, at_its_tip: bool) {
        let last = &mut self.last[blocker as usize];
        self.list.push((corner, *last));
        *last = (self.list.len() - 1) as u32;
        self.waits_for[corner as usize] = blocker;
        self.at_a_tip[blocker as usize] |= at_its_tip;
    }
}

/// Which corners forbid an ear. A corner is tried with one when no other is left to be tried with the one before.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Caution {
    /// Those inside it or on its border.
    Closed,
    /// Those inside it.
    Open,
    /// None.
    Nothing,
}

const CAUTIONS: [Caution; 3] = [Caution::Closed, Caution::Open, Caution::Nothing];

impl Triangulator {
    /// Appends the triangles of the polygon with corners `points`, all finite, as indices into `points`.
    ///
    /// They face to where the polygon is counter-clockwise; none has zero area.
    /// Cost: linear for convex polygons, for others in practice not much more.
    pub(crate) fn triangulate(&mut self, points: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> Fit {
        match points {
            [] | [_] | [_, _] => Fit::Exact,
            &[a, b, c] => {
                if doubled_area(a, b, c) != DVec3::ZERO {
                    triangles.push([0, 1, 2]);
                }
                Fit::Exact
            }
            &[a, b, c, d] => quad([a, b, c, d], triangles),
            _ => {
                let before = triangles.len();
                let fit = self.clip(points, triangles);
                if fit == Fit::TooIntricate {
                    triangles.truncate(before);
                }
                fit
            }
        }
    }

    fn clip(&mut self, points: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> Fit {
        let Some(normal) = normal(points) else { return Fit::Exact };
        self.flatten(points, normal);
        self.looks = 0;
        self.link();
        self.begin(0);
        let (mut left, mut turned_over, mut any) = (points.len(), false, 0);
        while left >= 3 {
            self.looks += 1;
            if self.looks > MAX_LOOKS {
                return Fit::TooIntricate;
            }
            let Some((at, caution)) = self.take() else {
                if turned_over {
                    return Fit::CrossesItself;
                }
                // What is left goes round the other way, as one half of a figure eight does.
                turned_over = true;
                std::mem::swap(&mut self.previous, &mut self.next);
                self.begin(any);
                continue;
            };
            let (a, c) = (self.previous[at as usize], self.next[at as usize]);
            let turn = self.turn(a, at, c);
            let ear = turn > 0.0 && self.is_clear(a, at, c, caution);
            if ear || (turn == 0.0 && self.doubles_back(a, at, c)) {
                if ear {
                    triangles.push(if turned_over { [c, at, a] } else { [a, at, c] });
                }
                self.remove(at);
                (left, any) = (left - 1, c);
            }
        }
        if turned_over { Fit::CrossesItself } else { Fit::Exact }
    }

    /// Drops the axis that is closest to the normal. Unlike a rotation into the plane, that is exact.
    fn flatten(&mut self, points: &[Vec3], normal: DVec3) {
        let size = normal.abs();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] < 0.0 {
            std::mem::swap(&mut u, &mut v);
        }
        self.flat.clear();
        self.flat.extend(points.iter().map(|p| Coord { x: f64::from(p[u]), y: f64::from(p[v]) }));
    }

    /// Links the corners to a ring. A corner that repeats another is cut off like a spike later on.
    fn link(&mut self) {
        let n = self.flat.len() as u32;
        self.previous.clear();
        self.previous.extend((0..n).map(|i| if i == 0 { n - 1 } else { i - 1 }));
        self.next.clear();
        self.next.extend((0..n).map(|i| if i + 1 == n { 0 } else { i + 1 }));
    }

    /// Finds what blocks in the ring that `start` is in, and queues all of the ring to be tried.
    fn begin(&mut self, start: u32) {
        let n = self.flat.len();
        self.waiting.reset(n);
        self.stamps.clear();
        self.stamps.resize(n, 0);
        self.queue_of.clear();
        self.queue_of.resize(n, ELSEWHERE);
        self.queues.iter_mut().for_each(VecDeque::clear);
        self.blockers.clear(n);
        let mut at = start;
        loop {
            let next = self.next[at as usize];
            if self.turn(self.previous[at as usize], at, next) <= 0.0 {
                self.blockers.add(at);
            }
            self.put(at, Caution::Closed);
            at = next;
            if at == start {
                break;
            }
        }
        self.blockers.build(&self.flat);
    }

    /// Puts a corner at the end of a queue, whichever it was in.
    fn put(&mut self, corner: u32, caution: Caution) {
        let stamp = &mut self.stamps[corner as usize];
        *stamp += 1;
        self.queue_of[corner as usize] = caution as u8;
        self.queues[caution as usize].push_back((corner, *stamp));
    }

    /// Takes the next corner to be tried, with the most caution that is left.
    fn take(&mut self) -> Option<(u32, Caution)> {
        for caution in CAUTIONS {
            while let Some((corner, stamp)) = self.queues[caution as usize].pop_front() {
                if self.stamps[corner as usize] == stamp {
                    self.queue_of[corner as usize] = ELSEWHERE;
                    return Some((corner, caution));
                }
            }
        }
        None
    }

    fn remove(&mut self, at: u32) {
        let (a, c) = (self.previous[at as usize], self.next[at as usize]);
        self.next[a as usize] = c;
        self.previous[c as usize] = a;
        self.queue_of[at as usize] = ELSEWHERE;
        self.waiting.waits_for[at as usize] = NOBODY;
        self.blockers.remove(at);
        self.wake(at);
        for end in [a, c] {
            let blocked = self.blockers.contains(end);
            let blocks = self.turn(self.previous[end as usize], end, self.next[end as usize]) <= 0.0;
            match (blocked, blocks) {
                (false, true) => self.blockers.add_late(end),
                (true, false) => self.blockers.remove(end),
                _ => {}
            }
            if blocked && (!blocks || self.waiting.at_a_tip[end as usize]) {
                self.wake(end);
            }
        }
        if self.queue_of[a as usize] != Caution::Closed as u8 {
            self.put(a, Caution::Closed);
        }
        // Going on beyond the next corner makes rounder triangles than a fan.
        self.put(c, Caution::Closed);
    }

    /// Tries anew what `blocker` has forbidden until now.
    fn wake(&mut self, blocker: u32) {
        let mut entry = std::mem::replace(&mut self.waiting.last[blocker as usize], NOBODY);
        while let Some(&(corner, before)) = self.waiting.list.get(entry as usize) {
            self.looks += 1;
            if self.waiting.waits_for[corner as usize] == blocker {
                self.waiting.waits_for[corner as usize] = NOBODY;
                if self.queue_of[corner as usize] != Caution::Closed as u8 {
                    self.put(corner, Caution::Closed);
                }
            }
            entry = before;
        }
    }

    /// Positive if the path over three corners turns left, 0 if it does not turn or turns back.
    fn turn(&self, a: u32, b: u32, c: u32) -> f64 {
        orient2d(self.flat[a as usize], self.flat[b as usize], self.flat[c as usize])
    }

    /// Whether the path, which does not turn at `b`, goes back to where it came from or stands still.
    fn doubles_back(&self, a: u32, b: u32, c: u32) -> bool {
        let [a, b, c] = [a, b, c].map(|i| self.flat[i as usize]);
        let between = |p: f64, q: f64, r: f64| (p < q && q < r) || (p > q && q > r);
        !between(a.x, b.x, c.x) && !between(a.y, b.y, c.y)
    }

    /// Whether no corner forbids the ear `b` between `a` and `c`. If one does, the ear waits for it, and is queued to
    /// be tried with less caution.
    fn is_clear(&mut self, a: u32, b: u32, c: u32, caution: Caution) -> bool {
        let less = match caution {
            Caution::Closed => Caution::Open,
            Caution::Open => Caution::Nothing,
            Caution::Nothing => return true,
        };
        let ear = [a, b, c].map(|i| self.flat[i as usize]);
        let mut looks = 0;
        let mut blockers = std::mem::take(&mut self.blockers);
        let forbids = |p| p != a && p != b && p != c && self.forbids(p, [a, b, c], caution);
        let found = blockers.find_in(ear, &self.flat, &mut looks, forbids);
        self.blockers = blockers;
        self.looks += looks;
        let Some(blocker) = found else { return true };
        let at_its_tip = same(self.flat[blocker as usize], ear[1]);
        self.waiting.wait(b, blocker, at_its_tip);
        self.put(b, less);
        false
    }

    fn forbids(&self, p: u32, [a, b, c]: [u32; 3], caution: Caution) -> bool {
        let at = self.flat[p as usize];
        let is_at = |corner: u32| same(at, self.flat[corner as usize]);
        if is_at(b) {
            // The outline passes the tip a second time: does it enter the ear there?
            let enters = |to: u32| self.turn(a, b, to) > 0.0 && self.turn(b, c, to) > 0.0;
            return enters(self.previous[p as usize]) || enters(self.next[p as usize]);
        }
        // At the ends of the diagonal it cannot enter without another corner inside.
        if is_at(a) || is_at(c) {
            return false;
        }
        let sides = [self.turn(a, b, p), self.turn(b, c, p), self.turn(c, a, p)];
        match caution {
            Caution::Closed => sides.iter().all(|&s| s >= 0.0),
            Caution::Open => sides.iter().all(|&s| s > 0.0),
            Caution::Nothing => false,
        }
    }
}

fn same(p: Coord<f64>, q: Coord<f64>) -> bool {
    p.x == q.x && p.y == q.y
}

/// Normal of triangle `a b c`, as long as twice its area. Differences of `f32` neither overflow nor vanish.
pub(crate) fn doubled_area(a: Vec3, b: Vec3, c: Vec3) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

/// A normal of the polygon's best plane (Newell), or `None` if all corners are on a line.
pub(crate) fn normal(points: &[Vec3]) -> Option<DVec3> {
    let fan = || points.windows(2).map(|w| doubled_area(points[0], w[0], w[1]));
    let sum: DVec3 = fan().sum();
    if sum != DVec3::ZERO {
        return Some(sum);
    }
    // An outline that crosses itself may enclose as much one way as the other.
    fan().find(|&n| n != DVec3::ZERO)
}

/// Cuts along the diagonal whose worse triangle is better: right for every quad that does not cross itself.
fn quad([a, b, c, d]: [Vec3; 4], triangles: &mut Vec<[u32; 3]>) -> Fit {
    let [abc, acd, abd, bcd] =
        [doubled_area(a, b, c), doubled_area(a, c, d), doubled_area(a, b, d), doubled_area(b, c, d)];
    let normal = abc + acd;
    let along_ac = abc.dot(normal).min(acd.dot(normal));
    let along_bd = abd.dot(normal).min(bcd.dot(normal));
    let (pair, worse) = if along_ac >= along_bd {
        ([([0, 1, 2], abc), ([0, 2, 3], acd)], along_ac)
    } else {
        ([([0, 1, 3], abd), ([1, 2, 3], bcd)], along_bd)
    };
    let mut some = false;
    for (triangle, area) in pair {
        if area != DVec3::ZERO {
            triangles.push(triangle);
            some = true;
        }
    }
    let crosses = worse < 0.0 || (some && normal == DVec3::ZERO);
    if crosses { Fit::CrossesItself } else { Fit::Exact }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashMap;

    fn cut(points: &[Vec3]) -> (Vec<[u32; 3]>, Fit) {
        let mut triangles = Vec::new();
        let fit = Triangulator::default().triangulate(points, &mut triangles);
        (triangles, fit)
    }

    /// Corners in the plane z = 0.
    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    /// The proof of the module's page: all triangles turn with the polygon, and their edges leave the outline.
    fn assert_covers(points: &[Vec3], triangles: &[[u32; 3]], area: f64) {
        let normal = normal(points).unwrap().normalize();
        let mut sum = 0.0;
        let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
        let key = |i: u32| points[i as usize].to_array().map(|c| (c + 0.0).to_bits());
        let mut add = |a: u32, b: u32, count: i32| {
            *edges.entry([key(a), key(b)]).or_default() += count;
            *edges.entry([key(b), key(a)]).or_default() -= count;
        };
        for &[a, b, c] in triangles {
            let [pa, pb, pc] = [a, b, c].map(|i| points[i as usize]);
            let turn = doubled_area(pa, pb, pc).dot(normal);
            assert!(turn > 0.0, "triangle {a} {b} {c} turns the other way");
            sum += turn * 0.5;
            for (p, q) in [(a, b), (b, c), (c, a)] {
                add(p, q, 1);
            }
        }
        for i in 0..points.len() as u32 {
            add(i, (i + 1) % points.len() as u32, -1);
        }
        assert!(edges.values().all(|&count| count == 0), "the outline is not what the triangles leave");
        assert!((sum - area).abs() <= 1e-5 * area, "area {sum} for {area}");
    }

    #[test]
    fn every_rotation_of_a_concave_quad_is_cut_at_its_notch() {
        let outline = [[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]];
        for turn in 0..4 {
            let mut points = flat(&outline);
            points.rotate_left(turn);
            let (triangles, fit) = cut(&points);
            assert_eq!(fit, Fit::Exact);
            assert_covers(&points, &triangles, 1.5);
        }
    }

    #[test]
    fn an_l_and_a_star_are_covered_in_any_plane() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let star: Vec<[f32; 2]> = (0..10)
            .map(|i| {
                let (angle, radius) = (i as f32 * 0.628_318_5, if i % 2 == 0 { 0.38 } else { 1.0 });
                [angle.cos() * radius, angle.sin() * radius]
            })
            .collect();
        for outline in [&l[..], &star] {
            let area = normal(&flat(outline)).unwrap().length() * 0.5;
            for plane in 0..6 {
                let points: Vec<Vec3> = flat(outline)
                    .iter()
                    .map(|p| match plane {
                        0 => *p,
                        1 => Vec3::new(p.y, p.x, 7.0),
                        2 => Vec3::new(5.0, p.x, p.y),
                        3 => Vec3::new(-5.0, p.y, p.x),
                        4 => Vec3::new(p.x, 3.0, p.y),
                        _ => Vec3::new(p.y, 3.0, p.x),
                    })
                    .collect();
                let (triangles, fit) = cut(&points);
                assert_eq!((fit, triangles.len()), (Fit::Exact, points.len() - 2));
                assert_covers(&points, &triangles, area);
            }
        }
    }

    #[test]
    fn corners_in_the_middle_of_a_side_are_kept() {
        let points = flat(&[
            [0.0, 0.0],
            [1.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [2.0, 2.0],
            [1.0, 2.0],
            [0.5, 2.0],
            [0.0, 2.0],
            [0.0, 1.0],
        ]);
        let (triangles, fit) = cut(&points);
        assert_eq!((fit, triangles.len()), (Fit::Exact, 7));
        assert_covers(&points, &triangles, 4.0);
        let quad = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 2.0]]);
        for turn in 0..4 {
            let mut points = quad.clone();
            points.rotate_left(turn);
            let (triangles, fit) = cut(&points);
            assert_eq!((fit, triangles.len()), (Fit::Exact, 2));
            assert_covers(&points, &triangles, 2.0);
        }
    }

    #[test]
    fn holes_joined_by_double_edges_stay_holes() {
        let mut outline = vec![[0.0, 0.0]];
        // A comb of bridges from the lower left corner's side to square holes.
        let holes = 12;
        for i in 0..holes {
            let x = 1.0 + 2.0 * i as f32;
            outline.extend([
                [x, 0.0],
                [x, 1.0],
                [x, 2.0],
                [x + 1.0, 2.0],
                [x + 1.0, 1.0],
                [x, 1.0],
                [x, 0.0],
            ]);
        }
        let end = 2.0 * holes as f32 + 1.0;
        outline.extend([[end, 0.0], [end, 3.0], [0.0, 3.0]]);
        let points = flat(&outline);
        let (triangles, fit) = cut(&points);
        assert_eq!(fit, Fit::Exact);
        assert_covers(&points, &triangles, f64::from(end * 3.0 - holes as f32));
    }

    #[test]
    fn what_has_no_area_gives_nothing_and_repeated_corners_do_no_harm() {
        let line = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.5, 0.0], [0.5, 0.0]]);
        for points in [&line[..], &line[..4], &line[..3], &line[..2], &[Vec3::ONE; 9]] {
            assert_eq!(cut(points), (vec![], Fit::Exact));
        }
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let points = flat(&square);
        let (triangles, fit) = cut(&points);
        assert_eq!((fit, triangles.len()), (Fit::Exact, 2));
        assert_covers(&points, &triangles, 1.0);
    }

    #[test]
    fn outlines_that_cross_themselves_stay_within_their_bounds() {
        let bow = flat(&[[3.0, 3.0], [4.0, 4.0], [4.0, 3.0], [3.0, 4.0]]);
        let (triangles, fit) = cut(&bow);
        assert!(fit == Fit::CrossesItself && triangles.len() <= 2);
        let eight = flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 1.0], [2.0, 0.0], [0.0, 2.0], [0.0, 1.0]]);
        let (triangles, fit) = cut(&eight);
        assert!(fit == Fit::CrossesItself && !triangles.is_empty());
    }

    #[test]
    fn extreme_sizes_neither_overflow_nor_vanish() {
        for scale in [1e-38f32, 1e-20, 1e18, 1e37] {
            let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
            let points: Vec<Vec3> = flat(&l).iter().map(|p| p * scale).collect();
            let (triangles, fit) = cut(&points);
            assert_eq!((fit, triangles.len()), (Fit::Exact, 4));
            assert_covers(&points, &triangles, 3.0 * f64::from(scale).powi(2));
        }
    }

    #[test]
    fn a_coast_of_many_corners_is_cut_in_time_and_a_maze_given_up() {
        let n = 20_000;
        let coast: Vec<[f32; 2]> = (0..n)
            .map(|i| {
                let angle = std::f32::consts::TAU * i as f32 / n as f32;
                let radius = 1.0 + 0.1 * (angle * 7.0).sin() + if i % 2 == 0 { 1e-4 } else { 0.0 };
                [angle.cos() * radius, angle.sin() * radius]
            })
            .collect();
        let points = flat(&coast);
        let (triangles, fit) = cut(&points);
        assert_eq!((fit, triangles.len()), (Fit::Exact, n - 2));
        // Long parallel teeth: every ear reaches over all of them.
        let teeth: Vec<[f32; 2]> = (0..60_000)
            .map(|i| {
                [if i % 2 == 0 { 0.0 } else { 1.0 + (i % 7) as f32 }, (i / 2) as f32 + (i % 2) as f32 * 900.0]
            })
            .collect();
        let mut comb = teeth.clone();
        comb.extend([[-1.0, 4e4], [-1.0, 0.0]]);
        let (triangles, fit) = cut(&flat(&comb));
        assert!(fit != Fit::TooIntricate || triangles.is_empty());
    }

    /// Teeth in a row, points up, as in a histogram drawn with a pen.
    fn comb(teeth: usize, height: impl Fn(usize) -> f32) -> Vec<[f32; 2]> {
        let mut outline = vec![[2.0 * teeth as f32, -1.0]];
        for i in (0..teeth).rev() {
            outline.extend([[2.0 * i as f32 + 2.0, 0.0], [2.0 * i as f32 + 1.0, height(i)]]);
        }
        outline.extend([[0.0, 0.0], [0.0, -1.0]]);
        outline
    }

    /// A band that goes round a centre many times: its inside is one long corridor.
    fn spiral(corners: usize, turns: f32) -> Vec<[f32; 2]> {
        let half = corners / 2;
        let at = |i: usize, radius: f32| {
            let angle = std::f32::consts::TAU * turns * i as f32 / half as f32;
            let radius = radius + angle;
            [angle.cos() * radius, angle.sin() * radius]
        };
        let outer = (0..half).map(|i| at(i, 4.0));
        outer.chain((0..half).rev().map(|i| at(i, 2.0))).collect()
    }

    #[test]
    fn simple_outlines_of_a_hundred_thousand_corners_are_cut() {
        let tall = |i: usize| 1000.0 + (i % 7) as f32;
        let slope = |i: usize| 1.0 + i as f32;
        let mut coast: Vec<[f32; 2]> = spiral(2 * 100_002, 1.0);
        coast.truncate(100_002);
        for outline in [
            comb(5_000, tall),
            comb(50_000, tall),
            comb(50_000, slope),
            comb(50_000, |_| 1.0),
            spiral(100_002, 3.0),
            spiral(100_002, 100.0),
            coast,
        ] {
            for axes in [[0, 1], [1, 0]] {
                let points: Vec<Vec3> =
                    outline.iter().map(|p| Vec3::new(p[axes[0]], p[axes[1]], 0.0)).collect();
                let (triangles, fit) = cut(&points);
                assert_eq!((fit, triangles.len()), (Fit::Exact, points.len() - 2));
                let area = normal(&points).unwrap().length() * 0.5;
                assert_covers(&points, &triangles, area);
            }
        }
    }

    #[test]
    fn many_holes_are_cut_out_and_a_tangle_ends() {
        // Holes on a grid, each joined to the one before by a double edge, the first of a row to the outline.
        let holes = 60;
        let mut outline = vec![[0.0, 0.0]];
        for row in 0..holes {
            let y = 2.0 * row as f32 + 1.0;
            outline.push([0.0, y]);
            let mut back = Vec::new();
            for column in 0..holes {
                let x = 2.0 * column as f32 + 1.0;
                outline.extend([[x, y], [x + 1.0, y]]);
                back.extend([[x, y], [x, y + 1.0], [x + 1.0, y + 1.0], [x + 1.0, y]]);
            }
            back.pop();
            outline.extend(back.into_iter().rev());
            outline.push([0.0, y]);
        }
        let side = 2.0 * holes as f32 + 1.0;
        outline.extend([[0.0, side], [side, side], [side, 0.0]]);
        outline.reverse();
        let points = flat(&outline);
        let (triangles, fit) = cut(&points);
        assert_eq!(fit, Fit::Exact);
        assert_covers(&points, &triangles, f64::from(side).powi(2) - (holes * holes) as f64);
        // Every edge crosses every other, nearly.
        let tangle: Vec<[f32; 2]> = (0..100_001u32)
            .map(|i| {
                let angle = std::f32::consts::TAU * (i as f32 * 50_000.0 / 100_001.0).fract();
                [angle.cos(), angle.sin()]
            })
            .collect();
        let (triangles, fit) = cut(&flat(&tangle));
        assert!(fit != Fit::Exact && (fit == Fit::CrossesItself || triangles.is_empty()));
    }

    /// Outlines that wind around a centre once: simple, whatever the radii.
    fn star_shaped() -> impl Strategy<Value = Vec<[f32; 2]>> {
        prop::collection::vec(1..=8u8, 5..40).prop_map(|radii| {
            let n = radii.len() as f32;
            let corner = |(i, r): (usize, &u8)| {
                let angle = std::f32::consts::TAU * i as f32 / n;
                [angle.cos() * f32::from(*r), angle.sin() * f32::from(*r)]
            };
            radii.iter().enumerate().map(corner).collect()
        })
    }

    /// Outlines of a histogram on a grid: full of collinear corners.
    fn skyline() -> impl Strategy<Value = Vec<[f32; 2]>> {
        prop::collection::vec(1..=4u8, 2..20).prop_map(|heights| {
            let mut outline: Vec<[f32; 2]> = Vec::new();
            for (i, &h) in heights.iter().enumerate() {
                outline.extend([[i as f32, f32::from(h)], [i as f32 + 1.0, f32::from(h)]]);
            }
            outline.dedup();
            outline.reverse();
            outline.splice(0..0, (0..=heights.len()).map(|i| [i as f32, 0.0]));
            outline
        })
    }

    proptest! {
        #[test]
        fn simple_outlines_are_covered_exactly(outline in prop_oneof![star_shaped(), skyline()], turn in 0usize..40) {
            let mut points = flat(&outline);
            let n = points.len();
            points.rotate_left(turn % n);
            let (triangles, fit) = cut(&points);
            prop_assert_eq!(fit, Fit::Exact);
            let area = normal(&points).unwrap().length() * 0.5;
            assert_covers(&points, &triangles, area);
            prop_assert_eq!(triangles.len(), n - 2);
        }

        #[test]
        fn any_outline_ends(outline in prop::collection::vec((0i8..4, 0i8..4, 0i8..3), 0..30)) {
            let points: Vec<Vec3> =
                outline.iter().map(|&(x, y, z)| Vec3::new(x.into(), y.into(), z.into())).collect();
            let (triangles, _) = cut(&points);
            for t in triangles {
                let [a, b, c] = t.map(|i| points[i as usize]);
                prop_assert!(doubled_area(a, b, c) != DVec3::ZERO);
            }
        }
    }
}
