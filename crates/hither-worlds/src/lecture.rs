//! Textbook situations that make sorting hard, each with a camera of its own and a hundred metres from the
//! next: polygons that penetrate each other, overlap in a cycle, and enclose each other (Crawfis).

use crate::palette::paint;
use crate::spec::{Values, WorldInfo};
use glam::{DVec3, Vec3};
use hither::conventions::{Projection, View};
use hither::scene::{Camera, CameraProjection, Content, Material, Mesh, Node, Primitive, Scene, Transform};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "lecture",
    description: "a penetrating triangle, a cyclic overlap and nested tetrahedra",
    keys: &[],
    make: lecture,
};

/// Distance from one example's origin to the next, metres along x.
const APART: f64 = 100.0;

fn lecture(_: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    let two_sided = |name, srgb| Material { double_sided: true, ..paint(name, srgb) };
    scene.materials =
        vec![two_sided("red", 0xc8553d), two_sided("green", 0x6b9f4b), two_sided("blue", 0x4f78c4)];
    penetrating(&mut scene);
    cycle(&mut scene);
    tetrahedra(&mut scene);
    scene
}

/// Shows a polygon (a fan around its first corner) or a list of triangles as a part of its own.
fn show(scene: &mut Scene, name: &str, example: f64, color: u32, positions: &[[f64; 3]], faces: &[[u32; 3]]) {
    let content = Content::Mesh(scene.meshes.len() as u32);
    scene.meshes.push(Mesh {
        name: name.to_owned(),
        positions: positions.iter().map(|&p| DVec3::from(p).as_vec3()).collect::<Vec<Vec3>>(),
        triangles: faces.to_vec(),
        primitives: vec![Primitive { triangles: 0..faces.len() as u32, material: Some(color) }],
        ..Mesh::default()
    });
    let local = Transform::from_translation(DVec3::X * example * APART);
    scene.groups[0].push(Node { name: name.to_owned(), local, content, ..Node::default() });
}

const QUADRILATERAL: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

/// A rectangle and a triangle that passes through it, with the slides' own coordinates; the camera's view is
/// the slides' frame buffer of 32 × 32 pixels, one a metre, with the eye on the side of large z.
fn penetrating(scene: &mut Scene) {
    let rectangle = [[10.0, 5.0, 10.0], [10.0, 25.0, 10.0], [25.0, 25.0, 10.0], [25.0, 5.0, 10.0]];
    let triangle = [[15.0, 15.0, 15.0], [25.0, 25.0, 5.0], [30.0, 10.0, 5.0]];
    show(scene, "rectangle", 0.0, 0, &rectangle, &QUADRILATERAL);
    show(scene, "triangle", 0.0, 2, &triangle, &[[0, 1, 2]]);
    scene.cameras.push(Camera {
        name: "penetrating".to_owned(),
        node: None,
        local: Transform::from_translation(DVec3::new(16.0, 16.0, 20.0)),
        projection: CameraProjection::Orthographic {
            half_width: 16.0,
            half_height: 16.0,
            near: 0.0,
            far: 20.0,
        },
    });
}

/// Three bars around a triangle: each passes over the next and under the one before.
fn cycle(scene: &mut Scene) {
    // Bars along the sides of an equilateral triangle, longer than these, each rising along its length.
    let (half_length, half_width, rise, inradius) = (7.0, 0.9, 1.0, 2.2);
    for (k, name) in ["first bar", "second bar", "third bar"].into_iter().enumerate() {
        let angle = k as f64 * std::f64::consts::TAU / 3.0;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let corner = |along: f64, across: f64| {
            let across = across * half_width - inradius;
            let (x, y) = (along * half_length, across);
            [x * cos - y * sin, x * sin + y * cos, along * rise]
        };
        let bar = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        show(scene, name, 1.0, k as u32, &bar, &QUADRILATERAL);
    }
    scene.cameras.push(perspective("cycle", DVec3::new(APART, 0.0, 16.0), DVec3::new(APART, 0.0, 0.0)));
}

/// Three tetrahedra, each inside the next larger one; the larger two lack the face towards the camera.
fn tetrahedra(scene: &mut Scene) {
    let corners = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];
    let faces = [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]];
    for (k, name) in ["outer tetrahedron", "middle tetrahedron", "inner tetrahedron"].into_iter().enumerate()
    {
        let size = 5.0 * [1.0, 0.45, 0.2][k];
        let positions = corners.map(|c| c.map(|x: f64| x * size));
        let shown = if k == 2 { &faces[..] } else { &faces[..3] };
        show(scene, name, 2.0, k as u32, &positions, shown);
    }
    let target = DVec3::new(2.0 * APART, 0.0, 0.0);
    // Face (1, 2, 3) looks along (−1, −1, −1).
    scene.cameras.push(perspective("tetrahedra", target + DVec3::new(-11.0, -8.0, -10.0), target));
}

fn perspective(name: &str, eye: DVec3, target: DVec3) -> Camera {
    let fov_y = 60f64.to_radians();
    let view = View::look_at(eye, target, DVec3::Y, Projection::Perspective { fov_y, near: 0.1 }, (1, 1));
    Camera {
        name: name.to_owned(),
        node: None,
        local: Transform::Affine(view.view_from_world.inverse()),
        projection: CameraProjection::Perspective { fov_y, near: 0.1 },
    }
}
