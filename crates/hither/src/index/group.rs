//! A group of nodes made searchable: trees over its instances, one for what rests and one for what moves.
//!
//! An item that has moved once leaves the static tree for the dynamic one, which is refitted when its
//! items move and rebuilt when refitting has let it grow loose, or when an item joins it [Greene 1995, §3.4].
//! Static parts are not touched again; a frame costs what moved in it.

use super::TreeKind;
use super::parts::Primitive;
use super::poses::Poses;
use super::refit::Refit;
use super::tree::{Box3, Child, Slot, WideTree};
use super::{bvh, middle_of, octree};
use crate::geometry::Aabb;
use crate::raster::ScreenFromObject;
use crate::scene::{Content, Group};
use glam::{DAffine3, DMat3, DVec3};

/// An instance of a mesh or of another group. Small: a walk that finds one hidden needs not know where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    pub content: Content,
    /// Number of its first instance, counted from the group's first.
    pub first_instance: u32,
    /// Node of the group. Items are in the order of their nodes.
    pub node: u32,
}

#[derive(Debug, Default)]
pub(crate) struct GroupIndex {
    pub items: Vec<Item>,
    /// Of each item, where it is.
    pub group_from_content: Vec<DAffine3>,
    /// Where the trees' boxes have their origin.
    middle: DVec3,
    pub resting: WideTree,
    pub moving: WideTree,
    kind: TreeKind,
    /// Where each item's slot is: in which tree, node and slot.
    pub(super) places: Vec<Place>,
    /// Items in `resting`.
    at_rest: usize,
    /// What nothing needs before something moves.
    motion: Option<Motion>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    moves: bool,
    /// `NOWHERE` where there is nothing to be seen.
    node: u32,
    slot: u32,
}

const NOWHERE: u32 = u32::MAX;

#[derive(Debug)]
struct Motion {
    poses: Poses,
    /// Items in `moving`, and how to keep it around them.
    movers: Vec<u32>,
    refit: Refit,
}

impl GroupIndex {
    /// `content_bounds` gives the bounds of a mesh or group; `instances` how many instances it expands to.
    pub fn build(
        group: &Group,
        kind: TreeKind,
        content_bounds: impl Fn(Content) -> Aabb,
        instances: impl Fn(Content) -> u64,
    ) -> GroupIndex {
        let world = group.world_transforms();
        let mut first_instance = 0u64;
        let mut index = GroupIndex { kind, ..GroupIndex::default() };
        let mut placed = Vec::new();
        for (n, node) in group.nodes.iter().enumerate() {
            if node.content != Content::Nothing {
                let bounds = placed_bounds(&content_bounds(node.content), &world[n]);
                if !bounds.is_empty() {
                    placed.push((bounds, index.items.len() as u32));
                }
                index.group_from_content.push(world[n]);
                index.items.push(Item {
                    content: node.content,
                    first_instance: first_instance as u32,
                    node: n as u32,
                });
            }
            first_instance += instances(node.content);
        }
        index.places = vec![Place { moves: false, node: NOWHERE, slot: 0 }; index.items.len()];
        index.at_rest = placed.len();
        index.middle = middle_of(placed.len(), |i| placed[i].0);
        let box_of =
            |(bounds, item): &(Aabb, u32)| Primitive::of_box(&Box3::about(bounds, index.middle), *item);
        index.resting = tree_of_items(placed.iter().map(box_of).collect(), kind);
        record_places(&index.resting, &mut index.places, false);
        index
    }

    /// The bounds of all items.
    pub fn bounds(&self) -> Aabb {
        let Aabb { min, max } = self.bounds_of_trees().to_aabb();
        Aabb { min: min + self.middle, max: max + self.middle }
    }

    /// The same in the space of the trees' boxes.
    pub fn bounds_of_trees(&self) -> Box3 {
        self.resting.bounds().union(&self.moving.bounds())
    }

    /// To the screen from the space of the trees' boxes, given the way from the group's.
    #[inline(always)]
    pub fn screen_from_trees(&self, screen_from_group: &ScreenFromObject) -> ScreenFromObject {
        match self.middle == DVec3::ZERO {
            true => *screen_from_group,
            false => screen_from_group.after(&DAffine3::from_translation(self.middle)),
        }
    }

