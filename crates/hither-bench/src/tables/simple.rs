//! What the method costs where there is little to hide: one bare module, and three [Greene 1995, §3.5.1].

use super::{SIZES, TableInfo, column, frames_ms, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use hither::render::{Algorithm, RenderOptions};

pub(crate) const INFO: TableInfo = TableInfo {
    name: "simple",
    title: "simple scenes, one thread",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("camera", "camera", 0),
        column("size", "size", 0),
        column("hzb_ms", "hzb ms", 2),
        column("zbuffer_ms", "z-buffer ms", 2),
        column("hzb_to_zbuffer", "hzb/z-buffer", 2),
        column("greene", "Greene's", 2),
    ],
};

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    for (spec, greene) in [("office?n=1", 1.17), ("office?nx=3&ny=1&nz=1", 1.0)] {
        let index = index(spec)?;
        for camera in ["corridor", "open", "outside"] {
            for size in SIZES {
                (options.progress)(&format!("simple: {spec} {camera}"));
                let view = view(index.scene(), camera, size)?;
                let plain = RenderOptions { algorithm: Algorithm::ZBuffer, ..RenderOptions::default() };
                let ways = [&RenderOptions::default(), &plain];
                let [(hzb, _), (zbuffer, _)] = frames_ms(&index, &view, ways, options)?;
                let greene = (camera == "outside" && size == SIZES[0]).then_some(greene);
                table.push([
                    Cell::from(spec),
                    camera.into(),
                    format!("{}x{}", size.0, size.1).into(),
                    hzb.into(),
                    zbuffer.into(),
                    (hzb / zbuffer).into(),
                    greene.into(),
                ]);
            }
        }
    }
    table.notes.push(
        "Greene measured a module most of which was visible; camera outside is the nearest to it.".into(),
    );
    Ok(())
}
