//! An eye that moves: what is remembered, more occluders, and threads change no answer for the worse.

use super::{scene_of, wall};
use crate::cull::planes::{Amount, PlaneCuller, PlanesOptions};
use crate::reference::trouble::{self, Random};
use crate::scene::Scene;
use glam::DVec3;

/// Walls here and there, some of which meet.
fn maze(seed: u64) -> Scene {
    let random = &mut Random::new(seed);
    let mut walls = Vec::new();
    for _ in 0..120 {
        let at = |random: &mut Random| random.between(-20.0, 20.0).round();
        let (mut x, mut z) = (at(random), at(random));
        for _ in 0..1 + random.below(4) {
            let step = random.between(1.0, 5.0).round() * if random.one_in(2) { 1.0 } else { -1.0 };
            let (nx, nz) = if random.one_in(2) { (x + step, z) } else { (x, z + step) };
            walls.push(wall(x, z, nx, nz));
            (x, z) = (nx, nz);
        }
    }
    scene_of(&walls)
}

fn walk(random: &mut Random) -> Vec<DVec3> {
    let mut eye = DVec3::new(0.3, 1.6, 0.2);
    let mut eyes = Vec::new();
    for _ in 0..12 {
        let step = random.point(1.0) * DVec3::new(1.0, 0.1, 1.0) * [0.02, 0.2, 1.0][random.below(3) as usize];
        for _ in 0..10 {
            eyes.push(eye);
            eye += step;
        }
    }
    eyes
}

#[test]
fn what_is_remembered_changes_no_answer() {
    for seed in 0..8 {
        let scene = if seed % 2 == 0 { maze(seed) } else { trouble::scene(seed) };
        let options = PlanesOptions {
            occluders: Amount::Fixed(24),
            leaf_polygons: Amount::Fixed(3),
            fusion: false,
            ..PlanesOptions::default()
        };
        let mut culler = PlaneCuller::new(&scene, &options);
        let (mut remembered, mut visited) = (0, 0);
        for (i, eye) in walk(&mut Random::new(seed)).into_iter().enumerate() {
            let here = culler.look_around(eye).unwrap();
            let anew = PlaneCuller::new(&scene, &options).look_around(eye).unwrap();
            assert_eq!(here.visible, anew.visible, "seed {seed} eye {i}");
            remembered += here.work.nodes_remembered;
            visited += here.work.nodes_visited;
        }
        assert!(remembered * 8 > visited, "seed {seed}: {remembered} of {visited}");
    }
}

#[test]
fn more_tests_and_more_occluders_hide_no_less() {
    for seed in 0..4 {
        let scene = maze(seed);
        let of = |occluders, connected, fusion| PlanesOptions {
            occluders: Amount::Fixed(occluders),
            leaf_polygons: Amount::Fixed(3),
            connected,
            fusion,
            ..PlanesOptions::default()
        };
        for eye in walk(&mut Random::new(seed)).into_iter().step_by(20) {
            let mut fewest = usize::MAX;
            for options in
                [of(16, false, false), of(16, true, false), of(64, true, false), of(64, true, true)]
            {
                let visible = PlaneCuller::new(&scene, &options).look_around(eye).unwrap().visible.len();
                assert!(visible <= fewest, "seed {seed} {options:?}: {visible} after {fewest}");
                fewest = visible;
            }
        }
    }
}

#[test]
fn answers_do_not_depend_on_threads() {
    for seed in 0..2 {
        let scene = maze(seed);
        let of = |threads| {
            let leaf_polygons = Amount::Fixed(2);
            let options = PlanesOptions { threads, leaf_polygons, ..PlanesOptions::default() };
            let mut culler = PlaneCuller::new(&scene, &options);
            let looks =
                walk(&mut Random::new(seed)).into_iter().map(move |eye| culler.look_around(eye).unwrap());
            looks.collect::<Vec<_>>()
        };
        let one = of(1);
        assert!(one.iter().any(|c| c.visible.len() < 200));
        assert_eq!(one, of(2));
        assert_eq!(one, of(3));
    }
}
