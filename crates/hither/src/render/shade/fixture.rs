//! Small scenes and their frames, for the tests of shading.

use crate::conventions::{Projection, View};
use crate::index::{IndexOptions, SceneIndex};
use crate::render::{Frame, RenderOptions, render};
use crate::scene::{AlphaMode, Content, Group, Material, Mesh, Node, Primitive, Scene, Transform};
use glam::{DVec3, Vec3, Vec4};

/// A view from (0, 0, 5) down −Z, 40 × 30 pixels.
pub(in crate::render) fn front_view() -> View {
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
    View::look_at(DVec3::Z * 5.0, DVec3::ZERO, DVec3::Y, projection, (40, 30))
}

/// A square of two triangles, of side 2 about the origin, facing +Z, with one material.
pub(in crate::render) fn square(material: Option<u32>) -> Mesh {
    Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Vec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        primitives: vec![Primitive { triangles: 0..2, material }],
        ..Mesh::default()
    }
}

/// A scene of one group with `meshes`, each shown once by a transform.
pub(in crate::render) fn scene(materials: Vec<Material>, parts: Vec<(Mesh, Transform)>) -> Scene {
    let mut scene = Scene { materials, ..Scene::new("") };
    let mut group = Group::default();
    for (mesh, local) in parts {
        group.push(Node { content: Content::Mesh(scene.meshes.len() as u32), local, ..Node::default() });
        scene.meshes.push(mesh);
    }
    scene.groups = vec![group];
    scene.validate().expect("a fixture is valid");
    scene
}

pub(in crate::render) fn at(x: f64, y: f64, z: f64) -> Transform {
    Transform::from_translation(DVec3::new(x, y, z))
}

pub(in crate::render) fn colored(color: Vec4, alpha: AlphaMode) -> Material {
    Material { base_color: color, alpha, double_sided: true, ..Material::default() }
}

/// The frame of `scene` as the engine draws it.
pub(in crate::render) fn frame(scene: &Scene, view: &View) -> Frame {
    let index = SceneIndex::build(scene.clone(), &IndexOptions::default());
    render(&index, view, &RenderOptions::default()).expect("a fixture's view is valid")
}
