//! The hierarchical algorithm *Visible* [Coorg & Teller 1996, §3], for an eye that moves.
//!
//! ```text
//! Visible(S, T):  None of S occludes T at all          → everything below T is seen
//!                 one of S, or connected ones, hide T   → nothing is
//!                 else, with the S' that occlude T partially: the children of T, or the pieces of a leaf
//! ```
//!
//! Departures from the paper:
//!
//! 1. *What is remembered at a node* is not its list of planes but the distance to the nearest of them, as a
//!    reading of an odometer that counts the eye's way. Until the eye has come that far, and while the same
//!    occluders arrive from above, the node's state stands without a single inner product; a whole subtree
//!    does if all its nodes do.
//! 2. *Leaves are looked into.* The piece of each polygon in a partially hidden leaf is tested like a box.
//! 3. *Occluders that do not touch* are tried together where nothing else hides ([`super::fusion`]).
//!
//! A node outside the view's frustum is switched off: neither it nor what is below is touched, and what they
//! remember is good when they come back.
//!
//! Subtrees share nothing, so that they are worked on in parallel by rayon's work stealing: one thread goes
//! on with a child and leaves the other to be stolen, oldest first, as in the paper. Nothing depends on who
//! did what.

use super::connected::{SlotSet, hiding_set};
use super::frame::Frame;
use super::fusion::{self, box_outline};
use super::relation::{BoxAt, Kind, Occludee, Points, Relation, relate};
use super::tree::Tree;
use crate::geometry::Aabb;
use glam::DVec3;

/// What is known of a node, or of a polygon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Not looked at: outside the frustum, or below a node that is settled.
    #[default]
    Outside,
    /// Nothing in it can be seen.
    Hidden,
    /// Some of it may be hidden.
    Partial,
    /// No occluder in use hides any of it.
    Visible,
}

/// What a node remembers.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    pub state: State,
    /// Outside the frustum in the last frame; the rest is from before.
    pub outside: bool,
    /// What the odometer may read at most for `state` to stand, and for that of everything below.
    until: f64,
    until_below: f64,
    /// Ids of the occluders that arrived, and of those that were passed on.
    arrived: Vec<u32>,
    passed: Vec<u32>,
    /// Ids of those that hide it; of a partially hidden leaf, one for each piece that is hidden.
    pub hidden_by: Vec<u32>,
    /// Tests that were made when it was last tested.
    pub effort: u32,
}

impl Memory {
    /// Whatever arrives next is tested anew.
    pub fn forget(&mut self) {
        self.state = State::Outside;
    }

    /// Ids of the occluders that arrived.
    pub fn arrived(&self) -> &[u32] {
        &self.arrived
    }
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Nodes looked at.
    pub nodes_visited: u64,
    /// Of these, nodes whose state stood without a test.
    pub nodes_remembered: u64,
    /// Of these, nodes outside the frustum.
    pub nodes_outside: u64,
    /// Pairs of an occluder and a node that were tested.
    pub relations: u64,
    /// Pairs of an occluder and a piece of a polygon that were tested.
    pub piece_relations: u64,
    /// Nodes found hidden by one occluder, by connected ones, by separate ones together.
    pub hidden_by_one: u64,
    /// See `hidden_by_one`.
    pub hidden_by_connected: u64,
    /// See `hidden_by_one`.
    pub hidden_by_fusion: u64,
    /// Parts of occludees that were cut for that.
    pub fusion_parts: u64,
}

impl Work {
    /// All tests, in the time of one of an occluder against a box.
    pub(super) fn tests(&self) -> u64 {
        self.relations + self.piece_relations + 3 * self.fusion_parts
    }
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, o: Work) {
        self.nodes_visited += o.nodes_visited;
        self.nodes_remembered += o.nodes_remembered;
        self.nodes_outside += o.nodes_outside;
        self.relations += o.relations;
        self.piece_relations += o.piece_relations;
        self.hidden_by_one += o.hidden_by_one;
        self.hidden_by_connected += o.hidden_by_connected;
        self.hidden_by_fusion += o.hidden_by_fusion;
        self.fusion_parts += o.fusion_parts;
    }
}

/// Which tests are made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tests {
    pub connected: bool,
    pub fusion: bool,
    pub pieces: bool,
}

/// What all nodes of a frame share.
pub(super) struct Context<'a> {
    pub tree: &'a Tree,
    pub frame: &'a Frame,
    pub tests: Tests,
    /// Metres that the eye has gone.
    pub odometer: f64,
    /// Planes whose negative side is outside the view, as normal and offset.
    pub frustum: Option<&'a [(DVec3, f64)]>,
    /// Subtrees of fewer nodes are not split among threads.
    pub grain: u32,
}

