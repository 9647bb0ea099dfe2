//! The two witnesses, which share no code, agree at every pixel of troublesome scenes.

use super::{Caster, Judgement, trouble, zbuffer};
use crate::conventions::View;
use crate::scene::Scene;
use proptest::prelude::*;

/// Judges every pixel of the z-buffer by the ray caster; returns how many agree and how many are excused.
fn compare(scene: &Scene, view: &View) -> Result<(usize, usize), String> {
    let drawing = zbuffer::draw(scene, view);
    let caster = Caster::new(scene, view);
    let (mut agreed, mut excused) = (0, 0);
    for y in 0..view.height {
        for x in 0..view.width {
            match caster.probe(x, y).judge(drawing.seen(x, y)) {
                Judgement::Agrees => agreed += 1,
                Judgement::Excused => excused += 1,
                Judgement::Wrong(why) => return Err(why),
            }
        }
    }
    Ok((agreed, excused))
}

#[test]
fn witnesses_agree_and_few_pixels_need_an_excuse() {
    let (mut agreed, mut excused) = (0, 0);
    for seed in 0..300 {
        let scene = trouble::scene(seed);
        scene.validate().unwrap();
        let view = trouble::view(seed);
        view.validate().unwrap();
        let (a, e) = compare(&scene, &view).unwrap_or_else(|why| panic!("seed {seed}: {why}"));
        agreed += a;
        excused += e;
    }
    assert!(excused * 200 < agreed, "{excused} pixels excused, {agreed} agreed");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn witnesses_agree(scene_seed: u64, view_seed: u64) {
        let (scene, view) = (trouble::scene(scene_seed), trouble::view(view_seed));
        prop_assert!(compare(&scene, &view).is_ok(), "{}", compare(&scene, &view).unwrap_err());
    }
}
