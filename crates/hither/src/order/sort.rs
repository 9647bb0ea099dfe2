//! The incremental visibility sort.
//!
//! [Snyder & Lengyel 1997, §4] take the parts in last frame's order, put a part out when nothing that remains
//! occludes it, push it back behind its farthest occluder otherwise, and look for a cycle among the parts that
//! were pushed back. Here each part is visited in last frame's order, too, but its occluders are put out
//! *first*, by depth-first search, and the cycles are the strongly connected components that Tarjan's algorithm
//! (1972) finds on the way, in the order in which they must come:
//!
//! ```text
//! for each part A in last frame's order, if it is not out yet: visit(A)
//! visit(A): for each part B that is not out and may occlude A:      (extents, on a grid)
//!               if B has not been visited and occludes A: visit(B)  (exact test)
//!               if B is being visited and occludes A: they are in one cycle
//!           if A closes a component: put it out, and take its parts out of the grid
//! ```
//!
//! If the old order still holds, every query comes back empty and nothing is pushed anywhere. Each part is asked
//! for its occluders once, whatever happens; an arc is tested only while both ends remain, and only if it can
//! still change the answer. So the work is linear in the candidates; the paper's search is quadratic, and the
//! whole O(n⁴). A group is never tested as a whole, so that it cannot grow through the empty space between its
//! members (§5.3).

use super::extents::Direction;
use super::faces::Faces;
use super::kd_tree::KdTree;
use super::known::{Known, Says};
use super::pairs::{Pair, Pairs};
use super::{BroadPhase, Counters, Order, SortOptions};
use crate::geometry::{Body, Hull, Witness, disjoint};
use glam::{DAffine3, DVec3};
use std::cmp::Ordering;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::Range;

/// Parts whose poses are fetched at once.
const GATHERED: usize = 64;

/// Sorts parts front to back, frame after frame, and remembers what is worth remembering.
///
/// Parts are numbered in the order in which they are added, and so are their pieces; numbers are not used again.
#[derive(Debug, Default)]
pub struct VisibilitySort {
    pub(super) options: SortOptions,
    pub(super) hulls: Vec<Hull>,
    pub(super) pieces: Vec<Piece>,
    /// Where each piece is placed, by number, in world space.
    placed: Vec<DAffine3>,
    pub(super) parts: Vec<PartState>,
    /// For each pair the other way round, too, with the roles said.
    known: HashMap<u64, (Known, bool), BuildHasherDefault<PairHasher>>,
    pub(super) faces: Faces,
    tree: KdTree,
    pub(super) pairs: Pairs,
    pub(super) alive: Vec<bool>,
    search: Search,
    /// By seats.
    pub(super) seated: Order,
    /// By numbers.
    order: Order,
    /// Where each part is in `parts`, by number.
    pub(super) seats: Vec<u32>,
    pub(super) counters: Counters,
    pub(super) eye: DVec3,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Its number; where it is in the list is its seat.
    pub(super) number: u32,
    /// The seat of its part.
    pub(super) part: u32,
    hull: u32,
    /// Where it was in the last sort, relative to the eye.
    pose: DAffine3,
    /// Of a sphere around it, metres.
    radius: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct PartState {
    /// Its number; where it is in the list is its seat.
    pub(super) number: u32,
    pub(super) first_piece: u32,
    pub(super) end_piece: u32,
    shown: bool,
    /// Behind everything, whatever its hull says.
    backdrop: bool,
    /// Shown, and placed by finite numbers.
    pub(super) present: bool,
    has_known: bool,
    /// Distance of its nearest piece's centre from the eye.
    pub(super) distance: f64,
    /// Of the sphere around that piece.
    pub(super) radius: f64,
}

impl PartState {
    pub(super) fn pieces(&self) -> Range<usize> {
        self.first_piece as usize..self.end_piece as usize
    }
}

/// Tarjan's bookkeeping.
#[derive(Debug, Default)]
struct Search {
    /// When each part was visited, from 1; 0: not yet.
    index: Vec<u32>,
    low: Vec<u32>,
    /// Visited and not out.
    open: Vec<u32>,
    frames: Vec<Visit>,
    visited: u32,
}

/// A part whose candidates are being looked at.
#[derive(Clone, Copy, Debug)]
struct Visit {
    part: u32,
    next: u32,
    end: u32,
}

impl VisibilitySort {
    /// A sort without parts.
    pub fn new(options: SortOptions) -> VisibilitySort {
        VisibilitySort { options, ..VisibilitySort::default() }
    }