/// A part of the tree with what it remembers.
pub(super) struct Subtree<'a> {
    /// Its first node.
    pub node: u32,
    /// Of its nodes, in order.
    pub memories: &'a mut [Memory],
    /// Of its pieces, in order: what is known of each, in leaves whose state is partial.
    pub pieces: &'a mut [State],
}

/// Memory that is used again; one for each thread's line of work.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    relations: Vec<(u16, Relation)>,
    members: Vec<(u16, Relation)>,
    set: SlotSet,
    fusion: fusion::Scratch,
    used: Vec<u16>,
    outline: Vec<DVec3>,
    points: Vec<DVec3>,
}

/// Visits a subtree at which the occluders `arriving` (ids, ascending) have arrived. Returns what was done and until
/// what reading of the odometer everything in it stands.
pub(super) fn visit(
    context: &Context,
    subtree: Subtree,
    arriving: &[u32],
    scratch: &mut Scratch,
) -> (Work, f64) {
    let mut work = Work { nodes_visited: 1, ..Work::default() };
    let node = &context.tree.nodes[subtree.node as usize];
    let Some((memory, below)) = subtree.memories.split_first_mut() else { return (work, 0.0) };
    if context.frustum.is_some_and(|planes| is_outside(&node.bounds, planes)) {
        memory.outside = true;
        work.nodes_outside += 1;
        return (work, 0.0);
    }
    memory.outside = false;
    let same = memory.state != State::Outside && memory.arrived == arriving;
    if same && context.odometer < memory.until_below && context.frustum.is_none() {
        work.nodes_remembered += 1;
        return (work, memory.until_below);
    }
    let remembered = same && context.odometer < memory.until;
    if remembered {
        work.nodes_remembered += 1;
    } else {
        classify(context, subtree.node, memory, arriving, scratch, &mut work);
        memory.effort = work.tests() as u32;
    }
    memory.until_below = memory.until;
    if memory.state != State::Partial {
        return (work, memory.until_below);
    }
    let passed = memory.passed.as_slice();
    if node.right == 0 {
        if !remembered {
            let of_leaf = (node.pieces, subtree.pieces, &mut memory.hidden_by);
            let holds = test_pieces(context, of_leaf, passed, scratch, &mut work);
            memory.until = memory.until.min(context.odometer + holds);
            memory.until_below = memory.until;
            memory.effort = work.tests() as u32;
        }
        return (work, memory.until_below);
    }
    let left_nodes = (node.right - subtree.node - 1) as usize;
    let (left, right) = below.split_at_mut(left_nodes);
    let left_pieces = {
        let (first, _) = node.pieces;
        (context.tree.nodes[node.right as usize].pieces.0 - first) as usize
    };
    let (left_states, right_states) = subtree.pieces.split_at_mut(left_pieces);
    let left = Subtree { node: subtree.node + 1, memories: left, pieces: left_states };
    let right = Subtree { node: node.right, memories: right, pieces: right_states };
    let small = node.end - subtree.node < context.grain;
    let (one, other) = if small {
        (visit(context, left, passed, scratch), visit(context, right, passed, scratch))
    } else {
        rayon::join(
            || visit(context, left, passed, scratch),
            || visit(context, right, passed, &mut Scratch::default()),
        )
    };
    work += one.0;
    work += other.0;
    memory.until_below = memory.until.min(one.1).min(other.1);
    (work, memory.until_below)
}

fn is_outside(bounds: &Aabb, planes: &[(DVec3, f64)]) -> bool {
    planes.iter().any(|(n, offset)| {
        let farthest = n.max(DVec3::ZERO).dot(bounds.max) + n.min(DVec3::ZERO).dot(bounds.min);
        farthest < *offset
    })
}

/// Finds a node's state and puts it into `memory`.
fn classify(
    context: &Context,
    node: u32,
    memory: &mut Memory,
    arriving: &[u32],
    scratch: &mut Scratch,
    work: &mut Work,
) {
    let frame = context.frame;
    let id = |slot: u16| frame.active[usize::from(slot)].id;
    memory.arrived.clear();
    memory.arrived.extend(arriving);
    memory.passed.clear();
    let bounds = &context.tree.nodes[node as usize].bounds;
    if bounds.is_empty() {
        (memory.state, memory.until) = (State::Hidden, f64::INFINITY);
        return;
    }
    let occludee = BoxAt::new(bounds, frame.eye);
    // What hid it last will mostly do so again.
    if let [last] = memory.hidden_by[..]
        && arriving.binary_search(&last).is_ok()
    {
        work.relations += 1;
        let relation = relate(frame, &frame.active[usize::from(frame.slot(last))], &occludee);
        if relation.kind == Kind::Full {
            work.hidden_by_one += 1;
            (memory.state, memory.until) = (State::Hidden, context.odometer + relation.satisfied_holds);
            return;
        }
    }
    memory.hidden_by.clear();
    work.relations += arriving.len() as u64;
    let (verdict, holds) = hide(context, &occludee, arriving, scratch, work, |outline| {
        box_outline(occludee.min, occludee.max, outline);
    });
    memory.until = context.odometer + holds;
    memory.state = match verdict {
        Verdict::Visible => State::Visible,
        Verdict::Partial => {
            memory.passed.extend(scratch.relations.iter().map(|(slot, _)| id(*slot)));
            State::Partial
        }
        Verdict::HiddenBy(how) => {
            memory.hidden_by.extend(scratch.used.iter().map(|&slot| id(slot)));
            match how {
                How::One => work.hidden_by_one += 1,
                How::Connected => work.hidden_by_connected += 1,
                How::Fusion => work.hidden_by_fusion += 1,
            }
            State::Hidden
        }
    };
}

