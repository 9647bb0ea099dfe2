//! From the benchmarks' left-handed axes (x right, y up, z forward) to ours: `z → −z`, windings kept.

use glam::{DVec3, Vec3, Vec4};
use hither::conventions::{Projection, View};
use hither::geometry::Aabb;
use hither::scene::{Camera, CameraProjection, Content, Mesh, Node, Primitive, Scene, Transform};

/// Vertical field of view of every benchmark camera, degrees.
const FOV_Y_DEGREES: f64 = 60.0;
/// Near plane of every benchmark camera, metres.
const NEAR: f64 = 0.1;

/// A point given in the benchmarks' axes. Zero stays +0.
pub(crate) fn point([x, y, z]: [f32; 3]) -> Vec3 {
    Vec3::new(x, y, 0.0 - z)
}

/// An occludee box from its centre and half sides in the benchmarks' axes.
pub(crate) fn occludee(center: [f32; 3], half: [f32; 3]) -> Aabb {
    let (center, half) = (point(center).as_dvec3(), Vec3::from(half).as_dvec3());
    Aabb { min: center - half, max: center + half }
}

/// Appends the eight corners and twelve triangles of a box given in the benchmarks' axes.
pub(crate) fn push_box(mesh: &mut Mesh, min: [f32; 3], max: [f32; 3], color: Vec4) {
    const FACES: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [5, 4, 6, 7], [4, 0, 2, 6], [1, 5, 7, 3], [2, 3, 7, 6], [4, 5, 1, 0]];
    let first = mesh.positions.len() as u32;
    for corner in 0..8 {
        let axis = |a: usize| if corner >> a & 1 == 1 { max[a] } else { min[a] };
        mesh.positions.push(point([axis(0), axis(1), axis(2)]));
        mesh.colors.push(color);
    }
    for [a, b, c, d] in FACES {
        mesh.triangles.push([first + a, first + b, first + c]);
        mesh.triangles.push([first + a, first + c, first + d]);
    }
}

/// A fixed camera at `eye` that looks along `direction`, both in the benchmarks' axes.
pub(crate) fn camera(name: &str, eye: [f64; 3], direction: [f64; 3]) -> Camera {
    let [eye, direction] = [eye, direction].map(|[x, y, z]| DVec3::new(x, y, 0.0 - z));
    let lens = Projection::Perspective { fov_y: FOV_Y_DEGREES.to_radians(), near: NEAR };
    let view = View::look_at(eye, eye + direction, DVec3::Y, lens, (1, 1));
    Camera {
        name: name.to_owned(),
        node: None,
        local: Transform::Affine(view.view_from_world.inverse()),
        projection: lens_of_every_camera(),
    }
}

/// The lens that every benchmark camera has.
pub(crate) fn lens_of_every_camera() -> CameraProjection {
    CameraProjection::Perspective { fov_y: FOV_Y_DEGREES.to_radians(), near: NEAR }
}

/// Shows `mesh` once, or, with `parts`, each run of `triangles_per_object` triangles as a node of its own.
///
/// Objects must use vertices of their own, in the order of the objects.
pub(crate) fn show(scene: &mut Scene, mesh: Mesh, triangles_per_object: usize, parts: bool) {
    let meshes = if parts { split(&mesh, triangles_per_object) } else { vec![mesh] };
    for mesh in meshes {
        let content = Content::Mesh(scene.meshes.len() as u32);
        scene.groups[0].push(Node { name: mesh.name.clone(), content, ..Node::default() });
        scene.meshes.push(mesh);
    }
}

fn split(mesh: &Mesh, triangles_per_object: usize) -> Vec<Mesh> {
    let material = mesh.primitives[0].material;
    let objects = mesh.triangles.chunks(triangles_per_object).enumerate();
    objects
        .map(|(i, triangles)| {
            let used = || triangles.as_flattened().iter().copied();
            let first = used().min().unwrap_or(0);
            let range = first as usize..used().max().map_or(0, |last| last as usize + 1);
            Mesh {
                name: format!("{} {i}", mesh.name),
                positions: mesh.positions[range.clone()].to_vec(),
                normals: if mesh.normals.is_empty() { vec![] } else { mesh.normals[range.clone()].to_vec() },
                uvs: vec![],
                colors: mesh.colors[range].to_vec(),
                triangles: triangles.iter().map(|t| t.map(|v| v - first)).collect(),
                primitives: vec![Primitive { triangles: 0..triangles.len() as u32, material }],
                lines: vec![],
            }
        })
        .collect()
}
