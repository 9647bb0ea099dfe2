//! The kd-tree over extents of [Snyder & Lengyel 1997, §5.2], kept from frame to frame.
//!
//! A node halves its members along one of the directions; who lies on both sides is in both halves. Which direction
//! is settled when the tree is built, by the least cost (the longer half plus what is shared); where, anew each
//! frame, from a list of the members' ends that stays sorted by insertion. A tree whose leaves cost
//! half as much again as when it was built is built anew in the background, from the extents of the frame in which that was seen; the
//! old one serves meanwhile. The new one takes over a fixed number of frames later, ready or not, so that the order
//! does not depend on how fast a thread was.
//!
//! Angles are periodic: an interval across the branch cut goes to both halves wherever angles are halved, and
//! intervals are compared on the circle at the leaves.
//!
//! [`Faces`](super::faces::Faces) is the faster way to the same candidates and the default.

use super::extents::{CUT, Direction, Interval, TURN};
use crate::geometry::Hull;
use glam::{DAffine3, DVec3};
use std::thread::JoinHandle;

/// A node with fewer members is a leaf.
const LEAST_HALVED: usize = 10;
/// Halving must take at least this many members off the longer half.
const LEAST_GAIN: usize = 4;
/// A tree is built anew when its burden is so many times what it was when it was built.
const GROWTH: f64 = 1.5;
/// Frames for which a tree is built in the background.
const FRAMES_TO_BUILD: u32 = 8;
/// The directions that are measured unless others are set: two angles about axes at right angles, and the depth at
/// right angles to both, as in [Snyder & Lengyel 1997, §5.1], but the world's instead of the camera's.
const USUAL: [Direction; 3] = [
    Direction::Angular { zero: DVec3::NEG_Z, positive: DVec3::X },
    Direction::Angular { zero: DVec3::NEG_Z, positive: DVec3::Y },
    Direction::Spatial(DVec3::Z),
];

/// An end of a member's interval.
#[derive(Clone, Copy, Debug)]
struct Bound {
    at: f64,
    member: u32,
    upper: bool,
}

impl Bound {
    /// Upper bounds come before lower ones at the same place.
    fn key(&self) -> (f64, bool) {
        (self.at, !self.upper)
    }

    fn before(&self, other: &Bound) -> bool {
        self.key().0.total_cmp(&other.key().0).then(self.key().1.cmp(&other.key().1)).is_lt()
    }
}

#[derive(Clone, Debug)]
enum Kind {
    Leaf(Vec<u32>),
    Halved { direction: usize, at: f64, bounds: Vec<Bound>, children: [u32; 2] },
}

#[derive(Clone, Debug)]
struct Node {
    kind: Kind,
    /// Members that are not out.
    active: u32,
}

/// What pieces measure along each direction.
#[derive(Clone, Debug)]
struct Extents {
    directions: Vec<Direction>,
    /// For each piece one for each direction.
    intervals: Vec<Interval>,
}

/// A tree that is built in the background.
#[derive(Debug)]
struct Building {
    tree: JoinHandle<Vec<Node>>,
    /// It takes over when this is 0.
    frames: u32,
}

/// The tree, and the extents it is over.
#[derive(Debug)]
pub(super) struct KdTree {
    extents: Extents,
    nodes: Vec<Node>,
    building: Option<Building>,
    summits: Vec<[u32; 2]>,
    present: Vec<bool>,
    /// Who has been found by the query that is under way, and who is a member of the node that is worked on.
    marks: Vec<u32>,
    mark: u32,
    /// Its burden when it was built.
    built_burden: usize,
    /// How often it was built.
    pub(super) builds: u64,
}

impl Extents {
    fn is_angle(&self, direction: usize) -> bool {
        matches!(self.directions[direction], Direction::Angular { .. })
    }

    fn of(&self, piece: u32) -> &[Interval] {
        let k = self.directions.len();
        &self.intervals[piece as usize * k..(piece as usize + 1) * k]
    }

    /// The interval that decides in which half a member is.
    fn span(&self, member: u32, direction: usize) -> Interval {
        let interval = self.of(member)[direction];
        let across_cut = self.is_angle(direction) && interval.high >= CUT + TURN;
        if across_cut { Interval { low: CUT - 1.0, high: CUT + TURN + 1.0 } } else { interval }
    }

