//! CITY: 10,000 box buildings in a 2 km square, 120,000 triangles, seen from the street.

use crate::benchmark_axes::{camera, occludee, push_box, show};
use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use crate::spec::{KeyDefault, KeyInfo, Values, WorldInfo};
use hither::geometry::Aabb;
use hither::scene::{Mesh, Primitive, Scene};

pub(crate) const PARTS: KeyInfo = KeyInfo {
    name: "parts",
    description: "1: every object is a node of its own; 0: all are one mesh",
    min: 0,
    max: 1,
    default: KeyDefault::Number(0),
};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "boxcity",
    description: "10,000 box buildings seen from the street, 120,000 triangles",
    keys: &[PARTS],
    make: boxcity,
};

fn boxcity(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![paint("facade", 0xf4f1ea)];
    let mut mesh = Mesh { name: "building".to_owned(), ..Mesh::default() };
    let mut random = Lcg::new(1);
    for iz in 0..100u16 {
        for ix in 0..100u16 {
            let u = random.unit();
            let height = 8.0 + 52.0 * u * u;
            let (x, z) = ((f32::from(ix) - 49.5) * 20.0, f32::from(iz) * 20.0 + 10.0);
            let color = tint(u32::from(iz) * 100 + u32::from(ix));
            push_box(&mut mesh, [x - 7.0, 0.0, z - 7.0], [x + 7.0, height, z + 7.0], color);
        }
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
    show(&mut scene, mesh, 12, values.get("parts") == 1);
    scene.cameras = vec![camera("street", [0.5, 1.7, -5.0], [0.02, 0.03, 1.0])];
    scene
}

/// Boxes of 1 to 4 m, more of them near the ground than above it.
pub(crate) fn occludees() -> Vec<Aabb> {
    let mut random = Lcg::new(2);
    let mut side = || random.unit();
    (0..100_000)
        .map(|_| {
            let (x, z) = ((side() - 0.5) * 2000.0, side() * 2000.0);
            let u = side();
            let y = u * u * 40.0;
            let half = [0.5 + 1.5 * side(), 0.5 + 1.5 * side(), 0.5 + 1.5 * side()];
            occludee([x, y + half[1], z], half)
        })
        .collect()
}
