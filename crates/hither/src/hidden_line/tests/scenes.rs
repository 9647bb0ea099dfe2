//! Small scenes in which bodies pierce, touch, coincide and are open, and views of them.

use crate::conventions::{Projection, View};
use crate::reference::trouble;
use crate::scene::{Content, Mesh, Node, Primitive, Scene, Transform};
use glam::{DQuat, DVec3, Vec3};

pub fn add(scene: &mut Scene, name: &str, positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, local: Transform) {
    let primitives = vec![Primitive { triangles: 0..triangles.len() as u32, material: None }];
    scene.meshes.push(Mesh { name: name.into(), positions, triangles, primitives, ..Mesh::default() });
    let content = Content::Mesh(scene.meshes.len() as u32 - 1);
    scene.groups[0].push(Node { name: name.into(), content, local, ..Node::default() });
}

pub fn cuboid(min: [f32; 3], max: [f32; 3]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
    let positions = (0..8).map(|k| Vec3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect();
    let quads = [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    (positions, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

pub fn add_box(scene: &mut Scene, name: &str, min: [f32; 3], max: [f32; 3]) {
    let (positions, triangles) = cuboid(min, max);
    add(scene, name, positions, triangles, Transform::default());
}

/// A ball of triangles.
pub fn ball(scene: &mut Scene, name: &str, center: DVec3, radius: f64, rows: u32) {
    let columns = rows * 2;
    let mut positions = Vec::new();
    for i in 0..=rows {
        for j in 0..columns {
            let (t, p) = (
                std::f64::consts::PI * f64::from(i) / f64::from(rows),
                std::f64::consts::TAU * f64::from(j) / f64::from(columns),
            );
            let at = DVec3::new(t.sin() * p.cos(), t.cos(), -t.sin() * p.sin());
            positions.push((center + at * radius).as_vec3());
        }
    }
    let mut triangles = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let id = |i: u32, j: u32| i * columns + j % columns;
            let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    add(scene, name, positions, triangles, Transform::default());
}

/// So many triangles that threads share them: two balls that meet, one of them of twice as many parts, and
/// vertices that occur twice.
pub fn many_triangles() -> Scene {
    let mut scene = Scene::new("many");
    ball(&mut scene, "fine", DVec3::ZERO, 1.0, 60);
    ball(&mut scene, "coarse", DVec3::new(0.7, 0.4, 0.5), 0.8, 40);
    let mesh = &mut scene.meshes[1];
    let at = |v: u32| mesh.positions[v as usize];
    mesh.positions = mesh.triangles.iter().flatten().map(|&v| at(v)).collect();
    let count = mesh.triangles.len() as u32;
    mesh.triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    scene
}

/// Named scenes of bodies.
pub fn bodies() -> Vec<(&'static str, Scene)> {
    let mut scenes = Vec::new();
    let mut scene = Scene::new("pierced");
    add_box(&mut scene, "cube", [0.0; 3], [1.0; 3]);
    add_box(&mut scene, "bar", [-0.3, 0.3, 0.3], [1.3, 0.7, 0.7]);
    scenes.push(("pierced", scene));

    let mut scene = Scene::new("nested");
    add_box(&mut scene, "outer", [0.0; 3], [2.0; 3]);
    add_box(&mut scene, "flush", [0.0, 0.0, 0.0], [1.0, 1.0, 2.0]);
    add_box(&mut scene, "on top", [0.0, 2.0, 0.0], [1.0, 3.0, 1.0]);
    add_box(&mut scene, "beside", [2.0, 0.0, 0.5], [3.0, 2.0, 1.5]);
    scenes.push(("nested", scene));

    let mut scene = Scene::new("building");
    for floor in 0..2 {
        let y = floor as f32 * 3.0;
        add_box(&mut scene, "slab", [0.0, y, 0.0], [8.0, y + 0.3, 6.0]);
        add_box(&mut scene, "wall", [0.0, y + 0.3, 0.0], [8.0, y + 3.0, 0.3]);
        add_box(&mut scene, "wall", [0.0, y + 0.3, 0.3], [0.3, y + 3.0, 6.0]);
        add_box(&mut scene, "column", [7.0, y + 0.3, 5.0], [7.4, y + 3.0, 5.4]);
    }
    scenes.push(("building", scene));

    let mut scene = Scene::new("crossing");
    add_box(&mut scene, "lying", [1.0, -2.0, -1.0], [3.0, 0.0, 1.0]);
    add_box(&mut scene, "standing", [1.0, -1.0, -1.0], [3.0, 1.0, 0.0]);
    scenes.push(("crossing", scene));

    // Where a coordinate is 0, nothing of it is rounded.
    let mut scene = Scene::new("corner");
    add_box(&mut scene, "cube", [0.0; 3], [1.0; 3]);
    add_box(&mut scene, "floor", [-3.0, -0.5, -3.0], [3.0, 0.0, 3.0]);
    scenes.push(("corner", scene));

    let mut scene = Scene::new("balls");
    ball(&mut scene, "one", DVec3::ZERO, 1.0, 6);
    ball(&mut scene, "two", DVec3::new(0.7, 0.3, 0.4), 0.8, 5);
    add_box(&mut scene, "floor", [-2.0, -1.2, -2.0], [2.0, -0.95, 2.0]);
    scenes.push(("balls", scene));

    let mut scene = Scene::new("turned");
    for k in 0..3 {
        let (positions, triangles) = cuboid([-1.0; 3], [1.0; 3]);
        let local = Transform::Trs {
            translation: DVec3::new(0.3, 0.7, 0.2) * f64::from(k),
            rotation: DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), f64::from(k) * 0.7),
            scale: DVec3::new(1.0, 1.0 + 0.3 * f64::from(k), 0.8),
        };
        add(&mut scene, "box", positions, triangles, local);
    }
    scenes.push(("turned", scene));

    let mut scene = Scene::new("sheets");
    let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    // Three leaves on one edge, the third wound the other way; and a square that stands on one of them.
    let leaves = vec![v(0., 0., 0.), v(0., 2., 0.), v(2., 1., 0.), v(-1., 1., 1.5), v(-1., 1., -1.5)];
    add(&mut scene, "leaves", leaves, vec![[0, 1, 2], [0, 1, 3], [1, 0, 4]], Transform::default());
    let square = vec![v(0.2, 1., 0.), v(1.2, 1., 0.), v(1.2, 1., 1.), v(0.2, 1., 1.)];
    add(&mut scene, "square", square, vec![[0, 1, 2], [0, 2, 3]], Transform::default());
    scenes.push(("sheets", scene));
    scenes
}

/// Rods that lie, slope a little, and pierce one another and two plates, at random.
pub fn rods(seed: u64) -> Scene {
    let random = &mut trouble::Random::new(seed);
    let mut scene = Scene::new("rods");
    add_box(&mut scene, "plate", [-4.0, -0.1, -4.0], [4.0, 0.1, 4.0]);
    add_box(&mut scene, "plate", [-0.1, -4.0, -4.0], [0.1, 4.0, 4.0]);
    for _ in 0..12 {
        let (middle, along, width) = (random.point(3.0), random.point(3.0), random.point(0.4));
        let corner = |k: usize| {
            let side = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let across = along.cross(width).normalize_or_zero() * 0.2;
            (middle + along * side(0) + width * side(1) + across * side(2)).as_vec3()
        };
        let (_, triangles) = cuboid([0.0; 3], [1.0; 3]);
        add(&mut scene, "rod", (0..8).map(corner).collect(), triangles, Transform::default());
    }
    scene
}

/// Views from around, from a front where much coincides, from near and from inside.
pub fn views(scene: &Scene) -> Vec<View> {
    let bounds = scene.bounds().unwrap();
    let (center, size) = (bounds.center(), bounds.size().length());
    let eye = |d: DVec3| center + d * size;
    let perspective = Projection::Perspective { fov_y: 0.8, near: size * 1e-3 };
    let parallel = Projection::Orthographic { half_height: size * 0.6, near: 0.0, far: size * 10.0 };
    let look = |e: DVec3, projection| View::look_at(e, center, DVec3::Y, projection, (500, 400));
    vec![
        look(eye(DVec3::new(0.9, 0.6, 1.1)), perspective),
        look(eye(DVec3::new(-0.7, 0.5, 0.9)), parallel),
        look(eye(DVec3::Z * 2.0), parallel),
        look(eye(DVec3::new(1.0, 1.0, 1.0)), parallel),
        look(eye(DVec3::new(0.2, -0.9, 0.5)), perspective),
        look(eye(DVec3::new(0.21, 0.17, 0.13)), perspective),
    ]
}
