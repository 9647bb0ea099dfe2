//! Canyon flyby: six aircraft of six parts each in formation inside a winding valley, under a sky
//! [Snyder & Lengyel 1997, §12.2].
//!
//! Polygons are the paper's table's within 5 %, counted as triangles: body 1558, engine 1255, wing 1421, tail 22,
//! rudder 48, hinge 64, sky 480, terrain 2473. The terrain is split by a grid of planes over x and z, pieces
//! larger by a fifth. The shapes are our own: the paper shows them small.
//!
//! Parts in order: the sky, the pieces of terrain, six parts for each aircraft.

use crate::palette::paint;
use crate::spec::{KeyDefault, KeyInfo, Values, WorldInfo};
use glam::{DQuat, DVec3, Vec3, Vec4};
use hither::order::{Known, SplitBy, SplitMesh, split};
use hither::scene::{
    Animation, Camera, CameraProjection, Channel, Content, Interpolation, Mesh, Node, Primitive, Property,
    Scene, Transform,
};
use std::f64::consts::{PI, TAU};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "canyon",
    description: "six aircraft in formation in a winding valley, its terrain split by a grid",
    keys: &[
        KeyInfo {
            name: "grid",
            description: "cells a side that the terrain is split into",
            min: 1,
            max: 40,
            default: KeyDefault::Number(14),
        },
        KeyInfo {
            name: "overlap",
            description: "percent by which a cell is larger",
            min: 0,
            max: 100,
            default: KeyDefault::Number(20),
        },
        KeyInfo {
            name: "speed",
            description: "velocities are multiplied by this",
            min: 0,
            max: 64,
            default: KeyDefault::Fraction(1.0),
        },
        KeyInfo {
            name: "frames",
            description: "length, sixtieths of a second",
            min: 1,
            max: 100_000,
            default: KeyDefault::Number(250),
        },
    ],
    make: canyon,
};

/// Half a side of the land, metres.
const HALF: f64 = 500.0;
/// Squares of the terrain along x and z: 2 · 35 · 35 triangles.
const SQUARES: u32 = 35;
const SKY_RADIUS: f64 = 1500.0;
/// Along the valley, metres a second.
const SPEED: f64 = 60.0;
const FRAMES_A_SECOND: f64 = 60.0;

fn canyon(values: &Values) -> Scene {
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![
        paint("sky", 0x9fc3e6),
        paint("rock", 0xb98a5e),
        paint("hull", 0xd9dde2),
        paint("wing", 0xa8b3c0),
        paint("engine", 0x5b6470),
        paint("rudder", 0xc8553d),
    ];
    let sky = lathe("sky", &sky_profile(), 24, 0, true);
    add(&mut scene, "sky", sky, None, DVec3::ZERO, DQuat::IDENTITY);
    for (i, piece) in terrain(values.get("grid") as u32, values.get("overlap") as f64 / 100.0)
        .pieces
        .into_iter()
        .enumerate()
    {
        add(
            &mut scene,
            &format!("terrain {i}"),
            Mesh { name: format!("terrain {i}"), ..piece },
            None,
            DVec3::ZERO,
            DQuat::IDENTITY,
        );
    }
    let duration = values.get("frames") as f64 / FRAMES_A_SECOND;
    let clock = Clock { duration, pace: values.fraction("speed") };
    let mut motion = Animation { name: "flyby".to_owned(), channels: Vec::new() };
    let parts = aircraft();
    let first = scene.meshes.len() as u32;
    scene.meshes.extend(parts.iter().map(|p| p.mesh.clone()));
    for i in 0..6 {
        let node = plane(&mut scene, i, &parts, first);
        motion.channels.extend(flight(node, i, &clock));
    }
    camera(&mut scene, &mut motion, &clock);
    scene.animations = vec![motion];
    scene
}

