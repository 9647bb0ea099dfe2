//! As a drawing: from a file to SVG, beside what other software takes for the same input.

use super::drawing_inputs::{self, Polygons};
use super::{TableInfo, column, view, world};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::{median, timed};
use glam::DVec2;
use hither::hidden_line::views::standard_view;
use hither::hidden_line::{Drawing, Kinds, LineOptions, Preparation, PrepareOptions};
use hither_io::{Sheet, SheetView, Unit};
use std::path::Path;
use std::time::Duration;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "lines",
    title: "line drawings: OBJ file to SVG file, orthographic, every edge, one thread",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("triangles", "triangles", 0),
        column("read_ms", "read ms", 1),
        column("prepare_ms", "prepare ms", 1),
        column("draw_ms", "draw ms", 1),
        column("write_ms", "write ms", 1),
        column("total_ms", "total ms", 1),
        column("intersections_ms", "with intersections", 1),
        column("two_threads_ms", "two threads", 1),
        column("two_threads_ratio", "one/two threads", 2),
        column("line_art_ms", "Line Art's", 0),
        column("line_art_ratio", "Line Art's/total", 1),
    ],
};

pub(crate) const GROWTH: TableInfo = TableInfo {
    name: "lines-growth",
    title: "line drawings: office corridor, n x n x n modules, drawing alone, one thread",
    make: growth,
    columns: &[
        column("n", "n", 0),
        column("triangles", "triangles", 0),
        column("draw_ms", "draw ms", 1),
        column("ns_per_triangle", "ns a triangle", 1),
        column("triangles_projected", "projected", 0),
        column("triangles_live", "live", 0),
        column("lines", "lines", 0),
        column("strokes", "strokes", 0),
    ],
};

const RUNS: usize = 5;

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    // The last is what Blender 3.4's Line Art took, ms, on another machine.
    type Input = (&'static str, fn() -> Polygons, Option<f64>);
    let inputs: [Input; 6] = [
        ("pierced cube", drawing_inputs::pierced, None),
        ("1,000 cubes", || drawing_inputs::cubes(10), Some(260.0)),
        ("sphere 5 k", || drawing_inputs::bumps(50), Some(50.0)),
        ("sphere 50 k", || drawing_inputs::bumps(158), Some(480.0)),
        ("sphere 500 k", || drawing_inputs::bumps(500), Some(5100.0)),
        ("200 toothpicks", || drawing_inputs::toothpicks(200), Some(1100.0)),
    ];
    let folder = std::env::temp_dir();
    let name = |extension: &str| folder.join(format!("hither-lines-{}.{extension}", std::process::id()));
    let (from, to) = (name("obj"), name("svg"));
    let (one, two) = (pool(1)?, pool(2)?);
    for (title, input, line_art) in inputs {
        (options.progress)(&format!("lines: {title}"));
        let polygons = input();
        std::fs::write(&from, polygons.obj()).map_err(|e| format!("{}: {e}", from.display()))?;
        let edges = Kinds { intersection: false, contact: false, ..Kinds::ALL };
        let measured = one.install(|| {
            measure(&from, &to, edges)
                .and_then(|plain| Ok((plain, measure(&from, &to, Kinds::ALL)?.iter().sum::<f64>())))
        });
        let with_two = two.install(|| measure(&from, &to, edges));
        let _ = std::fs::remove_file(&from);
        let _ = std::fs::remove_file(&to);
        let (plain, meeting) = measured?;
        let total: f64 = plain.iter().sum();
        let two: f64 = with_two?.iter().sum();
        table.push([
            Cell::from(title),
            polygons.triangles().into(),
            plain[0].into(),
            plain[1].into(),
            plain[2].into(),
            plain[3].into(),
            total.into(),
            meeting.into(),
            two.into(),
            (total / two).into(),
            line_art.into(),
            line_art.map(|l| l / total).into(),
        ]);
    }
    table.notes.push(
        "Line Art: Blender 3.4, user CPU time on one core of a Sapphire Rapids Xeon. It leaves a line of the \
         pierced cube out. Its toothpicks are others, made alike."
            .into(),
    );
    Ok(())
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, String> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())
}

/// Medians of reading, preparing, drawing and writing, milliseconds.
fn measure(from: &Path, to: &Path, kinds: Kinds) -> Result<[f64; 4], String> {
    let mut times: [Vec<Duration>; 4] = Default::default();
    for _ in 0..RUNS {
        let (read, loaded) = timed(|| hither_io::read(from));
        let scene = loaded.map_err(|e| e.to_string())?.scene;
        let (prepare, preparation) = timed(|| Preparation::new(&scene, &PrepareOptions::default()));
        let bounds = scene.bounds().ok_or("the input is empty")?;
        let direction = standard_view("front").ok_or("there is no front view")?;
        let view = direction.view(&bounds, 900.0 / direction.extent(&bounds).max_element(), 50);
        let options = LineOptions { kinds, crease_angle: 0.0, ..LineOptions::default() };
        let (draw, drawing) = timed(|| preparation.draw(&view, &options));
        let drawing = drawing.map_err(|e| e.to_string())?;
        let (write, written) = timed(|| hither_io::write_svg(to, &sheet(&drawing)));
        written.map_err(|e| e.to_string())?;
        for (list, time) in times.iter_mut().zip([read, prepare, draw, write]) {
            list.push(time);
        }
    }
    Ok(times.map(|mut list| median(&mut list).as_secs_f64() * 1e3))
}

fn sheet(drawing: &Drawing) -> Sheet<'_> {
    let view = SheetView { name: String::new(), drawing, origin: DVec2::ZERO, scale: 1.0 };
    Sheet {
        title: "",
        width: drawing.width,
        height: drawing.height,
        unit: Unit::Pixel,
        views: vec![view],
        part_names: &[],
        style: "",
    }
}

fn growth(table: &mut Table, options: &Options) -> Result<(), String> {
    let one = pool(1)?;
    for n in [1u64, 2, 3, 5, 7, 9] {
        (options.progress)(&format!("lines-growth: n = {n}"));
        let scene = world(&format!("office?n={n}"))?;
        let view = view(&scene, "corridor", (1280, 720))?;
        let preparation = Preparation::new(&scene, &PrepareOptions::default());
        let line_options = LineOptions::default();
        let mut times = Vec::new();
        let mut last = None;
        for _ in 0..3 {
            let (time, drawing) = one.install(|| timed(|| preparation.draw(&view, &line_options)));
            times.push(time);
            last = Some(drawing.map_err(|e| e.to_string())?);
        }
        let Some(drawing) = last else { continue };
        let time = median(&mut times).as_secs_f64() * 1e3;
        let triangles = scene.instanced_triangle_count();
        table.push([
            Cell::from(n),
            triangles.into(),
            time.into(),
            (time * 1e6 / triangles as f64).into(),
            drawing.counters.triangles.into(),
            drawing.counters.triangles_live.into(),
            drawing.counters.lines.into(),
            drawing.strokes.len().into(),
        ]);
    }
    Ok(())
}