    pub fn memory_bytes(&self) -> usize {
        let motion = self.motion.as_ref().map_or(0, |m| {
            m.poses.memory_bytes() + size_of_val(m.movers.as_slice()) + m.refit.memory_bytes()
        });
        size_of_val(self.items.as_slice())
            + size_of_val(self.group_from_content.as_slice())
            + size_of_val(self.places.as_slice())
            + size_of_val(self.resting.nodes.as_slice())
            + size_of_val(self.moving.nodes.as_slice())
            + motion
    }

    /// Follows the group's nodes to where they are now; returns how many items moved. `changed` lists all
    /// nodes whose own transforms may have changed since the last call, ascending. Cost: their subtrees and
    /// the boxes above what moved; the first time, all nodes; when items move that never did, all that ever
    /// did.
    pub fn update(
        &mut self,
        group: &Group,
        changed: &[u32],
        content_bounds: impl Fn(Content) -> Aabb,
    ) -> usize {
        let mut moved = Vec::new();
        let motion = match &mut self.motion {
            Some(motion) => {
                let (items, group_from_content) = (&self.items, &mut self.group_from_content);
                motion.poses.follow(group, changed, |node, now| {
                    if let Ok(i) = items.binary_search_by_key(&(node as u32), |item| item.node) {
                        group_from_content[i] = *now;
                        moved.push(i as u32);
                    }
                });
                motion
            }
            none => {
                let poses = Poses::new(group);
                for (i, (item, before)) in self.items.iter().zip(&mut self.group_from_content).enumerate() {
                    let now = poses.world(item.node as usize);
                    if before != now {
                        *before = *now;
                        moved.push(i as u32);
                    }
                }
                none.insert(Motion { poses, movers: Vec::new(), refit: Refit::default() })
            }
        };
        moved.retain(|&i| self.places[i as usize].node != NOWHERE);
        let bounds_now = |i: u32| {
            let (bounds, i) = (content_bounds(self.items[i as usize].content), i as usize);
            placed_box(&bounds, &self.group_from_content[i], self.middle)
        };
        let is_off = |i: u32| is_off(&self.group_from_content[i as usize]);
        let before = motion.movers.len();
        for &i in &moved {
            let place = &mut self.places[i as usize];
            if !place.moves {
                leave(&mut self.resting, *place);
                self.at_rest -= 1;
                place.moves = true;
                motion.movers.push(i);
            }
        }
        let joined = motion.movers.len() > before;
        if joined && self.at_rest == 0 {
            self.resting = WideTree::default();
        }
        if !joined {
            let slots = moved.iter().map(|&i| {
                let place = self.places[i as usize];
                (place.node, place.slot, if is_off(i) { Box3::EMPTY } else { bounds_now(i) }, i)
            });
            motion.refit.set(&mut self.moving, slots);
        }
        let (anew, most) = (joined || motion.refit.is_loose(), moved.len() * 2 > motion.movers.len());
        if anew || most && self.has_left_its_middle(&content_bounds) {
            self.build_movers_anew(content_bounds);
        }
        moved.len()
    }

    /// Whether all have come to where boxes about the origin that suited them tell little.
    fn has_left_its_middle(&self, content_bounds: impl Fn(Content) -> Aabb) -> bool {
        let Some(Motion { movers, .. }) = &self.motion else { return false };
        let about_middle = |mover: usize| {
            let i = movers[mover] as usize;
            let Aabb { min, max } =
                placed_bounds(&content_bounds(self.items[i].content), &self.group_from_content[i]);
            Aabb { min: min - self.middle, max: max - self.middle }
        };
        self.at_rest == 0 && middle_of(movers.len(), about_middle) != DVec3::ZERO
    }

