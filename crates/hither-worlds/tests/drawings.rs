//! Three ways to the visible instances that share nothing but the scene: what a picture shows at a pixel's centre has a
//! visible face or line in an exact drawing, and what has one is found by culling.

mod common;

use common::{seen, views};
use hither::cull::{CullOptions, Culler};
use hither::hidden_line::{FaceColor, LineOptions, Preparation, PrepareOptions};
use hither::reference::trouble::Random;
use hither::{IndexOptions, SceneIndex};
use std::collections::HashSet;

/// Worlds of many instances.
const SPECS: &[&str] = &[
    "office?n=3",
    "boxcity?parts=1",
    "clutter?parts=1",
    "spheres?parts=1",
    "lecture",
    "toothpicks?n=400",
    "canyon?grid=7",
];

#[test]
fn pictures_show_no_more_than_drawings_and_drawings_no_more_than_culling_finds() {
    let (mut shown, mut left_out) = (0, 0);
    for (number, spec) in SPECS.iter().enumerate() {
        let mut scene = hither_worlds::generate(spec).unwrap();
        // A drawing takes all surfaces for double-sided.
        scene.materials.iter_mut().for_each(|material| material.double_sided = true);
        let preparation = Preparation::new(&scene, &PrepareOptions::default());
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let random = &mut Random::new(number as u64 + 200);
        let mut culler = Culler::new();
        for view in views(index.scene(), random) {
            let options = LineOptions { faces: Some(FaceColor::White), ..LineOptions::default() };
            let drawing = preparation.draw(&view, &options).unwrap();
            let faces = drawing.faces.iter().map(|face| face.part);
            let lines = drawing.strokes.iter().filter(|stroke| stroke.covers == 0).map(|stroke| stroke.part);
            let exact: HashSet<u32> = faces.chain(lines).collect();
            let missing: Vec<u32> = seen(&index, &view, 1).difference(&exact).copied().collect();
            assert!(
                missing.is_empty(),
                "{spec}, {view:?}: {missing:?} are in the picture, not in the drawing"
            );
            for coarseness in [1, 1 + random.below(4)] {
                let options = CullOptions {
                    coarseness: Some(coarseness),
                    least_occluder_px: 0,
                    ..CullOptions::default()
                };
                let found = culler.cull(&index, &view, &options).unwrap();
                let found: HashSet<u32> = found.visible.into_iter().collect();
                let missing: Vec<u32> = exact.difference(&found).copied().collect();
                assert!(
                    missing.is_empty(),
                    "{spec}, {view:?}, {options:?}: {missing:?} are drawn, not found"
                );
                left_out += index.scene().instance_count() as usize - found.len();
            }
            shown += exact.len();
        }
    }
    assert!(shown > 1000 && left_out > 1000, "{shown} shown, {left_out} left out");
}
