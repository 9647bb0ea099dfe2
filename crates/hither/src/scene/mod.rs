//! Scenes as plain data: meshes, nested instances, materials, parts, cameras, motion. No files.
//!
//! A [`Scene`] is a list of [`Group`]s. A group is a forest of [`Node`]s; a node shows a mesh, or *another
//! group* (an instance of it), so a building can be 33 instances of a floor that is 33 instances of a row:
//! triangles are never copied, and neither are nodes. Files produce one group; generated worlds nest.
//!
//! Instances are numbered depth-first through the root group's nodes in their stored order, groups
//! expanded in place; only nodes that show a mesh count ([`Scene::instances`], [`Scene::instance`]).

mod animation;
mod camera;
mod hiding;
mod locator;
mod material;
mod mesh;
mod mip;
mod nodes;
mod sample;

pub use animation::{Animation, Channel, Interpolation, Property};
pub use camera::{Camera, CameraProjection};
pub(crate) use hiding::HidingMaterials;
pub use locator::InstanceLocator;
pub use material::{AlphaMode, Filter, Material, Texture, TextureRef, Wrap};
pub use mesh::{Mesh, Primitive};
pub use mip::TexturePyramids;
pub use nodes::{Content, Group, Instance, Node, Transform};
pub use sample::{LINEAR_FROM_SRGB, Surface};

use crate::geometry::Aabb;

/// Everything there is to see. See the module's page for how the parts refer to each other.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// What the scene is called, possibly empty.
    pub name: String,
    /// Triangle meshes, referred to by nodes.
    pub meshes: Vec<Mesh>,
    /// Materials, referred to by primitives.
    pub materials: Vec<Material>,
    /// Decoded images, referred to by materials.
    pub textures: Vec<Texture>,
    /// Groups of nodes. A group refers only to groups *before* it, so nesting always ends.
    pub groups: Vec<Group>,
    /// The group that is shown; it must exist.
    pub root: u32,
    /// Cameras, in file order.
    pub cameras: Vec<Camera>,
    /// Motions of the root group's nodes.
    pub animations: Vec<Animation>,
}

/// A reference in a [`Scene`] that leads nowhere, or a number that is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}: {fault}")]
pub struct SceneError {
    /// Which part of the scene, for example `mesh 3 ("door")`.
    pub place: String,
    /// What is wrong with it.
    pub fault: String,
}

impl Scene {
    /// An empty scene with one empty root group.
    pub fn new(name: impl Into<String>) -> Scene {
        Scene { name: name.into(), groups: vec![Group::default()], ..Scene::default() }
    }

    /// The group that is shown.
    pub fn root_group(&self) -> &Group {
        &self.groups[self.root as usize]
    }

    /// Number of instances (nodes with a mesh, groups expanded). Cost: the number of stored nodes.
    pub fn instance_count(&self) -> u64 {
        self.instance_counts()[self.root as usize]
    }

    /// Number of triangles with every instance counted.
    pub fn instanced_triangle_count(&self) -> u64 {
        let per_group = self.per_group(|node, below| match node.content {
            Content::Mesh(m) => self.meshes[m as usize].triangles.len() as u64,
            Content::Group(g) => below[g as usize],
            Content::Nothing => 0,
        });
        per_group[self.root as usize]
    }

    /// For each group, how many instances it expands to.
    pub fn instance_counts(&self) -> Vec<u64> {
        self.per_group(|node, below| match node.content {
            Content::Mesh(_) => 1,
            Content::Group(g) => below[g as usize],
            Content::Nothing => 0,
        })
    }

    fn per_group(&self, of_node: impl Fn(&Node, &[u64]) -> u64) -> Vec<u64> {
        let mut totals: Vec<u64> = Vec::with_capacity(self.groups.len());
        for group in &self.groups {
            let total = group.nodes.iter().map(|node| of_node(node, &totals)).fold(0u64, u64::saturating_add);
            totals.push(total);
        }
        totals
    }

    /// A box around everything shown, lines included, in world space; `None` for an empty scene. It is put together from
    /// the boxes of meshes, and larger than need be where nodes turn them. Cost: vertices stored, and nodes.
    pub fn bounds(&self) -> Option<Aabb> {
        let meshes: Vec<Aabb> = self.meshes.iter().map(|m| m.bounds().union(&m.bounds_of_lines())).collect();
        let mut groups: Vec<Aabb> = Vec::with_capacity(self.groups.len());
        for group in &self.groups {
            let world = group.world_transforms();
            let bounds = group.nodes.iter().zip(&world).fold(Aabb::EMPTY, |all, (node, at)| {
                let inner = match node.content {
                    Content::Mesh(m) => meshes[m as usize],
                    Content::Group(g) => groups[g as usize],
                    Content::Nothing => Aabb::EMPTY,
                };
                all.union(&inner.transformed(at))
            });
            groups.push(bounds);
        }
        let bounds = groups.get(self.root as usize).copied().unwrap_or(Aabb::EMPTY);
        (!bounds.is_empty()).then_some(bounds)
    }

    /// Checks every reference and every number. Readers call it; code that builds scenes may.
    pub fn validate(&self) -> Result<(), SceneError> {
        nodes::validate(self)?;
        mesh::validate(self)?;
        material::validate(self)?;
        camera::validate(self)?;
        animation::validate(self)
    }
}

fn fault(place: impl Into<String>, fault: impl Into<String>) -> SceneError {
    SceneError { place: place.into(), fault: fault.into() }
}
