//! The walk: straight along the middle corridor to a crossing, round the corner, straight to the next.
//! It stays in the corridors, half a metre or more from everything.

use super::{CORRIDOR, EYE, PITCH, Sides};
use crate::benchmark_axes::lens_of_every_camera;
use glam::{DVec3, Vec4};
use hither::scene::{Animation, Camera, Channel, Interpolation, Node, Property, Scene, Transform};
use std::f64::consts::FRAC_PI_2;

/// Length of the walk, seconds.
const DURATION: f64 = 10.0;
/// Radius of the turn, metres; the corridors are two metres wide.
const TURN: f64 = 0.8;
/// Straight pieces that the turn is walked in.
const TURN_STEPS: u32 = 8;

/// Adds node `walker` with camera `walk`, and the animation that moves it.
pub(super) fn add(scene: &mut Scene, sides: Sides) {
    let stations = stations(sides);
    let start = Transform::from_translation(stations[0].0);
    let node = scene.groups[scene.root as usize].push(Node {
        name: "walker".to_owned(),
        local: start,
        ..Node::default()
    });
    scene.cameras.push(Camera {
        name: "walk".to_owned(),
        node: Some(node),
        local: Transform::default(),
        projection: lens_of_every_camera(),
    });
    scene.animations.push(animation(node, &stations));
}

/// Where the walker is and how far it has turned to the right, radians.
fn stations(sides: Sides) -> Vec<(DVec3, f64)> {
    let y = sides.storey() + EYE;
    let x = sides.corridor();
    // The crossing where the walker turns, and where it stops: the next crossing, or short of the wall.
    let turn_z = -(CORRIDOR + if sides.nz > 1 { PITCH.z } else { 0.0 });
    let east = sides.nx - 1 - sides.nx / 2;
    let stop_x = x + if east > 0 { PITCH.x } else { CORRIDOR - 0.5 };
    let mut stations = vec![(DVec3::new(x, y, -0.5), 0.0)];
    for step in 0..=TURN_STEPS {
        let angle = FRAC_PI_2 * f64::from(step) / f64::from(TURN_STEPS);
        let at = DVec3::new(x + TURN * (1.0 - libm::cos(angle)), y, turn_z + TURN * (1.0 - libm::sin(angle)));
        stations.push((at, angle));
    }
    stations.push((DVec3::new(stop_x, y, turn_z), FRAC_PI_2));
    stations
}

/// Constant speed from station to station.
fn animation(node: u32, stations: &[(DVec3, f64)]) -> Animation {
    let mut walked = vec![0.0];
    for pair in stations.windows(2) {
        walked.push(walked[walked.len() - 1] + pair[0].0.distance(pair[1].0));
    }
    let length = walked[walked.len() - 1];
    let times: Vec<f32> = walked.iter().map(|s| (s / length * DURATION) as f32).collect();
    let rotation = |turned: f64| {
        let (sin, cos) = (libm::sin(-turned / 2.0), libm::cos(turned / 2.0));
        Vec4::new(0.0, sin as f32, 0.0, cos as f32)
    };
    let channel = |property, values| Channel {
        node,
        property,
        interpolation: Interpolation::Linear,
        times: times.clone(),
        values,
    };
    let translations = stations.iter().map(|s| s.0.as_vec3().extend(0.0)).collect();
    let rotations = stations.iter().map(|s| rotation(s.1)).collect();
    Animation {
        name: "walk".to_owned(),
        channels: vec![channel(Property::Translation, translations), channel(Property::Rotation, rotations)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate;

    /// Distance from `p` to the nearest box of the building, with the modules around it.
    fn clearance(scene: &Scene, p: DVec3, sides: Sides) -> f64 {
        let cell = (DVec3::new(p.x, p.y, -p.z) / PITCH).floor();
        let mut nearest = f64::INFINITY;
        for dx in -1..=1 {
            for dz in -1..=1 {
                let cell = cell + DVec3::new(f64::from(dx), 0.0, f64::from(dz));
                let counts = DVec3::new(sides.nx as f64, sides.ny as f64, sides.nz as f64);
                if cell.cmplt(DVec3::ZERO).any() || cell.cmpge(counts).any() {
                    continue;
                }
                let origin = cell * PITCH * DVec3::new(1.0, 1.0, -1.0);
                for corners in scene.meshes[0].positions.chunks(8) {
                    let b = hither::geometry::Aabb::around(corners.iter().map(|c| c.as_dvec3() + origin));
                    nearest = nearest.min(p.distance(p.clamp(b.min, b.max)));
                }
            }
        }
        nearest
    }

    #[test]
    fn the_walk_keeps_clear_of_everything() {
        for n in [1, 2, 3] {
            let mut scene = generate(&format!("office?n={n}")).unwrap();
            let sides = Sides { nx: n, ny: n, nz: n };
            let camera = scene.find_camera("walk").unwrap();
            for step in 0..=100 {
                scene.pose(0, DURATION * f64::from(step) / 100.0);
                let at = scene.world_from_camera(camera).unwrap();
                let clear = clearance(&scene, at.translation, sides);
                assert!(clear > 0.5, "n={n} step {step}: {clear} m at {}", at.translation);
            }
        }
    }

    #[test]
    fn the_walker_starts_at_the_corridor_camera_and_turns_right() {
        let mut scene = generate("office?n=33").unwrap();
        let of = |scene: &Scene, name| {
            let camera = scene.find_camera(name).unwrap();
            scene.world_from_camera(camera).unwrap()
        };
        let corridor = of(&scene, "corridor").translation;
        assert!(of(&scene, "walk").translation.distance(corridor) < 1e-5);
        assert!(scene.pose(0, DURATION));
        let forward = of(&scene, "walk").transform_vector3(DVec3::NEG_Z);
        assert!(forward.distance(DVec3::X) < 1e-6, "{forward}");
    }
}