    /// Builds the tree over `members` at the end of `nodes`; `before` is how many the parent had.
    fn grow(&self, nodes: &mut Vec<Node>, members: &[u32], before: usize) -> u32 {
        let number = nodes.len() as u32;
        let active = members.len() as u32;
        nodes.push(Node { kind: Kind::Leaf(members.to_vec()), active });
        if members.len() < LEAST_HALVED || before.saturating_sub(members.len()) < LEAST_GAIN {
            return number;
        }
        let mut best: Option<(usize, usize, f64, Vec<Bound>)> = None;
        for direction in 0..self.directions.len() {
            let mut bounds = self.bounds(members, direction);
            bounds.sort_by(|a, b| a.key().0.total_cmp(&b.key().0).then(a.key().1.cmp(&b.key().1)));
            let (cost, at) = least_cost(&bounds);
            if best.as_ref().is_none_or(|b| cost < b.0) {
                best = Some((cost, direction, at, bounds));
            }
        }
        let Some((_, direction, at, bounds)) = best else { return number };
        let halves = self.halves(members, direction, at);
        if halves.iter().any(|h| members.len() - h.len().min(members.len()) < LEAST_GAIN) {
            return number;
        }
        let children = halves.map(|half| self.grow(nodes, &half, members.len()));
        nodes[number as usize].kind = Kind::Halved { direction, at, bounds, children };
        number
    }

    fn bounds(&self, members: &[u32], direction: usize) -> Vec<Bound> {
        let ends = members.iter().flat_map(|&member| {
            let span = self.span(member, direction);
            [Bound { at: span.low, member, upper: false }, Bound { at: span.high, member, upper: true }]
        });
        ends.collect()
    }

    /// Members with something below `at`, and with something above it.
    fn halves(&self, members: &[u32], direction: usize, at: f64) -> [Vec<u32>; 2] {
        let span = |m: &u32| self.span(*m, direction);
        let below = members.iter().copied().filter(|m| span(m).low <= at).collect();
        let above = members.iter().copied().filter(|m| span(m).high > at).collect();
        [below, above]
    }
}

impl Default for KdTree {
    fn default() -> Self {
        KdTree {
            extents: Extents { directions: USUAL.to_vec(), intervals: Vec::new() },
            nodes: Vec::new(),
            building: None,
            summits: Vec::new(),
            present: Vec::new(),
            marks: Vec::new(),
            mark: 0,
            built_burden: 0,
            builds: 0,
        }
    }
}

impl KdTree {
    /// Measures along these directions from now on. As many as before, and near them: the tree stays.
    pub(super) fn set_directions(&mut self, directions: &[Direction]) {
        let kind = |d: &Direction| matches!(d, Direction::Angular { .. });
        if !directions.iter().map(kind).eq(self.extents.directions.iter().map(kind)) {
            self.nodes.clear();
            self.building = None;
            self.extents.intervals.clear();
            self.summits.clear();
        }
        self.extents.directions = directions.to_vec();
    }

    /// Forgets who is there; `pieces` is how many there are.
    pub(super) fn clear(&mut self, pieces: usize) {
        let ends = pieces * self.extents.directions.len();
        self.extents.intervals.resize(ends, Interval::default());
        self.summits.resize(ends, [0; 2]);
        self.marks.resize(pieces, 0);
        self.present.clear();
        self.present.resize(pieces, false);
    }

    /// Measures a piece, whose pose is relative to the eye.
    pub(super) fn add(&mut self, piece: u32, hull: &Hull, pose: &DAffine3) {
        self.present[piece as usize] = true;
        let Extents { directions, intervals } = &mut self.extents;
        let first = piece as usize * directions.len();
        for (at, direction) in (first..).zip(directions) {
            intervals[at] = direction.extent(hull, pose, &mut self.summits[at]);
        }
    }

    /// Brings the tree up to date with what was measured.
    pub(super) fn update(&mut self) {
        let members: Vec<u32> =
            (0..self.present.len() as u32).filter(|&p| self.present[p as usize]).collect();
        let due = |building: &mut Building| {
            building.frames = building.frames.saturating_sub(1);
            building.frames == 0
        };
        if let Some(building) = self.building.take_if(due) {
            // A thread that failed leaves no tree: it is built at once.
            self.nodes = building.tree.join().unwrap_or_default();
            self.count_build();
        }
        if self.nodes.is_empty() {
            self.building = None;
            self.extents.grow(&mut self.nodes, &members, usize::MAX);
            self.count_build();
            return;
        }
        self.rebalance(0, &members);
        let is_worse = self.burden(0) as f64 > GROWTH * self.built_burden.max(256) as f64;
        if is_worse && self.building.is_none() {
            let extents = self.extents.clone();
            let build = move || {
                let mut nodes = Vec::new();
                extents.grow(&mut nodes, &members, usize::MAX);
                nodes
            };
            let tree = std::thread::Builder::new().name("kd-tree".into()).spawn(build);
            // Without a thread there is no better tree; it is tried again in the next frame.
            self.building = tree.ok().map(|tree| Building { tree, frames: FRAMES_TO_BUILD });
        }
    }

    fn count_build(&mut self) {
        self.built_burden = self.burden(0);
        self.builds += 1;
    }

    /// What queries cost: the square of the members, over all leaves. It grows where members are in several leaves, and
    /// where a leaf has come to hold many.
    fn burden(&self, node: u32) -> usize {
        match &self.nodes[node as usize].kind {
            Kind::Leaf(members) => members.len() * members.len(),
            Kind::Halved { children, .. } => children.iter().map(|&c| self.burden(c)).sum(),
        }
    }

