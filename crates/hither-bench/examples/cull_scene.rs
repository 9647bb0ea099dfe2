//! Culls a file or a world from each of its cameras: time, instances found, instances truly seen.
//!
//! ```sh
//! cargo run --release -p hither-bench --example cull_scene -- FILE|world:SPEC WIDTH HEIGHT [sampled] [coherence] [coarse=N]
//!     [occluder=PX] [piece=PX] [face=PX] [pays=FACES] [frames=N] [samples=N] [camera=NAME]
//! ```
//!
//! The second line's are the thresholds of [`CullOptions`], how many frames are timed, samples a pixel each way (4; 0
//! for none), and the only camera.
//!
//! *Seen* are the instances that are nearest at a pixel's centre, and at one of 4×4 samples a pixel.

use hither::conventions::View;
use hither::cull::{CullOptions, Culler, Meaning};
use hither::{IndexOptions, RenderOptions, SceneIndex, render};
use std::collections::HashSet;
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, or: u32| arguments.get(i).and_then(|s| s.parse().ok()).unwrap_or(or);
    let name = arguments.first().ok_or("which scene?")?;
    let scene = match name.strip_prefix("world:") {
        Some(spec) => hither_worlds::generate(spec)?,
        None => hither_io::read(std::path::Path::new(name))?.scene,
    };
    let size = (number(1, 1920), number(2, 1080));
    let sampled = arguments.iter().any(|a| a == "sampled");
    let meaning = if sampled { Meaning::Sampled } else { Meaning::Continuous };
    let coherence = arguments.iter().any(|a| a == "coherence");
    let coarse = arguments.iter().find_map(|a| a.strip_prefix("coarse=")).map_or(Ok(1), str::parse)?;
    let number_of = |name: &str, or: u32| {
        let value = arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('='));
        value.map_or(Ok(or), str::parse)
    };
    let default = CullOptions::default();
    let options = CullOptions {
        meaning,
        coherence,
        coarseness: coarse,
        least_occluder_px: number_of("occluder", default.least_occluder_px)?,
        least_piece_px: number_of("piece", default.least_piece_px)?,
        least_px_a_face: number_of("face", default.least_px_a_face)?,
        faces_a_hidden_box: number_of("pays", default.faces_a_hidden_box)?,
        ..default
    };
    let (samples, frames) = (number_of("samples", 4)?, number_of("frames", 30)?);
    let only = arguments.iter().find_map(|a| a.strip_prefix("camera="));
    let index = SceneIndex::build(scene, &IndexOptions::default());
    let mut culler = Culler::new();
    culler.prepare(&index);
    println!(
        "{:14} {:>8} {:>8} {:>8} {:>8} {:>8}  missing",
        "camera", "ms", "least", "visible", "seen", "4x4"
    );
    for camera in 0..index.scene().cameras.len() {
        if only.is_some_and(|name| index.scene().cameras[camera].name != name) {
            continue;
        }
        let view = index.scene().view(camera, size).ok_or("no camera")?;
        let mut times = Vec::new();
        let mut found = Default::default();
        for _ in 0..frames {
            let start = Instant::now();
            found = culler.cull(&index, &view, &options)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        let (at_centres, finer) = match samples {
            0 => Default::default(),
            side => (seen(&index, &view, 1)?, seen(&index, &view, side)?),
        };
        let visible: HashSet<u32> = found.visible.iter().copied().collect();
        let truth = if sampled { &at_centres } else { &finer };
        println!(
            "{:14} {:8.2} {:8.2} {:8} {:8} {:8}  {}; {:?}",
            index.scene().cameras[camera].name,
            times[times.len() / 2],
            times[0],
            visible.len(),
            at_centres.len(),
            finer.len(),
            truth.difference(&visible).count(),
            found.counters
        );
    }
    Ok(())
}

/// Instances that are nearest at one of `side` × `side` samples a pixel.
fn seen(index: &SceneIndex, view: &View, side: u32) -> Result<HashSet<u32>, Box<dyn Error>> {
    let fine = View { width: view.width * side, height: view.height * side, ..*view };
    let frame = render(index, &fine, &RenderOptions::default())?;
    let pixels = (0..fine.height).flat_map(|y| (0..fine.width).map(move |x| (x, y)));
    Ok(pixels.filter_map(|(x, y)| frame.id(x, y)).map(|id| id.instance).collect())
}
