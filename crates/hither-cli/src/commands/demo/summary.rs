//! What the demonstration found, as text.

use super::{Comparison, Measured, SIZE, WORLD};
use crate::numbers::{count, grouped};
use hither::Scene;
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

/// The walk as a whole, and the compared frames side by side.
pub fn table(scene: &Scene, walk: &[Measured], comparisons: &[Comparison]) -> String {
    let mut text = String::new();
    let frames = walk.len().max(1) as f64;
    let mean = walk.iter().map(|m| ms(m.time)).sum::<f64>() / frames;
    let slowest = walk.iter().map(|m| ms(m.time)).fold(0.0, f64::max);
    let drawn = walk.iter().map(|m| m.counters.triangles_drawn as f64).sum::<f64>() / frames;
    let _ = writeln!(
        text,
        "The walk: {} of {}x{} pixels, ids and depth on one thread, each from scratch:\n\
         {mean:.1} ms a frame on average, {slowest:.1} ms at most; {} triangles drawn on average.",
        count(walk.len() as u64, "frame"),
        SIZE.0,
        SIZE.1,
        grouped(drawn as u64)
    );
    for comparison in comparisons {
        let _ = write!(text, "\n{}", compared(scene, comparison));
    }
    text
}

fn compared(scene: &Scene, comparison: &Comparison) -> String {
    let Comparison { number, hierarchical: ours, plain, same } = comparison;
    let mut text =
        format!("{:<24}{:>20}{:>20}\n", format!("Frame {number}"), "hierarchical", "plain z-buffer");
    let mut row = |what: &str, ours: String, plain: String| {
        let _ = writeln!(text, "  {what:<22}{ours:>20}{plain:>20}");
    };
    let both = |of: &dyn Fn(&Measured) -> u64| (grouped(of(ours)), grouped(of(plain)));
    let all = grouped(scene.instanced_triangle_count());
    row("triangles in the scene", all.clone(), all);
    let in_view = grouped(plain.counters.triangles_tested);
    row("  in the view", in_view.clone(), in_view);
    let (a, b) = both(&|m| m.counters.nodes_visited);
    row("boxes visited", a, b);
    let (a, b) = both(&|m| m.counters.triangles_tested);
    row("triangles tested", a, b);
    let (a, b) = both(&|m| m.counters.triangles_drawn);
    row("triangles drawn", a, b);
    let (a, b) = both(&|m| m.counters.pixels_written);
    row("pixels written", a, b);
    let (a, b) = both(&|m| m.seen.triangles);
    row("triangles seen", a, b);
    let (a, b) = both(&|m| m.seen.instances);
    row("  of instances", a, b);
    row("time", format!("{:.1} ms", ms(ours.time)), format!("{:.0} ms", ms(plain.time)));
    let ratio = plain.time.as_secs_f64() / ours.time.as_secs_f64();
    let agreement = match same {
        true => "every id and every bit of depth is the same",
        false => "but the pictures differ, which is a bug in hither; please report it",
    };
    let _ = writeln!(text, "  {ratio:.0} times faster than the plain z-buffer; {agreement}.");
    text
}

/// Where the pictures are, and what to try next.
pub fn closing(folder: &Path) -> String {
    // Under `cargo run` the binary is not on the path.
    let hither = if std::env::var_os("CARGO").is_some() { "cargo run --release --" } else { "hither" };
    format!(
        "\nPictures are in {folder}/; sheet.png has all of them.\n\n\
         Try next:\n\
         \x20 {hither} render model.glb -o out.png\n\
         \x20 {hither} render {WORLD} --camera open --shade complexity -o work.png\n\
         \x20 {hither} render {WORLD} --camera walk --frames 0..300 -o walk-####.png\n\
         \x20 {hither} info {WORLD}\n\
         \x20 {hither} world\n",
        folder = folder.display(),
    )
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
