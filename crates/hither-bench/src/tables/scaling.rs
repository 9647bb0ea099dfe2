//! How a frame divides: on several threads, and into windows of several widths [Greene 1995, §3.5.5].

use super::{SIZES, TableInfo, column, frame_ms, index, view};
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
    let counts: Vec<usize> = [1, 2, 4, 8, 16, 32].into_iter().filter(|&n| n <= cores.max(2)).collect();
    for (spec, cameras) in
        [("office?n=33", &["corridor", "outside"][..]), ("spheres", &["front"]), ("clutter", &["front"])]
    {
        let index = index(spec)?;
        for camera in cameras {
            for size in SIZES {
                (options.progress)(&format!("threads: {spec} {camera}"));
                let view = view(index.scene(), camera, size)?;
                let mut one = f64::NAN;
                for &threads in &counts {
                    let how = RenderOptions { threads, ..RenderOptions::default() };
                    let (time, _) = frame_ms(&index, &view, &how, options)?;
                    if threads == 1 {
                        one = time;
                    }
                    table.push([
                        Cell::from(spec),
                        (*camera).into(),
                        format!("{}x{}", size.0, size.1).into(),
                        threads.into(),
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
    let mut measured = Vec::new();
    for width in [512, 256, 128, 64, 32, 16] {
        (options.progress)(&format!("windows: {width}"));
        let how = RenderOptions { window_width: width, ..RenderOptions::default() };
        measured.push((width, frame_ms(&index, &view, &how, options)?.0));
    }
    let whole = measured[0].1;
    for (width, time) in measured {
        table.push([
            Cell::from(u64::from(width)),
            u64::from(512 / width).into(),
            time.into(),
            (time / whole).into(),
        ]);
    }
    table.notes.push("A window is as high as the image.".into());
    Ok(())
}
