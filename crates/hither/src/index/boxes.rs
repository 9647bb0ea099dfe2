//! A tree over any boxes, for rooms above that have things of their own to sort.

use super::bvh;
use super::parts::Primitive;
use super::tree::{Box3, Child, Slot, WideTree};

/// A wide tree whose leaves are the numbers of `boxes`; empty boxes are left out. Cost: n log n.
pub(crate) fn tree_of_boxes(boxes: &[Box3]) -> WideTree {
    let full = boxes.iter().enumerate().filter(|(_, b)| !b.is_empty());
    let mut primitives: Vec<Primitive> = full.map(|(i, b)| Primitive::of_box(b, i as u32)).collect();
    let built = bvh::build(&mut primitives, 1);
    let mut tree = built.tree;
    for node in &mut tree.nodes {
        for slot in 0..node.used as usize {
            if let Child::Leaf(leaf) = node.child[slot].child() {
                node.child[slot] = Slot::leaf(built.order[leaf as usize] as usize);
            }
        }
    }
    tree
}
