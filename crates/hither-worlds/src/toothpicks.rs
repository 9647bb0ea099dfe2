//! Tumbling toothpicks: eccentric ellipsoids of 328 polygons that tumble through each other inside a cube of 12
//! cylinders and 8 spheres, 250 frames at 60 a second [Snyder & Lengyel 1997, §12.1].
//!
//! The paper does not print the ellipsoids' axes. They are chosen here so that its statistics for 200 objects
//! come out (share of parts in cycles, size of the cycles); speeds are its own, 0.269 % of the cube's side a
//! frame at a toothpick's tip. Uniform density scales toothpicks by (200/n)^⅓, uniform scale leaves them alone.
//!
//! Parts in order: 8 spheres, 12 cylinders, the toothpicks.

use crate::lcg::Lcg;
use crate::palette::{linear, paint, tint};
use crate::spec::{KeyDefault, KeyInfo, Values, WorldInfo};
use glam::{DQuat, DVec3, Vec4};
use hither::order::Known;
use hither::scene::{
    Animation, Camera, CameraProjection, Channel, Content, Interpolation, Material, Mesh, Node, Primitive,
    Property, Scene, Transform,
};
use std::f64::consts::PI;

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "toothpicks",
    description: "ellipsoids that tumble through each other in a cube of cylinders and spheres",
    keys: &[
        number("n", "toothpicks", 1, 1_000_000, 200),
        number(
            "density",
            "ud: uniform density, smaller ones where there are more; us: uniform scale",
            0,
            1,
            0,
        ),
        KeyInfo {
            default: KeyDefault::Fraction(1.0),
            ..number("speed", "velocities are multiplied by this", 0, 1024, 1)
        },
        number("frames", "length, sixtieths of a second", 1, 100_000, 250),
        number("seed", "other toothpicks of the same kind", 0, u32::MAX as u64, 1),
    ],
    make: toothpicks,
};

const fn number(name: &'static str, description: &'static str, min: u64, max: u64, default: u64) -> KeyInfo {
    KeyInfo { name, description, min, max, default: KeyDefault::Number(default) }
}

/// Words for the values of `density`.
pub(crate) const DENSITIES: &[&str] = &["ud", "us"];

/// Half a side of the cube, metres.
const HALF: f64 = 1.0;
/// Semi-axes of a toothpick where there are 200.
const LONG: f64 = 0.15;
const THIN: f64 = 0.0075;
const SPHERE_RADIUS: f64 = 0.05;
const CYLINDER_RADIUS: f64 = 0.03;
const FRAMES_A_SECOND: f64 = 60.0;
/// Of a centre, metres a second: with the turning it makes the paper's speed at the tip.
const SPEED: f64 = 0.002_145 * 2.0 * HALF * FRAMES_A_SECOND;
/// Turning moves a tip as fast as the centre.
const TURNING: f64 = SPEED / LONG;
/// The camera goes around the cube, radians a second.
const ORBIT: f64 = 0.1;
const CAMERA_DISTANCE: f64 = 4.8;

fn toothpicks(values: &Values) -> Scene {
    let n = values.get("n");
    let scale = if values.get("density") == 0 { libm::cbrt(200.0 / n as f64) } else { 1.0 };
    let pace = values.fraction("speed");
    let duration = values.get("frames") as f64 / FRAMES_A_SECOND;
    let mut scene = Scene::new(INFO.name);
    scene.materials = vec![paint("frame", 0x8a8f98)];
    scene.materials.extend((0..12).map(|i| Material {
        name: format!("wood {i}"),
        base_color: tint(i) * linear(0xf4ead8),
        ..Material::default()
    }));
    frame(&mut scene);
    let first = scene.meshes.len() as u32;
    for i in 0..12 {
        let mut mesh = ellipsoid(8, 41, DVec3::new(THIN, LONG, THIN), 1 + i);
        mesh.name = format!("toothpick {i}");
        scene.meshes.push(mesh);
    }
    let mut random = Lcg::new(values.get("seed") as u32);
    let mut motion = Animation { name: "tumble".to_owned(), channels: Vec::new() };
    for i in 0..n as u32 {
        let (node, channels) = toothpick(i, first + i % 12, scale, pace, duration, &mut random, &scene);
        scene.groups[0].push(node);
        motion.channels.extend(channels);
    }
    camera(&mut scene, &mut motion, pace, duration);
    scene.animations = vec![motion];
    scene
}

/// What is known of the frame's parts: every cylinder and the spheres at its ends.
pub(crate) fn joints() -> Vec<(u32, u32, Known)> {
    let corners = corners();
    let mut found = Vec::new();
    for (cylinder, (a, b)) in edges().into_iter().enumerate() {
        for (from, to) in [(a, b), (b, a)] {
            let axis = (corners[to] - corners[from]).normalize();
            let known = Known::Joint {
                center: corners[from],
                sphere_radius: SPHERE_RADIUS,
                axis,
                cylinder_radius: CYLINDER_RADIUS,
            };
            found.push((from as u32, 8 + cylinder as u32, known));
        }
    }
    found
}