/// Tests each piece of a partially hidden leaf, and notes for each that is hidden one of the occluders that
/// hide it, the least of them. Returns how long all that was found holds.
fn test_pieces(
    context: &Context,
    (pieces, states, hidden_by): ((u32, u32), &mut [State], &mut Vec<u32>),
    passed: &[u32],
    scratch: &mut Scratch,
    work: &mut Work,
) -> f64 {
    let mut holds = f64::INFINITY;
    hidden_by.clear();
    for (piece, state) in (pieces.0..pieces.1).zip(states) {
        *state = State::Partial;
        if !context.tests.pieces {
            continue;
        }
        let mut points = std::mem::take(&mut scratch.points);
        points.clear();
        points.extend(context.tree.piece(piece as usize).iter().map(|p| *p - context.frame.eye));
        let ball = &context.tree.pieces[piece as usize];
        let occludee = Points::new(&points, ball.centre - context.frame.eye, ball.radius);
        work.piece_relations += passed.len() as u64;
        let (verdict, this_holds) =
            hide(context, &occludee, passed, scratch, work, |outline| outline.extend_from_slice(&points));
        *state = match verdict {
            Verdict::Visible => State::Visible,
            Verdict::Partial => State::Partial,
            Verdict::HiddenBy(_) => State::Hidden,
        };
        if *state == State::Hidden {
            let active = |slot: &u16| &context.frame.active[usize::from(*slot)];
            hidden_by.extend(scratch.used.iter().map(active).max_by_key(|a| a.rank).map(|a| a.id));
        }
        holds = holds.min(this_holds);
        scratch.points = points;
    }
    holds
}

enum Verdict {
    Visible,
    Partial,
    HiddenBy(How),
}

enum How {
    One,
    Connected,
    Fusion,
}

/// Tests an occludee against the occluders `ids`. Leaves those that partially hide it in
/// `scratch.relations`, or those that hide it in `scratch.used`; returns how far the eye may go until
/// something changes.
fn hide(
    context: &Context,
    occludee: &impl Occludee,
    ids: &[u32],
    scratch: &mut Scratch,
    work: &mut Work,
    outline_of: impl FnOnce(&mut Vec<DVec3>),
) -> (Verdict, f64) {
    let frame = context.frame;
    let Scratch { relations, members, set, fusion, used, outline, .. } = scratch;
    relations.clear();
    used.clear();
    let mut holds = f64::INFINITY;
    for &id in ids {
        let slot = frame.slot(id);
        let relation = relate(frame, &frame.active[usize::from(slot)], occludee);
        match relation.kind {
            Kind::Full => {
                used.push(slot);
                return (Verdict::HiddenBy(How::One), relation.satisfied_holds);
            }
            Kind::Partial => relations.push((slot, relation)),
            Kind::None => {}
        }
        holds = holds.min(relation.holds);
    }
    if relations.is_empty() {
        return (Verdict::Visible, holds);
    }
    if context.tests.connected && relations.len() > 1 {
        hiding_set(frame, relations, set, members);
        if !members.is_empty() {
            used.extend(members.iter().map(|m| m.0));
            let holds = members.iter().map(|m| m.1.satisfied_holds).fold(f64::INFINITY, f64::min);
            return (Verdict::HiddenBy(How::Connected), holds);
        }
    }
    if context.tests.fusion && relations.len() > 1 {
        outline.clear();
        outline_of(outline);
        let hidden = fusion::hides(frame, relations, occludee, outline, fusion, used);
        work.fusion_parts += u64::from(fusion.examined);
        if hidden {
            // Holds for this eye only.
            return (Verdict::HiddenBy(How::Fusion), 0.0);
        }
    }
    (Verdict::Partial, holds)
}
