//! Culling a whole scene: the office, from each of its cameras, in the ways that one may choose.

use super::super::{TableInfo, column, index, view};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::{median_ms, timed};
use hither::conventions::View;
use hither::cull::{CullOptions, Culler};
use hither::{RenderOptions, SceneIndex, render};
use std::collections::HashSet;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "cull-scenes",
    title: "the instances of the office that could be seen, 35,937 modules, 512x512, one thread",
    make,
    columns: &[
        column("camera", "camera", 0),
        column("how", "", 0),
        column("cull_ms", "ms", 2),
        column("found", "found", 0),
        column("seen", "seen", 0),
        column("missing", "seen, not found", 0),
        column("boxes_asked", "boxes asked", 0),
        column("occluder_faces", "faces drawn", 0),
    ],
};

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let index = index("office?n=33")?;
    let usual = CullOptions::default();
    let ways = [
        ("", usual),
        ("coherence", CullOptions { coherence: true, ..usual }),
        ("pixels 4 times as wide", CullOptions { coarseness: Some(4), ..usual }),
        ("margin of 1 cm", CullOptions { eye_moves: 0.01, ..usual }),
    ];
    for camera in ["corridor", "open", "outside"] {
        let view = view(index.scene(), camera, (512, 512))?;
        let seen = seen(&index, &view)?;
        for (how, choice) in &ways {
            (options.progress)(&format!("cull-scenes: {camera} {how}"));
            let mut culler = Culler::new();
            let mut cull = || culler.cull(&index, &view, choice).map_err(|e| e.to_string());
            // Makes occluders ready, and gives coherence a frame to begin with.
            let mut found = cull()?;
            let mut fault = None;
            let cull_ms = median_ms(options, || {
                timed(|| match cull() {
                    Ok(culling) => found = culling,
                    Err(e) => fault = Some(e),
                })
                .0
            });
            if let Some(fault) = fault {
                return Err(fault);
            }
            let visible: HashSet<u32> = found.visible.iter().copied().collect();
            table.push([
                Cell::from(camera),
                (*how).into(),
                cull_ms.into(),
                visible.len().into(),
                seen.len().into(),
                seen.difference(&visible).count().into(),
                found.counters.boxes_asked.into(),
                found.counters.occluder_faces.into(),
            ]);
        }
    }
    table
        .notes
        .push("seen: nearest at some pixel's centre. Peers take 104 to 181 ms for a view, on a".into());
    table.notes.push("Sapphire Rapids Xeon.".into());
    Ok(())
}

/// Instances that are nearest at a pixel's centre.
fn seen(index: &SceneIndex, view: &View) -> Result<HashSet<u32>, String> {
    let frame = render(index, view, &RenderOptions::default()).map_err(|e| e.to_string())?;
    let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
    Ok(pixels.filter_map(|(x, y)| frame.id(x, y)).map(|id| id.instance).collect())
}
