//! Cycles with mutual occluders merged: what must be drawn together, and what need not.

use super::plan;
use super::sight::{Holdout, Sight};
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

/// The components of an order, front to back. `arcs_among` returns the occlusion arcs among some parts, in any order;
/// it is asked for groups only. It may know better than the sort did
/// ([`Sight::arcs`](super::Sight::arcs), or the sort's own
/// [`VisibilitySort::arcs_among`](crate::order::VisibilitySort::arcs_among)): a group that is no cycle by these arcs
/// falls apart.
pub fn decompose(order: &Order, mut arcs_among: impl FnMut(&[u32]) -> Vec<(u32, u32)>) -> Vec<Component> {
    let mut all = Vec::new();
    for group in order.groups() {
        if let [part] = group {
            all.push(Component { layers: vec![vec![*part]], arcs: Vec::new() });
            continue;
        }
        all.extend(fall_apart(group, &arcs_among(group)));
    }
    all
}

/// The strongly connected components of a group by arcs among its members, each merged, front to back.
fn fall_apart(group: &[u32], arcs: &[(u32, u32)]) -> Vec<Component> {
    let place: HashMap<u32, u32> = group.iter().copied().zip(0..).collect();
    let mut occluders = vec![Vec::new(); group.len()];
    arcs.iter().for_each(|(front, behind)| occluders[place[behind] as usize].push(place[front]));
    let places: Vec<u32> = (0..group.len() as u32).collect();
    let cycles = plan::components(&places, &occluders);
    let mut cycle_of = vec![0; group.len()];
    for (number, cycle) in cycles.iter().enumerate() {
        cycle.iter().for_each(|&at| cycle_of[at as usize] = number);
    }
    let mut inner: Vec<Vec<(u32, u32)>> = vec![Vec::new(); cycles.len()];
    for &(front, behind) in arcs {
        let number = cycle_of[place[&front] as usize];
        if number == cycle_of[place[&behind] as usize] {
            inner[number].push((front, behind));
        }
    }
    let parts = |cycle: &[u32]| cycle.iter().map(|&at| group[at as usize]).collect::<Vec<_>>();
    cycles.iter().zip(inner).map(|(cycle, arcs)| merge(&parts(cycle), &arcs)).collect()
}

/// What becomes of parts that occlude each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mutual {
    /// They are one layer.
    Merged,
    /// They stay apart where that is possible ([`Sight::can_hold_out`]), and are cut where others are before them.
    HeldOut,
}

/// As [`decompose`], by what is drawn at samples. `sight` looks at a group, its members in the order given. Returns
/// what is held out of which parts, besides.
pub fn decompose_by_sight<E>(
    order: &Order,
    mutual: Mutual,
    mut sight: impl FnMut(&[u32]) -> Result<Sight, E>,
) -> Result<(Vec<Component>, HashMap<u32, Holdout>), E> {
    let (mut all, mut held) = (Vec::new(), HashMap::new());
    for group in order.groups() {
        if let [part] = group {
            all.push(Component { layers: vec![vec![*part]], arcs: Vec::new() });
            continue;
        }
        let sight = sight(group)?;
        let places: Vec<u32> = (0..group.len() as u32).collect();
        for component in fall_apart(&places, &sight.arcs()) {
            let members = component.layers.concat();
            let merged = component.layers.len() < members.len();
            if mutual == Mutual::Merged || !merged || !sight.can_hold_out(&members) {
                let named = |layer: &Vec<u32>| layer.iter().map(|&at| group[at as usize]).collect();
                all.push(Component { layers: component.layers.iter().map(named).collect(), ..component });
                continue;
            }
            for (at, holdout) in sight.held_out(&members) {
                let part = group[at as usize];
                all.push(Component { layers: vec![vec![part]], arcs: Vec::new() });
                held.insert(part, holdout);
            }
        }
    }
    Ok((all, held))
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

    #[test]
    fn a_group_that_is_no_cycle_falls_apart_in_order() {
        let alone = |part| Component { layers: vec![vec![part]], arcs: Vec::new() };
        assert_eq!(fall_apart(&[7, 3, 5], &[]), [alone(7), alone(3), alone(5)]);
        let two = Component { layers: vec![vec![3, 9]], arcs: Vec::new() };
        assert_eq!(fall_apart(&[7, 3, 5, 9], &[(9, 3), (3, 9), (5, 9), (3, 7)]), [alone(5), two, alone(7)]);
    }
}
