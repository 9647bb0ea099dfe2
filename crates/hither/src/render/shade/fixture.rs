//! Small scenes and their frames, found ray by ray, for the tests of shading.

use crate::conventions::{NO_ID, Projection, SurfaceId, View};
use crate::render::Frame;
use crate::render::shade::{TriangleInView, depth_at, pixel_centre};
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

/// The nearest surface at every pixel that is not blended, both sides of each solid.
pub(in crate::render) fn frame(scene: &Scene, view: &View) -> Frame {
    let mut frame = Frame::empty(*view);
    let nothing = SurfaceId { instance: NO_ID, triangle: NO_ID };
    for (i, instance) in scene.instances().iter().enumerate() {
        let view_from_mesh = view.view_from_world * instance.world_from_mesh;
        let mesh = &scene.meshes[instance.mesh as usize];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            if scene.is_blended(mesh.material_of(t as u32)) {
                continue;
            }
            let corners =
                corners.map(|v| view_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3()));
            let triangle = TriangleInView::new(view, corners);
            let id = SurfaceId { instance: i as u32, triangle: t as u32 };
            for pixel in 0..frame.depth.len() {
                let (x, y) = (pixel as u32 % view.width, pixel as u32 / view.width);
                let hit = triangle.hit(pixel_centre(x, y));
                let depth = hit.and_then(|w| depth_at(&view.projection, triangle.distance(w)));
                let Some(depth) = depth else { continue };
                let nearest = (frame.depth[pixel], frame.ids[pixel]);
                if depth > nearest.0 || (depth == nearest.0 && nearest.1 != nothing && id < nearest.1) {
                    (frame.depth[pixel], frame.ids[pixel]) = (depth, id);
                }
            }
        }
    }
    frame
}
