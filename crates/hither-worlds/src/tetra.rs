//! TETRA: 900 tetrahedra that stand on a square of ground, 3,601 polygons [Coorg & Teller 1996, §4].
//!
//! They stand in rows, turned and sized at random, with paths between the rows. All surfaces are two-sided,
//! so that what faces away is hidden by what stands in front of it and not by a rule.

use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use crate::sheets::Sheets;
use crate::spec::{Values, WorldInfo};
use crate::stroll::{Paths, WALK};
use glam::DVec3;
use hither::scene::{Material, Scene};
use std::f64::consts::TAU;

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "tetra",
    description: "900 tetrahedra on a plane, 3,601 polygons, with random walks",
    keys: &[WALK],
    make: tetra,
};

/// Tetrahedra along a side.
const SIDE: u32 = 30;
/// From one to the next, metres.
const PITCH: f64 = 6.0;

fn tetra(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![Material { double_sided: true, ..paint("stone", 0xf4f1ea) }];
    let random = &mut Lcg::new(7);
    let reach = f64::from(SIDE) * PITCH / 2.0 + PITCH;
    let mut ground = Sheets::new("ground");
    let corner = |x: f64, z: f64| DVec3::new(x * reach, 0.0, z * reach);
    ground.push(&[corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)], tint(9));
    ground.show(&mut scene);
    let line = |i: u32| (f64::from(i) - f64::from(SIDE - 1) / 2.0) * PITCH;
    for i in 0..SIDE * SIDE {
        let mut sheets = Sheets::new(&format!("tetrahedron {i}"));
        tetrahedron(&mut sheets, DVec3::new(line(i % SIDE), 0.0, line(i / SIDE)), i, random);
        sheets.show(&mut scene);
    }
    let mut paths = Paths::default();
    let between = |i: u32| line(i) + PITCH / 2.0;
    for i in 0..(SIDE - 1) * (SIDE - 1) {
        let here = paths.place(between(i % (SIDE - 1)), between(i / (SIDE - 1)));
        if i % (SIDE - 1) > 0 {
            paths.link(here, here - 1);
        }
        if i >= SIDE - 1 {
            paths.link(here, here - (SIDE - 1) as usize);
        }
    }
    paths.add_walk(&mut scene, values.get("walk"));
    scene
}

/// Its base is on the ground, within 2.6 m of `at`.
fn tetrahedron(sheets: &mut Sheets, at: DVec3, number: u32, random: &mut Lcg) {
    let mut between = |low: f64, high: f64| low + (high - low) * f64::from(random.unit());
    let (turn, radius, height) = (between(0.0, TAU), between(2.45, 2.6), between(9.0, 13.0));
    let foot = |k: u32| {
        let angle = turn + f64::from(k) * TAU / 3.0;
        at + DVec3::new(libm::cos(angle), 0.0, -libm::sin(angle)) * radius
    };
    let (a, b, c, top) = (foot(0), foot(1), foot(2), at + DVec3::Y * height);
    for face in [[a, c, b], [a, b, top], [b, c, top], [c, a, top]] {
        sheets.push(&face, tint(number));
    }
}
