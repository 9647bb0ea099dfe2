//! A walk through the office, each frame from scratch and each starting from what the last one saw
//! [Greene 1995, §3.3.3].

use super::{SIZES, TableInfo, column, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use hither::SceneIndex;
use hither::render::{RenderOptions, Renderer};
use std::time::Instant;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "coherence",
    title: "a ten-second walk through the office, with and without temporal coherence, one thread",
    make,
    columns: &[
        column("size", "size", 0),
        column("fps", "frames/s", 0),
        column("scratch_ms", "scratch ms", 2),
        column("coherent_ms", "coherent ms", 2),
        column("speedup", "speed-up", 2),
        column("worst_frame", "worst frame, coherent/scratch", 2),
        column("slower_frames", "frames slower", 0),
        column("frames", "of", 0),
    ],
};

/// Times of a whole walk are taken this often; a frame's least counts.
const WALKS: usize = 3;

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let mut index = index("office?n=33")?;
    for size in SIZES {
        for fps in [10, 30] {
            (options.progress)(&format!("coherence: {}x{} at {fps} frames a second", size.0, size.1));
            let frames = 10 * fps as usize;
            let mut best = [vec![f64::INFINITY; frames], vec![f64::INFINITY; frames]];
            for _ in 0..WALKS {
                for (coherence, best) in [false, true].into_iter().zip(&mut best) {
                    walk(&mut index, size, f64::from(fps), coherence, best)?;
                }
            }
            let [scratch, coherent] = best;
            let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len() as f64;
            // The first frame has no last one to start from.
            let ratios: Vec<f64> = scratch.iter().zip(&coherent).skip(1).map(|(s, c)| c / s).collect();
            table.push([
                Cell::from(format!("{}x{}", size.0, size.1)),
                u64::from(fps as u32).into(),
                mean(&scratch[1..]).into(),
                mean(&coherent[1..]).into(),
                (mean(&scratch[1..]) / mean(&coherent[1..])).into(),
                ratios.iter().copied().fold(0.0, f64::max).into(),
                ratios.iter().filter(|&&r| r > 1.0).count().into(),
                ratios.len().into(),
            ]);
        }
    }
    Ok(())
}

fn walk(
    index: &mut SceneIndex,
    size: (u32, u32),
    fps: f64,
    coherence: bool,
    best_ms: &mut [f64],
) -> Result<(), String> {
    let how = RenderOptions { coherence, ..RenderOptions::default() };
    let mut renderer = Renderer::new();
    for (number, best) in best_ms.iter_mut().enumerate() {
        index.pose(0, number as f64 / fps);
        let view = view(index.scene(), "walk", size)?;
        let start = Instant::now();
        let frame = renderer.render(index, &view, &how).map_err(|e| e.to_string())?;
        *best = best.min(start.elapsed().as_secs_f64() * 1e3);
        renderer.recycle(frame);
    }
    Ok(())
}
