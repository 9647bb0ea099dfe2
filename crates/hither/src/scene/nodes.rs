//! Groups of nodes, their transforms, and the numbering of instances.

use super::{Scene, SceneError, fault};
use glam::{DAffine3, DQuat, DVec3};

/// A forest of nodes in depth-first order: a parent comes before its children, and a subtree is a run.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// The group's name, possibly empty.
    pub name: String,
    /// Nodes, parents first, depth-first.
    pub nodes: Vec<Node>,
}

/// A named place that may show something.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// The node's name in its file, possibly empty.
    pub name: String,
    /// Index of the parent within the same group, smaller than the node's own.
    pub parent: Option<u32>,
    /// Transform to the parent's space (or the group's).
    pub local: Transform,
    /// What is shown here.
    pub content: Content,
}

/// What a node shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// Nothing itself.
    #[default]
    Nothing,
    /// A mesh, by index: one instance.
    Mesh(u32),
    /// A whole earlier group, by index.
    Group(u32),
}

/// A node's transform. Scales may be zero or negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Scale, then rotation, then translation; what animations set.
    Trs {
        /// Metres.
        translation: DVec3,
        /// Unit quaternion.
        rotation: DQuat,
        /// Factors along the local axes.
        scale: DVec3,
    },
    /// Any affine map.
    Affine(DAffine3),
}

impl Default for Transform {
    fn default() -> Self {
        Transform::from_translation(DVec3::ZERO)
    }
}

impl Transform {
    /// A pure translation.
    pub fn from_translation(translation: DVec3) -> Transform {
        Transform::Trs { translation, rotation: DQuat::IDENTITY, scale: DVec3::ONE }
    }

    /// The affine map `parent_from_node`.
    pub fn matrix(&self) -> DAffine3 {
        match *self {
            Transform::Trs { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
            Transform::Affine(m) => m,
        }
    }
}

impl Group {
    /// Adds a node and returns its index. Keep depth-first order: add a node's children right after it.
    pub fn push(&mut self, node: Node) -> u32 {
        self.nodes.push(node);
        (self.nodes.len() - 1) as u32
    }

    /// `group_from_node` of every node. Linear, without recursion, however deep the nesting.
    pub fn world_transforms(&self) -> Vec<DAffine3> {
        let mut world: Vec<DAffine3> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let local = node.local.matrix();
            world.push(match node.parent {
                Some(p) => world[p as usize] * local,
                None => local,
            });
        }
        world
    }

    /// `group_from_node` of one node, bit-identical to the entry of [`Group::world_transforms`].
    pub fn world_transform(&self, node: usize) -> DAffine3 {
        let mut chain = vec![node];
        while let Some(p) = self.nodes[chain[chain.len() - 1]].parent {
            chain.push(p as usize);
        }
        let mut world: Option<DAffine3> = None;
        for &i in chain.iter().rev() {
            let local = self.nodes[i].local.matrix();
            world = Some(match world {
                Some(w) => w * local,
                None => local,
            });
        }
        world.unwrap_or(DAffine3::IDENTITY)
    }
}

/// One appearance of a mesh in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Where it is.
    pub world_from_mesh: DAffine3,
    /// Node indices from the root group inwards, one per nested group.
    pub path: Vec<u32>,
}

impl Scene {
    /// The instance with number `index`, or `None` past the end. Cost: the nodes of the groups on its path.
    pub fn instance(&self, index: u64) -> Option<Instance> {
        let counts = self.instance_counts();
        let mut group = self.root as usize;
        let mut rest = index;
        let mut world = DAffine3::IDENTITY;
        let mut path = Vec::new();
        'descend: loop {
            for (i, node) in self.groups[group].nodes.iter().enumerate() {
                let size = match node.content {
                    Content::Mesh(_) => 1,
                    Content::Group(g) => counts[g as usize],
                    Content::Nothing => 0,
                };
                if rest >= size {
                    rest -= size;
                    continue;
                }
                world *= self.groups[group].world_transform(i);
                path.push(i as u32);
                match node.content {
                    Content::Mesh(mesh) => return Some(Instance { mesh, world_from_mesh: world, path }),
                    Content::Group(g) => {
                        group = g as usize;
                        continue 'descend;
                    }
                    Content::Nothing => unreachable!("a node without content has size 0"),
                }
            }
            return None;
        }
    }

    /// Every instance in order, expanded. For references, exports and small scenes: the memory is theirs.
    pub fn instances(&self) -> Vec<Instance> {
        let worlds: Vec<Vec<DAffine3>> = self.groups.iter().map(Group::world_transforms).collect();
        let mut found = Vec::new();
        // (group, next node, transform of the group, path to the group)
        let mut stack = vec![(self.root as usize, 0usize, DAffine3::IDENTITY, Vec::<u32>::new())];
        while let Some((group, at, world, path)) = stack.pop() {
            let Some(node) = self.groups[group].nodes.get(at) else { continue };
            let here = world * worlds[group][at];
            let mut inner = path.clone();
            inner.push(at as u32);
            stack.push((group, at + 1, world, path));
            match node.content {
                Content::Mesh(mesh) => found.push(Instance { mesh, world_from_mesh: here, path: inner }),
                Content::Group(g) => stack.push((g as usize, 0, here, inner)),
                Content::Nothing => {}
            }
        }
        found
    }

    /// Names along an instance's path, joined by `/`; unnamed nodes appear as `#index`.
    pub fn path_name(&self, path: &[u32]) -> String {
        let mut group = self.root as usize;
        let mut names = Vec::with_capacity(path.len());
        for &at in path {
            let node = &self.groups[group].nodes[at as usize];
            names.push(if node.name.is_empty() { format!("#{at}") } else { node.name.clone() });
            if let Content::Group(g) = node.content {
                group = g as usize;
            }
        }
        names.join("/")
    }
}

pub(super) fn validate(scene: &Scene) -> Result<(), SceneError> {
    if scene.root as usize >= scene.groups.len() {
        return Err(fault("scene", "its root group does not exist"));
    }
    for (g, group) in scene.groups.iter().enumerate() {
        for (n, node) in group.nodes.iter().enumerate() {
            let wrong = |what: &str| Err(fault(format!("node {n} (\"{}\") of group {g}", node.name), what));
            if node.parent.is_some_and(|p| p as usize >= n) {
                return wrong("its parent does not come before it");
            }
            if !node.local.matrix().is_finite() {
                return wrong("its transform is not finite");
            }
            match node.content {
                Content::Mesh(m) if m as usize >= scene.meshes.len() => {
                    return wrong("it shows a mesh that does not exist");
                }
                Content::Group(inner) if inner as usize >= g => {
                    return wrong("it shows a group that does not come before its own");
                }
                _ => {}
            }
        }
    }
    if scene.instance_count() >= u64::from(u32::MAX) {
        return Err(fault("scene", "it expands to more than 4,294,967,294 instances"));
    }
    Ok(())
}
