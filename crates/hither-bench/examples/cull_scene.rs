//! Culls a file or a world from each of its cameras: time, instances found, instances truly seen.
//!
//! `cargo run --release -p hither-bench --example cull_scene -- FILE|world:SPEC WIDTH HEIGHT [OCCLUDER_PX PIECE_PX]`
use hither::cull::{CullOptions, Culler};
use hither::{IndexOptions, RenderOptions, SceneIndex, render};
use std::collections::HashSet;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, or: u32| arguments.get(i).and_then(|s| s.parse().ok()).unwrap_or(or);
    let name = arguments.first().ok_or("which scene?")?;
    let scene = match name.strip_prefix("world:") {
        Some(spec) => hither_worlds::generate(spec)?,
        None => hither_io::read(std::path::Path::new(name))?.scene,
    };
    let size = (number(1, 1920), number(2, 1080));
    let default = CullOptions::default();
    let options = CullOptions {
        least_occluder_px: number(3, default.least_occluder_px),
        least_piece_px: number(4, default.least_piece_px),
        boxes_an_instance: number(5, default.boxes_an_instance),
        ..default
    };
    let index = SceneIndex::build(scene, &IndexOptions::default());
    let mut culler = Culler::new();
    culler.prepare(&index);
    for camera in 0..index.scene().cameras.len() {
        let view = index.scene().view(camera, size).ok_or("no camera")?;
        let mut times = Vec::new();
        let mut found = Default::default();
        for _ in 0..30 {
            let start = Instant::now();
            found = culler.cull(&index, &view, &options)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        let frame = render(&index, &view, &RenderOptions::default())?;
        let pixels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
        let seen: HashSet<u32> = pixels.filter_map(|(x, y)| frame.id(x, y)).map(|id| id.instance).collect();
        let visible: HashSet<u32> = found.visible.iter().copied().collect();
        println!(
            "{:14} {:7.2} ms (least {:.2}); visible {}, seen {} (x {:.2}), missing {}; {:?}",
            index.scene().cameras[camera].name,
            times[times.len() / 2],
            times[0],
            visible.len(),
            seen.len(),
            visible.len() as f64 / seen.len() as f64,
            seen.difference(&visible).count(),
            found.counters
        );
    }
    Ok(())
}
