//! How a frame divides: on several threads, and into windows of several widths [Greene 1995, §3.5.5].

use super::{SIZES, TableInfo, column, frames_ms, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use hither::render::RenderOptions;

pub(crate) const THREADS: TableInfo = TableInfo {
    name: "threads",
    title: "hzb on several threads",
    make: threads,
    columns: &[
        column("scene", "scene", 0),
        column("camera", "camera", 0),
        column("size", "size", 0),
        column("threads", "threads", 0),
        column("one_thread_ms", "one thread, ms", 2),
        column("hzb_ms", "hzb ms", 2),
        column("speedup", "speed-up", 2),
    ],
};

pub(crate) const WINDOWS: TableInfo = TableInfo {
    name: "windows",
    title: "all windows of a frame against their width (fig. 3.10), office corridor, 512x512, one thread",
    make: windows,
    columns: &[
        column("width", "width", 0),
        column("windows", "windows", 0),
        column("hzb_ms", "all windows, ms", 2),
        column("to_whole", "to one window", 2),
    ],
};

fn threads(table: &mut Table, options: &Options) -> Result<(), String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let counts = [1, 2, 4, 8, 16, 32];
    let ways = counts.map(|threads| RenderOptions { threads, ..RenderOptions::default() });
    for (spec, cameras) in
        [("office?n=33", &["corridor", "outside"][..]), ("spheres", &["front"]), ("clutter", &["front"])]
    {
        let index = index(spec)?;
        for camera in cameras {
            for size in SIZES {
                (options.progress)(&format!("threads: {spec} {camera}"));
                let view = view(index.scene(), camera, size)?;
                for (&threads, how) in counts.iter().zip(&ways).skip(1).filter(|(n, _)| **n <= cores.max(2)) {
                    let [(one, _), (time, _)] = frames_ms(&index, &view, [&ways[0], how], options)?;
                    table.push([
                        Cell::from(spec),
                        (*camera).into(),
                        format!("{}x{}", size.0, size.1).into(),
                        threads.into(),
                        one.into(),
                        time.into(),
                        (one / time).into(),
                    ]);
                }
            }
        }
    }
    Ok(())
}

fn windows(table: &mut Table, options: &Options) -> Result<(), String> {
    let index = index("office?n=33")?;
    let view = view(index.scene(), "corridor", (512, 512))?;
    (options.progress)("windows");
    let widths = [512, 256, 128, 64, 32, 16];
    let ways = widths.map(|width| RenderOptions { window_width: width, ..RenderOptions::default() });
    let measured = frames_ms(&index, &view, ways.each_ref(), options)?;
    let whole = measured[0].0;
    for (width, (time, _)) in widths.into_iter().zip(measured) {
        table.push([
            Cell::from(u64::from(width)),
            u64::from(512 / width).into(),
            time.into(),
            (time / whole).into(),
        ]);
    }
    table.notes.push(
        "A window is as high as the image. Greene's windows are square: his curve is relatively flat from"
            .into(),
    );
    table.notes.push(
        "32x32 on, and a window of 32x32 takes about four times as long as a pixel alone (§3.5.5).".into(),
    );
    Ok(())
}
