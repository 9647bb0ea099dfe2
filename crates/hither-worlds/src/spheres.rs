//! DENSE: 2,000 spheres of 512 triangles in a cube, 1.02 million triangles, most of them a pixel or two.

use crate::benchmark_axes::{camera, occludee, point, show};
use crate::boxcity::PARTS;
use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use crate::spec::{Values, WorldInfo};
use hither::geometry::Aabb;
use hither::scene::{Mesh, Primitive, Scene};
use std::f64::consts::PI;

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "spheres",
    description: "2,000 spheres of 512 triangles in a cube, 1.02 million triangles",
    keys: &[PARTS],
    make: spheres,
};

/// Meridians, and bands between the poles.
const MERIDIANS: u32 = 16;
const BANDS: u32 = 17;

fn spheres(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![paint("sphere", 0xffffff)];
    let mut mesh = Mesh { name: "sphere".to_owned(), ..Mesh::default() };
    let mut random = Lcg::new(5);
    for i in 0..2_000 {
        let center = [0; 3].map(|_| (random.unit() - 0.5) * 100.0);
        let radius = 1.0 + 2.0 * random.unit();
        push_sphere(&mut mesh, center, radius);
        mesh.colors.resize(mesh.positions.len(), tint(i));
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
    show(&mut scene, mesh, (2 * MERIDIANS * (BANDS - 1)) as usize, values.get("parts") == 1);
    scene.cameras = vec![camera("front", [0.0, 0.0, -120.0], [0.0, 0.0, 1.0])];
    scene
}

fn push_sphere(mesh: &mut Mesh, center: [f32; 3], radius: f32) {
    let top = mesh.positions.len() as u32;
    let mut push = |direction: [f32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| center[k] + radius * direction[k]);
        mesh.positions.push(point([x, y, z]));
        mesh.normals.push(point(direction));
    };
    push([0.0, 1.0, 0.0]);
    for band in 1..BANDS {
        for meridian in 0..MERIDIANS {
            let theta = PI * f64::from(band) / f64::from(BANDS);
            let phi = 2.0 * PI * f64::from(meridian) / f64::from(MERIDIANS);
            let (sin_theta, cos_theta) = (libm::sin(theta), libm::cos(theta));
            let (sin_phi, cos_phi) = (libm::sin(phi), libm::cos(phi));
            push([(sin_theta * cos_phi) as f32, cos_theta as f32, (sin_theta * sin_phi) as f32]);
        }
    }
    push([0.0, -1.0, 0.0]);
    let bottom = mesh.positions.len() as u32 - 1;
    let ring = |band: u32, meridian: u32| top + 1 + (band - 1) * MERIDIANS + meridian % MERIDIANS;
    for k in 0..MERIDIANS {
        mesh.triangles.push([top, ring(1, k), ring(1, k + 1)]);
        for band in 1..BANDS - 1 {
            mesh.triangles.push([ring(band, k), ring(band + 1, k), ring(band + 1, k + 1)]);
            mesh.triangles.push([ring(band, k), ring(band + 1, k + 1), ring(band, k + 1)]);
        }
        mesh.triangles.push([bottom, ring(BANDS - 1, k + 1), ring(BANDS - 1, k)]);
    }
}

/// Boxes of 0.5 to 2 m, spread evenly over the cube.
pub(crate) fn occludees() -> Vec<Aabb> {
    let mut random = Lcg::new(6);
    (0..100_000)
        .map(|_| {
            let center = [0; 3].map(|_| (random.unit() - 0.5) * 100.0);
            occludee(center, [0; 3].map(|_| 0.25 + 0.75 * random.unit()))
        })
        .collect()
}
