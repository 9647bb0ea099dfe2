//! The occluders in use for one eye, with the planes through the eye and their sides.
//!
//! A supporting plane of an occluder and a box holds a side (a, b) of the one and a corner v of the other;
//! the eye E satisfies it if `det(a − E, b − E, v − E) > 0`. The paper stores the plane of a, b, v and asks
//! on which side E is. The same determinant asks on which side of the plane of E, a, b the corner v is, and
//! that plane serves all boxes: it is made once a frame, and which corner supports and which separates is
//! read off the signs of its normal ([`super::relation`]).
//!
//! Coordinates in this module and those that use it are relative to the eye.

use super::ROUNDING;
use super::occluder::{Occluder, Occluders};
use glam::DVec3;

/// "No occluder" among mates.
pub(super) const NOBODY: u16 = u16::MAX;

/// An occluder that is in use: a number and the side that is turned to the eye.
#[derive(Clone, Debug)]
pub(super) struct Active {
    /// Twice the occluder's number, plus one if it shows its back. The same from frame to frame.
    pub id: u32,
    /// Place in the order of area-angle.
    pub rank: u16,
    /// Run in [`Frame::sides`].
    pub sides: (u32, u32),
    /// Normal on the eye's side, and the least height along it of the occluder: what lies below is beyond.
    pub normal: DVec3,
    pub lowest: f64,
    /// Box around the occluder and the eye (and all eyes within reach).
    pub min: DVec3,
    pub max: DVec3,
}

/// The plane through the eye and a side.
#[derive(Clone, Debug)]
pub(super) struct SidePlane {
    /// Unit normal towards the inside.
    pub normal: DVec3,
    /// Its positive and its negative part: the table that picks a box's corners, unrolled.
    pub positive: DVec3,
    pub negative: DVec3,
    /// What the normal's direction may be wrong by, radians, with room to spare.
    pub margin: f64,
    /// Distance of the eye from the side's line.
    pub distance: f64,
    /// A point and the unit direction of the line.
    pub point: DVec3,
    pub along: DVec3,
    /// Run in [`Frame::mates`]; none if an edge of the side has no mate.
    pub mates: Option<(u32, u32)>,
}

/// Everything that depends on the eye alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    pub eye: DVec3,
    /// Verdicts are to hold for all eyes this near.
    pub reach: f64,
    pub active: Vec<Active>,
    pub sides: Vec<SidePlane>,
    /// Slots of the occluders on the other side of a side's edges.
    pub mates: Vec<u16>,
    /// Slot of each id, where it is in use.
    slot_of: Vec<u16>,
    scratch: Vec<(u32, bool, u16, u32)>,
    mate_of: Vec<(u16, u32, u16)>,
    /// The mates of each side, and the ids for which they were found.
    runs: Vec<Option<(u32, u32)>>,
    paired: Vec<u32>,
}

impl Frame {
    /// The slot of an id that is in use.
    pub fn slot(&self, id: u32) -> u16 {
        self.slot_of[id as usize]
    }

    /// Begins anew for `eye` with the `chosen` occluders, best first; those that cannot hide from here are
    /// left out. `usable` may refuse more. Slots are in the order of ids, so that lists of slots are
    /// ordered the same from frame to frame.
    pub fn begin(
        &mut self,
        occluders: &Occluders,
        eye: DVec3,
        reach: f64,
        chosen: &[(f64, u32, f64)],
        usable: impl Fn(&Occluder) -> bool,
    ) {
        for active in &self.active {
            self.slot_of[active.id as usize] = NOBODY;
        }
        self.slot_of.resize(2 * occluders.all.len(), NOBODY);
        (self.eye, self.reach) = (eye, reach);
        self.active.clear();
        self.sides.clear();
        let mut ids: Vec<(u32, u16)> = chosen
            .iter()
            .zip(0u16..)
            .filter(|((_, number, side), _)| {
                let occluder = &occluders.all[*number as usize];
                let outside = occluder.solid.is_none_or(|s| {
                    let off = (s.min - eye).max(eye - s.max).max(DVec3::ZERO).length();
                    off > reach && !s.contains(eye)
                });
                outside && occluders.faces(occluder, *side, eye, reach) && usable(occluder)
            })
            .map(|((_, number, side), rank)| (2 * number + u32::from(*side < 0.0), rank))
            .collect();
        ids.sort_unstable();
        for (id, rank) in ids {
            self.slot_of[id as usize] = self.active.len() as u16;
            self.push(occluders, id, rank);
        }
        // Who meets whom depends on who is there and which side is turned here, and on nothing else.
        if !self.paired.iter().copied().eq(self.active.iter().map(|a| a.id)) {
            self.find_mates(occluders);
            self.paired.clear();
            self.paired.extend(self.active.iter().map(|a| a.id));
        }
        self.sides.iter_mut().zip(&self.runs).for_each(|(side, run)| side.mates = *run);
    }

