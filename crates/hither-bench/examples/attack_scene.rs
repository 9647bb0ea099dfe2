//! Attacks culling and rendering on a file or a world, from eyes and with options that chance chooses, until time is up.
//!
//! ```sh
//! cargo run --release -p hither-bench --example attack_scene -- FILE|world:SPEC SECONDS [FIRST_ROUND]
//! ```
//!
//! Each round stands somewhere in the scene, often at a hair's breadth from a surface, culls a few frames and asserts that
//! nothing was left out that shows at a pixel's centre or, unless sampled, between centres; with a margin also that
//! nothing was that a moved eye sees. Then it draws the view by both algorithms, and asserts that ids and depths are the same.
//! What fails, or panics, is printed with its round, from which it can be run again. The exit code is 1 if anything was.

use glam::{DAffine3, DVec3};
use hither::conventions::{Projection, View};
use hither::cull::{CullOptions, Culler, Meaning};
use hither::reference::trouble::Random;
use hither::{Algorithm, IndexOptions, RenderOptions, Scene, SceneIndex, render};
use std::collections::HashSet;
use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, seconds, more @ ..] = arguments.as_slice() else {
        return Err("FILE|world:SPEC SECONDS [FIRST_ROUND]".into());
    };
    let scene = match name.strip_prefix("world:") {
        Some(spec) => hither_worlds::generate(spec)?,
        None => hither_io::read(std::path::Path::new(name))?.scene,
    };
    let first: u64 = more.first().map_or(Ok(0), |s| s.parse())?;
    let until = Instant::now() + Duration::from_secs(seconds.parse()?);
    let index = SceneIndex::build(scene, &IndexOptions::default());
    let places = Places::new(&index);
    let (mut round, mut faults, mut sums) = (first, 0, Sums::default());
    // One for all rounds, as a program has that goes on: what it keeps of a view must not matter to another.
    let mut culler = Culler::new();
    while Instant::now() < until {
        let attack = || places.attack(&index, &mut culler, round, &mut sums);
        match catch_unwind(AssertUnwindSafe(attack)) {
            Ok(Ok(())) => {}
            Ok(Err(fault)) => {
                println!("round {round}: {fault}");
                faults += 1;
            }
            Err(_) => {
                println!("round {round}: panicked");
                (faults, culler) = (faults + 1, Culler::new());
            }
        }
        round += 1;
    }
    println!("{name}: {} rounds, {faults} faults; {sums:?}", round - first);
    if faults > 0 { Err("something is wrong".into()) } else { Ok(()) }
}

/// What the rounds came to, to see that they attack something.
#[derive(Debug, Default)]
struct Sums {
    culled: u64,
    refused: u64,
    seen: u64,
    left_out: u64,
    pixels: u64,
}

/// Where a scene's surfaces are.
struct Places {
    corners: Vec<[DVec3; 3]>,
    middle: DVec3,
    reach: f64,
}

