//! Scenes made searchable: a tree for each mesh, trees of instances for each group, nested as the scene is
//! ("an octree of octrees", [Greene 1995, §3.5.2]).
//!
//! Every tree, whichever way it was built, is the same flat array of 16-wide nodes, so that one
//! nearest-first walk serves them all.

mod boxes;
mod bvh;
mod group;
mod mesh;
mod octree;
mod parts;
mod poses;
mod refit;
mod tree;

use crate::geometry::Aabb;
pub(crate) use boxes::{blocks_of_boxes, middle_of, tree_of_boxes};
pub(crate) use group::{GroupIndex, Item};
pub(crate) use mesh::{BlockTree, MeshIndex};
pub(crate) use tree::{Box3, Child, Slot, WideNode, WideTree};

use crate::scene::{Content, HidingMaterials, Scene, Transform};
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// How a scene is indexed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IndexOptions {
    /// Which tree.
    pub tree: TreeKind,
}

/// The trees that serve the nearest-first walk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TreeKind {
    /// A 16-wide bounding volume hierarchy.
    #[default]
    Bvh,
    /// Greene's octree, each primitive in the smallest cube around it.
    OctreeSmallest,
    /// Greene's octree, small primitives pushed down to all the children they cross.
    OctreePushed,
}

/// Where a node is that is switched off.
const OFF: Transform = Transform::Affine(DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO });

/// A scene together with its trees. It owns the scene, so that the two cannot disagree.
#[derive(Debug)]
pub struct SceneIndex {
    scene: Scene,
    options: IndexOptions,
    pub(crate) meshes: Vec<MeshIndex>,
    pub(crate) groups: Vec<GroupIndex>,
    /// Of nodes that are switched off, where they would be.
    switched_off: HashMap<u32, Transform>,
    /// A number no other index of this process has, so that a renderer knows what it remembers.
    pub(crate) serial: u64,
}

impl SceneIndex {
    /// Builds the trees. The scene must be valid ([`Scene::validate`]). Cost: n log n in stored triangles.
    pub fn build(scene: Scene, options: &IndexOptions) -> SceneIndex {
        let materials = HidingMaterials::new(&scene);
        let build = |mesh| MeshIndex::build(mesh, materials.of(mesh), options);
        let meshes: Vec<MeshIndex> = scene.meshes.par_iter().map(build).collect();
        let counts = scene.instance_counts();
        let mut groups: Vec<GroupIndex> = Vec::with_capacity(scene.groups.len());
        for group in &scene.groups {
            let bounds = |c: Content| content_bounds(&meshes, &groups, c);
            let index = GroupIndex::build(group, options.tree, bounds, |c| match c {
                Content::Mesh(_) => 1,
                Content::Group(g) => counts[g as usize],
                Content::Nothing => 0,
            });
            groups.push(index);
        }
        let index = SceneIndex {
            scene,
            options: *options,
            meshes,
            groups,
            switched_off: HashMap::new(),
            serial: next_serial(),
        };
        if cfg!(debug_assertions) {
            index.validate();
        }
        index
    }

    /// The scene as it is posed now.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How it was built.
    pub fn options(&self) -> &IndexOptions {
        &self.options
    }

    /// The mesh of an instance; `None` if there is no such instance. `visit` gets the maps from the root down to it, each
    /// from what a group holds to the group. Cost: the depth, times the logarithm of the groups' sizes.
    pub(crate) fn descend(&self, instance: u32, mut visit: impl FnMut(&DAffine3)) -> Option<u32> {
        let (mut group, mut rest) = (self.scene.root, instance);
        loop {
            let GroupIndex { items, group_from_content, .. } = &self.groups[group as usize];
            let place = items.partition_point(|i| i.first_instance <= rest).checked_sub(1)?;
            let item = &items[place];
            visit(&group_from_content[place]);
            rest -= item.first_instance;
            match item.content {
                Content::Mesh(mesh) => return (rest == 0).then_some(mesh),
                Content::Group(g) => group = g,
                Content::Nothing => return None,
            }
        }
    }

    /// Poses the scene at `time` seconds of animation `animation` and refits what moved; static parts are
    /// untouched. Returns the number of root-group nodes with content that moved. Cost: the animation's
    /// channels, the nodes below those that they move, and the boxes above; the first time, all nodes of the
    /// root group; where a node moves that never did, the tree of all that ever did.
    pub fn pose(&mut self, animation: usize, time: f64) -> usize {
        let Some(channels) = self.scene.animations.get(animation).map(|a| &a.channels) else { return 0 };
        let mut changed: Vec<u32> = channels.iter().map(|channel| channel.node).collect();
        changed.retain(|&n| (n as usize) < self.scene.root_group().nodes.len());
        changed.sort_unstable();
        changed.dedup();
        // What is off is posed where it would be.
        self.exchange(&changed);
        self.scene.pose(animation, time);
        self.exchange(&changed);
        self.update(&changed)
    }

