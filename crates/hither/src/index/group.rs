//! A group of nodes made searchable: trees over its instances, one for what rests and one for what moves.
//!
//! An item that has moved once leaves the static tree for the dynamic one, which is refitted when its
//! items move and rebuilt when refitting has let it grow loose [Greene 1995, §3.4]. Static parts are not
//! touched again.

use super::bvh::{self, Primitive};
use super::tree::{Box3, Child, Slot, WideTree};
use crate::scene::{Content, Group};
use glam::DAffine3;

/// An instance of a mesh or of another group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    pub group_from_content: DAffine3,
    pub content: Content,
    /// Number of its first instance, counted from the group's first.
    pub first_instance: u32,
    /// Node of the group.
    pub node: u32,
}

#[derive(Debug, Default)]
pub(crate) struct GroupIndex {
    pub items: Vec<Item>,
    pub resting: WideTree,
    pub moving: WideTree,
    /// Where each item's slot is: in which tree, node and slot.
    places: Vec<Place>,
    /// Items in `moving`.
    movers: Vec<u32>,
    /// Total box surface of `moving` when it was built.
    built_area: f64,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    moves: bool,
    node: u32,
    slot: u32,
}

/// The dynamic tree is rebuilt once its boxes have this many times the surface they were built with.
const LOOSE: f64 = 1.5;

impl GroupIndex {
    /// `content_bounds` gives the bounds of a mesh or group; `instances` how many instances it expands to.
    pub fn build(
        group: &Group,
        content_bounds: impl Fn(Content) -> Box3,
        instances: impl Fn(Content) -> u64,
    ) -> GroupIndex {
        let world = group.world_transforms();
        let mut first_instance = 0u64;
        let mut index = GroupIndex::default();
        let mut primitives = Vec::new();
        for (n, node) in group.nodes.iter().enumerate() {
            let bounds = content_bounds(node.content);
            if node.content != Content::Nothing {
                let placed = placed_bounds(&bounds, &world[n]);
                if !placed.is_empty() {
                    primitives.push(Primitive { bounds: placed, index: index.items.len() as u32 });
                }
                index.items.push(Item {
                    group_from_content: world[n],
                    content: node.content,
                    first_instance: first_instance as u32,
                    node: n as u32,
                });
            }
            first_instance += instances(node.content);
        }
        index.places = vec![Place { moves: false, node: u32::MAX, slot: 0 }; index.items.len()];
        index.resting = tree_of_items(&mut primitives);
        record_places(&index.resting, &mut index.places, false);
        index
    }