    fn push(&mut self, occluders: &Occluders, id: u32, rank: u16) {
        let occluder = &occluders.all[id as usize / 2];
        let front = id.is_multiple_of(2);
        let first = self.sides.len() as u32;
        let (from, end) = occluder.sides;
        for side in &occluders.sides[from as usize..end as usize] {
            let [a, b] = [side.from, side.to].map(|v| occluders.vertices[v as usize]);
            // Clockwise seen from the eye: then their cross product points inside.
            let (a, b) = if front { (b, a) } else { (a, b) };
            self.sides.push(plane_of(a - self.eye, b - self.eye, a.abs().max_element()));
        }
        let normal = if front { occluder.normal } else { -occluder.normal };
        let lowest = if front { occluder.slab[0] } else { -occluder.slab[1] };
        let size = occluder.bounds.min.abs().max(occluder.bounds.max.abs()).max_element();
        let relative = lowest - normal.dot(self.eye) - ROUNDING * (size + self.eye.abs().max_element());
        let ball = DVec3::splat(self.reach);
        self.active.push(Active {
            id,
            rank,
            sides: (first, self.sides.len() as u32),
            normal,
            lowest: relative,
            min: (occluder.bounds.min - self.eye).min(-ball),
            max: (occluder.bounds.max - self.eye).max(ball),
        });
    }

    /// Pairs up occluders that have an edge in opposite directions, seen from the eye: between them the
    /// edge is no silhouette. Each direction of an edge is paired once.
    fn find_mates(&mut self, occluders: &Occluders) {
        self.mates.clear();
        self.scratch.clear();
        for (slot, active) in (0u16..).zip(&self.active) {
            let occluder = &occluders.all[active.id as usize / 2];
            for side in &occluders.sides[occluder.sides.0 as usize..occluder.sides.1 as usize] {
                for at in side.edges.0..side.edges.1 {
                    let edge = &occluders.loops[at as usize];
                    let forward = edge.forward == active.id.is_multiple_of(2);
                    self.scratch.push((edge.edge, forward, slot, at));
                }
            }
        }
        self.scratch.sort_unstable();
        let mate_of = &mut self.mate_of;
        mate_of.clear();
        for same in self.scratch.chunk_by(|a, b| a.0 == b.0) {
            let backward = same.partition_point(|e| !e.1);
            let (backward, forward) = same.split_at(backward);
            for (b, f) in backward.iter().zip(forward) {
                mate_of.push((b.2, b.3, f.2));
                mate_of.push((f.2, f.3, b.2));
            }
        }
        mate_of.sort_unstable();
        let mut next = 0;
        self.runs.clear();
        for (slot, active) in (0u16..).zip(&self.active) {
            let occluder = &occluders.all[active.id as usize / 2];
            let statics = &occluders.sides[occluder.sides.0 as usize..occluder.sides.1 as usize];
            for side in statics {
                let first = self.mates.len() as u32;
                let mut all = true;
                for at in side.edges.0..side.edges.1 {
                    if mate_of.get(next).is_some_and(|m| (m.0, m.1) == (slot, at)) {
                        self.mates.push(mate_of[next].2);
                        next += 1;
                    } else {
                        all = false;
                    }
                }
                self.runs.push(all.then_some((first, self.mates.len() as u32)));
            }
        }
    }
}

/// The plane through the eye and the line from `a` to `b`.
fn plane_of(a: DVec3, b: DVec3, world_size: f64) -> SidePlane {
    let cross = a.cross(b);
    let length = cross.length();
    let (edge, la, lb) = (b - a, a.length(), b.length());
    // Where the eye is on the line there is no plane, and the margin is without bound.
    let margin =
        if length > 0.0 { ROUNDING * (la * lb + world_size * (la + lb)) / length } else { f64::INFINITY };
    let normal = if length > 0.0 { cross / length } else { DVec3::ZERO };
    SidePlane {
        normal,
        positive: normal.max(DVec3::ZERO),
        negative: normal.min(DVec3::ZERO),
        margin,
        distance: length / edge.length(),
        point: a,
        along: edge / edge.length(),
        mates: None,
    }
}
