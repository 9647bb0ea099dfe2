//! SODA: one floor of an office building, 1,685 polygons [Coorg & Teller 1996, §4].
//!
//! Nine bands from front to back: offices, a corridor, two rows of inner rooms, a corridor, two rows, a
//! corridor, offices. Three of the 32 columns are cross corridors. Each room has a floor, a ceiling, walls
//! and an open door to its corridor; what is left of the count stands in the rooms as partitions. Walls are
//! single sheets, two-sided; where they meet, they share vertices.

use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use crate::sheets::Sheets;
use crate::spec::{Values, WorldInfo};
use crate::stroll::{Paths, WALK};
use glam::DVec3;
use hither::scene::{Material, Scene};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "soda",
    description: "a floor of offices and corridors, 1,685 polygons, with random walks",
    keys: &[WALK],
    make: soda,
};

/// Polygons in all.
const POLYGONS: usize = 1685;
/// Rooms along a band.
const COLUMNS: u32 = 32;
/// Width of a room, metres.
const WIDTH: f64 = 3.25;
/// Height of a storey and of a door, metres.
const HEIGHT: f64 = 3.0;
const DOOR_HEIGHT: f64 = 2.125;
const DOOR_WIDTH: f64 = 1.0;
/// Columns that are cross corridors.
const CROSSING: [u32; 3] = [7, 16, 25];

/// A band of the plan.
#[derive(Clone, Copy, PartialEq)]
enum Band {
    Corridor,
    /// Rooms whose doors are towards larger z (`true`) or smaller.
    Rooms(bool),
}

const BANDS: [(Band, f64); 9] = [
    (Band::Rooms(true), 5.0),
    (Band::Corridor, 2.5),
    (Band::Rooms(false), 5.0),
    (Band::Rooms(true), 5.0),
    (Band::Corridor, 2.5),
    (Band::Rooms(false), 5.0),
    (Band::Rooms(true), 5.0),
    (Band::Corridor, 2.5),
    (Band::Rooms(false), 5.0),
];

/// Cross corridors lie between the outer rows.
fn is_crossing(band: usize, column: u32) -> bool {
    (1..BANDS.len() - 1).contains(&band) && CROSSING.contains(&column)
}

fn x_of(column: u32) -> f64 {
    f64::from(column) * WIDTH
}

/// Where band `band` begins.
fn z_of(band: usize) -> f64 {
    BANDS[..band].iter().map(|b| b.1).sum()
}

/// Middle of the doors of a column.
fn door_of(column: u32) -> f64 {
    x_of(column) + 1.0 + 0.125 * f64::from(column * 5 % 9)
}

fn soda(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![Material { double_sided: true, ..paint("plaster", 0xf4f1ea) }];
    let mut sheets = Sheets::new("floor 5");
    for (band, &(kind, depth)) in BANDS.iter().enumerate() {
        let z = z_of(band);
        for column in 0..COLUMNS {
            cell(&mut sheets, band, column, kind, (z, z + depth));
        }
        // The end walls.
        for x in [0.0, x_of(COLUMNS)] {
            sheets.wall(ground(x, z), ground(x, z + depth), 0.0, HEIGHT, tint(3));
        }
    }
    partitions(&mut sheets, &mut Lcg::new(11));
    sheets.show(&mut scene);
    paths().add_walk(&mut scene, values.get("walk"));
    scene
}

fn ground(x: f64, z: f64) -> DVec3 {
    DVec3::new(x, 0.0, z)
}