impl Places {
    fn new(index: &SceneIndex) -> Places {
        let (scene, random) = (index.scene(), &mut Random::new(1));
        let instances = scene.instances();
        let mut corners = Vec::new();
        for _ in 0..100_000.min(instances.len() * 1000) {
            let instance = &instances[random.below(instances.len() as u32) as usize];
            let mesh = &scene.meshes[instance.mesh as usize];
            if mesh.triangles.is_empty() {
                continue;
            }
            let triangle = mesh.triangles[random.below(mesh.triangles.len() as u32) as usize];
            let at =
                |v: u32| instance.world_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3());
            corners.push(triangle.map(at));
        }
        let bounds = scene.bounds();
        let of = |i: usize| bounds.map_or([0.0; 2], |b| [b.min[i], b.max[i]]);
        let sides = [0, 1, 2].map(of);
        Places {
            corners,
            middle: DVec3::from(sides.map(|[low, high]| (low + high) / 2.0)),
            reach: sides.iter().map(|[low, high]| (high - low) / 2.0).fold(1e-9, f64::max),
        }
    }

    /// A point on a triangle, in one of its corners or edges now and then, or a little off it.
    fn near_a_surface(&self, random: &mut Random) -> DVec3 {
        if self.corners.is_empty() {
            return self.middle;
        }
        let [a, b, c] = self.corners[random.below(self.corners.len() as u32) as usize];
        let (u, v) = (random.unit(), random.unit());
        let on = match random.below(4) {
            0 => a,
            1 => a + (b - a) * u,
            _ => a + ((b - a) * u + (c - a) * v) / 2.0,
        };
        let off = self.reach * [0.0, 1e-9, 1e-5, 1e-3, 0.02, 0.1][random.below(6) as usize];
        on + (b - a).cross(c - a).normalize_or_zero() * off * if random.one_in(2) { -1.0 } else { 1.0 }
    }

    /// That of one of the scene's cameras, or of an eye anywhere.
    fn view(&self, scene: &Scene, random: &mut Random) -> View {
        let size = match random.below(4) {
            0 => (1 + random.below(40), 1 + random.below(40)),
            1 => (1280, 800),
            _ => (64 + random.below(600), 48 + random.below(400)),
        };
        if let count @ 1.. = scene.cameras.len() as u32
            && random.one_in(4)
            && let Some(view) = scene.view(random.below(count) as usize, size)
        {
            return view;
        }
        let eye = match random.below(4) {
            0 => self.middle + random.point(1.5) * self.reach,
            1 => self.middle + random.point(20.0) * self.reach,
            _ => self.near_a_surface(random),
        };
        let target = if random.one_in(3) { eye + random.point(1.0) } else { self.near_a_surface(random) };
        let target = if target == eye { eye + DVec3::X } else { target };
        let up = [DVec3::Y, DVec3::Z, DVec3::X, random.point(1.0)][random.below(4) as usize];
        let projection = if random.one_in(4) {
            let half_height = self.reach * 10f64.powf(random.between(-3.0, 0.5));
            Projection::Orthographic { half_height, near: -self.reach, far: self.reach * 4.0 }
        } else {
            let near = self.reach * 10f64.powf(random.between(-6.0, -1.0));
            Projection::Perspective { fov_y: random.between(0.02, 2.6), near }
        };
        View::look_at(eye, target, up, projection, size)
    }

    fn options(&self, random: &mut Random) -> CullOptions {
        let distance = self.reach * 10f64.powf(random.between(-7.0, -1.5));
        let eye_moves = if random.one_in(2) { distance } else { 0.0 };
        let objects_move = if random.one_in(6) { distance } else { 0.0 };
        let is_sampled = eye_moves == 0.0 && objects_move == 0.0 && random.one_in(3);
        CullOptions {
            eye_moves,
            objects_move,
            meaning: if is_sampled { Meaning::Sampled } else { Meaning::Continuous },
            coarseness: match random.below(4) {
                _ if is_sampled => None,
                0 => Some(1 + random.below(6)),
                1 => Some(1),
                _ => None,
            },
            least_occluder_px: [0, 40, 800][random.below(3) as usize],
            least_piece_px: [0, 2, 6][random.below(3) as usize],
            least_px_a_face: [0, 4, 64][random.below(3) as usize],
            boxes_an_instance: [0, 16, 256][random.below(3) as usize],
            coherence: random.one_in(2),
            reasons: random.one_in(4),
            ..CullOptions::default()
        }
    }

    fn attack(
        &self,
        index: &SceneIndex,
        culler: &mut Culler,
        round: u64,
        sums: &mut Sums,
    ) -> Result<(), String> {
        let random = &mut Random::new(round);
        let (view, options) = (self.view(index.scene(), random), self.options(random));
        let what = |e: &dyn std::fmt::Display| format!("{e}: {view:?}, {options:?}");
        if view.validate().is_err() {
            sums.refused += 1;
            return Ok(());
        }
        let mut found = HashSet::new();
        for frame in (0..1 + random.below(4)).rev() {
            let step = DVec3::new(0.3, 0.1, 1.0) * (self.reach * 1e-3 * f64::from(frame));
            let at = DAffine3::from_translation(step) * view.view_from_world;
            match culler.cull(index, &View { view_from_world: at, ..view }, &options) {
                Ok(culling) => found = culling.visible.into_iter().collect(),
                Err(_) => {
                    sums.refused += 1;
                    return Ok(());
                }
            }
        }
        sums.culled += 1;
        let mut eyes = vec![view];
        if options.meaning == Meaning::Continuous && view.width <= 600 {
            eyes[0] = View { width: view.width * 3, height: view.height * 3, ..view };
        }
        for _ in 0..if options.eye_moves > 0.0 { 3 } else { 0 } {
            let step = random.point(1.0).normalize_or_zero() * (options.eye_moves * 0.999_999);
            let at = DAffine3::from_translation(step) * view.view_from_world;
            eyes.push(View { view_from_world: at, ..view });
        }
        for eye in &eyes {
            let seen = seen(index, eye)?;
            sums.seen += seen.len() as u64;
            let missing: Vec<_> = seen.difference(&found).take(3).collect();
            if !missing.is_empty() {
                return Err(what(&format!(
                    "{missing:?} show from {:?} and were left out",
                    eye.eye_in_world()
                )));
            }
        }
        sums.left_out += u64::from(index.scene().instance_count() as u32) - found.len() as u64;
        self.compare(index, &view, random, sums).map_err(|e| what(&e))
    }

    /// Draws a view by both algorithms. The plain one draws all that lies in the frustum: not of the largest worlds.
    fn compare(
        &self,
        index: &SceneIndex,
        view: &View,
        random: &mut Random,
        sums: &mut Sums,
    ) -> Result<(), String> {
        if index.scene().instanced_triangle_count() > 5_000_000 {
            return Ok(());
        }
        let of = |algorithm, threads| {
            let options = RenderOptions { algorithm, threads, ..RenderOptions::default() };
            render(index, view, &options).map_err(|e| e.to_string())
        };
        let fast = of(Algorithm::Hzb, 1 + random.below(3) as usize)?;
        let plain = of(Algorithm::ZBuffer, 1)?;
        for (x, y) in (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y))) {
            if fast.id(x, y) != plain.id(x, y) || fast.depth(x, y).to_bits() != plain.depth(x, y).to_bits() {
                return Err(format!("({x}, {y}) differs"));
            }
        }
        sums.pixels += u64::from(view.width) * u64::from(view.height);
        Ok(())
    }
}

/// Instances that are nearest at a pixel's centre.
fn seen(index: &SceneIndex, view: &View) -> Result<HashSet<u32>, String> {
    let frame = render(index, view, &RenderOptions::default()).map_err(|e| e.to_string())?;
    let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
    Ok(pixels.filter_map(|(x, y)| frame.id(x, y)).map(|id| id.instance).collect())
}
