//! Parts of a scene: which instances belong together, and the hulls around them.

use super::sort::VisibilitySort;
use super::split::{SplitBy, split};
use crate::geometry::Hull;
use crate::scene::{Instance, Mesh, Scene};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::ops::Range;

/// What becomes one part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Granularity {
    /// Every instance of a mesh.
    #[default]
    Instances,
    /// Everything below a node at this depth of the shown forest, roots being 1; what is higher is a part each.
    Depth(u32),
    /// Everything below a node with one of these names; the rest is a part an instance.
    Names(Vec<String>),
}

/// What is put around parts, and what stays apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shapes {
    /// Up to so many hulls a mesh; 0 means 1. A mesh that is not convex is divided where it is least so
    /// ([`SplitBy::Adaptive`]) and the hulls are put around the pieces, until no surface is deeper inside its hull than
    /// a hundredth of the mesh's size. What is drawn is not divided.
    pub hulls: u32,
    /// Each hull is made smaller about its centre by this share: parts that only touch, or sink into each other a
    /// little, then have an order, at the price of what shows of that. 0 is safe.
    pub shrink: f64,
    /// Nodes of the root group, ascending, that are parts of their own whatever the granularity:
    /// [`PreSplit::pieces`](super::PreSplit::pieces).
    pub apart: Vec<u32>,
}

/// A part: instances that are sorted as one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// The name of its node, possibly empty.
    pub name: String,
    /// Its instances, ascending.
    pub instances: Vec<u32>,
    /// Triangles in all.
    pub triangles: u64,
}

/// The parts of a scene, and their hulls.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// In the order of their first instances.
    pub parts: Vec<Part>,
    /// Instances that have no triangles, and so are in no part.
    pub empty_instances: Vec<u32>,
    hulls: Vec<Hull>,
    /// For each piece its instance and its hull.
    pieces: Vec<(u32, u32)>,
    /// Where each part's pieces end.
    ends: Vec<u32>,
}

/// Why a scene has no such parts.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartsError {
    /// A name that no node with a mesh below it has.
    #[error("no node \"{0}\" with anything to see; `hither order --json -` without --parts names the parts")]
    UnknownName(String),
    /// Too many.
    #[error("the scene has {0} instances; whole parts are sorted up to 16,777,216")]
    TooMany(u64),
}

/// Most instances that are sorted.
const MOST_INSTANCES: u64 = 1 << 24;

impl Parts {
    /// The parts of `scene`, and a hull for each mesh they show. Cost: the vertices of these meshes, and the
    /// instances.
    pub fn of(scene: &Scene, granularity: &Granularity) -> Result<Parts, PartsError> {
        Parts::shaped(scene, granularity, &Shapes::default())
    }

    /// As [`Parts::of`], with hulls as `shapes` says.
    pub fn shaped(scene: &Scene, granularity: &Granularity, shapes: &Shapes) -> Result<Parts, PartsError> {
        let count = scene.instance_count();
        if count > MOST_INSTANCES {
            return Err(PartsError::TooMany(count));
        }
        let instances = scene.instances();
        let mut found = Parts::default();
        let mut hulls_of_mesh: HashMap<u32, Range<u32>> = HashMap::new();
        let mut hulls_of_points: HashMap<Vec<[u32; 3]>, Range<u32>> = HashMap::new();
        let mut part_of_owner: HashMap<Owner, usize> = HashMap::new();
        let mut used = vec![false; if let Granularity::Names(names) = granularity { names.len() } else { 0 }];
        let mut members: Vec<Vec<(u32, u32)>> = Vec::new();
        for (number, instance) in instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh as usize];
            let around = hulls_of_mesh.entry(instance.mesh).or_insert_with(|| {
                // Meshes that differ in colour alone share their hulls.
                let corners = mesh.triangles.as_flattened().iter().map(|&v| mesh.positions[v as usize]);
                let bits = corners.map(|p| p.to_array().map(f32::to_bits)).collect();
                let add = || {
                    let first = found.hulls.len() as u32;
                    found.hulls.extend(
                        hulls_around(mesh, shapes.hulls).iter().map(|hull| shrunk(hull, shapes.shrink)),
                    );
                    first..found.hulls.len() as u32
                };
                hulls_of_points.entry(bits).or_insert_with(add).clone()
            });
            if around.start == around.end {
                found.empty_instances.push(number as u32);
                continue;
            }
            let apart = matches!(instance.path[..], [node] if shapes.apart.binary_search(&node).is_ok());
            let granularity = if apart { &Granularity::Instances } else { granularity };
            let (owner, name) = owner(scene, instance, number, granularity, &mut used);
            let at = *part_of_owner.entry(owner).or_insert_with(|| {
                found.parts.push(Part { name, ..Part::default() });
                members.push(Vec::new());
                found.parts.len() - 1
            });
            found.parts[at].instances.push(number as u32);
            found.parts[at].triangles += mesh.triangles.len() as u64;
            members[at].extend(around.clone().map(|hull| (number as u32, hull)));
        }
        if let (Granularity::Names(names), Some(at)) = (granularity, used.iter().position(|&u| !u)) {
            return Err(PartsError::UnknownName(names[at].clone()));
        }
        for pieces in members {
            found.pieces.extend(pieces);
            found.ends.push(found.pieces.len() as u32);
        }
        Ok(found)
    }

    /// Adds the parts to a sort that has none yet, so that numbers are the same in both.
    pub fn add_to(&self, sort: &mut VisibilitySort) {
        for hull in &self.hulls {
            sort.add_hull(hull.clone());
        }
        for part in 0..self.parts.len() {
            let hulls: Vec<u32> = self.pieces_of(part).iter().map(|&(_, hull)| hull).collect();
            sort.add_part(&hulls);
        }
    }

    /// Places every piece as `scene` is posed now.
    pub fn place_in(&self, sort: &mut VisibilitySort, scene: &Scene) {
        let instances = scene.instances();
        self.place_at(sort, &instances);
    }

    /// As [`Parts::place_in`], with the scene's instances already listed.
    pub fn place_at(&self, sort: &mut VisibilitySort, instances: &[Instance]) {
        for (piece, &(instance, _)) in self.pieces.iter().enumerate() {
            sort.place(piece as u32, instances[instance as usize].world_from_mesh);
        }
    }

    /// The corners of all hulls of a part, in world space. `instances` are those of the scene as it is posed.
    pub fn hull_points(&self, part: usize, instances: &[Instance]) -> Vec<DVec3> {
        let pieces = self.pieces_of(part).iter();
        let corners = pieces.flat_map(|&(instance, hull)| {
            let pose = instances[instance as usize].world_from_mesh;
            self.hulls[hull as usize].vertices().iter().map(move |&v| pose.transform_point3(v))
        });
        corners.collect()
    }

    /// Faces of all hulls of a part together, for measures of cost.
    pub fn hull_triangles(&self, part: usize) -> usize {
        self.pieces_of(part).iter().map(|&(_, hull)| self.hulls[hull as usize].triangles().len()).sum()
    }

    fn pieces_of(&self, part: usize) -> &[(u32, u32)] {
        let start = if part == 0 { 0 } else { self.ends[part - 1] };
        &self.pieces[start as usize..self.ends[part] as usize]
    }
}

