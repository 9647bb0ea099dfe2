//! Who sees what: ids and depth at every pixel's centre, from scratch each frame, on one thread.

use super::{Frames, SIZES, TableInfo, column, view, world};
use crate::Options;
use crate::peers::{Peer, Sighting, obvhs::Obvhs};
use crate::report::{Cell, Table};
use crate::timing::{Sample, median_ms, medians_ms, timed};
use hither::conventions::View;
use hither::reference::zbuffer;
use hither::render::{Algorithm, Frame, RenderOptions, render};
use hither::{IndexOptions, SceneIndex};
use std::collections::HashSet;
use std::time::Duration;

pub(crate) const INFO: TableInfo = TableInfo {
    name: "exact",
    title: "ids and depth at pixel centres, one thread, ms a frame",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("camera", "camera", 0),
        column("size", "size", 0),
        column("hzb_ms", "hzb", 2),
        column("zbuffer_ms", "z-buffer", 1),
        column("reference_ms", "textbook", 1),
        column("obvhs_ms", "obvhs", 1),
        column("embree_ms", "Embree", 1),
        column("zbuffer_ratio", "z-buffer/hzb", 1),
        column("obvhs_ratio", "obvhs/hzb", 1),
        column("embree_ratio", "Embree/hzb", 2),
        column("visible_triangles", "seen", 0),
        column("same_id_percent", "same id %", 2),
        column("same_distance_percent", "same distance %", 2),
    ],
};

/// Scenes, and the cameras they are measured from.
const SCENES: [(&str, &[&str]); 6] = [
    ("office?n=33", &["corridor", "open", "outside"]),
    ("boxcity", &["street"]),
    ("spheres", &["front"]),
    ("clutter", &["front"]),
    ("hills", &["valley"]),
    ("hills?polygons=5000000", &["open"]),
];

/// Above this many triangles in all the textbook z-buffer takes minutes.
const TEXTBOOK_LIMIT: u64 = 10_000_000;

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    for (spec, cameras) in SCENES {
        let scene = world(spec)?;
        let textbook = options.slow || scene.instanced_triangle_count() < TEXTBOOK_LIMIT;
        (options.progress)(&format!("exact: building the trees of {spec}"));
        let peers = Peers::build(&scene, table);
        let index = SceneIndex::build(scene, &IndexOptions::default());
        for camera in cameras {
            for size in SIZES {
                let view = view(index.scene(), camera, size)?;
                (options.progress)(&format!("exact: {spec} {camera} {}x{}", size.0, size.1));
                let mut row: Vec<Cell> =
                    vec![spec.into(), (*camera).into(), format!("{}x{}", size.0, size.1).into()];
                row.extend(measure(&index, &view, &peers, textbook, options)?);
                table.push(row);
            }
        }
    }
    table
        .notes
        .push("seen: distinct triangles in the picture. same: shares of the pixels in which the last".into());
    table
        .notes
        .push("peer measured finds the same triangle, or the same distance to 1 in 10,000, as hzb.".into());
    Ok(())
}

struct Peers {
    obvhs: Obvhs,
    embree: Option<Box<dyn Peer>>,
}

impl Peers {
    fn build(scene: &hither::Scene, table: &mut Table) -> Peers {
        let mut note = |text: String| {
            if !table.notes.contains(&text) {
                table.notes.push(text);
            }
        };
        let obvhs = Obvhs::build(scene);
        #[cfg(feature = "embree")]
        let embree = match crate::peers::embree::Embree::build(scene) {
            Ok(embree) => {
                note(embree.name());
                Some(Box::new(embree) as Box<dyn Peer>)
            }
            Err(fault) => {
                note(fault.to_string());
                None
            }
        };
        #[cfg(not(feature = "embree"))]
        let embree = {
            note("Embree was not measured: this program was built without feature `embree`.".to_owned());
            None
        };
        Peers { obvhs, embree }
    }
}

fn measure(
    index: &SceneIndex,
    view: &View,
    peers: &Peers,
    textbook: bool,
    options: &Options,
) -> Result<Vec<Cell>, String> {
    let hierarchical = RenderOptions::default();
    let plain = RenderOptions { algorithm: Algorithm::ZBuffer, ..hierarchical };
    let (mut ours, mut plain) = (Frames::new(index, view, &hierarchical), Frames::new(index, view, &plain));
    // The last peer's is compared with ours.
    let (mut of_obvhs, mut of_embree) = (Sighting::default(), Sighting::default());
    let mut no_peer = || Duration::ZERO;
    let mut embree = peers.embree.as_ref().map(|e| || e.frame(view, 1, &mut of_embree));
    let [hzb, zbuffer, obvhs, embree_ms] = medians_ms(
        options,
        [
            &mut || ours.sample(),
            &mut || plain.sample(),
            &mut || peers.obvhs.frame(view, 1, &mut of_obvhs),
            embree.as_mut().map_or(&mut no_peer as Sample, |sample| sample),
        ],
    );
    let embree = peers.embree.as_ref().map(|_| embree_ms);
    ours.counters()?;
    plain.counters()?;
    let reference = textbook.then(|| median_ms(options, || timed(|| zbuffer::draw(index.scene(), view)).0));
    let sighting = if embree.is_some() { of_embree } else { of_obvhs };
    let frame = render(index, view, &RenderOptions::default()).map_err(|e| e.to_string())?;
    let agreement = sighting.agreement(&frame);
    Ok(vec![
        hzb.into(),
        zbuffer.into(),
        reference.into(),
        obvhs.into(),
        embree.into(),
        (zbuffer / hzb).into(),
        (obvhs / hzb).into(),
        embree.map(|e| e / hzb).into(),
        distinct_triangles(&frame).into(),
        (agreement.same_id * 100.0).into(),
        (agreement.same_distance * 100.0).into(),
    ])
}

fn distinct_triangles(frame: &Frame) -> usize {
    let (width, height) = (frame.view.width, frame.view.height);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.filter_map(|(x, y)| frame.id(x, y)).collect::<HashSet<_>>().len()
}
