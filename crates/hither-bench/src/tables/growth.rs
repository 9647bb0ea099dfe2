//! How the time of a frame grows with the model: the corridor view of offices of 15,000 to 4 billion
//! triangles.

use super::{TableInfo, column, frame_ms, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use hither::render::RenderOptions;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "growth",
    title: "office corridor, n x n x n modules, 512x512, one thread",
    make,
    columns: &[
        column("n", "n", 0),
        column("triangles", "triangles", 0),
        column("hzb_ms", "hzb ms", 2),
        column("to_17", "to n = 17", 2),
        column("nodes_visited", "nodes", 0),
        column("triangles_tested", "tested", 0),
        column("triangles_drawn", "drawn", 0),
    ],
};

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    const SIDES: [u32; 11] = [1, 2, 3, 5, 9, 13, 17, 25, 33, 49, 65];
    let mut measured = Vec::new();
    for n in SIDES {
        (options.progress)(&format!("growth: n = {n}"));
        let index = index(&format!("office?n={n}"))?;
        let view = view(index.scene(), "corridor", (512, 512))?;
        let (time, counters) = frame_ms(&index, &view, &RenderOptions::default(), options)?;
        measured.push((n, index.scene().instanced_triangle_count(), time, counters));
    }
    let at_17 = measured.iter().find(|m| m.0 == 17).map_or(f64::NAN, |m| m.2);
    for (n, triangles, time, counters) in measured {
        table.push([
            Cell::from(u64::from(n)),
            triangles.into(),
            time.into(),
            (time / at_17).into(),
            counters.nodes_visited.into(),
            counters.triangles_tested.into(),
            counters.triangles_drawn.into(),
        ]);
    }
    Ok(())
}
