//! Nodes of a scene whose meshes are pre-split, each piece a node and a part of its own [Snyder & Lengyel 1997, §9].

use super::known::Known;
use super::parts::PartsError;
use super::split::{Seam, SplitBy, SplitMesh, split};
use crate::scene::{Content, Instance, Node, Scene};
use glam::DAffine3;
use std::collections::HashMap;

/// A scene with some of its meshes in pieces.
#[derive(Clone, Debug, Default)]
pub struct PreSplit {
    /// The scene. Nodes keep their numbers; pieces come after them as children of the nodes that had their meshes, and
    /// move with them.
    pub scene: Scene,
    /// The pieces' nodes in the root group, ascending.
    pub pieces: Vec<u32>,
    /// Seams between pieces, by their nodes, in the space of their meshes.
    pub seams: Vec<(u32, u32, Seam)>,
}

/// Splits the meshes of, and below, the root group's nodes of the given names. Where there is no such node, a number
/// is that of a part, if every instance is one ([`Granularity::Instances`](super::Granularity::Instances)). `overlap`
/// is as for [`split`], and 0 for meshes that blend: where their pieces overlapped, both would tint what is behind.
/// Piece k of a node is called by the node's name, or `part` and its number, and k. A mesh that is one piece stays
/// as it is.
///
/// # Errors
/// A name that no node with a mesh of or below it has, and that is no such number.
pub fn split_nodes(mut scene: Scene, by: &[(String, SplitBy)], overlap: f64) -> Result<PreSplit, PartsError> {
    let (mut pieces, mut seams) = (Vec::new(), Vec::new());
    let mut known: HashMap<(u32, usize), (u32, SplitMesh)> = HashMap::new();
    let root = scene.root as usize;
    let numbered = parts_by_number(&scene);
    for (rule, (name, by)) in by.iter().enumerate() {
        let mut nodes = Vec::new();
        if !name.is_empty() {
            nodes = meshes_below(&scene.groups[root].nodes, name);
        }
        let mut called_by = name.clone();
        if nodes.is_empty() {
            let part = name.parse().ok().and_then(|number: usize| *numbered.get(number)?);
            nodes.push(part.ok_or_else(|| PartsError::UnknownName(name.clone()))?);
            called_by = format!("part {name}");
        }
        for (node, mesh) in nodes {
            let (first_mesh, split) = known.entry((mesh, rule)).or_insert_with(|| {
                let overlap = if blends(&scene, mesh) { 0.0 } else { overlap };
                let split = split(&scene.meshes[mesh as usize], by, overlap);
                let first = scene.meshes.len() as u32;
                if split.pieces.len() > 1 {
                    scene.meshes.extend(split.pieces.iter().cloned());
                }
                (first, split)
            });
            if split.pieces.len() < 2 {
                continue;
            }
            let nodes = &mut scene.groups[root].nodes;
            nodes[node as usize].content = Content::Nothing;
            let called = match nodes[node as usize].name.as_str() {
                "" => called_by.clone(),
                own => own.to_owned(),
            };
            let first = nodes.len() as u32;
            for piece in 0..split.pieces.len() as u32 {
                pieces.push(first + piece);
                nodes.push(Node {
                    name: format!("{called} {piece}"),
                    parent: Some(node),
                    content: Content::Mesh(*first_mesh + piece),
                    ..Node::default()
                });
            }
            seams.extend(split.seams.iter().map(|s| (first + s.first, first + s.second, *s)));
        }
    }
    Ok(PreSplit { scene, pieces, seams })
}

/// Whether any of a mesh is blended.
fn blends(scene: &Scene, mesh: u32) -> bool {
    scene.meshes[mesh as usize].primitives.iter().any(|p| scene.is_blended(p.material))
}

/// The nodes with a mesh among those of a name and what is below them, with their meshes.
fn meshes_below(nodes: &[Node], name: &str) -> Vec<(u32, u32)> {
    let mut inside = vec![false; nodes.len()];
    let mut found = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        inside[i] = node.name == name || node.parent.is_some_and(|p| inside[p as usize]);
        if let (true, Content::Mesh(mesh)) = (inside[i], node.content) {
            found.push((i as u32, mesh));
        }
    }
    found
}

/// The node and the mesh of each part, were every instance one; `None` for parts inside of nested groups.
fn parts_by_number(scene: &Scene) -> Vec<Option<(u32, u32)>> {
    let seen = |instance: &Instance| !scene.meshes[instance.mesh as usize].triangles.is_empty();
    let place = |instance: Instance| match instance.path[..] {
        [node] => Some((node, instance.mesh)),
        _ => None,
    };
    scene.instances().into_iter().filter(seen).map(place).collect()
}

