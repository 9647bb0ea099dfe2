//! Renders a world from some of its cameras: least and median time of a frame, what was done, and a sum of the picture.
//!
//! ```sh
//! cargo run --release -p hither-bench --example render_scene -- WIDTH HEIGHT FRAMES SPEC CAMERA [CAMERA ...]
//! ```
//!
//! Two programs whose sums are the same drew the same ids and depths: it is made for comparing a change with what was
//! before.

use hither::render::Renderer;
use hither::{IndexOptions, RenderOptions, SceneIndex};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [width, height, frames, spec, cameras @ ..] = arguments.as_slice() else {
        return Err("WIDTH HEIGHT FRAMES SPEC CAMERA [CAMERA ...]".into());
    };
    let size = (width.parse()?, height.parse()?);
    let index = SceneIndex::build(hither_worlds::generate(spec)?, &IndexOptions::default());
    for camera in cameras {
        let view = index.scene().find_camera(camera).and_then(|c| index.scene().view(c, size));
        let view = view.ok_or("no such camera")?;
        let mut renderer = Renderer::new();
        let mut times = Vec::new();
        let mut sum = 0u64;
        for frame in 0..frames.parse::<usize>()?.max(1) {
            let start = Instant::now();
            let drawn = renderer.render(&index, &view, &RenderOptions::default())?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
            if frame == 0 {
                for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
                    let id = drawn
                        .id(x, y)
                        .map_or(u64::MAX, |s| u64::from(s.instance) << 32 | u64::from(s.triangle));
                    for n in [id, u64::from(drawn.depth(x, y).to_bits())] {
                        sum = (sum.rotate_left(26) ^ n).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                    }
                }
                println!("{spec} {camera} {:?}", drawn.counters);
            }
            renderer.recycle(drawn);
        }
        times.sort_by(f64::total_cmp);
        println!("{spec} {camera} least {:.3} median {:.3} sum {sum:016x}", times[0], times[times.len() / 2]);
    }
    Ok(())
}
