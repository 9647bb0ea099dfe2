//! What the hierarchical z-buffer asks of boxes: of the rectangle alone, or of the outline too
//! [Greene 1995, §3.3.2].

use super::{SIZES, TableInfo, column, frames_ms, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use hither::render::{BoxTest, RenderOptions};

pub(crate) const INFO: TableInfo = TableInfo {
    name: "box-tests",
    title: "boxes tested by their rectangle, and by their outline too, one thread",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("camera", "camera", 0),
        column("size", "size", 0),
        column("rectangle_ms", "rectangle ms", 2),
        column("definitive_ms", "definitive ms", 2),
        column("rectangle_nodes", "nodes", 0),
        column("definitive_nodes", "nodes, definitive", 0),
    ],
};

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let scenes = [("office?n=33", &["corridor", "open", "outside"][..]), ("boxcity", &["street"])];
    for (spec, cameras) in scenes {
        let index = index(spec)?;
        for camera in cameras {
            for size in SIZES {
                (options.progress)(&format!("box-tests: {spec} {camera}"));
                let view = view(index.scene(), camera, size)?;
                let definitive = RenderOptions { box_test: BoxTest::Definitive, ..RenderOptions::default() };
                let ways = [&RenderOptions::default(), &definitive];
                let [(fast_ms, fast), (slow_ms, slow)] = frames_ms(&index, &view, ways, options)?;
                table.push([
                    Cell::from(spec),
                    (*camera).into(),
                    format!("{}x{}", size.0, size.1).into(),
                    fast_ms.into(),
                    slow_ms.into(),
                    fast.nodes_visited.into(),
                    slow.nodes_visited.into(),
                ]);
            }
        }
    }
    Ok(())
}
