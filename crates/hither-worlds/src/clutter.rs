//! CLUTTER: 20,000 two-sided triangles of all sizes on screen, spread evenly over it.

use crate::benchmark_axes::{camera, occludee, point, show};
use crate::boxcity::PARTS;
use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use crate::spec::{Values, WorldInfo};
use hither::geometry::Aabb;
use hither::scene::{Material, Mesh, Primitive, Scene};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "clutter",
    description: "20,000 loose two-sided triangles of all sizes on screen",
    keys: &[PARTS],
    make: clutter,
};

/// tan 30°: half the height of the view at distance 1.
const T: f32 = 0.577_350_26;
/// The aspect ratio that the triangles are spread over.
const A: f32 = 16.0 / 9.0;

/// 2^`x` for the `x` met here, −8 to −2, with the rounding of the C library that the benchmarks were made
/// with, which is not always the nearest `f32`: 2^(k/32) times a cubic in the rest, in `f64`.
fn exp2(x: f32) -> f32 {
    /// Fitted to 2^r over |r| ≤ 1/64: factors of r³, r² and r.
    const CUBIC: [f64; 3] = [0.055_503_615_593_413_4, 0.240_228_452_244_572_2, 0.693_147_180_691_620_3];
    let x = f64::from(x);
    let base = (x * 32.0).round_ties_even() / 32.0;
    let r = x - base;
    let power = (CUBIC[0] * r + CUBIC[1]) * (r * r) + (CUBIC[2] * r + 1.0);
    (power * libm::exp2(base)) as f32
}

fn clutter(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![Material { double_sided: true, ..paint("scrap", 0xffffff) }];
    let mut mesh = Mesh { name: "triangle".to_owned(), ..Mesh::default() };
    let mut random = Lcg::new(3);
    let mut unit = || random.unit();
    for i in 0..20_000 {
        let (ud, ux, uy, us) = (unit(), unit(), unit(), unit());
        let z = 10.0 + 990.0 * ud;
        let x = (2.0 * ux - 1.0) * 1.1 * z * T * A;
        let y = (2.0 * uy - 1.0) * 1.1 * z * T;
        let r = z * T * exp2(-7.0 + 5.0 * us);
        let first = 3 * i;
        for _ in 0..3 {
            let corner = [x, y, z].map(|center| center + r * (2.0 * unit() - 1.0));
            mesh.positions.push(point(corner));
            mesh.colors.push(tint(i));
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
    show(&mut scene, mesh, 1, values.get("parts") == 1);
    scene.cameras = vec![camera("front", [0.0; 3], [0.0, 0.0, 1.0])];
    scene
}

/// Cubes of all sizes on screen.
pub(crate) fn occludees() -> Vec<Aabb> {
    let mut random = Lcg::new(4);
    let mut unit = || random.unit();
    (0..100_000)
        .map(|_| {
            let (ud, ux, uy, us) = (unit(), unit(), unit(), unit());
            let z = 10.0 + 990.0 * ud;
            let center = [(2.0 * ux - 1.0) * z * T * A, (2.0 * uy - 1.0) * z * T, z];
            occludee(center, [z * T * exp2(-8.0 + 4.0 * us); 3])
        })
        .collect()
}