/// The seams of the terrain, by the parts' numbers.
pub(crate) fn seams(spec: &str) -> Vec<(u32, u32, Known)> {
    let query = spec.split_once('?').map_or("", |(_, query)| query);
    let Ok(values) = Values::parse(&INFO, query) else { return Vec::new() };
    let split = terrain(values.get("grid") as u32, values.get("overlap") as f64 / 100.0);
    let seam = |s: &hither::order::Seam| {
        (1 + s.first, 1 + s.second, Known::Plane { normal: s.normal, offset: s.offset })
    };
    split.seams.iter().map(seam).collect()
}

/// The middle of the valley at z.
fn middle(z: f64) -> f64 {
    110.0 * libm::sin(z * TAU / 620.0) + 40.0 * libm::sin(z * TAU / 270.0 + 1.0)
}

fn height(x: f64, z: f64) -> f64 {
    let away = (x - middle(z)).abs();
    let wall = (away - 45.0).max(0.0) / 60.0;
    let rise = 130.0 * wall * wall / (1.0 + wall * wall);
    rise + 9.0 * libm::sin(x * 0.043 + 2.0) * libm::cos(z * 0.051) * (0.3 + wall.min(1.0))
}

fn terrain(grid: u32, overlap: f64) -> SplitMesh {
    let mut mesh = Mesh { name: "terrain".to_owned(), ..Mesh::default() };
    let at = |i: u32| -HALF + 2.0 * HALF * f64::from(i) / f64::from(SQUARES);
    for j in 0..=SQUARES {
        for i in 0..=SQUARES {
            let (x, z) = (at(i), at(j));
            mesh.positions.push(DVec3::new(x, height(x, z), z).as_vec3());
            let slope = |dx: f64, dz: f64| height(x + dx, z + dz) - height(x - dx, z - dz);
            mesh.normals.push(DVec3::new(-slope(1.0, 0.0), 2.0, -slope(0.0, 1.0)).normalize().as_vec3());
            let shade = 0.75 + 0.25 * (height(x, z) / 130.0).clamp(0.0, 1.0) as f32;
            mesh.colors.push(Vec4::new(shade, shade, shade, 1.0));
        }
    }
    for j in 0..SQUARES {
        for i in 0..SQUARES {
            let a = j * (SQUARES + 1) + i;
            let (b, c, d) = (a + 1, a + SQUARES + 1, a + SQUARES + 2);
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(1) }];
    split(&mesh, &SplitBy::HeightField { columns: grid, rows: grid }, overlap)
}

fn sky_profile() -> Vec<(f64, f64)> {
    (0..=11)
        .map(|i| PI * f64::from(i) / 11.0)
        .map(|t| (SKY_RADIUS * libm::sin(t), SKY_RADIUS * libm::cos(t)))
        .collect()
}

/// A surface of revolution about y through (radius, y), top to bottom; inside out if asked for.
fn lathe(name: &str, profile: &[(f64, f64)], sides: u32, material: u32, inside: bool) -> Mesh {
    let mut mesh = Mesh { name: name.to_owned(), ..Mesh::default() };
    for &(r, y) in profile {
        for k in 0..sides {
            let angle = TAU * f64::from(k) / f64::from(sides);
            mesh.positions.push(DVec3::new(r * libm::cos(angle), y, r * libm::sin(angle)).as_vec3());
        }
    }
    for ring in 0..profile.len() as u32 - 1 {
        for k in 0..sides {
            let next = (k + 1) % sides;
            let (a, b) = (ring * sides + k, ring * sides + next);
            let (c, d) = (a + sides, b + sides);
            let mut push = |t: [u32; 3]| {
                let [p, q, r] = t.map(|v| mesh.positions[v as usize]);
                if (q - p).cross(r - p).length_squared() > 1e-12 {
                    mesh.triangles.push(if inside { [t[0], t[2], t[1]] } else { t });
                }
            };
            push([a, b, d]);
            push([a, d, c]);
        }
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(material) }];
    mesh
}