/// Floor, ceiling, and the walls that a cell adds to those of its neighbours before it.
fn cell(sheets: &mut Sheets, band: usize, column: u32, kind: Band, (z0, z1): (f64, f64)) {
    let (x0, x1) = (x_of(column), x_of(column + 1));
    let number = band as u32 * COLUMNS + column;
    for y in [0.0, HEIGHT] {
        let corner = |x: f64, z: f64| DVec3::new(x, y, z);
        sheets.push(&[corner(x0, z1), corner(x1, z1), corner(x1, z0), corner(x0, z0)], tint(number));
    }
    let Band::Rooms(door_behind) = kind else { return };
    if column > 0 {
        sheets.wall(ground(x0, z0), ground(x0, z1), 0.0, HEIGHT, tint(number));
    }
    if is_crossing(band, column) {
        return;
    }
    let (door_z, back_z) = if door_behind { (z1, z0) } else { (z0, z1) };
    door_wall(sheets, column, door_z, tint(number + 1));
    // Rows back to back share the wall, which the first of them adds.
    if !(door_behind && band > 0) {
        sheets.wall(ground(x0, back_z), ground(x1, back_z), 0.0, HEIGHT, tint(number + 2));
    }
}

/// A wall with a door: beside it twice, and above it. The sides have a vertex at the height of the door.
fn door_wall(sheets: &mut Sheets, column: u32, z: f64, color: glam::Vec4) {
    let (left, right) = (door_of(column) - DOOR_WIDTH / 2.0, door_of(column) + DOOR_WIDTH / 2.0);
    for (side, door) in [(x_of(column), left), (x_of(column + 1), right)] {
        let corner = |x: f64, y: f64| DVec3::new(x, y, z);
        let jamb = [corner(door, 0.0), corner(door, DOOR_HEIGHT), corner(door, HEIGHT)];
        sheets.push(&[corner(side, 0.0), jamb[0], jamb[1], jamb[2], corner(side, HEIGHT)], color);
    }
    sheets.wall(ground(left, z), ground(right, z), DOOR_HEIGHT, HEIGHT, color);
}

/// Upright boards in the inner halves of rooms, in turn, until the count is reached.
fn partitions(sheets: &mut Sheets, random: &mut Lcg) {
    let rooms: Vec<(usize, u32)> = (0..BANDS.len())
        .filter(|&b| BANDS[b].0 != Band::Corridor)
        .flat_map(|b| (0..COLUMNS).map(move |c| (b, c)))
        .filter(|&(b, c)| !is_crossing(b, c))
        .collect();
    let mut next = 0;
    while sheets.polygons() < POLYGONS {
        let (band, column) = rooms[next % rooms.len()];
        next += 7;
        let Band::Rooms(door_behind) = BANDS[band].0 else { continue };
        let mut between = |low: f64, high: f64| low + (high - low) * f64::from(random.unit());
        let depth = between(0.5, 2.0);
        let z = if door_behind { z_of(band) + depth } else { z_of(band + 1) - depth };
        let x = x_of(column) + between(0.2, 1.0);
        sheets.wall(
            ground(x, z),
            ground(x + between(1.0, 2.0), z),
            0.0,
            between(1.2, 2.2),
            tint(next as u32),
        );
    }
}

/// Along the corridors, through the cross corridors, and through each door.
fn paths() -> Paths {
    let mut paths = Paths::default();
    let mut last: Option<Vec<usize>> = None;
    for (band, &(kind, depth)) in BANDS.iter().enumerate() {
        if kind != Band::Corridor {
            continue;
        }
        let z = z_of(band) + depth / 2.0;
        let stations: Vec<usize> = (0..COLUMNS).map(|c| paths.place(door_of(c), z)).collect();
        for pair in stations.windows(2) {
            paths.link(pair[0], pair[1]);
        }
        for column in 0..COLUMNS {
            for (beside, room_z) in [(band - 1, z_of(band) - 1.5), (band + 1, z_of(band + 1) + 1.5)] {
                if !is_crossing(beside, column) {
                    let room = paths.place(door_of(column), room_z);
                    paths.link(stations[column as usize], room);
                }
            }
        }
        if let Some(before) = last {
            for column in CROSSING {
                paths.link(before[column as usize], stations[column as usize]);
            }
        }
        last = Some(stations);
    }
    paths
}