/// Up to `most` hulls around a mesh; none without triangles.
fn hulls_around(mesh: &Mesh, most: u32) -> Vec<Hull> {
    let bounds = mesh.bounds();
    if most > 1 && !bounds.is_empty() {
        let depth = 0.01 * bounds.size().length();
        let split = split(mesh, &SplitBy::Adaptive { pieces: most, depth }, 0.0);
        if split.pieces.len() > 1 {
            return split.pieces.iter().filter_map(|piece| Hull::around(&used_points(piece))).collect();
        }
    }
    Hull::around(&used_points(mesh)).into_iter().collect()
}

/// A hull made smaller about its centre by a share.
fn shrunk(hull: &Hull, by: f64) -> Hull {
    let smaller = DAffine3::from_scale(DVec3::splat(1.0 - by));
    let to_center = DAffine3::from_translation(hull.center());
    if by == 0.0 { hull.clone() } else { hull.transformed(&(to_center * smaller * to_center.inverse())) }
}

/// The positions that a mesh's triangles use.
fn used_points(mesh: &Mesh) -> Vec<DVec3> {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    mesh.positions.iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| p.as_dvec3()).collect()
}

/// What an instance belongs to: itself, or a node by its path through nested groups.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Owner {
    Instance(usize),
    Node(Vec<u32>),
}

/// The ancestors of an instance, outermost first: the path that leads to each, and its name.
fn ancestors<'s>(scene: &'s Scene, instance: &Instance) -> Vec<(Vec<u32>, &'s str)> {
    let mut found = Vec::new();
    let mut group = &scene.groups[scene.root as usize];
    let mut prefix: Vec<u32> = Vec::new();
    for &node in &instance.path {
        let mut chain = vec![node];
        while let Some(parent) = group.nodes[chain[chain.len() - 1] as usize].parent {
            chain.push(parent);
        }
        for &at in chain.iter().rev() {
            let path = prefix.iter().copied().chain([at]).collect();
            found.push((path, group.nodes[at as usize].name.as_str()));
        }
        prefix.push(node);
        if let crate::scene::Content::Group(inner) = group.nodes[node as usize].content {
            group = &scene.groups[inner as usize];
        }
    }
    found
}

fn owner(
    scene: &Scene,
    instance: &Instance,
    number: usize,
    granularity: &Granularity,
    used: &mut [bool],
) -> (Owner, String) {
    let mut ancestors = ancestors(scene, instance);
    let own = || {
        // The innermost name that is not empty.
        let name = ancestors.iter().rev().map(|a| a.1).find(|name| !name.is_empty());
        (Owner::Instance(number), name.unwrap_or_default().to_owned())
    };
    let at = match granularity {
        Granularity::Instances => return own(),
        Granularity::Depth(depth) => (*depth as usize).max(1) - 1,
        Granularity::Names(names) => {
            let found = ancestors.iter().position(|(_, name)| {
                let at = names.iter().position(|n| n == name);
                if let Some(at) = at {
                    used[at] = true;
                }
                at.is_some()
            });
            match found {
                Some(at) => at,
                None => return own(),
            }
        }
    };
    if at >= ancestors.len() {
        return own();
    }
    let (path, name) = ancestors.swap_remove(at);
    (Owner::Node(path), name.to_owned())
}
