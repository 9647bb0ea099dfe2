//! The conditioning sort [Snyder & Lengyel 1997, §7]: what is near moves up in the order where it may.
//!
//! Without it, parts that occlude nothing stay where they are until one day they do, and must jump far. The
//! paper orders by the midpoint along an extent; here by the distance of the centre, which means the same in
//! every direction. A group moves before its predecessor if it is nearer by more than its own size, and the extents
//! rule out that the predecessor occludes it: a finer order would be upset by every motion and gain nothing. It moves no farther than a bounded number of places in a frame: the next frame goes
//! on from there.

use super::sort::VisibilitySort;

/// Places that a group may move up in one frame.
const PLACES: usize = 64;
/// Groups with more pairs of members than this do not pass each other.
const MOST_PAIRS: usize = 64;

/// A run of the order.
#[derive(Clone, Copy)]
struct Group {
    distance: f64,
    /// Distance and size.
    reach: f64,
    from: u32,
    end: u32,
}

impl VisibilitySort {
    pub(super) fn condition(&mut self) {
        let order = &self.seated;
        let key = |g: &[u32]| {
            let part = &self.parts[g[0] as usize];
            (part.distance, part.distance + part.radius)
        };
        let mut sorted = true;
        let mut groups: Vec<Group> = Vec::with_capacity(order.ends.len());
        let mut from = 0;
        for &end in &order.ends {
            let (distance, reach) = key(&order.parts[from as usize..end as usize]);
            sorted &= groups.last().is_none_or(|last| last.distance <= reach);
            groups.push(Group { distance, reach, from, end });
            from = end;
        }
        if sorted {
            return;
        }
        let members = |g: &Group| &order.parts[g.from as usize..g.end as usize];
        let mut moved = 0;
        for i in 1..groups.len() {
            let group = groups[i];
            let mut to = i;
            while to > 0
                && i - to < PLACES
                && groups[to - 1].distance > group.reach
                && !self.group_may_occlude(members(&groups[to - 1]), members(&group))
            {
                groups[to] = groups[to - 1];
                to -= 1;
            }
            groups[to] = group;
            moved += u64::from(to < i);
        }
        if moved == 0 {
            return;
        }
        let parts = groups.iter().flat_map(members).copied().collect();
        let mut end = 0;
        let sizes = groups.iter().map(|g| g.end - g.from);
        self.seated.ends = sizes
            .map(|size| {
                end += size;
                end
            })
            .collect();
        self.seated.parts = parts;
        self.counters.moved_up = moved;
    }

    fn group_may_occlude(&self, front: &[u32], behind: &[u32]) -> bool {
        if front.len() * behind.len() > MOST_PAIRS {
            return true;
        }
        let pieces = |part: u32| self.parts[part as usize].pieces();
        front.iter().flat_map(|&f| pieces(f)).any(|f| {
            behind.iter().flat_map(|&b| pieces(b)).any(|b| self.faces.may_occlude(f as u32, b as u32))
        })
    }
}
