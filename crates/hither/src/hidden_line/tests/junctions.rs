//! Surfaces whose triangles meet part of the way, the model's own lines, and scenes of very different sizes.

use super::super::{Drawing, FaceColor, Kind, LineOptions, Preparation, PrepareOptions, SectionPlane};
use super::{all_lines, judge, scenes};
use crate::conventions::{Projection, View};
use crate::scene::{Scene, Transform};
use glam::{DQuat, DVec3, Vec3};

fn quad(positions: &mut Vec<Vec3>, triangles: &mut Vec<[u32; 3]>, corners: [[f32; 3]; 4]) {
    let first = positions.len() as u32;
    positions.extend(corners.map(Vec3::from));
    triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| v + first)));
}

/// Rows of bricks in a bond, `rise` out of the plane from row to row; as one mesh.
fn wall(rise: f32) -> Scene {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for row in 0..4u8 {
        let (y, z) = (f32::from(row) * 0.3, [0.0, 1.0, 0.0, 1.0, 0.0].map(|k| k * rise));
        let mut x = 0.0;
        for brick in 0..5u8 {
            let end: f32 =
                if brick == 4 { 2.8 } else { x + if brick == 0 && row % 2 == 1 { 0.35 } else { 0.7 } };
            let end = end.min(2.8);
            if end > x {
                let r = usize::from(row);
                let (z0, z1) = (z[r], z[r + 1]);
                let corners = [[x, y, z0], [end, y, z0], [end, y + 0.3, z1], [x, y + 0.3, z1]];
                quad(&mut positions, &mut triangles, corners);
            }
            x = end;
        }
    }
    let mut scene = Scene::new("wall");
    scenes::add(&mut scene, "wall", positions, triangles, Transform::default());
    scene
}

fn front(scene: &Scene) -> View {
    let center = scene.bounds().unwrap().center();
    let projection = Projection::Orthographic { half_height: 1.5, near: 0.0, far: 10.0 };
    View::look_at(center + DVec3::Z * 2.0, center, DVec3::Y, projection, (500, 400))
}

fn drawn(scene: &Scene, view: &View, options: &LineOptions) -> Drawing {
    Preparation::new(scene, &PrepareOptions::default()).draw(view, options).unwrap()
}

#[test]
fn a_flat_bond_of_bricks_shows_only_its_outline() {
    let scene = wall(0.0);
    let view = front(&scene);
    let options = LineOptions { faces: Some(FaceColor::White), ..all_lines() };
    let drawing = drawn(&scene, &view, &options);
    let outline = 2.0 * (2.8 + 1.2) * view.pixels_per_unit();
    assert!((drawing.visible_length() - outline).abs() < 1e-3, "{} {outline}", drawing.visible_length());
    assert_eq!((drawing.strokes.len(), drawing.faces.len()), (1, 1));
}

#[test]
fn a_folded_bond_of_bricks_is_creased_along_its_rows() {
    let scene = wall(0.2);
    let view = front(&scene);
    let drawing = drawn(&scene, &view, &all_lines());
    let length = |kind| {
        let strokes = drawing.strokes.iter().filter(|s| s.kind == kind);
        let lines = strokes.flat_map(|s| drawing.points_of(s).windows(2));
        lines.map(|w| w[0].distance(w[1])).sum::<f64>() / view.pixels_per_unit()
    };
    assert!((length(Kind::Crease) - 3.0 * 2.8).abs() < 1e-6, "{}", length(Kind::Crease));
    assert!((length(Kind::Boundary) - 8.0).abs() < 1e-6, "{}", length(Kind::Boundary));
    assert_eq!(length(Kind::Contact), 0.0);
}

#[test]
fn bonds_of_bricks_agree_with_dense_sampling() {
    let (mut right, mut wrong) = (0, Vec::new());
    for rise in [0.0, 0.2, -0.35] {
        let mut scene = wall(rise);
        scenes::add_box(&mut scene, "box", [0.5, 0.2, -0.4], [0.9, 0.8, 0.5]);
        scene.groups[0].nodes[0].local = Transform::Trs {
            translation: DVec3::new(0.3, -0.1, 0.2),
            rotation: DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 0.3),
            scale: DVec3::new(1.0, 1.3, 0.8),
        };
        for view in scenes::views(&scene) {
            let score = judge(&scene, &view);
            right += score.right;
            wrong.extend(score.wrong);
        }
    }
    assert!(wrong.is_empty(), "{} wrong of {right}; {:#?}", wrong.len(), &wrong[..wrong.len().min(12)]);
}

/// Two boxes with lines: along an edge, across a face, through the air and through a box.
fn lined() -> Scene {
    let mut scene = Scene::new("lined");
    scenes::add_box(&mut scene, "one", [0.0; 3], [1.0; 3]);
    scenes::add_box(&mut scene, "two", [1.5, 0.0, 0.0], [2.0, 0.5, 1.0]);
    let v = Vec3::new;
    scene.meshes[0].lines = vec![
        [v(0.0, 0.0, 1.0), v(1.0, 0.0, 1.0)],
        [v(0.2, 0.3, 1.0), v(0.8, 0.7, 1.0)],
        [v(-0.5, 0.5, 0.5), v(2.5, 0.6, 0.4)],
    ];
    // A part of lines alone.
    scenes::add(&mut scene, "wire", Vec::new(), Vec::new(), Transform::default());
    scene.meshes[2].lines = vec![[v(-1.0, 1.5, -1.0), v(3.0, 0.2, 2.0)], [v(0.0, 0.0, 0.0); 2]];
    scene.meshes[2].primitives.clear();
    scene
}

