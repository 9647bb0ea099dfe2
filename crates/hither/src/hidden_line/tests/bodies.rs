//! What leaving out the backs of bodies must not change.

use super::super::{Drawing, Kind, LineOptions, Preparation, PrepareOptions};
use super::{all_lines, scenes};
use crate::reference::trouble::Random;
use crate::scene::{Scene, Transform};
use glam::{DMat3, DQuat, DVec3, Vec3};
use std::collections::BTreeMap;

/// A ball with a random radius at each of its vertices.
fn boulder(random: &mut Random, rows: u32, roughness: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let columns = rows * 2;
    let id = |i: u32, j: u32| match i {
        0 => 0,
        i if i == rows => 1,
        i => 2 + (i - 1) * columns + j % columns,
    };
    let mut positions = Vec::new();
    let mut put = |t: f64, p: f64| {
        let at = DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos());
        positions.push((at * random.between(1.0 - roughness, 1.0)).as_vec3());
    };
    let angle = |i: u32, of: u32| f64::from(i) / f64::from(of) * std::f64::consts::PI;
    put(0.0, 0.0);
    put(std::f64::consts::PI, 0.0);
    (1..rows).for_each(|i| (0..columns).for_each(|j| put(angle(i, rows), 2.0 * angle(j, columns))));
    let mut triangles = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
            let whole = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
            triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(whole));
        }
    }
    (positions, triangles)
}

/// Boulders that pierce each other, some inside out, some mirrored, some with a hole.
fn boulders(seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut scene = Scene::new("boulders");
    for _ in 0..4 {
        let roughness = if random.one_in(3) { 0.0 } else { random.between(0.0, 0.6) };
        let rows = 3 + random.below(5);
        let (positions, mut triangles) = boulder(&mut random, rows, roughness);
        if random.one_in(3) {
            triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        if random.one_in(4) {
            triangles.pop();
        }
        let turn = DQuat::from_axis_angle(random.point(1.0).normalize_or(DVec3::X), random.between(0.0, 6.0));
        let mirror = if random.one_in(3) { -1.0 } else { 1.0 };
        let scale = DVec3::new(mirror * random.between(0.5, 1.5), 1.0, random.between(0.3, 1.5));
        let map = glam::DAffine3 {
            matrix3: DMat3::from_quat(turn) * DMat3::from_diagonal(scale),
            translation: random.point(1.2),
        };
        scenes::add(&mut scene, "boulder", positions, triangles, Transform::Affine(map));
    }
    scene
}

/// Visible lengths by part and kind.
fn lengths(drawing: &Drawing) -> BTreeMap<(u32, Kind), f64> {
    let mut lengths = BTreeMap::new();
    for s in drawing.strokes.iter().filter(|s| s.covers == 0) {
        let length: f64 = drawing.points_of(s).windows(2).map(|p| p[0].distance(p[1])).sum();
        *lengths.entry((s.part, s.kind)).or_default() += length;
    }
    lengths
}

#[test]
fn backs_that_are_left_out_change_nothing() {
    // Drawings with hidden lines look at every triangle.
    for seed in 0..60 {
        let scene = boulders(seed);
        let preparation = Preparation::new(&scene, &PrepareOptions::default());
        for (k, view) in scenes::views(&scene).iter().enumerate() {
            let fast = preparation.draw(view, &all_lines()).unwrap();
            let full = preparation.draw(view, &LineOptions { hidden: true, ..all_lines() }).unwrap();
            assert!(fast.counters.triangles_live <= full.counters.triangles_live);
            let (fast, full) = (lengths(&fast), lengths(&full));
            let get = |of: &BTreeMap<_, f64>, key| of.get(key).copied().unwrap_or_default();
            for key in fast.keys().chain(full.keys()) {
                let (a, b) = (get(&fast, key), get(&full, key));
                assert!((a - b).abs() < 1e-3, "seed {seed}, view {k}, {key:?}: {a} and {b}");
            }
        }
    }
}

#[test]
fn what_lies_within_a_box_neither_shows_nor_costs() {
    let mut random = Random::new(3);
    let mut scene = Scene::new("chest");
    scenes::add_box(&mut scene, "chest", [-1.0; 3], [1.0; 3]);
    let alone = Preparation::new(&scene, &PrepareOptions::default());
    let count = 300;
    for _ in 0..count {
        let (p, q) = (random.point(0.49).as_vec3(), random.point(0.49).as_vec3());
        scenes::add_box(&mut scene, "within", (p - 0.5).to_array(), (q + 0.5).to_array());
    }
    let full = Preparation::new(&scene, &PrepareOptions::default());
    let views = scenes::views(&scene);
    // The last eye is inside.
    for view in &views[..views.len() - 1] {
        let (alone, full) = (alone.draw(view, &all_lines()).unwrap(), full.draw(view, &all_lines()).unwrap());
        let difference = (alone.visible_length() - full.visible_length()).abs();
        assert!(difference < 1e-3, "{} and {}", alone.visible_length(), full.visible_length());
        // Six triangles of each box turn to the eye; not each is tried with each, in each cell.
        assert!(full.counters.pairs < 1000 * count, "{}", full.counters.pairs);
    }
}
