//! The trees that serve the same walk, against each other.

use super::{TableInfo, column, frame_ms, view, world};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::timed;
use hither::index::TreeKind;
use hither::render::RenderOptions;
use hither::{IndexOptions, SceneIndex};

pub(crate) const INFO: TableInfo = TableInfo {
    name: "trees",
    title: "bounding volume hierarchy and octrees, 512x512, one thread",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("camera", "camera", 0),
        column("tree", "tree", 0),
        column("build_ms", "build ms", 1),
        column("memory_mib", "MiB", 1),
        column("hzb_ms", "hzb ms", 2),
        column("nodes_visited", "nodes", 0),
        column("nodes_culled", "hidden", 0),
        column("triangles_tested", "tested", 0),
        column("triangles_drawn", "drawn", 0),
    ],
};

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let kinds = [
        ("bvh", TreeKind::Bvh),
        ("octree, smallest cube", TreeKind::OctreeSmallest),
        ("octree, pushed down", TreeKind::OctreePushed),
    ];
    let scenes: [(&str, &[&str]); 5] = [
        ("office?n=33", &["corridor", "open", "outside"]),
        ("boxcity", &["street"]),
        ("spheres", &["front"]),
        ("clutter", &["front"]),
        ("hills", &["valley"]),
    ];
    for (spec, cameras) in scenes {
        for (name, tree) in kinds {
            (options.progress)(&format!("trees: {spec}, {name}"));
            let scene = world(spec)?;
            let (build, index) = timed(|| SceneIndex::build(scene, &IndexOptions { tree }));
            for camera in cameras {
                let view = view(index.scene(), camera, (512, 512))?;
                let (time, counters) = frame_ms(&index, &view, &RenderOptions::default(), options)?;
                table.push([
                    Cell::from(spec),
                    (*camera).into(),
                    name.into(),
                    (build.as_secs_f64() * 1e3).into(),
                    (index.memory_bytes() as f64 / f64::from(1 << 20)).into(),
                    time.into(),
                    counters.nodes_visited.into(),
                    counters.nodes_culled.into(),
                    counters.triangles_tested.into(),
                    counters.triangles_drawn.into(),
                ]);
            }
        }
    }
    Ok(())
}
