//! Cycles with mutual occluders merged: what must be drawn together, and what need not.

use crate::order::Order;
use std::collections::{HashMap, HashSet};

/// A strongly connected component of the occlusion graph after merging: one layer, or several in a cycle.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Component {
    /// The parts of each layer.
    pub layers: Vec<Vec<u32>>,
    /// Arcs (occluder, occluded) between the layers, by their places in `layers`; never both ways between two.
    pub arcs: Vec<(u32, u32)>,
}

/// The components of an order, front to back. `arcs_among` returns the occlusion arcs among some parts
/// ([`VisibilitySort::arcs_among`](crate::order::VisibilitySort::arcs_among)); it is asked for groups only.
pub fn decompose(order: &Order, mut arcs_among: impl FnMut(&[u32]) -> Vec<(u32, u32)>) -> Vec<Component> {
    let component = |group: &[u32]| match group {
        [part] => Component { layers: vec![vec![*part]], arcs: Vec::new() },
        _ => merge(group, &arcs_among(group)),
    };
    order.groups().map(component).collect()
}

/// Merges parts that occlude each other, and what then occludes each other, until nothing does.
fn merge(group: &[u32], arcs: &[(u32, u32)]) -> Component {
    let place: HashMap<u32, usize> = group.iter().enumerate().map(|(i, &p)| (p, i)).collect();
    let mut layer: Vec<usize> = (0..group.len()).collect();
    loop {
        let lifted: HashSet<(usize, usize)> =
            arcs.iter().map(|(a, b)| (layer[place[a]], layer[place[b]])).filter(|(a, b)| a != b).collect();
        let mutual: Vec<(usize, usize)> =
            lifted.iter().copied().filter(|&(a, b)| a < b && lifted.contains(&(b, a))).collect();
        if mutual.is_empty() {
            return number(group, &layer, &lifted);
        }
        // Each layer joins the smallest it is connected to by mutual occlusion.
        let mut root: Vec<usize> = (0..group.len()).collect();
        for (a, b) in mutual {
            let (a, b) = (find(&root, a), find(&root, b));
            root[a.max(b)] = a.min(b);
        }
        layer.iter_mut().for_each(|l| *l = find(&root, *l));
    }
}

fn find(root: &[usize], mut at: usize) -> usize {
    while root[at] != at {
        at = root[at];
    }
    at
}

/// Numbers the layers in the order of their first members.
fn number(group: &[u32], layer: &[usize], lifted: &HashSet<(usize, usize)>) -> Component {
    let mut numbers: HashMap<usize, u32> = HashMap::new();
    let mut layers: Vec<Vec<u32>> = Vec::new();
    for (&part, l) in group.iter().zip(layer) {
        let number = *numbers.entry(*l).or_insert_with(|| {
            layers.push(Vec::new());
            layers.len() as u32 - 1
        });
        layers[number as usize].push(part);
    }
    layers.iter_mut().for_each(|l| l.sort_unstable());
    let mut arcs: Vec<(u32, u32)> = lifted.iter().map(|(a, b)| (numbers[a], numbers[b])).collect();
    arcs.sort_unstable();
    Component { layers, arcs }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_stays_apart_and_mutual_occluders_merge_again_and_again() {
        let ring = merge(&[5, 6, 7], &[(5, 6), (6, 7), (7, 5)]);
        assert_eq!(ring.layers, [[5], [6], [7]]);
        assert_eq!(ring.arcs, [(0, 1), (1, 2), (2, 0)]);
        // 1 and 2 occlude each other; then {1, 2} and 3 do, through different members; 4 and 5 stay in a cycle.
        let arcs = [(1, 2), (2, 1), (1, 3), (3, 2), (3, 4), (4, 5), (5, 1)];
        let merged = merge(&[1, 2, 3, 4, 5], &arcs);
        assert_eq!(merged.layers, [vec![1, 2, 3], vec![4], vec![5]]);
        assert_eq!(merged.arcs, [(0, 1), (1, 2), (2, 0)]);
    }
}
