//! No visible polygon is ever called hidden, and what the paper says is hidden is.

mod known_answers;
mod motion;
mod truth;

use crate::scene::{Content, Material, Mesh, Node, Primitive, Scene};
use glam::DVec3;

/// A two-sided rectangle or other convex polygon for each list of corners, each an instance of its own.
fn scene_of(polygons: &[Vec<[f64; 3]>]) -> Scene {
    let mut scene = Scene::new("polygons");
    scene.materials = vec![Material { double_sided: true, ..Material::default() }];
    for corners in polygons {
        let last = corners.len() as u32 - 1;
        let triangles: Vec<[u32; 3]> = (1..last).map(|i| [0, i, i + 1]).collect();
        scene.groups[0].push(Node { content: Content::Mesh(scene.meshes.len() as u32), ..Node::default() });
        scene.meshes.push(Mesh {
            positions: corners.iter().map(|&c| DVec3::from(c).as_vec3()).collect(),
            primitives: vec![Primitive { triangles: 0..triangles.len() as u32, material: Some(0) }],
            triangles,
            ..Mesh::default()
        });
    }
    scene
}

/// An upright wall from (x0, z0) to (x1, z1), from the ground to 3 m.
fn wall(x0: f64, z0: f64, x1: f64, z1: f64) -> Vec<[f64; 3]> {
    vec![[x0, 0.0, z0], [x1, 0.0, z1], [x1, 3.0, z1], [x0, 3.0, z0]]
}

/// A small upright square around a point.
fn sign(x: f64, y: f64, z: f64) -> Vec<[f64; 3]> {
    let r = 0.1;
    vec![[x - r, y - r, z], [x + r, y - r, z], [x + r, y + r, z], [x - r, y + r, z]]
}