/// A part of an aircraft, in the aircraft's space: nose towards −z, up +y, metres.
struct AircraftPart {
    name: &'static str,
    mesh: Mesh,
    at: DVec3,
}

fn aircraft() -> Vec<AircraftPart> {
    let spindle = |name, sides: u32, rings: u32, radius: f64, length: f64, material| {
        let profile: Vec<(f64, f64)> = (0..=rings)
            .map(|i| PI * f64::from(i) / f64::from(rings))
            .map(|t| (radius * libm::sin(t), length * 0.5 * libm::cos(t)))
            .collect();
        turned(lathe(name, &profile, sides, material, false))
    };
    let part = |name, mesh, x, y, z| AircraftPart { name, mesh, at: DVec3::new(x, y, z) };
    vec![
        // A spindle of s sides and b bands has s · (2 b − 2) triangles.
        part("body", spindle("body", 41, 20, 1.6, 15.0, 2), 0.0, 0.0, 0.0),
        part("wing", wing("wing", 60, 12, DVec3::new(7.5, 0.28, 1.5), 3), 0.0, 1.95, 0.5),
        part("rudder", wing("rudder", 3, 12, DVec3::new(0.12, 1.3, 0.9), 5), 0.0, 2.3, 6.4),
        part("engine", spindle("engine", 33, 20, 0.7, 4.0, 4), 0.0, -2.4, 0.5),
        part("hinge", spindle("hinge", 8, 5, 0.16, 1.2, 4), 0.0, 1.0, 7.2),
        part("tail", wing("tail", 2, 11, DVec3::new(2.6, 0.1, 0.6), 3), 0.0, 0.0, 8.3),
    ]
}

/// From the y axis to the z axis.
fn turned(mut mesh: Mesh) -> Mesh {
    for p in &mut mesh.positions {
        *p = Vec3::new(p.x, -p.z, p.y);
    }
    mesh
}

/// A flat ellipsoid with its poles at the ends of the span: `sides` around it, `bands` along it.
fn wing(name: &str, bands: u32, sides: u32, half: DVec3, material: u32) -> Mesh {
    let profile: Vec<(f64, f64)> = (0..=bands)
        .map(|i| PI * f64::from(i) / f64::from(bands))
        .map(|t| (libm::sin(t), libm::cos(t)))
        .collect();
    let mut mesh = lathe(name, &profile, sides, material, false);
    for p in &mut mesh.positions {
        // Along the span is what was the axis; the longest half side, for wings; the rudder stands up.
        let q = if half.x >= half.y { Vec3::new(p.y, p.x, p.z) } else { Vec3::new(p.x, p.y, -p.z) };
        *p = q * half.as_vec3() * Vec3::new(1.0, 1.0, -1.0);
    }
    mesh
}

fn add(
    scene: &mut Scene,
    name: &str,
    mesh: Mesh,
    parent: Option<u32>,
    translation: DVec3,
    rotation: DQuat,
) -> u32 {
    scene.meshes.push(mesh);
    let content = Content::Mesh(scene.meshes.len() as u32 - 1);
    let local = Transform::Trs { translation, rotation, scale: DVec3::ONE };
    scene.groups[0].push(Node { name: name.to_owned(), parent, local, content })
}

fn plane(scene: &mut Scene, number: u32, parts: &[AircraftPart], first: u32) -> u32 {
    let node = scene.groups[0].push(Node { name: format!("aircraft {number}"), ..Node::default() });
    for (i, part) in parts.iter().enumerate() {
        scene.groups[0].push(Node {
            name: format!("{} {number}", part.name),
            parent: Some(node),
            local: Transform::from_translation(part.at),
            content: Content::Mesh(first + i as u32),
        });
    }
    node
}