fn corners() -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let side = |bit: usize| if i >> bit & 1 == 0 { -HALF } else { HALF };
        DVec3::new(side(0), side(1), side(2))
    })
}

/// Pairs of corners.
fn edges() -> Vec<(usize, usize)> {
    let all = (0..8).flat_map(|a| [1, 2, 4].map(|bit| (a, a | bit)));
    all.filter(|&(a, b)| a != b).collect()
}

fn frame(scene: &mut Scene) {
    let mut show = |name: String, mesh: u32, translation: DVec3, rotation: DQuat| {
        let local = Transform::Trs { translation, rotation, scale: DVec3::ONE };
        scene.groups[0].push(Node { name, local, content: Content::Mesh(mesh), ..Node::default() });
    };
    let corners = corners();
    for (i, &corner) in corners.iter().enumerate() {
        show(format!("sphere {i}"), 0, corner, DQuat::IDENTITY);
    }
    for (i, (a, b)) in edges().into_iter().enumerate() {
        let axis = (corners[b] - corners[a]).normalize();
        let turn = if axis.y > 0.5 { DQuat::IDENTITY } else { quarter_turn(axis) };
        show(format!("cylinder {i}"), 1, (corners[a] + corners[b]) * 0.5, turn);
    }
    let mut sphere = ellipsoid(24, 24, DVec3::splat(SPHERE_RADIUS), 0);
    sphere.name = "sphere".to_owned();
    scene.meshes = vec![sphere, cylinder()];
}

/// From +Y to x or z.
fn quarter_turn(axis: DVec3) -> DQuat {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let about = DVec3::Y.cross(axis);
    DQuat::from_xyzw(about.x * half, about.y * half, about.z * half, half)
}

