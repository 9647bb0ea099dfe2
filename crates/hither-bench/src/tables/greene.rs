//! The thesis's own figures for a frame of the office [Greene 1995, §3.5.2–3.5.3], beside ours for the
//! corridor view of an office of the same plan.

use super::{TableInfo, column, frames_ms, view, world};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::timed;
use hither::index::TreeKind;
use hither::reference::zbuffer;
use hither::render::{Algorithm, Complexity, Counters, RenderOptions, render};
use hither::{IndexOptions, SceneIndex};

pub(crate) const INFO: TableInfo = TableInfo {
    name: "greene",
    title: "what a frame of the office takes, 512x512, beside the thesis's figures",
    make,
    columns: &[
        column("quantity", "", 0),
        column("greene", "Greene 1995", 2),
        column("bvh", "bvh", 2),
        column("octree_pushed", "octree, pushed", 2),
        column("octree_smallest", "octree, smallest", 2),
    ],
};

const TREES: [TreeKind; 3] = [TreeKind::Bvh, TreeKind::OctreePushed, TreeKind::OctreeSmallest];

/// What one tree made of the frame.
struct Figures {
    counters: Counters,
    cubes: f64,
    polygons: f64,
    hzb_ms: f64,
    plain: Counters,
    plain_ms: f64,
}

/// Time of a scalar z-buffer, one triangle and one sample at a time: what the thesis compares with.
fn textbook_ms(options: &Options) -> Result<f64, String> {
    (options.progress)("greene: textbook z-buffer");
    let scene = world("office?n=33")?;
    let view = view(&scene, "corridor", (512, 512))?;
    Ok(timed(|| zbuffer::draw(&scene, &view)).0.as_secs_f64() * 1e3)
}

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let figures = TREES.map(|tree| figures(tree, options));
    let [Ok(bvh), Ok(pushed), Ok(smallest)] = &figures else {
        return Err(figures.into_iter().find_map(Result::err).unwrap_or_default());
    };
    let textbook_ms = textbook_ms(options)?;
    let mut row = |quantity: &str, greene: Option<f64>, ours: &dyn Fn(&Figures) -> f64| {
        table.push([
            Cell::from(quantity),
            greene.into(),
            ours(bvh).into(),
            ours(pushed).into(),
            ours(smallest).into(),
        ]);
    };
    row("cubes tested against the pyramid", Some(5910.0), &|f| {
        (f.counters.nodes_visited - f.counters.nodes_outside) as f64
    });
    row("of these hidden", Some(3450.0), &|f| f.counters.nodes_culled as f64);
    row("polygons in visible cubes", Some(47_900.0), &|f| f.counters.triangles_tested as f64);
    row("of these front-facing", Some(19_300.0), &|f| f.counters.triangles_front_facing as f64);
    row("of these drawn", None, &|f| f.counters.triangles_drawn as f64);
    row("polygons in the frustum", Some(59_700_000.0), &|f| f.plain.triangles_tested as f64);
    row("depth complexity, cubes", Some(0.20), &|f| f.cubes);
    row("depth complexity, polygons", Some(0.25 + 2.51), &|f| f.polygons);
    row("depth complexity, all tiling", Some(2.96), &|f| f.counters.depth_complexity);
    row("the same without the pyramid", Some(29.2), &|_| f64::NAN);
    row("the same, plain z-buffer", Some(83.7), &|f| f.plain.depth_complexity);
    row("time of a frame, ms", Some(4880.0), &|f| f.hzb_ms);
    row("times faster than textbook z-buffer", Some(413.0), &|f| textbook_ms / f.hzb_ms);
    row("times faster than ours, vectorised", None, &|f| f.plain_ms / f.hzb_ms);
    for row in &mut table.rows {
        for cell in row {
            if matches!(cell, Cell::Number(n) if n.is_nan()) {
                *cell = Cell::Nothing;
            }
        }
    }
    table
        .notes
        .push("Greene's model, view and machine (a 50 MHz R4000) were others; the plan is the same.".into());
    table
        .notes
        .push("A node of the bvh holds up to sixteen boxes, each tested and counted as a cube.".into());
    table.notes.push(
        "Without the pyramid his cubes and polygons met a plain z-buffer; ours are not asked so.".into(),
    );
    Ok(())
}

fn figures(tree: TreeKind, options: &Options) -> Result<Figures, String> {
    (options.progress)(&format!("greene: {tree:?}"));
    let index = SceneIndex::build(world("office?n=33")?, &IndexOptions { tree });
    let view = view(index.scene(), "corridor", (512, 512))?;
    let hzb = RenderOptions::default();
    let plain = RenderOptions { algorithm: Algorithm::ZBuffer, ..hzb };
    let [(hzb_ms, _), (plain_ms, _)] = frames_ms(&index, &view, [&hzb, &plain], options)?;
    let recorded = |how: RenderOptions| {
        render(&index, &view, &RenderOptions { complexity: true, ..how }).map_err(|e| e.to_string())
    };
    let frame = recorded(hzb)?;
    let mean = |of: fn(&Complexity) -> &Vec<f32>| {
        let visits = frame.complexity.as_ref().map(of);
        visits.map_or(f64::NAN, |v| v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len() as f64)
    };
    Ok(Figures {
        counters: frame.counters,
        cubes: mean(|c| &c.cubes),
        polygons: mean(|c| &c.polygons),
        hzb_ms,
        plain: recorded(plain)?.counters,
        plain_ms,
    })
}
