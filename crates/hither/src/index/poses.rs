//! Where a group's nodes are, kept up to date at the cost of what changed.

use crate::scene::Group;
use glam::DAffine3;

/// Transforms of all nodes, bit-identical to [`Group::world_transforms`].
#[derive(Debug)]
pub(super) struct Poses {
    /// `group_from_node`.
    world: Vec<DAffine3>,
    /// Each node's last descendant, or itself. Between the two lies its subtree, and nothing else where nodes
    /// are in depth-first order.
    last: Vec<u32>,
}

impl Poses {
    pub fn new(group: &Group) -> Poses {
        let mut last: Vec<u32> = (0..group.nodes.len() as u32).collect();
        for n in (0..group.nodes.len()).rev() {
            if let Some(parent) = group.nodes[n].parent {
                let parent = parent as usize;
                last[parent] = last[parent].max(last[n]);
            }
        }
        Poses { world: group.world_transforms(), last }
    }

    pub fn world(&self, node: usize) -> &DAffine3 {
        &self.world[node]
    }

    /// Follows `changed`, all nodes whose own transform may have changed, ascending; calls `moved` with each
    /// node that is now elsewhere, ascending. Cost: the subtrees of those that did change.
    pub fn follow(&mut self, group: &Group, changed: &[u32], mut moved: impl FnMut(usize, &DAffine3)) {
        // Nodes before this one are up to date.
        let mut next = 0;
        for &start in changed {
            let mut n = next.max(start as usize);
            let mut end = n.max(start as usize + 1);
            while n < end {
                let node = &group.nodes[n];
                let local = node.local.matrix();
                let now = node.parent.map_or(local, |p| self.world[p as usize] * local);
                if now != self.world[n] {
                    self.world[n] = now;
                    end = end.max(self.last[n] as usize + 1);
                    moved(n, &now);
                }
                n += 1;
            }
            next = n;
        }
    }

    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.world.as_slice()) + size_of_val(self.last.as_slice())
    }
}