/// From the circle where it meets one sphere to that where it meets the other.
fn cylinder() -> Mesh {
    const SIDES: u32 = 24;
    let h = (SPHERE_RADIUS * SPHERE_RADIUS - CYLINDER_RADIUS * CYLINDER_RADIUS).sqrt();
    let mut mesh = Mesh { name: "cylinder".to_owned(), ..Mesh::default() };
    for k in 0..SIDES {
        let angle = 2.0 * PI * f64::from(k) / f64::from(SIDES);
        let (x, z) = (libm::cos(angle), libm::sin(angle));
        for y in [h - HALF, HALF - h] {
            mesh.positions.push(DVec3::new(x * CYLINDER_RADIUS, y, z * CYLINDER_RADIUS).as_vec3());
            mesh.normals.push(DVec3::new(x, 0.0, z).as_vec3());
        }
        let (a, b) = (2 * k, 2 * ((k + 1) % SIDES));
        mesh.triangles.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
    }
    for k in 1..SIDES - 1 {
        mesh.triangles.extend([[0, 2 * k, 2 * k + 2], [1, 2 * k + 3, 2 * k + 1]]);
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
    mesh
}

/// An ellipsoid with its poles on the y axis: slices × stacks polygons, those between the poles quadrilaterals.
fn ellipsoid(slices: u32, stacks: u32, semi_axes: DVec3, material: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut push = |direction: DVec3| {
        mesh.positions.push((direction * semi_axes).as_vec3());
        mesh.normals.push((direction / semi_axes).normalize().as_vec3());
    };
    push(DVec3::Y);
    for stack in 1..stacks {
        let theta = PI * f64::from(stack) / f64::from(stacks);
        for slice in 0..slices {
            let phi = 2.0 * PI * f64::from(slice) / f64::from(slices);
            let (s, c) = (libm::sin(theta), libm::cos(theta));
            push(DVec3::new(s * libm::cos(phi), c, s * libm::sin(phi)));
        }
    }
    push(DVec3::NEG_Y);
    let bottom = mesh.positions.len() as u32 - 1;
    let ring = |stack: u32, slice: u32| 1 + (stack - 1) * slices + slice % slices;
    for k in 0..slices {
        mesh.triangles.push([0, ring(1, k + 1), ring(1, k)]);
        for stack in 1..stacks - 1 {
            let [a, b] = [ring(stack, k), ring(stack, k + 1)];
            let [c, d] = [ring(stack + 1, k), ring(stack + 1, k + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
        mesh.triangles.push([bottom, ring(stacks - 1, k), ring(stacks - 1, k + 1)]);
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(material) }];
    mesh
}

/// A toothpick that flies straight, bounces off the cube's sides, and turns about a fixed axis.
fn toothpick(
    number: u32,
    mesh: u32,
    scale: f64,
    pace: f64,
    duration: f64,
    random: &mut Lcg,
    scene: &Scene,
) -> (Node, [Channel; 2]) {
    let room = HALF - CYLINDER_RADIUS - LONG * scale;
    let start = vector(random) * room;
    let velocity = direction(random) * SPEED * pace * (0.5 + f64::from(random.unit()));
    let axis = direction(random);
    let turning = TURNING / scale * pace * (0.5 + f64::from(random.unit()));
    let attitude = DQuat::from_rotation_arc(DVec3::Y, direction(random));
    let translation = |t: f64| bounced(start + velocity * t, room);
    let rotation = |t: f64| turn(axis, turning * t) * attitude;
    let node = Node {
        name: format!("toothpick {number}"),
        local: Transform::Trs { translation: start, rotation: attitude, scale: DVec3::splat(scale) },
        content: Content::Mesh(mesh),
        ..Node::default()
    };
    let mut bounces: Vec<f64> =
        (0..3).flat_map(|k| bounce_times(start[k], velocity[k], room, duration)).collect();
    bounces.extend([0.0, duration]);
    bounces.sort_by(f64::total_cmp);
    let turns = (turning.abs() * duration / 1.0).ceil().max(1.0) as u32;
    let turn_times = (0..=turns).map(|i| duration * f64::from(i) / f64::from(turns)).collect();
    let node_index = scene.groups[0].nodes.len() as u32;
    let channels = [
        channel(node_index, Property::Translation, bounces, |t| translation(t).as_vec3().extend(0.0)),
        channel(node_index, Property::Rotation, turn_times, |t| Vec4::from(rotation(t).as_quat())),
    ];
    (node, channels)
}

fn channel(node: u32, property: Property, times: Vec<f64>, value: impl Fn(f64) -> Vec4) -> Channel {
    let mut times: Vec<f32> = times.into_iter().map(|t| t as f32).collect();
    times.dedup();
    let values = times.iter().map(|&t| value(f64::from(t))).collect();
    Channel { node, property, interpolation: Interpolation::Linear, times, values }
}

fn turn(axis: DVec3, angle: f64) -> DQuat {
    let (s, c) = (libm::sin(angle * 0.5), libm::cos(angle * 0.5));
    DQuat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// A coordinate that runs on, folded back into ±room.
fn bounced(p: DVec3, room: f64) -> DVec3 {
    let fold = |x: f64| {
        let period = 4.0 * room;
        let at = libm::fmod(libm::fmod(x + room, period) + period, period);
        if at <= 2.0 * room { at - room } else { 3.0 * room - at }
    };
    DVec3::from(p.to_array().map(fold))
}

/// When a coordinate that runs on passes an odd multiple of room.
fn bounce_times(start: f64, velocity: f64, room: f64, duration: f64) -> Vec<f64> {
    let mut times = Vec::new();
    if velocity == 0.0 {
        return times;
    }
    let first = if velocity > 0.0 { room - start } else { -room - start } / velocity;
    let mut t = first;
    while t < duration {
        times.push(t);
        t += 2.0 * room / velocity.abs();
    }
    times
}

fn camera(scene: &mut Scene, motion: &mut Animation, pace: f64, duration: f64) {
    let group = &mut scene.groups[0];
    let orbit = group.push(Node { name: "orbit".to_owned(), ..Node::default() });
    let steps = (ORBIT * pace * duration).ceil().max(1.0) as u32;
    let times = (0..=steps).map(|i| duration * f64::from(i) / f64::from(steps)).collect();
    motion.channels.push(channel(orbit, Property::Rotation, times, |t| {
        Vec4::from(turn(DVec3::Y, ORBIT * pace * t).as_quat())
    }));
    // From above and beside, looking at the middle.
    let tilt = turn(DVec3::Y, 0.35) * turn(DVec3::X, -0.2);
    let local = Transform::Trs {
        translation: tilt * (DVec3::Z * CAMERA_DISTANCE),
        rotation: tilt,
        scale: DVec3::ONE,
    };
    scene.cameras = vec![Camera {
        name: "orbit".to_owned(),
        node: Some(orbit),
        local,
        projection: CameraProjection::Perspective { fov_y: 45f64.to_radians(), near: 0.01 },
    }];
}

/// In the unit cube around the origin.
fn vector(random: &mut Lcg) -> DVec3 {
    let [x, y, z] = [0; 3].map(|_| f64::from(random.unit()) * 2.0 - 1.0);
    DVec3::new(x, y, z)
}

fn direction(random: &mut Lcg) -> DVec3 {
    loop {
        let v = vector(random);
        let length = v.length_squared();
        if length <= 1.0 && length > 1e-4 {
            return v / length.sqrt();
        }
    }
}
