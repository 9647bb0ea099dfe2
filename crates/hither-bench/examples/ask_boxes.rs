//! Draws a benchmark world into an occlusion buffer and asks about its boxes: least and median times, and the verdicts.
//!
//! ```sh
//! cargo run --release -p hither-bench --example ask_boxes -- WIDTH HEIGHT FRAMES SPEC CAMERA [SPEC CAMERA ...]
//! ```
//!
//! The worlds are those that have boxes: `boxcity street`, `clutter front` and `spheres front`. Two programs whose sums
//! are the same gave the same verdicts: it is made for comparing a change with what was before.

use glam::DAffine3;
use hither::cull::{Boxes, Occluder, OcclusionBuffer, OcclusionOptions, Verdict};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [width, height, frames, worlds @ ..] = arguments.as_slice() else {
        return Err("WIDTH HEIGHT FRAMES SPEC CAMERA [SPEC CAMERA ...]".into());
    };
    let (size, frames) = ((width.parse()?, height.parse()?), frames.parse::<usize>()?.max(1));
    for world in worlds.chunks_exact(2) {
        let scene = hither_worlds::generate(&world[0])?;
        let view = scene.find_camera(&world[1]).and_then(|c| scene.view(c, size)).ok_or("no such camera")?;
        let boxes: Boxes =
            hither_worlds::occludees(&world[0]).ok_or("it has no boxes")?.into_iter().collect();
        let occluder = Occluder::of_mesh(&scene.meshes[0], &scene.materials);
        let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default())?;
        let (mut draw, mut ask, mut verdicts) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..frames {
            let start = Instant::now();
            buffer.clear();
            buffer.draw(&occluder, &DAffine3::IDENTITY);
            draw.push(start.elapsed().as_secs_f64() * 1e3);
            let start = Instant::now();
            buffer.ask(&boxes, &mut verdicts);
            ask.push(start.elapsed().as_secs_f64() * 1e9 / verdicts.len() as f64);
        }
        let count = |verdict| verdicts.iter().filter(|v| **v == verdict).count();
        let sum = verdicts
            .iter()
            .fold(0u64, |sum, v| (sum.rotate_left(5) ^ *v as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let [visible, hidden] = [Verdict::Visible, Verdict::Hidden].map(count);
        for (what, times) in [("draw, ms", &mut draw), ("ask, ns a box", &mut ask)] {
            times.sort_by(f64::total_cmp);
            println!("{:8} {what:14} least {:.3} median {:.3}", world[0], times[0], times[times.len() / 2]);
        }
        println!("{:8} visible {visible}, hidden {hidden}, sum {sum:016x}", world[0]);
    }
    Ok(())
}
