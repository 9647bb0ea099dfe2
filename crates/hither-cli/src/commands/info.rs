//! `hither info`: what is in a file or a world.

use super::report;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{count, grouped, point, short};
use crate::options::ReportOptions;
use crate::{console, outputs, source};
use glam::{DAffine3, DVec3};
use hither::scene::{Camera, CameraProjection, Scene};
use hither_io::one_line;
use serde_json::{Value, json};
use std::fmt::Write;

/// Counts, bounds, cameras and animations of a scene
#[derive(clap::Args)]
pub struct Arguments {
    /// A .glb, .gltf, .obj, .stl or .ply file, or a generated world, as in `world:office?n=33`
    scene: String,
    #[command(flatten)]
    report: ReportOptions,
}

/// Prints what is in a scene.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let to = arguments.report.json.as_deref();
    let mut files = Files::of_scene(&arguments.scene);
    files.reports(to)?;
    let scene = source::open(&arguments.scene, &files, arguments.report.verbosity())?;
    match to {
        Some(_) => outputs::write_report(to, &as_json(&scene, &arguments.scene)),
        None => console::print(&as_text(&scene, &arguments.scene)),
    }
}

fn as_text(scene: &Scene, source: &str) -> String {
    let mut text = format!("{}\n", one_line(source));
    let mut line = |what: &str, value: String| {
        let _ = writeln!(text, "  {what:<11} {value}");
    };
    let counts = Counts::of(scene);
    let stored = grouped(counts.triangles_stored);
    line("triangles", format!("{} shown, {stored} stored", grouped(counts.triangles)));
    let meshes = count(counts.meshes, "mesh").replace("meshs", "meshes");
    line("instances", format!("{} of {meshes}", grouped(counts.instances)));
    line("nodes", format!("{} in {}", grouped(counts.nodes), count(counts.groups, "group")));
    line("materials", format!("{}, {}", counts.materials, count(counts.textures, "texture")));
    line(
        "bounds",
        match scene.bounds() {
            Some(b) => format!("{} to {}, size {}", point(b.min), point(b.max), point(b.size())),
            None => "none; nothing is shown".into(),
        },
    );
    line("cameras", if scene.cameras.is_empty() { "none".into() } else { String::new() });
    for (i, camera) in scene.cameras.iter().enumerate() {
        let pose = Pose::of(scene, i);
        let _ = writeln!(
            text,
            "    {i} {:<16} eye {}  towards {}  {}",
            quoted(&camera.name),
            point(pose.eye),
            point(pose.direction),
            lens(camera)
        );
    }
    let none = if scene.animations.is_empty() { "none" } else { "" };
    let _ = writeln!(text, "  {:<11} {none}", "animations");
    for (i, animation) in scene.animations.iter().enumerate() {
        let channels = count(animation.channels.len() as u64, "channel");
        let _ = writeln!(
            text,
            "    {i} {:<16} {} s, {channels}",
            quoted(&animation.name),
            short(animation.duration())
        );
    }
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

fn as_json(scene: &Scene, source: &str) -> Value {
    let counts = Counts::of(scene);
    let mut info = report::opening("info");
    let cameras = scene.cameras.iter().enumerate().map(|(i, camera)| {
        let pose = Pose::of(scene, i);
        json!({
            "index": i,
            "name": camera.name,
            "eye": report::point(pose.eye),
            "direction": report::point(pose.direction),
            "up": report::point(pose.up),
            "projection": lens_as_json(camera),
        })
    });
    let animations = scene.animations.iter().enumerate().map(|(i, animation)| {
        json!({
            "index": i,
            "name": animation.name,
            "duration_ms": animation.duration() * 1e3,
            "channels": animation.channels.len(),
        })
    });
    info.insert("scene".into(), source.into());
    info.insert("triangles".into(), counts.triangles.into());
    info.insert("triangles_stored".into(), counts.triangles_stored.into());
    info.insert("instances".into(), counts.instances.into());
    info.insert("meshes".into(), counts.meshes.into());
    info.insert("nodes".into(), counts.nodes.into());
    info.insert("groups".into(), counts.groups.into());
    info.insert("materials".into(), counts.materials.into());
    info.insert("textures".into(), counts.textures.into());
    info.insert("bounds".into(), report::bounds(scene.bounds()));
    info.insert("cameras".into(), cameras.collect());
    info.insert("animations".into(), animations.collect());
    info.into()
}

/// How much there is of everything.
struct Counts {
    triangles: u64,
    triangles_stored: u64,
    instances: u64,
    meshes: u64,
    nodes: u64,
    groups: u64,
    materials: u64,
    textures: u64,
}

impl Counts {
    fn of(scene: &Scene) -> Counts {
        Counts {
            triangles: scene.instanced_triangle_count(),
            triangles_stored: scene.meshes.iter().map(|m| m.triangles.len() as u64).sum(),
            instances: scene.instance_count(),
            meshes: scene.meshes.len() as u64,
            nodes: scene.groups.iter().map(|g| g.nodes.len() as u64).sum(),
            groups: scene.groups.len() as u64,
            materials: scene.materials.len() as u64,
            textures: scene.textures.len() as u64,
        }
    }
}

/// Where a camera is and looks, in the world.
struct Pose {
    eye: DVec3,
    direction: DVec3,
    up: DVec3,
}

impl Pose {
    fn of(scene: &Scene, camera: usize) -> Pose {
        let world_from_camera = scene.world_from_camera(camera).unwrap_or(DAffine3::IDENTITY);
        let along = |axis: DVec3| world_from_camera.transform_vector3(axis).normalize_or_zero();
        Pose { eye: world_from_camera.translation, direction: along(DVec3::NEG_Z), up: along(DVec3::Y) }
    }
}

fn lens(camera: &Camera) -> String {
    match camera.projection {
        CameraProjection::Perspective { fov_y, .. } => format!("fov {}", short(fov_y.to_degrees())),
        CameraProjection::Orthographic { half_width, half_height, .. } => {
            format!("orthographic, {} x {} m", short(2.0 * half_width), short(2.0 * half_height))
        }
    }
}

fn lens_as_json(camera: &Camera) -> Value {
    match camera.projection {
        CameraProjection::Perspective { fov_y, near } => {
            json!({ "kind": "perspective", "fov_y_degrees": fov_y.to_degrees(), "near": near })
        }
        CameraProjection::Orthographic { half_width, half_height, near, far } => json!({
            "kind": "orthographic",
            "half_width": half_width,
            "half_height": half_height,
            "near": near,
            "far": far,
        }),
    }
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", one_line(name))
}
