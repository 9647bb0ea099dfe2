//! CITY: 571 box-shaped parts of buildings on streets and parks, 2,857 polygons [Coorg & Teller 1996, §4].
//!
//! Blocks of four lots; some buildings are turned on their lot, some carry a narrower tower. A part is four
//! walls and a roof. All surfaces are two-sided.

use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use crate::sheets::Sheets;
use crate::spec::{Values, WorldInfo};
use crate::stroll::{Paths, WALK};
use glam::DVec3;
use hither::scene::{Material, Scene};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "city",
    description: "a city of 2,857 polygons with random walks along its streets",
    keys: &[WALK],
    make: city,
};

/// Blocks along a side.
const SIDE: u32 = 11;
/// From one street to the next, metres.
const PITCH: f64 = 80.0;
/// Width of a street, metres.
const STREET: f64 = 18.0;
/// Blocks that are parks, as column and row.
const PARKS: [(u32, u32); 3] = [(3, 4), (7, 7), (8, 2)];
/// Buildings that carry a tower.
const TOWERS: u32 = 99;

fn city(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![Material { double_sided: true, ..paint("facade", 0xf4f1ea) }];
    ground(&mut scene);
    let random = &mut Lcg::new(5);
    let lots: Vec<DVec3> = lots();
    let mut towers = TOWERS;
    for (i, &lot) in lots.iter().enumerate() {
        // Exactly TOWERS of the lots that are left, all with the same chance.
        let tower = random.below((lots.len() - i) as u32) < towers;
        towers -= u32::from(tower);
        building(&mut scene, lot, i as u32, tower, random);
    }
    streets().add_walk(&mut scene, values.get("walk"));
    scene
}

/// Two halves, one on either side of the middle.
fn ground(scene: &mut Scene) {
    let mut sheets = Sheets::new("ground");
    let reach = f64::from(SIDE) * PITCH / 2.0 + STREET;
    for (west, east) in [(-reach, 0.0), (0.0, reach)] {
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        sheets.push(
            &[corner(west, reach), corner(east, reach), corner(east, -reach), corner(west, -reach)],
            tint(9),
        );
    }
    sheets.show(scene);
}

fn line(i: u32) -> f64 {
    (f64::from(i) - f64::from(SIDE - 1) / 2.0) * PITCH
}

/// Middles of the lots.
fn lots() -> Vec<DVec3> {
    let mut lots = Vec::new();
    for block in 0..SIDE * SIDE {
        let (column, row) = (block % SIDE, block / SIDE);
        if PARKS.contains(&(column, row)) {
            continue;
        }
        let quarter = (PITCH - STREET) / 4.0;
        for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            lots.push(DVec3::new(line(column) + x * quarter, 0.0, line(row) + z * quarter));
        }
    }
    lots
}

fn building(scene: &mut Scene, lot: DVec3, number: u32, tower: bool, random: &mut Lcg) {
    let mut between = |low: f64, high: f64| low + (high - low) * f64::from(random.unit());
    // Higher towards the middle of the city.
    let centre = libm::exp(-lot.length_squared() / (200.0 * 200.0));
    let height = between(8.0, 20.0) + centre * between(0.0, 60.0);
    let half = DVec3::new(between(10.0, 15.2), 0.0, between(10.0, 15.2));
    let turned = between(0.0, 1.0) < 0.25;
    let turn = if turned { between(0.1, 0.5) } else { 0.0 };
    // A turned building reaches farther than its sides.
    let half = if turned { half * 0.75 } else { half };
    let mut sheets = Sheets::new(&format!("building {number}"));
    part(&mut sheets, lot, half, turn, (0.0, height), number);
    if tower {
        let top = height * between(1.3, 2.5);
        part(&mut sheets, lot, half * 0.6, turn, (height, top), number);
    }
    sheets.show(scene);
}

/// Four walls and a roof.
fn part(sheets: &mut Sheets, at: DVec3, half: DVec3, turn: f64, (bottom, top): (f64, f64), number: u32) {
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    let corner = |x: f64, z: f64| {
        let (x, z) = (x * half.x, z * half.z);
        at + DVec3::new(x * cos + z * sin, 0.0, z * cos - x * sin)
    };
    let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
    for i in 0..4 {
        sheets.wall(corners[i], corners[(i + 1) % 4], bottom, top, tint(number));
    }
    sheets.push(&corners.map(|c| DVec3::new(c.x, top, c.z)), tint(number + 1));
}

/// Crossings, joined along the streets.
fn streets() -> Paths {
    let mut paths = Paths::default();
    let crossings = SIDE + 1;
    let street = |i: u32| line(i) - PITCH / 2.0;
    for i in 0..crossings * crossings {
        let here = paths.place(street(i % crossings), street(i / crossings));
        if i % crossings > 0 {
            paths.link(here, here - 1);
        }
        if i >= crossings {
            paths.link(here, here - crossings as usize);
        }
    }
    paths
}
