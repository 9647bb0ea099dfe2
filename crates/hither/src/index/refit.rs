//! Keeping a tree's boxes around leaves that move, at the cost of the boxes above them.

use super::tree::{Box3, Child, Slot, WideTree};
use std::collections::BinaryHeap;

/// What must be known of a tree to refit it in place.
#[derive(Debug, Default)]
pub(super) struct Refit {
    /// Node and slot that hold each node; the root's entry means nothing.
    above: Vec<(u32, u32)>,
    /// Total surface of the boxes now, and when the tree was built.
    area: f64,
    built_area: f64,
    /// Leaves that the tree was built of, and how often one got another box since.
    leaves: u64,
    changes: u64,
}

/// A tree is worth rebuilding once its boxes have this many times the surface they were built with, or were built with
/// this many times what they have.
const LOOSE: f64 = 1.5;

/// But not before one in so many of its leaves has changed: what fewer do to boxes costs a walk less than a new tree.
const FEW: u64 = 64;

/// And, whatever its boxes, once each of its leaves has changed so often, on average: it may have been built badly, around
/// something far away that has gone.
const CHANGES: u64 = 256;

/// A box so large, square metres, is around something that is nowhere, and says nothing of how well the others lie.
const NOWHERE: f64 = 1e30;

/// Half the surface of a box, where it counts.
fn area(bounds: &Box3) -> f64 {
    let area = if bounds.is_empty() { 0.0 } else { bounds.half_area() };
    if area < NOWHERE { area } else { 0.0 }
}

impl Refit {
    pub fn new(tree: &WideTree) -> Refit {
        let mut above = vec![(0, 0); tree.nodes.len()];
        let (mut sum, mut leaves) = (0.0, 0);
        for (n, node) in tree.nodes.iter().enumerate() {
            for slot in (0..node.used as usize).filter(|&s| node.child[s] != Slot::EMPTY) {
                sum += area(&node.bounds_of(slot));
                match node.child[slot].child() {
                    Child::Node(child) => above[child as usize] = (n as u32, slot as u32),
                    Child::Leaf(_) => leaves += 1,
                }
            }
        }
        Refit { above, area: sum, built_area: sum, leaves, changes: 0 }
    }

    /// Whether the boxes have grown so much, or shrunk, that the tree should be built anew. What shrinks was built around
    /// something that has gone, and a sum that it went from is no longer known well.
    pub fn is_loose(&self) -> bool {
        let as_built = self.area <= LOOSE * self.built_area && self.area * LOOSE >= self.built_area;
        !as_built && self.changes * FEW >= self.leaves || self.changes > CHANGES * self.leaves
    }

    /// Takes the boxes as they are now for those that the tree was built with.
    pub fn settle(&mut self) {
        (self.built_area, self.changes) = (self.area, 0);
    }

    /// Gives leaves new boxes: (node, slot, box, leaf). One with an empty box becomes vacant until it gets another.
    /// Cost: the nodes above them.
    pub fn set(&mut self, tree: &mut WideTree, leaves: impl IntoIterator<Item = (u32, u32, Box3, u32)>) {
        // Children come after their parents, so that the last node is always ready.
        let mut touched = BinaryHeap::new();
        for (node, slot, bounds, leaf) in leaves {
            let child = if bounds.is_empty() { Slot::EMPTY } else { Slot::leaf(leaf as usize) };
            self.set_slot(tree, (node, slot), &bounds, child);
            self.changes += 1;
            touched.push(node);
        }
        while let Some(node) = touched.pop() {
            while touched.peek() == Some(&node) {
                touched.pop();
            }
            if node == 0 {
                break;
            }
            let bounds = tree.nodes[node as usize].bounds();
            let (above, slot) = self.above[node as usize];
            if tree.nodes[above as usize].bounds_of(slot as usize) != bounds {
                let child = tree.nodes[above as usize].child[slot as usize];
                self.set_slot(tree, (above, slot), &bounds, child);
                touched.push(above);
            }
        }
    }

    fn set_slot(&mut self, tree: &mut WideTree, (node, slot): (u32, u32), bounds: &Box3, child: Slot) {
        let node = &mut tree.nodes[node as usize];
        self.area += area(bounds) - area(&node.bounds_of(slot as usize));
        node.set(slot as usize, bounds, child);
    }

    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.above.as_slice())
    }
}
