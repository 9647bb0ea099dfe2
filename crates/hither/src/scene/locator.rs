//! Finds an instance by its number in a few steps, without expanding the others.

use super::{Content, Group, Scene};
use glam::DAffine3;

/// For each group, where the instances of each of its nodes begin. Independent of how the scene is posed.
#[derive(Clone, Debug)]
pub struct InstanceLocator {
    groups: Vec<Starts>,
}

/// The nodes of a group that show something, and the number of instances in the group before each.
#[derive(Clone, Debug, Default)]
struct Starts {
    nodes: Vec<u32>,
    first: Vec<u32>,
    total: u32,
}

impl InstanceLocator {
    /// Counts once. Cost in time and memory: the stored nodes. The scene must be valid.
    pub fn new(scene: &Scene) -> InstanceLocator {
        let mut groups: Vec<Starts> = Vec::with_capacity(scene.groups.len());
        for group in &scene.groups {
            let mut starts = Starts::default();
            for (at, node) in group.nodes.iter().enumerate() {
                let size = match node.content {
                    Content::Nothing => continue,
                    Content::Mesh(_) => 1,
                    Content::Group(g) => groups[g as usize].total,
                };
                if size > 0 {
                    starts.nodes.push(at as u32);
                    starts.first.push(starts.total);
                    // A group that is not shown may exceed what a shown one can; it is never asked.
                    starts.total = starts.total.saturating_add(size);
                }
            }
            groups.push(starts);
        }
        InstanceLocator { groups }
    }

    /// The mesh of instance `index` and where it is in `scene` as posed now; `None` past the end. The
    /// transform is that of [`Scene::instances`] to the last bit. Cost: nesting depth × logarithm of nodes,
    /// and the node's ancestors in each group.
    pub fn locate(&self, scene: &Scene, index: u32) -> Option<(u32, DAffine3)> {
        let mut world = DAffine3::IDENTITY;
        let mesh = self.descend(scene, index, |group, node| world *= group.world_transform(node as usize))?;
        Some((mesh, world))
    }

    /// The nodes that lead to instance `index`, one in each nested group: the path of [`Scene::instance`], as
    /// [`Scene::path_name`] takes it. Cost: nesting depth × logarithm of nodes.
    pub fn path(&self, scene: &Scene, index: u32) -> Option<Vec<u32>> {
        let mut path = Vec::new();
        self.descend(scene, index, |_, node| path.push(node))?;
        Some(path)
    }

    /// Shows each group on the way to instance `index`, and its node that leads on. Returns the mesh.
    fn descend(&self, scene: &Scene, index: u32, mut through: impl FnMut(&Group, u32)) -> Option<u32> {
        let (mut group, mut rest) = (scene.root as usize, index);
        loop {
            let starts = &self.groups[group];
            if rest >= starts.total {
                return None;
            }
            let at = starts.first.partition_point(|&first| first <= rest) - 1;
            let node = starts.nodes[at];
            rest -= starts.first[at];
            through(&scene.groups[group], node);
            match scene.groups[group].nodes[node as usize].content {
                Content::Mesh(mesh) => return Some(mesh),
                Content::Group(inner) => group = inner as usize,
                Content::Nothing => unreachable!("only nodes that show something are listed"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Node, Transform};
    use glam::{DQuat, DVec3};
    use proptest::prelude::*;

    /// Groups of nodes that are empty, show a mesh, or show an earlier group; parents and poses vary.
    fn scene_from(recipe: &[Vec<(u8, u8)>]) -> Scene {
        let mut scene = Scene { meshes: vec![Mesh::default(); 3], ..Scene::default() };
        for (g, nodes) in recipe.iter().enumerate() {
            let mut group = Group::default();
            for (n, &(kind, pose)) in nodes.iter().enumerate() {
                let content = match kind % 6 {
                    0 => Content::Nothing,
                    k @ 1..=3 => Content::Mesh(u32::from(k) - 1),
                    _ if g > 0 => Content::Group(u32::from(pose) % g as u32),
                    _ => Content::Nothing,
                };
                group.push(Node {
                    parent: (n > 0 && pose % 3 > 0).then(|| n as u32 - 1),
                    local: Transform::Trs {
                        translation: DVec3::new(f64::from(pose), 1.0, 0.1),
                        rotation: DQuat::from_rotation_y(f64::from(kind)),
                        scale: DVec3::new(1.0, -1.5, 0.5),
                    },
                    content,
                    ..Node::default()
                });
            }
            scene.groups.push(group);
        }
        scene.root = scene.groups.len() as u32 - 1;
        scene
    }

    proptest! {
        #[test]
        fn locating_agrees_with_expanding(
            recipe in prop::collection::vec(prop::collection::vec(any::<(u8, u8)>(), 0..7), 1..5)
        ) {
            let scene = scene_from(&recipe);
            prop_assert!(scene.validate().is_ok());
            let locator = InstanceLocator::new(&scene);
            let all = scene.instances();
            for (i, instance) in all.iter().enumerate() {
                let found = locator.locate(&scene, i as u32);
                prop_assert_eq!(found, Some((instance.mesh, instance.world_from_mesh)));
                prop_assert_eq!(locator.path(&scene, i as u32), Some(instance.path.clone()));
            }
            prop_assert!(locator.locate(&scene, all.len() as u32).is_none());
            prop_assert!(locator.locate(&scene, u32::MAX).is_none());
        }
    }
}
