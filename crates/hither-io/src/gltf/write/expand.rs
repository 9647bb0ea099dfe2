//! Nested groups written out: one node for every place in the world, parents before children, in the order
//! in which instances are numbered. Twenty-odd bytes a node; entries are made as they are written.

use super::document::NodeEntry;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use hither::scene::{Content, Node, Scene, Transform};
use serde::{Serialize, Serializer};

const NONE: u32 = u32::MAX;

/// Number of nodes that the scene expands to; saturates.
pub(super) fn node_count(scene: &Scene) -> u64 {
    let mut counts: Vec<u64> = Vec::with_capacity(scene.groups.len());
    for group in &scene.groups {
        let inner = group.nodes.iter().map(|node| match node.content {
            Content::Group(g) => counts[g as usize],
            _ => 0,
        });
        counts.push(inner.fold(group.nodes.len() as u64, u64::saturating_add));
    }
    // Every camera may need a node of its own.
    counts[scene.root as usize].saturating_add(scene.cameras.len() as u64)
}

/// The written nodes.
pub(super) struct Expanded<'a> {
    sources: Vec<Source<'a>>,
    /// First and last child, and the next sibling, of each; [`NONE`] where there is none.
    first_child: Vec<u32>,
    last_child: Vec<u32>,
    next_sibling: Vec<u32>,
    camera: Vec<u32>,
    roots: Vec<u32>,
    /// Where the root group's nodes are.
    root_nodes: Vec<u32>,
}

#[derive(Clone, Copy)]
enum Source<'a> {
    Node(&'a Node),
    /// A place for a camera alone.
    Mount(&'a str, &'a Transform, f64),
}

/// A group that is being written out.
struct Frame<'a> {
    nodes: &'a [Node],
    /// Where its nodes so far were written.
    written: Vec<u32>,
    parent: Option<u32>,
}

impl<'a> Expanded<'a> {
    pub(super) fn of(scene: &'a Scene) -> Expanded<'a> {
        let mut all = Expanded {
            sources: Vec::new(),
            first_child: Vec::new(),
            last_child: Vec::new(),
            next_sibling: Vec::new(),
            camera: Vec::new(),
            roots: Vec::new(),
            root_nodes: Vec::new(),
        };
        let open = |group: u32, parent| Frame {
            nodes: &scene.groups[group as usize].nodes,
            written: Vec::new(),
            parent,
        };
        let mut frames = vec![open(scene.root, None)];
        while let Some(frame) = frames.last_mut() {
            let Some(node) = frame.nodes.get(frame.written.len()) else {
                let done = frames.pop();
                if frames.is_empty() {
                    all.root_nodes = done.map(|frame| frame.written).unwrap_or_default();
                }
                continue;
            };
            let parent = node.parent.map(|p| frame.written[p as usize]).or(frame.parent);
            let at = all.push(Source::Node(node), parent);
            frame.written.push(at);
            if let Content::Group(inner) = node.content {
                frames.push(open(inner, Some(at)));
            }
        }
        all
    }

    fn push(&mut self, source: Source<'a>, parent: Option<u32>) -> u32 {
        let at = self.sources.len() as u32;
        self.sources.push(source);
        for list in [&mut self.first_child, &mut self.last_child, &mut self.next_sibling, &mut self.camera] {
            list.push(NONE);
        }
        match parent.map(|p| p as usize) {
            None => self.roots.push(at),
            Some(p) => {
                match self.last_child[p] {
                    NONE => self.first_child[p] = at,
                    sibling => self.next_sibling[sibling as usize] = at,
                }
                self.last_child[p] = at;
            }
        }
        at
    }

    /// Hangs camera `index` from a node of the root group or from the world: on the node itself where it
    /// can be, else on one of its own, which stands `back` behind the pose.
    pub(super) fn mount(
        &mut self,
        index: u32,
        name: &'a str,
        node: Option<u32>,
        local: &'a Transform,
        back: f64,
    ) {
        let node = node.map(|n| self.root_nodes[n as usize]);
        let at = match node {
            Some(n)
                if self.camera[n as usize] == NONE && back == 0.0 && local.matrix() == DAffine3::IDENTITY =>
            {
                n
            }
            _ => self.push(Source::Mount(name, local, back), node),
        };
        self.camera[at as usize] = index;
    }

    pub(super) fn roots(&self) -> Vec<u32> {
        self.roots.clone()
    }

    /// Where node `node` of the root group is.
    pub(super) fn of_root_node(&self, node: u32) -> u32 {
        self.root_nodes[node as usize]
    }

    /// Which of the scene's meshes are shown anywhere.
    pub(super) fn shown_meshes(&self, meshes: usize) -> Vec<bool> {
        let mut shown = vec![false; meshes];
        for source in &self.sources {
            if let Source::Node(Node { content: Content::Mesh(mesh), .. }) = source {
                shown[*mesh as usize] = true;
            }
        }
        shown
    }

    fn children(&self, at: usize) -> Vec<u32> {
        let child = |at: u32| (at != NONE).then_some(at);
        std::iter::successors(child(self.first_child[at]), |&c| child(self.next_sibling[c as usize]))
            .collect()
    }
}

/// The document's nodes, made one by one while they are written.
pub(super) struct Nodes<'a> {
    pub(super) expanded: &'a Expanded<'a>,
    /// The written mesh for each of the scene's, if it is written.
    pub(super) mesh_index: &'a [Option<u32>],
}

impl Nodes<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.expanded.sources.is_empty()
    }

    fn entry(&self, at: usize) -> NodeEntry<'_> {
        let children = self.expanded.children(at);
        let camera = Some(self.expanded.camera[at]).filter(|&c| c != NONE);
        match self.expanded.sources[at] {
            Source::Node(node) => {
                let mesh = match node.content {
                    Content::Mesh(mesh) => self.mesh_index[mesh as usize],
                    _ => None,
                };
                placed(
                    NodeEntry { name: &node.name, children, mesh, camera, ..Default::default() },
                    &node.local,
                )
            }
            Source::Mount(name, local, back) => {
                let entry = NodeEntry { name, children, camera, ..Default::default() };
                if back == 0.0 {
                    return placed(entry, local);
                }
                let moved = local.matrix() * DAffine3::from_translation(DVec3::Z * back);
                placed(entry, &Transform::Affine(moved))
            }
        }
    }
}

impl Serialize for Nodes<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq((0..self.expanded.sources.len()).map(|at| self.entry(at)))
    }
}

fn placed<'a>(entry: NodeEntry<'a>, local: &Transform) -> NodeEntry<'a> {
    match *local {
        Transform::Affine(matrix) => NodeEntry { matrix: Some(DMat4::from(matrix).to_cols_array()), ..entry },
        Transform::Trs { translation, rotation, scale } => {
            let rotation = if rotation.is_normalized() {
                rotation
            } else {
                DQuat::from_vec4(glam::DVec4::from(rotation).normalize_or(glam::DVec4::W))
            };
            NodeEntry {
                translation: (translation != DVec3::ZERO).then(|| translation.to_array()),
                rotation: (rotation != DQuat::IDENTITY).then(|| rotation.to_array()),
                scale: (scale != DVec3::ONE).then(|| scale.to_array()),
                ..entry
            }
        }
    }
}