impl Seam {
    /// The plane in world space, with the mesh posed; `None` where the pose flattens it.
    pub fn known(&self, world_from_mesh: &DAffine3) -> Option<Known> {
        let normal = world_from_mesh.matrix3.inverse().transpose() * self.normal;
        let offset = self.offset + normal.dot(world_from_mesh.translation);
        let length = normal.length();
        let plane = Known::Plane { normal: normal / length, offset: offset / length };
        (length.is_normal() && (normal / length).is_finite() && offset.is_finite()).then_some(plane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AlphaMode, Material, Mesh, Primitive};
    use glam::{DVec3, Vec3};

    /// A strip of quads along x, under two nodes of which one is called "ground".
    fn strip() -> Scene {
        let mut mesh = Mesh::default();
        for x in 0..9 {
            mesh.positions.extend([0.0, 1.0].map(|z| Vec3::new(x as f32, 0.0, z)));
        }
        mesh.triangles =
            (0..8).flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 2], [2 * i + 2, 2 * i + 1, 2 * i + 3]]).collect();
        mesh.primitives = vec![Primitive { triangles: 0..16, material: None }];
        let mut scene = Scene::new("strip");
        scene.meshes.push(mesh);
        let nodes = &mut scene.groups[0].nodes;
        nodes.push(Node { name: "ground".into(), ..Node::default() });
        nodes.push(Node { parent: Some(0), content: Content::Mesh(0), ..Node::default() });
        nodes.push(Node { name: "other".into(), content: Content::Mesh(0), ..Node::default() });
        scene
    }

    #[test]
    fn what_is_below_a_name_is_split_and_nothing_else() {
        let by = SplitBy::HeightField { columns: 4, rows: 1 };
        let found = split_nodes(strip(), &[("ground".into(), by)], 0.2).unwrap();
        assert_eq!(found.pieces, [3, 4, 5, 6]);
        assert_eq!(found.seams.len(), 3);
        let nodes = &found.scene.root_group().nodes;
        assert_eq!((nodes[1].content, nodes[2].content), (Content::Nothing, Content::Mesh(0)));
        assert_eq!((nodes[3].name.as_str(), nodes[3].parent), ("ground 0", Some(1)));
        assert_eq!(found.scene.instances().len(), 5);
        let unknown = split_nodes(strip(), &[("sea".into(), by)], 0.2).unwrap_err();
        assert_eq!(unknown, PartsError::UnknownName("sea".into()));
        // The first node is empty: part 0 is the second, which has no name.
        let numbered = split_nodes(strip(), &[("0".into(), by)], 0.2).unwrap();
        assert_eq!(numbered.pieces, [3, 4, 5, 6]);
        let nodes = &numbered.scene.root_group().nodes;
        assert_eq!((nodes[3].name.as_str(), nodes[3].parent), ("part 0 0", Some(1)));
        for wrong in ["2", "-1", "0.0", ""] {
            assert!(split_nodes(strip(), &[(wrong.into(), by)], 0.2).is_err(), "{wrong}");
        }
        let whole = SplitBy::HeightField { columns: 1, rows: 1 };
        assert!(split_nodes(strip(), &[("ground".into(), whole)], 0.2).unwrap().pieces.is_empty());
    }

    #[test]
    fn pieces_overlap_unless_they_blend() {
        let widths = |alpha: AlphaMode| {
            let mut scene = strip();
            scene.materials.push(Material { alpha, ..Material::default() });
            scene.meshes[0].primitives[0].material = Some(0);
            let by = SplitBy::HeightField { columns: 4, rows: 1 };
            let found = split_nodes(scene, &[("ground".into(), by)], 0.2).unwrap();
            found.scene.meshes[1..].iter().map(|m| m.bounds().size().x).collect::<Vec<f64>>()
        };
        assert_eq!(widths(AlphaMode::Blend), [2.0; 4]);
        assert!(widths(AlphaMode::Opaque).iter().all(|&width| width > 2.1));
    }

    #[test]
    fn a_seam_moves_with_its_mesh() {
        let seam = Seam { first: 0, second: 1, normal: DVec3::new(0.6, 0.0, 0.8), offset: 2.0 };
        let pose = DAffine3::from_scale_rotation_translation(
            DVec3::new(2.0, 1.0, -3.0),
            glam::DQuat::from_rotation_y(0.7),
            DVec3::new(5.0, 6.0, 7.0),
        );
        let Some(Known::Plane { normal, offset }) = seam.known(&pose) else { panic!("no plane") };
        for p in [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 0.5, 2.0), DVec3::new(2.0, 9.0, 2.0)] {
            let (here, there) =
                (seam.normal.dot(p) - seam.offset, normal.dot(pose.transform_point3(p)) - offset);
            assert!(here * there > 0.0);
        }
        assert_eq!(seam.known(&DAffine3::from_scale(DVec3::ZERO)), None);
    }
}