    /// Exchanges the transforms of those of `nodes` that are switched off for those that they would have.
    fn exchange(&mut self, nodes: &[u32]) {
        let all = &mut self.scene.groups[self.scene.root as usize].nodes;
        for node in nodes {
            if let Some(stored) = self.switched_off.get_mut(node) {
                std::mem::swap(stored, &mut all[*node as usize].local);
            }
        }
    }

    /// Switches a node of the root group off, with what hangs from it, or on again, wherever it is then. What is off
    /// shows nothing, hides nothing and is in no answer; its numbers stay. Returns how many nodes with content it
    /// concerned. Cost: as of [`SceneIndex::pose`].
    ///
    /// In [`SceneIndex::scene`] a node that is off is a point at the origin, and so is what hangs from it, cameras too;
    /// [`SceneIndex::into_scene`] has it where it would be.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn set_shown(&mut self, node: u32, shown: bool) -> usize {
        let nodes = &mut self.scene.groups[self.scene.root as usize].nodes;
        assert!(
            (node as usize) < nodes.len(),
            "the root group has {} nodes, and no node {node}",
            nodes.len()
        );
        let local = &mut nodes[node as usize].local;
        match (shown, self.switched_off.remove(&node)) {
            (true, None) => return 0,
            (true, Some(stored)) => *local = stored,
            (false, stored) => {
                let before = std::mem::replace(local, OFF);
                self.switched_off.insert(node, stored.unwrap_or(before));
            }
        }
        self.update(&[node])
    }

    /// Moves one node of the root group; returns how many nodes with content moved with it. Cost: as of
    /// [`SceneIndex::pose`].
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn set_transform(&mut self, node: u32, local: Transform) -> usize {
        self.set_transforms([(node, local)])
    }

    /// Moves several nodes of the root group at once. Cost: as of [`SceneIndex::pose`], once instead of a node.
    ///
    /// # Panics
    ///
    /// If there is no such node; nothing has moved then.
    pub fn set_transforms(&mut self, moves: impl IntoIterator<Item = (u32, Transform)>) -> usize {
        let moves: Vec<_> = moves.into_iter().collect();
        let nodes = &mut self.scene.groups[self.scene.root as usize].nodes;
        for (node, _) in &moves {
            assert!(
                (*node as usize) < nodes.len(),
                "the root group has {} nodes, and no node {node}",
                nodes.len()
            );
        }
        let place = |(node, local): (u32, Transform)| {
            match self.switched_off.get_mut(&node) {
                Some(stored) => *stored = local,
                None => nodes[node as usize].local = local,
            }
            node
        };
        let mut changed: Vec<u32> = moves.into_iter().map(place).collect();
        changed.sort_unstable();
        changed.dedup();
        self.update(&changed)
    }

    /// Follows the nodes in `changed` (ascending) and below.
    fn update(&mut self, changed: &[u32]) -> usize {
        let root = self.scene.root as usize;
        let mut index = std::mem::take(&mut self.groups[root]);
        let group = &self.scene.groups[root];
        let moved = index.update(group, changed, |c| content_bounds(&self.meshes, &self.groups, c));
        self.groups[root] = index;
        if moved > 0 && cfg!(debug_assertions) {
            self.validate();
        }
        moved
    }

    /// Gives the scene back.
    pub fn into_scene(mut self) -> Scene {
        let nodes = &mut self.scene.groups[self.scene.root as usize].nodes;
        for (node, local) in self.switched_off {
            nodes[node as usize].local = local;
        }
        self.scene
    }

    /// Bytes held by the trees and their triangles (the scene's own lists not counted).
    pub fn memory_bytes(&self) -> usize {
        self.meshes.iter().map(MeshIndex::memory_bytes).sum::<usize>()
            + self.groups.iter().map(GroupIndex::memory_bytes).sum::<usize>()
    }

    /// Asserts the trees' invariants: every primitive in place, every box around what it holds.
    pub fn validate(&self) {
        for (index, mesh) in self.meshes.iter().zip(&self.scene.meshes) {
            index.validate(mesh, &self.options);
        }
        for (index, group) in self.groups.iter().zip(&self.scene.groups) {
            index.validate(group, |c| content_bounds(&self.meshes, &self.groups, c));
        }
    }
}

fn next_serial() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

fn content_bounds(meshes: &[MeshIndex], groups: &[GroupIndex], content: Content) -> Aabb {
    match content {
        Content::Mesh(m) => meshes[m as usize].bounds().to_aabb(),
        Content::Group(g) => groups[g as usize].bounds(),
        Content::Nothing => Aabb::EMPTY,
    }
}

#[cfg(test)]
mod tests;
