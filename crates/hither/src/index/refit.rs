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
}

/// A tree is worth rebuilding once its boxes have this many times the surface they were built with.
const LOOSE: f64 = 1.5;

impl Refit {
    pub fn new(tree: &WideTree) -> Refit {
        let mut above = vec![(0, 0); tree.nodes.len()];
        let mut area = 0.0;
        for (n, node) in tree.nodes.iter().enumerate() {
            for slot in (0..node.used as usize).filter(|&s| node.child[s] != Slot::EMPTY) {
                area += node.bounds_of(slot).half_area();
                if let Child::Node(child) = node.child[slot].child() {
                    above[child as usize] = (n as u32, slot as u32);
                }
            }
        }
        Refit { above, area, built_area: area }
    }

    /// Whether the boxes have grown so much that the tree should be built anew.
    pub fn is_loose(&self) -> bool {
        self.area > LOOSE * self.built_area
    }

    /// Gives leaves new boxes: (node, slot, box, leaf). One with an empty box becomes vacant until it gets another.
    /// Cost: the nodes above them.
    pub fn set(&mut self, tree: &mut WideTree, leaves: impl IntoIterator<Item = (u32, u32, Box3, u32)>) {
        // Children come after their parents, so that the last node is always ready.
        let mut touched = BinaryHeap::new();
        for (node, slot, bounds, leaf) in leaves {
            let child = if bounds.is_empty() { Slot::EMPTY } else { Slot::leaf(leaf as usize) };
            self.set_slot(tree, (node, slot), &bounds, child);
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
        let area = |b: &Box3| if b.is_empty() { 0.0 } else { b.half_area() };
        self.area += area(bounds) - area(&node.bounds_of(slot as usize));
        node.set(slot as usize, bounds, child);
    }

    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.above.as_slice())
    }
}
