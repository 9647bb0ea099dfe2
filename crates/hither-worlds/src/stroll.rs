//! Random walks along the paths of a world, at walking speed, and the camera that is led along them.

use crate::benchmark_axes::lens_of_every_camera;
use crate::lcg::Lcg;
use crate::spec::{KeyDefault, KeyInfo};
use glam::{DVec3, Vec4};
use hither::scene::{Animation, Camera, Channel, Interpolation, Node, Property, Scene, Transform};

/// Height of the eye, metres.
pub(crate) const EYE: f64 = 1.7;
/// Walking speed, metres a second.
const SPEED: f64 = 1.5;
/// Length of a walk, seconds.
const DURATION: f64 = 60.0;
/// Time to turn at a corner, seconds.
const TURN: f64 = 0.5;

/// Which of the random walks.
pub(crate) const WALK: KeyInfo = KeyInfo {
    name: "walk",
    description: "which random walk the camera takes",
    min: 1,
    max: 1000,
    default: KeyDefault::Number(1),
};

/// Where one may walk: places, and which of them are joined by a straight free line.
#[derive(Default)]
pub(crate) struct Paths {
    places: Vec<DVec3>,
    neighbours: Vec<Vec<usize>>,
}

impl Paths {
    /// Adds a place on the floor or ground and returns its number.
    pub(crate) fn place(&mut self, x: f64, z: f64) -> usize {
        self.places.push(DVec3::new(x, EYE, z));
        self.neighbours.push(Vec::new());
        self.places.len() - 1
    }

    /// Joins two places.
    pub(crate) fn link(&mut self, a: usize, b: usize) {
        self.neighbours[a].push(b);
        self.neighbours[b].push(a);
    }

    /// Adds node `walker` with camera `walk` and animation `walk`: a minute of random walk number `seed`.
    pub(crate) fn add_walk(&self, scene: &mut Scene, seed: u64) {
        let keys = self.keys(&mut Lcg::new(seed as u32));
        let local = Transform::from_translation(keys[0].1);
        let walker = Node { name: "walker".to_owned(), local, ..Node::default() };
        let node = scene.groups[0].push(walker);
        scene.cameras.push(Camera {
            name: "walk".to_owned(),
            node: Some(node),
            local: Transform::default(),
            projection: lens_of_every_camera(),
        });
        let channel = |property, values| Channel {
            node,
            property,
            interpolation: Interpolation::Linear,
            times: keys.iter().map(|k| k.0 as f32).collect(),
            values,
        };
        let translations = keys.iter().map(|k| k.1.as_vec3().extend(0.0)).collect();
        let rotations = keys.iter().map(|k| facing(k.2)).collect();
        scene.animations.push(Animation {
            name: "walk".to_owned(),
            channels: vec![
                channel(Property::Translation, translations),
                channel(Property::Rotation, rotations),
            ],
        });
    }

    /// Times, places, and directions of sight.
    fn keys(&self, random: &mut Lcg) -> Vec<(f64, DVec3, DVec3)> {
        // The generator's first numbers follow the seed closely.
        for _ in 0..8 {
            random.unit();
        }
        let mut at = random.below(self.places.len() as u32) as usize;
        let mut from = usize::MAX;
        let (mut time, mut keys) = (0.0, Vec::new());
        while time < DURATION {
            let near = &self.neighbours[at];
            // Back only from a dead end.
            let onward: Vec<usize> = near.iter().copied().filter(|&n| n != from || near.len() == 1).collect();
            let to = onward[random.below(onward.len() as u32) as usize];
            let step = self.places[to] - self.places[at];
            let direction = step.normalize();
            keys.push((time, self.places[at], direction));
            time += step.length() / SPEED;
            keys.push((time, self.places[to], direction));
            time += TURN;
            (from, at) = (at, to);
        }
        keys
    }
}

/// The turn about +Y that makes −Z look along a horizontal `direction`.
fn facing(direction: DVec3) -> Vec4 {
    let half = libm::atan2(-direction.x, -direction.z) / 2.0;
    Vec4::new(0.0, libm::sin(half) as f32, 0.0, libm::cos(half) as f32)
}
