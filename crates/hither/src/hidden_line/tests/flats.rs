//! Crowds of triangles in one plane are not tried pair by pair.

use super::all_lines;
use super::scenes;
use crate::conventions::{Projection, View};
use crate::hidden_line::{Drawing, Kind, Preparation, PrepareOptions};
use crate::scene::{Scene, Transform};
use glam::{DQuat, DVec3, Vec3};

const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 0.8, near: 0.05 };

fn draw(scene: &Scene, eye: DVec3) -> Drawing {
    let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, PERSPECTIVE, (1280, 720));
    Preparation::new(scene, &PrepareOptions::default()).draw(&view, &all_lines()).unwrap()
}

fn rim(n: u32) -> Vec<Vec3> {
    let at = |k: u32| f64::from(k) / f64::from(n) * std::f64::consts::TAU;
    (0..n).map(|k| DVec3::new(at(k).cos(), 0.0, at(k).sin()).as_vec3()).collect()
}

/// A disc as a fan of so many triangles, around a corner of its rim or its middle, which is the origin.
fn disc(scene: &mut Scene, n: u32, around_middle: bool, local: Transform) {
    let mut positions = rim(n);
    let triangles = if around_middle {
        positions.push(Vec3::ZERO);
        (0..n).map(|k| [n, k, (k + 1) % n]).collect()
    } else {
        (1..n - 1).map(|k| [0, k, k + 1]).collect()
    };
    scenes::add(scene, "disc", positions, triangles, local);
}

/// A comb's teeth, each a sliver from the same long edge up, that share no corners.
fn teeth(scene: &mut Scene, n: u32) {
    let mut positions = Vec::new();
    for k in 0..n {
        let x = (k as f32 / n as f32 - 0.5) * 2.0;
        positions.extend([Vec3::new(-1.0, -0.5, 0.0), Vec3::new(x, 0.5, 0.0)]);
        positions.push(Vec3::new(x + 0.5 / n as f32, 0.5, 0.0));
    }
    let triangles = (0..n).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    scenes::add(scene, "teeth", positions, triangles, Transform::default());
}

/// Adds so many triangles.
type Crowd<'a> = &'a dyn Fn(&mut Scene, u32);

/// Four times the triangles are far less than sixteen times the pairs.
#[test]
fn pairs_of_slivers_in_one_plane_are_not_tried() {
    let turned = Transform::Affine(glam::DAffine3::from_rotation_translation(
        DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.4),
        DVec3::new(0.2, -0.1, 0.3),
    ));
    let crowds: [(&str, Crowd); 4] = [
        ("fan around its rim", &|scene, n| disc(scene, n, false, Transform::default())),
        ("fan around the origin", &|scene, n| disc(scene, n, true, Transform::default())),
        ("turned fan", &|scene, n| disc(scene, n, false, turned)),
        ("teeth", &teeth),
    ];
    for (name, crowd) in crowds {
        let pairs = |n: u32| {
            let mut scene = Scene::new(name);
            crowd(&mut scene, n);
            draw(&scene, DVec3::new(0.4, 1.1, 2.0)).counters.pairs
        };
        let (few, many) = (pairs(500), pairs(2000));
        assert!(many < 10 * few && many < 200_000, "{name}: {few}, and of four times as many {many}");
    }
}

/// What a flat leaves out is only what lies in it: a blade that stands in a fan meets every triangle that it crosses.
#[test]
fn what_passes_through_a_flat_still_meets_it() {
    for around_middle in [false, true] {
        let mut scene = Scene::new("blade");
        disc(&mut scene, 1000, around_middle, Transform::default());
        let corners = [[-0.5, -0.3], [0.5, -0.3], [0.5, 0.4], [-0.5, 0.4]];
        let blade = corners.map(|[x, y]| Vec3::new(x, y, 0.31)).to_vec();
        scenes::add(&mut scene, "blade", blade, vec![[0, 1, 2], [0, 2, 3]], Transform::default());
        let eye = DVec3::new(0.0, 1.1, 2.0);
        let drawing = draw(&scene, eye);
        let met = drawing.strokes.iter().filter(|s| s.kind == Kind::Intersection && s.covers == 0);
        let length: f64 =
            met.flat_map(|s| drawing.points_of(s).windows(2)).map(|w| w[0].distance(w[1])).sum();
        let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, PERSPECTIVE, (1280, 720));
        let on_paper = |x: f64| {
            let p = view.view_from_world.transform_point3(DVec3::new(x, 0.0, f64::from(0.31f32)));
            p.truncate() / -p.z * view.pixels_per_unit()
        };
        let expected = on_paper(-0.5).distance(on_paper(0.5));
        assert!((length - expected).abs() < 1e-3, "{around_middle}: {length} for {expected}");
    }
}
