//! Which occluders are worth their while from here [Coorg & Teller 1996, §3.3].
//!
//! The *area-angle* `A · D / |D|³` estimates the solid angle of a polygon with directed area A at distance
//! D. Where it exceeds a threshold is a lobe on each side of the polygon; a box around the lobe is entered
//! in all leaves of the tree that it meets. The leaf that holds the eye then knows the potential occluders,
//! and of these the k with the largest area-angle are used.

use super::occluder::{Occluder, Occluders};
use super::tree::Tree;
use crate::geometry::Aabb;
use glam::DVec3;

/// Most entries in all leaves together, and on average in a leaf.
const MOST_ENTRIES: usize = 1 << 24;
const MOST_IN_A_LEAF: usize = 1024;

/// Potential occluders of every leaf.
#[derive(Clone, Debug, Default)]
pub(super) struct Potential {
    /// For each node a run of `occluders`; empty but for leaves.
    runs: Vec<(u32, u32)>,
    occluders: Vec<u32>,
    /// All of them, for an eye outside the tree.
    everything: Vec<u32>,
}

impl Potential {
    /// Enters each occluder where its area-angle may exceed `threshold` steradians; in a scene of very many
    /// polygons, as many times four of that as keep the lists short.
    pub fn new(occluders: &Occluders, tree: &Tree, threshold: f64) -> Potential {
        let most = MOST_ENTRIES.min(MOST_IN_A_LEAF * tree.nodes.len().div_ceil(2));
        let mut threshold = threshold;
        let of_node = loop {
            match entered(occluders, tree, threshold, most) {
                Some(lists) => break lists,
                None => threshold *= 4.0,
            }
        };
        let mut potential =
            Potential { everything: (0..occluders.all.len() as u32).collect(), ..Potential::default() };
        for list in of_node {
            let first = potential.occluders.len() as u32;
            potential.occluders.extend(list);
            potential.runs.push((first, potential.occluders.len() as u32));
        }
        potential
    }

    /// The potential occluders for an eye in `leaf`, ascending.
    pub fn of(&self, leaf: Option<u32>) -> &[u32] {
        match leaf {
            None => &self.everything,
            Some(leaf) => {
                let (first, end) = self.runs[leaf as usize];
                &self.occluders[first as usize..end as usize]
            }
        }
    }
}

/// A box around the points from which the area-angle exceeds `threshold`.
fn significance(occluder: &Occluder, threshold: f64) -> Aabb {
    // Along a direction that makes angle θ with the normal the lobe reaches r √cos θ, with r = √(A / t);
    // sideways it reaches at most r √cos θ sin θ, largest at cos θ = 1/√3.
    let reach = (occluder.area.length() / threshold).sqrt();
    let beside = 0.6205 * reach;
    let n = occluder.normal;
    let across = DVec3::new(
        (1.0 - n.x * n.x).max(0.0).sqrt(),
        (1.0 - n.y * n.y).max(0.0).sqrt(),
        (1.0 - n.z * n.z).max(0.0).sqrt(),
    ) * beside;
    let front = n.max(DVec3::ZERO) * reach;
    let back = (-n).max(DVec3::ZERO) * reach;
    // The lobe of the other side is the mirror image.
    let (up, down) = if occluder.double_sided { (front.max(back), front.max(back)) } else { (front, back) };
    Aabb { min: occluder.centre - down - across, max: occluder.centre + up + across }
}

/// The list of every node; `None` if they hold more than `most` together.
fn entered(occluders: &Occluders, tree: &Tree, threshold: f64, most: usize) -> Option<Vec<Vec<u32>>> {
    let mut of_node: Vec<Vec<u32>> = vec![Vec::new(); tree.nodes.len()];
    let mut entries = 0;
    for (number, occluder) in occluders.all.iter().enumerate() {
        let volume = significance(occluder, threshold);
        entries += enter(tree, 0, &volume, number as u32, &mut of_node);
        if entries > most {
            return None;
        }
    }
    Some(of_node)
}

/// Returns in how many leaves the occluder was entered.
fn enter(tree: &Tree, node: u32, volume: &Aabb, occluder: u32, of_node: &mut [Vec<u32>]) -> usize {
    let cell = &tree.nodes[node as usize].cell;
    if cell.min.cmpgt(volume.max).any() || cell.max.cmplt(volume.min).any() {
        return 0;
    }
    if tree.is_leaf(node) {
        of_node[node as usize].push(occluder);
        return 1;
    }
    enter(tree, node + 1, volume, occluder, of_node)
        + enter(tree, tree.nodes[node as usize].right, volume, occluder, of_node)
}

/// The area-angle of an occluder from `eye`, steradians, with the side that it turns to the eye; 0 for
/// the undrawn back of a one-sided one.
pub(super) fn area_angle(occluder: &Occluder, eye: DVec3) -> (f64, f64) {
    let to = occluder.centre - eye;
    let squared = to.length_squared();
    let facing = -occluder.area.dot(to);
    if squared == 0.0 || (facing < 0.0 && !occluder.double_sided) {
        return (0.0, 1.0);
    }
    let side = if facing < 0.0 { -1.0 } else { 1.0 };
    (facing.abs() / (squared * squared.sqrt()), side)
}

/// The `k` best of `potential` from `eye`, best first: area-angle, occluder, side. Equal ones by number.
pub(super) fn best(
    occluders: &Occluders,
    potential: &[u32],
    eye: DVec3,
    k: usize,
    found: &mut Vec<(f64, u32, f64)>,
) {
    found.clear();
    found.extend(potential.iter().filter_map(|&number| {
        let (angle, side) = area_angle(&occluders.all[number as usize], eye);
        (angle > 0.0).then_some((angle, number, side))
    }));
    let order = |a: &(f64, u32, f64), b: &(f64, u32, f64)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if found.len() > k {
        found.select_nth_unstable_by(k, order);
        found.truncate(k);
    }
    found.sort_unstable_by(order);
}