    /// Makes `members` those of the node and, where it is halved, halves them anew along the same direction.
    fn rebalance(&mut self, node: u32, members: &[u32]) {
        let at = node as usize;
        self.nodes[at].active = members.len() as u32;
        let Kind::Halved { direction, mut bounds, children, .. } =
            std::mem::replace(&mut self.nodes[at].kind, Kind::Leaf(Vec::new()))
        else {
            self.nodes[at].kind = Kind::Leaf(members.to_vec());
            return;
        };
        self.mark = self.mark.wrapping_add(2);
        let (wanted, had) = (self.mark, self.mark + 1);
        members.iter().for_each(|&m| self.marks[m as usize] = wanted);
        bounds.retain(|b| self.marks[b.member as usize] >= wanted);
        for bound in &mut bounds {
            let span = self.extents.span(bound.member, direction);
            bound.at = if bound.upper { span.high } else { span.low };
        }
        bounds.iter().for_each(|b| self.marks[b.member as usize] = had);
        insertion_sort(&mut bounds);
        let new: Vec<u32> = members.iter().copied().filter(|&m| self.marks[m as usize] == wanted).collect();
        if !new.is_empty() {
            bounds.extend(self.extents.bounds(&new, direction));
            // Two sorted runs, one of them after sorting: a merge.
            bounds.sort_by(|a, b| a.key().0.total_cmp(&b.key().0).then(a.key().1.cmp(&b.key().1)));
        }
        let (_, place) = least_cost(&bounds);
        let halves = self.extents.halves(members, direction, place);
        for (child, half) in children.into_iter().zip(&halves) {
            self.rebalance(child, half);
        }
        self.nodes[at].kind = Kind::Halved { direction, at: place, bounds, children };
    }

    /// Takes a piece out of the counts: it is not to be found any more.
    pub(super) fn deactivate(&mut self, piece: u32) {
        let mut work = vec![0];
        while let Some(node) = work.pop() {
            let node = &mut self.nodes[node as usize];
            node.active -= 1;
            if let Kind::Halved { direction, at, children, .. } = node.kind {
                let span = self.extents.span(piece, direction);
                work.extend((span.low <= at).then_some(children[0]));
                work.extend((span.high > at).then_some(children[1]));
            }
        }
    }

    fn allowed(&self, front: u32, query: &[Interval]) -> bool {
        let meet = |(d, (front, query)): (usize, (&Interval, &Interval))| match self.extents.is_angle(d) {
            true => front.meets_around(query),
            false => front.meets(query),
        };
        self.extents.of(front).iter().zip(query).enumerate().all(meet)
    }

    /// Calls `found` with every piece that is not out and whose extents allow that it occludes `piece`.
    pub(super) fn occluders(&mut self, piece: u32, alive: &[bool], mut found: impl FnMut(u32)) {
        // The eye is the origin: along the line, from it to the piece.
        let reach = |(d, interval): (usize, &Interval)| {
            if self.extents.is_angle(d) { *interval } else { interval.with(0.0) }
        };
        let query: Vec<Interval> = self.extents.of(piece).iter().enumerate().map(reach).collect();
        self.mark = self.mark.wrapping_add(2);
        let mut work = vec![0];
        while let Some(node) = work.pop() {
            let node = &self.nodes[node as usize];
            if node.active == 0 {
                continue;
            }
            match &node.kind {
                Kind::Halved { direction, at, children, .. } => {
                    let interval = query[*direction];
                    let across = self.extents.is_angle(*direction) && interval.high >= CUT + TURN;
                    work.extend((across || interval.low <= *at).then_some(children[0]));
                    work.extend((across || interval.high > *at).then_some(children[1]));
                }
                Kind::Leaf(members) => {
                    for &member in members {
                        let seen = self.marks[member as usize] == self.mark;
                        if member == piece || seen || !alive[member as usize] {
                            continue;
                        }
                        self.marks[member as usize] = self.mark;
                        if self.allowed(member, &query) {
                            found(member);
                        }
                    }
                }
            }
        }
    }
}

/// The least cost of halving, and where: right after an upper bound (§5.2.1).
fn least_cost(bounds: &[Bound]) -> (usize, f64) {
    let n = bounds.len() / 2;
    let (mut lower, mut upper) = (0, 0);
    let mut best = (usize::MAX, 0.0);
    for bound in bounds {
        if bound.upper {
            upper += 1;
            let cost = lower.max(n - upper) + (lower - upper);
            if cost < best.0 {
                best = (cost, bound.at);
            }
        } else {
            lower += 1;
        }
    }
    best
}

fn insertion_sort(bounds: &mut [Bound]) {
    for i in 1..bounds.len() {
        let bound = bounds[i];
        let mut to = i;
        while to > 0 && bound.before(&bounds[to - 1]) {
            bounds[to] = bounds[to - 1];
            to -= 1;
        }
        bounds[to] = bound;
    }
}
