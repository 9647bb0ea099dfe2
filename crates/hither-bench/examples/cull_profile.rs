//! Draws one world again and again, for a profiler.
use glam::DAffine3;
use hither::cull::{Boxes, Occluder, OcclusionBuffer, OcclusionOptions};
use std::time::Instant;

fn main() {
    let spec = std::env::args().nth(1).unwrap_or("clutter".into());
    let w: u32 = std::env::args().nth(2).and_then(|s| s.parse().ok()).unwrap_or(1920);
    let h: u32 = std::env::args().nth(3).and_then(|s| s.parse().ok()).unwrap_or(1080);
    let n: u32 = std::env::args().nth(4).and_then(|s| s.parse().ok()).unwrap_or(50);
    let scene = hither_worlds::generate(&spec).unwrap();
    let view = scene.view(0, (w, h)).unwrap();
    let occluder = Occluder::of_mesh(&scene.meshes[0], &scene.materials);
    println!("{} patches, {} triangles", occluder.patch_count(), occluder.triangle_count());
    let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
    let boxes: Boxes = hither_worlds::occludees(&spec).unwrap().into_iter().collect();
    let mut best = f64::INFINITY;
    let mut drawn = Default::default();
    for _ in 0..n {
        let start = Instant::now();
        buffer.clear();
        drawn = buffer.draw(&occluder, &DAffine3::IDENTITY);
        best = best.min(start.elapsed().as_secs_f64() * 1e3);
    }
    let mut ask = f64::INFINITY;
    let mut v = Vec::new();
    for _ in 0..n {
        let start = Instant::now();
        buffer.ask(&boxes, &mut v);
        ask = ask.min(start.elapsed().as_secs_f64() * 1e3);
    }
    println!("best {best:.3} ms, ask {:.1} M/s, {drawn:?}", boxes.len() as f64 / ask / 1e3);
}