    /// Builds the tree of what moves anew; if nothing rests, about the origin that suits it now.
    fn build_movers_anew(&mut self, content_bounds: impl Fn(Content) -> Aabb) {
        let Some(motion) = &mut self.motion else { return };
        let placed = motion.movers.iter().map(|&mover| {
            let i = mover as usize;
            (placed_bounds(&content_bounds(self.items[i].content), &self.group_from_content[i]), mover)
        });
        let placed: Vec<(Aabb, u32)> = placed.collect();
        if self.at_rest == 0 {
            self.middle = middle_of(placed.len(), |i| placed[i].0);
        }
        let box_of =
            |(bounds, item): &(Aabb, u32)| Primitive::of_box(&Box3::about(bounds, self.middle), *item);
        self.moving = tree_of_items(placed.iter().map(box_of).collect(), self.kind);
        record_places(&self.moving, &mut self.places, true);
        motion.refit = Refit::new(&self.moving);
        // They have slots to come back to.
        let off = motion.movers.iter().filter(|&&i| is_off(&self.group_from_content[i as usize]));
        let off = off.map(|&i| (self.places[i as usize], i));
        let off = off.map(|(place, i)| (place.node, place.slot, Box3::EMPTY, i));
        motion.refit.set(&mut self.moving, off);
        motion.refit.settle();
    }

    /// Asserts that every item is where `group` has it, and in one slot, whose box and all above contain it.
    pub fn validate(&self, group: &Group, content_bounds: impl Fn(Content) -> Aabb) {
        let world = group.world_transforms();
        let mut slots = vec![0; self.items.len()];
        for (tree, moves) in [(&self.resting, false), (&self.moving, true)] {
            for (n, node) in tree.nodes.iter().enumerate() {
                for slot in (0..node.used as usize).filter(|&s| node.child[s] != Slot::EMPTY) {
                    let inner = match node.child[slot].child() {
                        Child::Leaf(i) => {
                            let i = i as usize;
                            let place = self.places[i];
                            let found = (place.moves, place.node as usize, place.slot as usize);
                            assert_eq!(found, (moves, n, slot), "item {i} is looked for elsewhere");
                            slots[i] += 1;
                            let bounds = content_bounds(self.items[i].content);
                            placed_box(&bounds, &self.group_from_content[i], self.middle)
                        }
                        Child::Node(c) => tree.nodes[c as usize].bounds(),
                    };
                    let outer = node.bounds_of(slot);
                    assert!(outer.contains(&inner), "slot {slot} of node {n} is too small");
                }
            }
        }
        for (i, item) in self.items.iter().enumerate() {
            let off = self.places[i].moves && is_off(&self.group_from_content[i]);
            let seen = usize::from(!content_bounds(item.content).is_empty() && !off);
            assert_eq!(slots[i], seen, "item {i} occurs {} times", slots[i]);
            let (found, now) = (self.group_from_content[i], world[item.node as usize]);
            assert!(found == now || now.is_nan(), "item {i} is out of place");
        }
    }
}

/// Whether what has moved here is switched off: nothing is left of it.
fn is_off(transform: &DAffine3) -> bool {
    transform.matrix3 == DMat3::ZERO
}

/// A content's box seen through its transform, widened by the rounding of that arithmetic.
fn placed_bounds(bounds: &Aabb, transform: &DAffine3) -> Aabb {
    if bounds.is_empty() {
        return Aabb::EMPTY;
    }
    let placed = bounds.transformed(transform);
    // Three products and sums in f64 on either side: 2⁻⁴⁸ of the terms' size covers both roundings.
    let reach = bounds.min.abs().max(bounds.max.abs());
    let m = transform.matrix3;
    let size = m.x_axis.abs() * reach.x + m.y_axis.abs() * reach.y + m.z_axis.abs() * reach.z;
    let slack = (size + transform.translation.abs()) * 2f64.powi(-48);
    Aabb { min: placed.min - slack, max: placed.max + slack }
}

/// The same about the origin of the trees' boxes.
fn placed_box(bounds: &Aabb, transform: &DAffine3, middle: DVec3) -> Box3 {
    Box3::about(&placed_bounds(bounds, transform), middle)
}

/// A tree whose leaves are the primitives' numbers.
fn tree_of_items(mut primitives: Vec<Primitive>, kind: TreeKind) -> WideTree {
    let built = match kind {
        TreeKind::Bvh => bvh::build(&mut primitives, 1),
        // An item has one slot, where it is found when it moves: it is never shared by several cubes.
        TreeKind::OctreeSmallest | TreeKind::OctreePushed => octree::build_smallest(primitives, 1),
    };
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