    /// Adds a hull that pieces may refer to; returns its number.
    pub fn add_hull(&mut self, hull: Hull) -> u32 {
        self.hulls.push(hull);
        self.hulls.len() as u32 - 1
    }

    /// Adds a part that is the union of pieces, one a hull number (a number may come twice), shown and placed at
    /// the origin; returns its number. Its pieces are numbered on from [`VisibilitySort::piece_count`]. A part
    /// without pieces occludes nothing and is occluded by nothing.
    ///
    /// # Panics
    /// If a hull does not exist.
    pub fn add_part(&mut self, hulls: &[u32]) -> u32 {
        let part = self.parts.len() as u32;
        let first_piece = self.pieces.len() as u32;
        for &hull in hulls {
            assert!((hull as usize) < self.hulls.len(), "hull {hull} does not exist");
            self.pieces.push(Piece {
                number: self.pieces.len() as u32,
                part,
                hull,
                pose: DAffine3::IDENTITY,
                radius: 0.0,
            });
            self.placed.push(DAffine3::IDENTITY);
        }
        let end_piece = self.pieces.len() as u32;
        // Seats are numbers where nothing has moved; what is new sits last in any case.
        self.seats.push(part);
        self.parts.push(PartState {
            number: part,
            first_piece,
            end_piece,
            shown: true,
            backdrop: false,
            present: false,
            has_known: false,
            distance: 0.0,
            radius: 0.0,
        });
        part
    }

    /// Number of parts that were ever added.
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Number of pieces that were ever added.
    pub fn piece_count(&self) -> usize {
        self.pieces.len()
    }

    /// Shows a part from the next frame on, or hides it. A part that is removed for good is hidden for good.
    pub fn show(&mut self, part: u32, shown: bool) {
        self.part_mut(part).shown = shown;
    }

    /// Says that a part is behind all others wherever the eye is, as a sky is: it comes last and occludes nothing.
    pub fn set_backdrop(&mut self, part: u32, backdrop: bool) {
        self.part_mut(part).backdrop = backdrop;
    }

    /// The directions of the kd-tree's extents, any number of them; it is used with
    /// [`BroadPhase::KdTree`] alone. Directions tied to a camera are set anew before each sort.
    pub fn set_directions(&mut self, directions: &[Direction]) {
        self.tree.set_directions(directions);
    }

    /// How often the kd-tree was built from nothing.
    pub fn tree_builds(&self) -> u64 {
        self.tree.builds
    }

    /// Places a piece. A pose that is not finite takes the whole part out of the order while it lasts.
    pub fn place(&mut self, piece: u32, world_from_piece: DAffine3) {
        self.placed[piece as usize] = world_from_piece;
    }

    /// Says what is known of two parts; the later word counts.
    pub fn know(&mut self, first: u32, second: u32, known: Known) {
        self.known.insert(pair_key(first, second), (known, true));
        self.known.insert(pair_key(second, first), (known, false));
        self.part_mut(first).has_known = true;
        self.part_mut(second).has_known = true;
    }

    fn part_mut(&mut self, number: u32) -> &mut PartState {
        &mut self.parts[self.seats[number as usize] as usize]
    }

    /// The number of the part that sits there.
    pub(super) fn number(&self, seat: u32) -> u32 {
        self.parts[seat as usize].number
    }

