//! A tree over any boxes, for rooms above that have things of their own to sort; and the origin that suits boxes best.

use super::bvh;
use super::parts::Primitive;
use super::tree::{Box3, Child, Slot, WideTree};
use crate::geometry::Aabb;
use glam::DVec3;

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

/// Boxes that lie together, at most `size` (a power of two) in each block: their numbers. Empty boxes are left out.
pub(crate) fn blocks_of_boxes(boxes: &[(Box3, u32)], size: usize) -> Vec<Vec<u32>> {
    let full = boxes.iter().filter(|(b, _)| !b.is_empty());
    let mut primitives: Vec<Primitive> = full.map(|(b, number)| Primitive::of_box(b, *number)).collect();
    let built = bvh::build(&mut primitives, size);
    built.leaf_start.windows(2).map(|at| built.order[at[0] as usize..at[1] as usize].to_vec()).collect()
}

/// In f32 a coordinate so many times as large as things are is off by a thousandth of them.
const FAR: f64 = 8192.0;

/// So many boxes speak for all.
const SAMPLE: usize = 255;

/// The origin about which boxes of f32 tell best where things are: their middle, along the axes along which they lie
/// together and far away, as the houses of a town do in a country's coordinates. Others are best left about zero. Medians
/// of some of them: what is lost far away does not count.
pub(crate) fn middle_of(count: usize, bounds: impl Fn(usize) -> Aabb) -> DVec3 {
    let sample = || (0..count).step_by(count / SAMPLE + 1).map(&bounds);
    // If the medians say so, one box at least does. Mostly none does.
    if !sample().any(|b| b.center().abs().max_element() > FAR * b.size().max_element()) {
        return DVec3::ZERO;
    }
    let sample: Vec<Aabb> = sample().collect();
    let mut numbers = Vec::with_capacity(sample.len());
    let mut median = |of: &dyn Fn(&Aabb) -> f64| {
        numbers.clear();
        numbers.extend(sample.iter().map(of).filter(|n| n.is_finite()));
        let half = numbers.len() / 2;
        if numbers.is_empty() { 0.0 } else { *numbers.select_nth_unstable_by(half, f64::total_cmp).1 }
    };
    let extent = median(&|bounds| bounds.size().max_element());
    DVec3::from([0, 1, 2].map(|axis| {
        // With few bits, so that most differences are exact.
        let middle = f64::from(median(&|bounds| bounds.center()[axis]) as f32);
        let apart = median(&|bounds| (bounds.center()[axis] - middle).abs());
        let far = middle.abs() > FAR * extent && middle.abs() > 4.0 * apart && middle.is_finite();
        if far { middle } else { 0.0 }
    }))
}
