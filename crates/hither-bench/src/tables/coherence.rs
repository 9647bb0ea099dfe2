//! A walk through the office, each frame from scratch and each starting from what the last one saw
//! [Greene 1995, §3.3.3].

use super::{SIZES, TableInfo, column, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use hither::SceneIndex;
use hither::render::{Coherence, RenderOptions, Renderer};
use std::time::Instant;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "coherence",
    title: "a ten-second walk through the office, with and without temporal coherence, one thread",
    make,
    columns: &[
        column("size", "size", 0),
        column("fps", "frames/s", 0),
        column("scratch_ms", "scratch ms", 2),
        column("always_ms", "always coherent ms", 2),
        column("where_pays_ms", "where it pays ms", 2),
        column("always_speedup", "speed-up always", 2),
        column("where_pays_speedup", "speed-up where it pays", 2),
        column("slower_frames", "frames 5 % slower", 0),
        column("frames", "of", 0),
    ],
};

/// How frames may start.
const WAYS: [Coherence; 3] = [Coherence::Never, Coherence::Always, Coherence::WherePays];

/// Times of a whole walk are taken this often; a frame's least counts.
const WALKS: usize = 3;

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let mut index = index("office?n=33")?;
    for size in SIZES {
        for fps in [10, 30] {
            (options.progress)(&format!("coherence: {}x{} at {fps} frames a second", size.0, size.1));
            let frames = 10 * fps as usize;
            let mut best = WAYS.map(|_| vec![f64::INFINITY; frames]);
            for _ in 0..WALKS {
                for (coherence, best) in WAYS.into_iter().zip(&mut best) {
                    walk(&mut index, size, f64::from(fps), coherence, best)?;
                }
            }
            let mean = |times: &[f64]| times[1..].iter().sum::<f64>() / (times.len() - 1) as f64;
            let [scratch, always, where_pays] = &best;
            // The first frame has no last one to start from.
            let slower = scratch.iter().zip(where_pays).skip(1).filter(|(s, w)| **w > **s * 1.05).count();
            table.push([
                Cell::from(format!("{}x{}", size.0, size.1)),
                u64::from(fps as u32).into(),
                mean(scratch).into(),
                mean(always).into(),
                mean(where_pays).into(),
                (mean(scratch) / mean(always)).into(),
                (mean(scratch) / mean(where_pays)).into(),
                slower.into(),
                (frames - 1).into(),
            ]);
        }
    }
    Ok(())
}

fn walk(
    index: &mut SceneIndex,
    size: (u32, u32),
    fps: f64,
    coherence: Coherence,
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