    /// Sorts the parts that are shown as seen from `eye`, in every direction.
    ///
    /// If the eye is not finite, nothing is sorted and the order is empty. Cost: linear in parts and candidate
    /// pairs; with nothing remembered the first order is by distance (n log n).
    pub fn sort(&mut self, eye: DVec3) -> &Order {
        self.counters = Counters::default();
        self.eye = eye;
        if self.options.broad_phase != BroadPhase::KdTree {
            self.give_seats();
        }
        self.measure();
        self.faces.build(self.options.broad_phase == BroadPhase::Grids);
        if self.options.broad_phase == BroadPhase::KdTree {
            self.tree.update();
        }
        let roots = self.roots();
        self.pairs.turn(self.parts.len());
        self.search.begin(self.parts.len());
        self.seated.clear();
        for part in roots {
            if self.search.index[part as usize] == 0 {
                self.visit(part);
            }
        }
        if self.options.conditioning {
            self.condition();
        }
        self.count();
        self.order.clear();
        self.order.parts.extend(self.seated.parts.iter().map(|&seat| self.parts[seat as usize].number));
        self.order.ends.extend_from_slice(&self.seated.ends);
        &self.order
    }

    /// The order that [`VisibilitySort::sort`] found last.
    pub fn order(&self) -> &Order {
        &self.order
    }

    /// What it did.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Finds the extents of everything that is shown.
    fn measure(&mut self) {
        self.faces.clear(self.pieces.len());
        let with_tree = self.options.broad_phase == BroadPhase::KdTree;
        if with_tree {
            self.tree.clear(self.pieces.len());
        }
        self.alive.clear();
        self.alive.resize(self.pieces.len(), false);
        for from in (0..self.parts.len()).step_by(GATHERED) {
            let end = self.parts.len().min(from + GATHERED);
            self.gather(from..end);
            for part in &mut self.parts[from..end] {
                let pieces = &self.pieces[part.pieces()];
                part.present = part.shown && self.eye.is_finite();
                part.present &= pieces.iter().all(|p| p.pose.is_finite());
                part.distance = f64::INFINITY;
                if !part.present || part.backdrop {
                    continue;
                }
                for (piece, seat) in pieces.iter().zip(part.first_piece..) {
                    let hull = &self.hulls[piece.hull as usize];
                    let center = piece.pose.transform_point3(hull.center());
                    let distance = center.length();
                    if distance < part.distance {
                        (part.distance, part.radius) = (distance, piece.radius);
                    }
                    self.alive[seat as usize] = true;
                    self.faces.add(seat, hull, &piece.pose, (center, piece.radius), self.options.slack);
                    if with_tree {
                        self.tree.add(seat, hull, &piece.pose);
                    }
                }
            }
        }
    }

    /// Fetches the poses of some parts' pieces. They are anywhere in memory; loads that do not wait for each other's
    /// use wait together.
    fn gather(&mut self, parts: Range<usize>) {
        let pieces =
            self.parts[parts.start].first_piece as usize..self.parts[parts.end - 1].end_piece as usize;
        for piece in &mut self.pieces[pieces] {
            let placed = &self.placed[piece.number as usize];
            piece.pose = DAffine3 { translation: placed.translation - self.eye, ..*placed };
            piece.radius = self.hulls[piece.hull as usize].radius() * stretch(&piece.pose);
        }
    }

    /// The parts in last frame's order, and after them the new ones by distance.
    fn roots(&mut self) -> Vec<u32> {
        let present = |part: u32| self.parts[part as usize].present;
        let mut is_old = vec![false; self.parts.len()];
        let mut roots = Vec::with_capacity(self.parts.len());
        if self.options.incremental {
            for &part in self.seated.parts.iter().filter(|&&part| present(part)) {
                is_old[part as usize] = true;
                roots.push(part);
            }
        }
        let from = roots.len();
        roots.extend((0..self.parts.len() as u32).filter(|&part| !is_old[part as usize] && present(part)));
        roots[from..].sort_by(|&a, &b| self.nearer(a, b));
        if self.parts.iter().any(|p| p.backdrop) {
            roots.sort_by_key(|&part| self.parts[part as usize].backdrop);
        }
        roots
    }