    pub fn bounds(&self) -> Box3 {
        self.resting.bounds().union(&self.moving.bounds())
    }

    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.items.as_slice())
            + size_of_val(self.places.as_slice())
            + size_of_val(self.resting.nodes.as_slice())
            + size_of_val(self.moving.nodes.as_slice())
    }

    /// Follows the group's nodes to where they are now; returns how many items moved.
    pub fn update(&mut self, group: &Group, content_bounds: impl Fn(Content) -> Box3) -> usize {
        let world = group.world_transforms();
        let mut moved = Vec::new();
        let mut joined = false;
        for (i, item) in self.items.iter_mut().enumerate() {
            let now = world[item.node as usize];
            if now == item.group_from_content {
                continue;
            }
            item.group_from_content = now;
            if content_bounds(item.content).is_empty() {
                continue;
            }
            moved.push(i as u32);
            if !self.places[i].moves {
                joined = true;
                leave(&mut self.resting, self.places[i]);
                self.places[i].moves = true;
                self.movers.push(i as u32);
            }
        }
        let bounds_now = |index: &GroupIndex, i: u32| {
            let item = &index.items[i as usize];
            placed_bounds(&content_bounds(item.content), &item.group_from_content)
        };
        if !joined && !moved.is_empty() {
            for &i in &moved {
                let bounds = bounds_now(self, i);
                let place = self.places[i as usize];
                let child = self.moving.nodes[place.node as usize].child[place.slot as usize];
                self.moving.nodes[place.node as usize].set(place.slot as usize, &bounds, child);
            }
            refit(&mut self.moving);
        }
        if joined || (!moved.is_empty() && total_area(&self.moving) > LOOSE * self.built_area) {
            let mut primitives: Vec<Primitive> =
                self.movers.iter().map(|&i| Primitive { bounds: bounds_now(self, i), index: i }).collect();
            self.moving = tree_of_items(&mut primitives);
            record_places(&self.moving, &mut self.places, true);
            self.built_area = total_area(&self.moving);
        }
        moved.len()
    }

    pub fn validate(&self, content_bounds: impl Fn(Content) -> Box3) {
        for (tree, moves) in [(&self.resting, false), (&self.moving, true)] {
            for (n, node) in tree.nodes.iter().enumerate() {
                for slot in 0..node.used as usize {
                    if node.child[slot] == Slot::EMPTY {
                        continue;
                    }
                    match node.child[slot].child() {
                        Child::Leaf(i) => {
                            let item = &self.items[i as usize];
                            let place = self.places[i as usize];
                            assert!(
                                place.moves == moves
                                    && place.node as usize == n
                                    && place.slot as usize == slot
                            );
                            let bounds =
                                placed_bounds(&content_bounds(item.content), &item.group_from_content);
                            assert!(node.bounds_of(slot).contains(&bounds), "item {i} sticks out of its box");
                        }
                        Child::Node(c) => {
                            let inner = tree.nodes[c as usize].bounds();
                            assert!(node.bounds_of(slot).contains(&inner), "node {c} sticks out of its box");
                        }
                    }
                }
            }
        }
    }
}

/// A content's box seen through its transform, widened by the rounding of that arithmetic.
fn placed_bounds(bounds: &Box3, transform: &DAffine3) -> Box3 {
    if bounds.is_empty() {
        return Box3::EMPTY;
    }
    let placed = bounds.to_aabb().transformed(transform);
    // Three products and sums in f64 on either side: 2⁻⁴⁸ of the terms' size covers both roundings.
    let reach = bounds.to_aabb().min.abs().max(bounds.to_aabb().max.abs());
    let m = transform.matrix3;
    let size = m.x_axis.abs() * reach.x + m.y_axis.abs() * reach.y + m.z_axis.abs() * reach.z;
    let slack = (size + transform.translation.abs()) * 2f64.powi(-48);
    Box3::around(&crate::geometry::Aabb { min: placed.min - slack, max: placed.max + slack })
}

fn tree_of_items(primitives: &mut [Primitive]) -> WideTree {
    let built = bvh::build(primitives, 1);
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

fn record_places(tree: &WideTree, places: &mut [Place], moves: bool) {
    for (n, node) in tree.nodes.iter().enumerate() {
        for slot in 0..node.used as usize {
            if let Child::Leaf(item) = node.child[slot].child() {
                places[item as usize] = Place { moves, node: n as u32, slot: slot as u32 };
            }
        }
    }
}

/// Empties a slot; the boxes above keep their size, which is still a bound.
fn leave(tree: &mut WideTree, place: Place) {
    tree.nodes[place.node as usize].set(place.slot as usize, &Box3::EMPTY, Slot::EMPTY);
}

/// Recomputes every inner box from below: children come after their parents.
fn refit(tree: &mut WideTree) {
    for n in (0..tree.nodes.len()).rev() {
        for slot in 0..tree.nodes[n].used as usize {
            if tree.nodes[n].child[slot] == Slot::EMPTY {
                continue;
            }
            if let Child::Node(c) = tree.nodes[n].child[slot].child() {
                let bounds = tree.nodes[c as usize].bounds();
                let child = tree.nodes[n].child[slot];
                tree.nodes[n].set(slot, &bounds, child);
            }
        }
    }
}

fn total_area(tree: &WideTree) -> f64 {
    let slots = tree.nodes.iter().flat_map(|n| (0..n.used as usize).map(|s| n.bounds_of(s)));
    slots.filter(|b| !b.is_empty()).map(|b| b.half_area()).sum()
}
