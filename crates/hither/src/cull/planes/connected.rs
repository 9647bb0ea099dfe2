//! Connected occluders that hide together what none hides alone [Coorg & Teller 1996, §2.1].
//!
//! Of the occluders that partially occlude an occludee, find the largest set in which every supporting plane
//! that is not satisfied belongs to an edge *within* the set: shared with another member that lies on the
//! other side of it as seen from the eye. The planes of the silhouette are then all satisfied.
//!
//! **Why that hides.** Take the members as one surface. All of it turns the same side to the eye, so its
//! image covers a direction as often as its outline winds round it, the antipode not counted against it. The
//! outline is the edges left over when those between members cancel. An occludee's point is inside the plane
//! of the eye and every one of these, so each winds on round it by an angle above 0, all together at least
//! once. So a member covers the point's direction, and the point is beyond that member. Neither the
//! members nor the silhouette need be convex for this; convexity only decides how often the test succeeds.
//!
//! **Why the largest set is found.** A member with an unsatisfied plane at an edge whose other side is not in
//! the set can be in no set that hides; dropping such members until there is none left to drop drops only
//! these.

use super::frame::{Frame, NOBODY};
use super::relation::Relation;

/// A set of slots.
#[derive(Clone, Debug, Default)]
pub(super) struct SlotSet(Vec<u64>);

impl SlotSet {
    fn clear(&mut self, slots: usize) {
        self.0.clear();
        self.0.resize(slots.div_ceil(64), 0);
    }

    fn insert(&mut self, slot: u16) {
        self.0[usize::from(slot) / 64] |= 1 << (slot % 64);
    }

    fn remove(&mut self, slot: u16) {
        self.0[usize::from(slot) / 64] &= !(1 << (slot % 64));
    }

    fn contains(&self, slot: u16) -> bool {
        debug_assert_ne!(slot, NOBODY);
        self.0[usize::from(slot) / 64] >> (slot % 64) & 1 == 1
    }
}

/// The members of the largest hiding set among `candidates`, put into `members`, which is left empty if
/// there is none.
pub(super) fn hiding_set(
    frame: &Frame,
    candidates: &[(u16, Relation)],
    set: &mut SlotSet,
    members: &mut Vec<(u16, Relation)>,
) {
    set.clear(frame.active.len());
    members.clear();
    // Alone, or with a side that nobody shares, it is decided already.
    members.extend(candidates.iter().filter(|(slot, r)| r.beyond && may_be_member(frame, *slot, r.violated)));
    if members.len() < 2 {
        members.clear();
        return;
    }
    members.iter().for_each(|(slot, _)| set.insert(*slot));
    loop {
        let before = members.len();
        members.retain(|&(slot, relation)| {
            let keeps = violated_sides(frame, slot, relation.violated).all(|mates| {
                mates.is_some_and(|(from, to)| {
                    frame.mates[from as usize..to as usize].iter().all(|&mate| set.contains(mate))
                })
            });
            if !keeps {
                set.remove(slot);
            }
            keeps
        });
        if members.len() == before {
            return;
        }
    }
}

fn may_be_member(frame: &Frame, slot: u16, violated: u32) -> bool {
    violated_sides(frame, slot, violated).all(|mates| mates.is_some())
}

/// The mates of each side whose bit is set.
fn violated_sides(frame: &Frame, slot: u16, violated: u32) -> impl Iterator<Item = Option<(u32, u32)>> + '_ {
    let (first, end) = frame.active[usize::from(slot)].sides;
    let sides = &frame.sides[first as usize..end as usize];
    sides.iter().enumerate().filter(move |(i, _)| violated >> i & 1 == 1).map(|(_, plane)| plane.mates)
}