    /// Visits a part and all that must come before it.
    fn visit(&mut self, root: u32) {
        self.open(root);
        while let Some(visit) = self.search.frames.last().copied() {
            let part = visit.part as usize;
            if visit.next == visit.end {
                self.search.frames.pop();
                if self.search.low[part] == self.search.index[part] {
                    self.put_out(visit.part);
                }
                if let Some(below) = self.search.frames.last() {
                    let low = self.search.low[part];
                    let below = &mut self.search.low[below.part as usize];
                    *below = (*below).min(low);
                }
                continue;
            }
            if let Some(top) = self.search.frames.last_mut() {
                top.next += 1;
            }
            let pair = self.pairs.pairs[visit.next as usize];
            let front = self.pieces[pair.front as usize].part;
            let index = self.search.index[front as usize];
            // Out, or in the same component whatever the test says.
            if !self.alive[pair.front as usize] || (index != 0 && index >= self.search.low[part]) {
                continue;
            }
            if !self.occludes_as(visit.next as usize) {
                continue;
            }
            self.counters.arcs_found += 1;
            if index == 0 {
                self.open(front);
            } else {
                self.search.low[part] = self.search.low[part].min(index);
            }
        }
    }

    /// Lists the candidates of a part that is visited for the first time.
    fn open(&mut self, part: u32) {
        self.search.visited += 1;
        self.search.index[part as usize] = self.search.visited;
        self.search.low[part as usize] = self.search.visited;
        self.search.open.push(part);
        let start = self.pairs.pairs.len() as u32;
        for behind in self.parts[part as usize].pieces() {
            let behind = behind as u32;
            let (pairs, pieces) = (&mut self.pairs.pairs, &self.pieces);
            let found = |front: u32| {
                if pieces[front as usize].part != part {
                    pairs.push(Pair { front, behind });
                }
            };
            match self.options.broad_phase {
                BroadPhase::KdTree if self.alive[behind as usize] => {
                    self.tree.occluders(behind, &self.alive, found);
                }
                _ => self.faces.occluders(behind, found),
            }
        }
        let (next, end) = self.pairs.close(part, start);
        self.search.frames.push(Visit { part, next, end });
    }

    /// The component that `part` closes comes next in the order, nearest member first.
    fn put_out(&mut self, part: u32) {
        let from = self.seated.parts.len();
        loop {
            let member = self.search.open.pop().expect("a component ends with the part that opened it");
            for piece in self.parts[member as usize].pieces() {
                if self.options.broad_phase == BroadPhase::KdTree && self.alive[piece] {
                    self.tree.deactivate(piece as u32);
                }
                self.alive[piece] = false;
                self.faces.take_out(piece as u32);
            }
            self.seated.parts.push(member);
            if member == part {
                break;
            }
        }
        if self.seated.parts.len() - from > 1 {
            let mut group = self.seated.parts.split_off(from);
            group.sort_by(|&a, &b| self.nearer(a, b));
            self.seated.parts.append(&mut group);
        }
        self.seated.ends.push(self.seated.parts.len() as u32);
    }

    /// By the distance of the centre, then by number.
    fn nearer(&self, a: u32, b: u32) -> Ordering {
        let (a, b) = (&self.parts[a as usize], &self.parts[b as usize]);
        a.distance.total_cmp(&b.distance).then(a.number.cmp(&b.number))
    }

    /// The exact test of a listed pair.
    fn occludes_as(&mut self, at: usize) -> bool {
        let pair = self.pairs.pairs[at];
        let mut witness = self.pairs.witnesses[at];
        let result = self.occludes(pair, &mut witness);
        self.pairs.witnesses[at] = witness;
        result
    }