/// Where aircraft `i` is at `t`: in a wedge, weaving a little, along the valley.
fn position(i: u32, t: f64) -> DVec3 {
    let row = f64::from(i.div_ceil(2));
    let side = if i.is_multiple_of(2) { 1.0 } else { -1.0 } * if i == 0 { 0.0 } else { 1.0 };
    let phase = f64::from(i) * 1.7;
    let z = 380.0 - SPEED * t + row * 17.0;
    let x = middle(z) + side * row * 13.0 + 2.0 * libm::sin(t * 0.9 + phase);
    DVec3::new(x, 34.0 + 3.0 * libm::sin(t * 0.7 + phase) + row * 2.0, z)
}

fn heading(i: u32, t: f64) -> DQuat {
    let ahead = position(i, t + 0.1) - position(i, t - 0.1);
    let yaw = libm::atan2(-ahead.x, -ahead.z);
    let before = position(i, t - 0.1) - position(i, t - 0.3);
    let bank = (libm::atan2(-ahead.x, -ahead.z) - libm::atan2(-before.x, -before.z)) * 4.0;
    turn(DVec3::Y, yaw) * turn(DVec3::Z, bank.clamp(-0.8, 0.8))
}

fn turn(axis: DVec3, angle: f64) -> DQuat {
    let (s, c) = (libm::sin(angle * 0.5), libm::cos(angle * 0.5));
    DQuat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// When there are keys, and where the flight is then.
struct Clock {
    /// Seconds.
    duration: f64,
    /// Seconds of flight a second.
    pace: f64,
}

impl Clock {
    /// A tenth of a second of flight apart, at most.
    fn times(&self) -> Vec<f32> {
        let keys = (self.duration * 10.0 * self.pace.max(1.0)).ceil().max(1.0) as u32;
        (0..=keys).map(|k| (self.duration * f64::from(k) / f64::from(keys)) as f32).collect()
    }
}

fn flight(node: u32, i: u32, clock: &Clock) -> [Channel; 2] {
    let times = clock.times();
    let at = |t: &f32| f64::from(*t) * clock.pace;
    let places = times.iter().map(|t| position(i, at(t)).as_vec3().extend(0.0)).collect();
    let turns = times.iter().map(|t| Vec4::from(heading(i, at(t)).as_quat())).collect();
    let channel = |property, values| Channel {
        node,
        property,
        interpolation: Interpolation::Linear,
        times: times.clone(),
        values,
    };
    [channel(Property::Translation, places), channel(Property::Rotation, turns)]
}

/// Follows the formation from above and behind.
fn camera(scene: &mut Scene, motion: &mut Animation, clock: &Clock) {
    let eye = |t: f64| {
        let z = position(0, t).z + 62.0;
        DVec3::new(middle(z), 56.0, z)
    };
    let look = |t: f64| {
        let ahead = position(0, t) - eye(t);
        let yaw = libm::atan2(-ahead.x, -ahead.z);
        let pitch = libm::atan2(ahead.y, (ahead.x * ahead.x + ahead.z * ahead.z).sqrt());
        turn(DVec3::Y, yaw) * turn(DVec3::X, pitch)
    };
    let node = scene.groups[0].push(Node {
        name: "chase".to_owned(),
        local: Transform::Trs { translation: eye(0.0), rotation: look(0.0), scale: DVec3::ONE },
        ..Node::default()
    });
    let times = clock.times();
    let at = |t: &f32| f64::from(*t) * clock.pace;
    let places = times.iter().map(|t| eye(at(t)).as_vec3().extend(0.0)).collect();
    let turns = times.iter().map(|t| Vec4::from(look(at(t)).as_quat())).collect();
    let channel = |property, values| Channel {
        node,
        property,
        interpolation: Interpolation::Linear,
        times: times.clone(),
        values,
    };
    motion.channels.push(channel(Property::Translation, places));
    motion.channels.push(channel(Property::Rotation, turns));
    scene.cameras = vec![Camera {
        name: "chase".to_owned(),
        node: Some(node),
        local: Transform::default(),
        projection: CameraProjection::Perspective { fov_y: 50f64.to_radians(), near: 0.1 },
    }];
}
