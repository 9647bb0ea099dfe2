//! Culling: the occlusion buffer on the worlds and boxes that other buffers are measured on.

mod scenes;
mod truth;

pub(crate) use scenes::INFO as OF_SCENES;

use super::{TableInfo, column, view, world};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::{median_ms, timed};
use glam::DAffine3;
use hither::conventions::View;
use hither::cull::{Boxes, Occluder, OcclusionBuffer, OcclusionOptions, Verdict};
use hither::{IndexOptions, Scene, SceneIndex};

pub(crate) const INFO: TableInfo = TableInfo {
    name: "cull",
    title: "what is hidden: a conservative occlusion buffer, 100,000 boxes asked, one thread",
    make,
    columns: &[
        column("scene", "scene", 0),
        column("size", "size", 0),
        column("draw_ms", "draw ms", 3),
        column("parts_ms", "shuffled ms", 3),
        column("ask_millions", "M boxes/s", 1),
        column("in_view", "in view", 0),
        column("hidden", "truly hidden", 0),
        column("false_visible", "false visible %", 3),
        column("ideal_false_visible", "of an ideal image %", 3),
        column("false_hidden", "false hidden", 0),
        column("best_peer_ms", "best peer ms", 2),
        column("best_peer_false_visible", "its false visible %", 2),
    ],
};

/// A draw time in milliseconds, and a share of false-visible boxes in percent.
type PeerFigures = (f64, f64);

/// Scene, camera, and the best peer's figures at each size, as measured on another machine.
const SCENES: [(&str, &str, [PeerFigures; 2]); 3] = [
    ("boxcity", "street", [(0.59, 0.5), (0.21, 1.5)]),
    ("clutter", "front", [(2.3, 4.0), (1.0, 7.0)]),
    ("spheres", "front", [(12.8, 15.0), (10.8, 22.0)]),
];

const SIZES: [(u32, u32); 2] = [(1920, 1080), (512, 512)];

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    for (spec, camera, peers) in SCENES {
        (options.progress)(&format!("cull: preparing {spec}"));
        let scene = world(spec)?;
        let bounds = hither_worlds::occludees(spec).unwrap_or_default();
        let boxes: Boxes = bounds.iter().copied().collect();
        let occluder = Occluder::of_mesh(&scene.meshes[0], &scene.materials);
        let parts = shuffled_parts(&world(&format!("{spec}?parts=1"))?);
        let index = SceneIndex::build(scene, &IndexOptions::default());
        for (size, peer) in SIZES.into_iter().zip(peers) {
            (options.progress)(&format!("cull: {spec} {}x{}", size.0, size.1));
            let view = view(index.scene(), camera, size)?;
            let measured = measure(&view, &occluder, &parts, &boxes, options)?;
            let truth = truth::of_boxes(&index, &view, &bounds)?;
            let in_view = measured.verdicts.iter().filter(|v| **v != Verdict::Outside).count();
            let pairs = || measured.verdicts.iter().zip(&truth);
            let false_visible = pairs().filter(|(v, t)| **v == Verdict::Visible && t.is_hidden).count();
            let false_hidden = pairs().filter(|(v, t)| **v == Verdict::Hidden && !t.is_hidden).count();
            let hidden = pairs().filter(|(v, t)| **v != Verdict::Outside && t.is_hidden).count();
            let left_by_ideal =
                pairs().filter(|(v, t)| **v != Verdict::Outside && t.is_hidden && !t.is_found).count();
            table.push([
                Cell::from(spec),
                format!("{}x{}", size.0, size.1).into(),
                measured.draw_ms.into(),
                measured.parts_ms.into(),
                measured.ask_millions.into(),
                in_view.into(),
                hidden.into(),
                (false_visible as f64 * 100.0 / in_view as f64).into(),
                (left_by_ideal as f64 * 100.0 / in_view as f64).into(),
                false_hidden.into(),
                peer.0.into(),
                peer.1.into(),
            ]);
        }
    }
    table.notes.push(
        "draw: clear, then the scene as one occluder. shuffled: each object an occluder of its own, in"
            .into(),
    );
    table.notes.push(
        "a random order; the verdicts are the same. False visible: in view, truly hidden, not found to"
            .into(),
    );
    table.notes.push(
        "be; share of those in view. Truth: 4x4 samples a pixel. Peers: the best of Intel's MSOC and".into(),
    );
    table.notes.push(
        "RAWR, measured on a Sapphire Rapids Xeon; neither is conservative. Of an ideal image: what".into(),
    );
    table
        .notes
        .push("one would leave that holds in each pixel the farthest of its samples, asked the same.".into());
    Ok(())
}

struct Measured {
    draw_ms: f64,
    parts_ms: f64,
    ask_millions: f64,
    verdicts: Vec<Verdict>,
}

fn measure(
    view: &View,
    occluder: &Occluder,
    parts: &[Occluder],
    boxes: &Boxes,
    options: &Options,
) -> Result<Measured, String> {
    let choice = OcclusionOptions::default();
    let mut buffer = OcclusionBuffer::new(view, &choice).map_err(|e| e.to_string())?;
    let here = DAffine3::IDENTITY;
    let parts_ms = median_ms(options, || {
        timed(|| {
            buffer.clear();
            parts.iter().for_each(|part| {
                buffer.draw(part, &here);
            });
        })
        .0
    });
    let mut shuffled = Vec::new();
    buffer.ask(boxes, &mut shuffled);
    let draw_ms = median_ms(options, || {
        timed(|| {
            buffer.clear();
            buffer.draw(occluder, &here);
        })
        .0
    });
    let mut verdicts = Vec::new();
    let ask_ms = median_ms(options, || timed(|| buffer.ask(boxes, &mut verdicts)).0);
    if shuffled != verdicts {
        return Err("the order of drawing changed a verdict".into());
    }
    Ok(Measured { draw_ms, parts_ms, ask_millions: boxes.len() as f64 / ask_ms / 1e3, verdicts })
}

/// Every object as an occluder, in the order of a shuffle with a fixed seed.
fn shuffled_parts(scene: &Scene) -> Vec<Occluder> {
    let mut parts: Vec<Occluder> =
        scene.meshes.iter().map(|mesh| Occluder::of_mesh(mesh, &scene.materials)).collect();
    let mut state = 99u64;
    for i in (1..parts.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        parts.swap(i, (state >> 33) as usize % (i + 1));
    }
    parts
}