    /// Whether the front piece occludes the one behind, [Snyder & Lengyel 1997, §6].
    #[inline]
    pub(super) fn occludes(&mut self, pair: Pair, witness: &mut Witness) -> bool {
        let (front, behind) = (&self.pieces[pair.front as usize], &self.pieces[pair.behind as usize]);
        match self.known_says(front.part, behind.part) {
            Some(Says::No) => return false,
            Some(Says::Yes) => return true,
            Some(Says::AskHulls) | None => {}
        }
        self.counters.exact_tests += 1;
        let hull = |piece: &Piece| &self.hulls[piece.hull as usize];
        let shadow = Body { hull: hull(behind), outer_from_hull: &behind.pose, with_origin: true };
        let body = Body { hull: hull(front), outer_from_hull: &front.pose, with_origin: false };
        let mut margin = 0.0;
        if self.options.slack > 0.0 {
            let far = |body: &Body, radius: f64| body.center().length() + radius;
            margin = self.options.slack * far(&shadow, behind.radius).min(far(&body, front.radius));
        }
        !disjoint(&shadow, &body, witness, margin)
    }

    /// What is known of two parts, if anything.
    #[inline]
    pub(super) fn known_says(&self, front: u32, behind: u32) -> Option<Says> {
        if !self.parts[front as usize].has_known {
            return None;
        }
        let &(known, first) = self.known.get(&pair_key(self.number(front), self.number(behind)))?;
        Some(known.says(self.eye, first))
    }

    /// Whether two pieces intersect, wherever the eye is.
    pub(super) fn intersect(&self, a: u32, b: u32) -> bool {
        let body = |piece: u32| {
            let piece = &self.pieces[piece as usize];
            Body { hull: &self.hulls[piece.hull as usize], outer_from_hull: &piece.pose, with_origin: false }
        };
        !disjoint(&body(a), &body(b), &mut Witness::default(), 0.0)
    }

    fn count(&mut self) {
        let (cells, entries) = self.faces.size();
        let counters = &mut self.counters;
        counters.parts = self.seated.parts.len() as u64;
        counters.extents = self.faces.records.len() as u64;
        counters.cells = cells as u64;
        counters.cell_entries = entries as u64;
        counters.candidates = self.pairs.pairs.len() as u64;
        let sizes = self.seated.groups().map(|g| g.len() as u64).filter(|&n| n > 1);
        for size in sizes {
            counters.groups += 1;
            counters.grouped_parts += size;
            counters.largest_group = counters.largest_group.max(size);
        }
    }
}

impl Search {
    fn begin(&mut self, parts: usize) {
        self.index.clear();
        self.index.resize(parts, 0);
        self.low.clear();
        self.low.resize(parts, 0);
        self.open.clear();
        self.frames.clear();
        self.visited = 0;
    }
}

fn pair_key(front: u32, behind: u32) -> u64 {
    u64::from(front) << 32 | u64::from(behind)
}

/// Hashes a pair of parts by one multiplication: the numbers are our own, nobody chooses them to collide.
#[derive(Default)]
struct PairHasher(u64);

impl Hasher for PairHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.write_u64(u64::from(b)));
    }

    fn write_u64(&mut self, key: u64) {
        let product = u128::from(self.0 ^ key) * 0x9e37_79b9_7f4a_7c15_u128;
        self.0 = (product >> 64) as u64 ^ product as u64;
    }
}

/// An upper bound of how much a map stretches: its longest axis where the axes stand at right angles.
fn stretch(map: &DAffine3) -> f64 {
    let m = map.matrix3;
    let lengths = [m.x_axis, m.y_axis, m.z_axis].map(|a| a.length_squared());
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let skew =
        m.x_axis.dot(m.y_axis).abs().max(m.y_axis.dot(m.z_axis).abs()).max(m.z_axis.dot(m.x_axis).abs());
    if skew <= 1e-9 * longest { longest.sqrt() * (1.0 + 1e-8) } else { lengths.iter().sum::<f64>().sqrt() }
}
