//! Generated worlds: the same triangles, in the same order, on every machine.
//!
//! A world is asked for by a *spec*, `NAME?key=value&…`, for example `office?n=33`; [`list`] says which
//! there are. Each comes with cameras and, where something moves, an animation. Elementary functions come
//! from `libm` and not from the platform, so that the last bit of a vertex does not depend on it.
//!
//! Four worlds (`office`, `boxcity`, `clutter`, `spheres`) are shared with benchmarks that are written for
//! a *left-handed* world, x right, y up, z forward. They map to ours by `z → −z`, for eyes and directions
//! alike. Windings stay as they are: a triangle that is counter-clockwise on a screen there is
//! counter-clockwise on the same screen here, so the same camera sees the same picture.
#![forbid(unsafe_code)]

mod benchmark_axes;
mod boxcity;
mod canyon;
mod city;
mod clutter;
mod hills;
mod lcg;
mod lecture;
mod office;
mod palette;
mod sheets;
mod soda;
mod spec;
mod spheres;
mod stroll;
mod tetra;
mod toothpicks;

pub use spec::{KeyDefault, KeyInfo, WorldError, WorldInfo};

use hither::geometry::Aabb;
use hither::order::Known;
use hither::scene::Scene;
use spec::Values;

static WORLDS: &[WorldInfo] = &[
    office::INFO,
    boxcity::INFO,
    clutter::INFO,
    spheres::INFO,
    hills::INFO,
    lecture::INFO,
    toothpicks::INFO,
    canyon::INFO,
    soda::INFO,
    city::INFO,
    tetra::INFO,
];

/// Generates the world that `spec` asks for, `NAME?key=value&…`. Keys left out take their defaults.
///
/// The scene is valid ([`Scene::validate`]).
pub fn generate(spec: &str) -> Result<Scene, WorldError> {
    let (name, query) = spec.split_once('?').unwrap_or((spec, ""));
    let world = WORLDS
        .iter()
        .find(|w| w.name == name)
        .ok_or_else(|| spec::unknown_world(name, WORLDS.iter().map(|w| w.name)))?;
    let values = Values::parse(world, query)?;
    let mut scene = (world.make)(&values);
    scene.name = spec.to_owned();
    Ok(scene)
}

/// The worlds there are.
pub fn list() -> &'static [WorldInfo] {
    WORLDS
}

/// The 100,000 boxes whose visibility occlusion buffers are asked for in `boxcity`, `clutter` or
/// `spheres`, in world space; `None` for other worlds.
pub fn occludees(name: &str) -> Option<Vec<Aabb>> {
    match name {
        "boxcity" => Some(boxcity::occludees()),
        "clutter" => Some(clutter::occludees()),
        "spheres" => Some(spheres::occludees()),
        _ => None,
    }
}

/// What is known of the parts of a generated world, by the instances' numbers: pairs whose hulls meet and that
/// have an order all the same. Empty for scenes that are not worlds, and for most that are.
pub fn known_relations(scene: &Scene) -> Vec<(u32, u32, Known)> {
    match scene.name.split('?').next() {
        Some("toothpicks") => toothpicks::joints(),
        Some("canyon") => canyon::seams(&scene.name),
        _ => Vec::new(),
    }
}

/// Parts of a generated world, by the instances' numbers, that are behind everything: skies.
pub fn backdrops(scene: &Scene) -> Vec<u32> {
    match scene.name.split('?').next() {
        Some("canyon") => vec![0],
        _ => Vec::new(),
    }
}