#[test]
fn lines_of_the_model_are_drawn_where_they_are_seen() {
    let scene = lined();
    let (mut right, mut wrong) = (0, Vec::new());
    for view in scenes::views(&scene) {
        let score = judge(&scene, &view);
        right += score.right;
        wrong.extend(score.wrong);
    }
    assert!(wrong.is_empty(), "{} wrong of {right}; {:#?}", wrong.len(), &wrong[..wrong.len().min(12)]);
    let view = scenes::views(&scene)[0];
    let marked = |marked: bool| {
        let kinds = super::Kinds { marked, ..super::Kinds::NONE };
        drawn(&scene, &view, &LineOptions { kinds, ..all_lines() })
    };
    assert!(marked(false).strokes.is_empty());
    let lines = marked(true);
    assert!(
        lines.strokes.iter().any(|s| s.part == 2) && lines.strokes.iter().all(|s| s.kind == Kind::Marked)
    );
}

#[test]
fn planes_cut_the_lines_of_the_model() {
    let scene = lined();
    let kinds = super::Kinds { marked: true, ..super::Kinds::NONE };
    let section = SectionPlane { point: DVec3::X * 0.5, normal: DVec3::X };
    let view = front(&scene);
    let options = LineOptions { kinds, sections: vec![section], ..all_lines() };
    let drawing = drawn(&scene, &view, &options);
    let edge = view.width as f64 * 0.5 + (0.5 - scene.bounds().unwrap().center().x) * view.pixels_per_unit();
    let marked = drawing.strokes.iter().filter(|s| s.kind == Kind::Marked);
    let most = marked.flat_map(|s| drawing.points_of(s)).fold(0.0f64, |m, p| m.max(p.x));
    assert!((most - edge).abs() < 1e-6, "{most} {edge}");
}

/// Two millimetre boxes on each other, one pierced by a bar, on a ground of `reach` metres, at `place`.
fn tiny(reach: f32, place: DVec3) -> (Scene, View) {
    let mut scene = Scene::new("tiny");
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let r = reach;
    quad(&mut positions, &mut triangles, [[-r, 0., r], [r, 0., r], [r, 0., -r], [-r, 0., -r]]);
    scenes::add(&mut scene, "ground", positions, triangles, Transform::default());
    let boxes = [
        ([0.0, 0.0, 0.0], [1e-3, 1e-3, 1e-3]),
        ([-3e-4, 3e-4, 3e-4], [1.3e-3, 7e-4, 7e-4]),
        ([0.0, 1e-3, 0.0], [5e-4, 1.5e-3, 5e-4]),
        // Half of it in the ground, and one below.
        ([1.5e-3, -5e-4, 0.0], [2e-3, 5e-4, 1e-3]),
        ([-1.0e-3, -8e-4, 0.0], [-5e-4, -3e-4, 1e-3]),
    ];
    for (min, max) in boxes {
        let (positions, triangles) = scenes::cuboid(min, max);
        let local = Transform::Trs { translation: place, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        scenes::add(&mut scene, "box", positions, triangles, local);
    }
    let projection = Projection::Perspective { fov_y: 0.7, near: 1e-4 };
    let eye = place + DVec3::new(3e-3, 3e-3, 5e-3);
    (scene, View::look_at(eye, place + DVec3::splat(5e-4), DVec3::Y, projection, (500, 400)))
}

#[test]
fn tiny_parts_on_a_huge_ground_are_drawn_as_on_a_small_one() {
    let options = LineOptions { faces: Some(FaceColor::White), ..all_lines() };
    let (small, view) = tiny(0.01, DVec3::ZERO);
    let expected = drawn(&small, &view, &options);
    for reach in [1.0, 1e3, 1e5] {
        let (scene, view) = tiny(reach, DVec3::ZERO);
        let drawing = drawn(&scene, &view, &options);
        let of_boxes = |d: &Drawing| {
            let strokes = d.strokes.iter().filter(|s| s.part > 0);
            strokes.flat_map(|s| d.points_of(s).windows(2)).map(|p| p[0].distance(p[1])).sum::<f64>()
        };
        let (a, b) = (of_boxes(&expected), of_boxes(&drawing));
        assert!((a - b).abs() < 1e-3, "{reach}: {a} and {b}");
        let area =
            |d: &Drawing| d.faces.iter().filter(|f| f.part > 0).map(super::super::Face::area).sum::<f64>();
        let (a, b) = (area(&expected), area(&drawing));
        assert!((a - b).abs() < 1e-3, "{reach}: {a} and {b}");
        let score = judge(&scene, &view);
        assert!(score.wrong.is_empty(), "{reach}: {:#?}", &score.wrong[..score.wrong.len().min(8)]);
        assert!(score.unsure * 4 < score.right, "{reach}: {} of {} unsure", score.unsure, score.right);
    }
}
