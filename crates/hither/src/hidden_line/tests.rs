//! Whole drawings against dense sampling by rays, and what must not change a drawing.

mod bodies;
mod cuts;
mod flats;
mod junctions;
mod scenes;

use super::{Drawing, Kinds, LineOptions, Preparation, PrepareOptions};
use crate::conventions::{Projection, View};
use crate::reference::lines::{Line, LineOracle, Verdict};
use crate::reference::trouble;
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// A sample is drawn if a stroke passes this near, pixels.
const NEAR_PX: f64 = 2e-3;

/// Strokes by cell, to ask what is drawn at a place.
struct Paper<'a> {
    drawing: &'a Drawing,
    cells: std::collections::HashMap<[i64; 2], Vec<([DVec2; 2], u32)>>,
}

impl Paper<'_> {
    fn new(drawing: &Drawing) -> Paper<'_> {
        let mut paper = Paper { drawing, cells: Default::default() };
        for s in &drawing.strokes {
            for p in drawing.points_of(s).windows(2) {
                let steps = (p[0].distance(p[1]) * 4.0).ceil().max(1.0) as i64;
                let mut last = None;
                for i in 0..=steps {
                    let cell = Self::cell(p[0].lerp(p[1], i as f64 / steps as f64));
                    if last != Some(cell) {
                        paper.cells.entry(cell).or_default().push(([p[0], p[1]], s.covers));
                        last = Some(cell);
                    }
                }
            }
        }
        paper
    }

    fn cell(p: DVec2) -> [i64; 2] {
        [p.x.floor() as i64, p.y.floor() as i64]
    }

    /// Covers of the strokes that pass near `p` in about the direction `d`.
    fn at(&self, p: DVec2, d: DVec2) -> Vec<u32> {
        let [x, y] = Self::cell(p);
        let mut found = Vec::new();
        for cell in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y])) {
            for ([a, b], covers) in self.cells.get(&cell).into_iter().flatten() {
                let step = *b - *a;
                let length = step.length();
                let along = (p - *a).dot(step) / length;
                let near = (p - *a).perp_dot(step).abs() / length <= NEAR_PX;
                let parallel =
                    d.perp_dot(step).abs() <= 0.05 * length * d.length() || length.min(d.length()) < 0.05;
                if near && parallel && along >= -NEAR_PX && along <= length + NEAR_PX {
                    found.push(*covers);
                }
            }
        }
        found
    }
}

#[derive(Default, Debug)]
struct Score {
    right: usize,
    unsure: usize,
    wrong: Vec<String>,
}

const SAMPLES: usize = 23;

/// Every sample of every line against the drawing.
fn check_lines(oracle: &LineOracle, lines: &[Line], paper: &Paper, score: &mut Score) {
    let (w, h) = (paper.drawing.width, paper.drawing.height);
    for line in lines {
        let [a, b] = line.ends.map(|e| oracle.on_paper(e));
        if a.distance(b) < 1e-3 {
            continue;
        }
        for i in 0..SAMPLES {
            let u = (i as f64 + 0.37) / SAMPLES as f64;
            let p = oracle.on_paper(line.ends[0].lerp(line.ends[1], u));
            if p.x < 0.01 || p.y < 0.01 || p.x > w - 0.01 || p.y > h - 0.01 {
                continue;
            }
            let drawn = paper.at(p, b - a).contains(&0);
            match oracle.look(line, u) {
                Verdict::Unsure => score.unsure += 1,
                Verdict::Visible if !drawn => score.wrong.push(format!("missing at {p}: {line:?} {u}")),
                // Something visible may be drawn at the same place; the other direction tells.
                _ => score.right += 1,
            }
        }
    }
}

/// Every sample of every visible stroke must lie on a line that is seen there.
fn check_strokes(oracle: &LineOracle, lines: &[Line], drawing: &Drawing, score: &mut Score) {
    let ends: Vec<[DVec2; 2]> = lines.iter().map(|l| l.ends.map(|e| oracle.on_paper(e))).collect();
    for s in drawing.strokes.iter().filter(|s| s.covers == 0) {
        for w in drawing.points_of(s).windows(2) {
            for i in 0..5 {
                let p = w[0].lerp(w[1], (f64::from(i) + 0.41) / 5.0);
                let mut verdicts = Vec::new();
                for (line, [a, b]) in lines.iter().zip(&ends) {
                    let step = *b - *a;
                    let t = (p - *a).dot(step) / step.length_squared();
                    if !(-1e-6..=1.0 + 1e-6).contains(&t)
                        || (p - *a).perp_dot(step).abs() > NEAR_PX * step.length()
                    {
                        continue;
                    }
                    verdicts.push(oracle.look(line, along(oracle, line, t.clamp(0.0, 1.0))));
                }
                if verdicts.contains(&Verdict::Visible) {
                    score.right += 1;
                } else if verdicts.contains(&Verdict::Unsure) {
                    score.unsure += 1;
                } else {
                    score.wrong.push(format!("{:?} of part {} drawn at {p}: {verdicts:?}", s.kind, s.part));
                }
            }
        }
    }
}

/// The place on a line in space that is drawn at `t` of it on the paper.
fn along(oracle: &LineOracle, line: &Line, t: f64) -> f64 {
    let [a, b] = line.ends;
    let (pa, pb) = (oracle.on_paper(a), oracle.on_paper(b));
    let target = pa.lerp(pb, t);
    // In perspective depth is not linear on the paper: solve for the place by its position along the line.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        let here = oracle.on_paper(a.lerp(b, mid));
        if (here - pa).dot(pb - pa) < (target - pa).dot(pb - pa) { low = mid } else { high = mid }
    }
    0.5 * (low + high)
}

fn all_lines() -> LineOptions {
    LineOptions { crease_angle: 0.0, ..LineOptions::default() }
}

fn judge(scene: &Scene, view: &View) -> Score {
    let preparation = Preparation::new(scene, &PrepareOptions::default());
    let drawing = preparation.draw(view, &all_lines()).unwrap();
    let oracle = LineOracle::new(scene, view, preparation.tolerance());
    let mut lines = oracle.edges(super::edges::FLAT);
    lines.extend(oracle.meetings());
    let mut score = Score::default();
    check_lines(&oracle, &lines, &Paper::new(&drawing), &mut score);
    check_strokes(&oracle, &lines, &drawing, &mut score);
    score
}

#[test]
fn drawings_agree_with_dense_sampling_on_troublesome_scenes() {
    let (mut right, mut unsure) = (0, 0);
    let mut wrong = Vec::new();
    let scenes = scenes::bodies();
    let crossing = |name: &str| ["crossing", "corner"].contains(&name);
    let random = &mut trouble::Random::new(3);
    for (name, scene) in scenes.iter().filter(|s| crossing(s.0)) {
        for _ in 0..30 {
            let eye = random.point(4.0);
            let projection = Projection::Orthographic { half_height: 4.0, near: -20.0, far: 20.0 };
            let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, projection, (61, 53));
            let (r, u) = judge_faces(name, scene, &view);
            right += r;
            unsure += u;
        }
    }
    for seed in 0..60 {
        let scene = trouble::scene(seed);
        if scene.bounds().is_none_or(|b| b.size().max_element() > 200.0)
            || scene.instanced_triangle_count() > 600
        {
            continue;
        }
        let mut view = trouble::view(seed);
        (view.width, view.height) = (view.width * 10, view.height * 10);
        let score = judge(&scene, &view);
        right += score.right;
        unsure += score.unsure;
        wrong.extend(score.wrong.into_iter().map(|w| format!("seed {seed}: {w}")));
    }
    assert!(wrong.is_empty(), "{} wrong of {right}; {:#?}", wrong.len(), &wrong[..wrong.len().min(12)]);
    assert!(unsure * 20 < right, "{unsure} unsure, {right} right");
}

#[test]
fn drawings_agree_with_dense_sampling_on_bodies_that_touch() {
    let (mut right, mut unsure) = (0, 0);
    let mut wrong = Vec::new();
    for (name, scene) in scenes::bodies() {
        for (v, view) in scenes::views(&scene).into_iter().enumerate() {
            let score = judge(&scene, &view);
            right += score.right;
            unsure += score.unsure;
            wrong.extend(score.wrong.into_iter().map(|w| format!("{name} {v}: {w}")));
        }
    }
    assert!(wrong.is_empty(), "{} wrong of {right}; {:#?}", wrong.len(), &wrong[..wrong.len().min(12)]);
    assert!(unsure * 4 < right, "{unsure} unsure, {right} right");
}

#[test]
fn covers_are_what_rays_count() {
    let (mut right, mut wrong) = (0, Vec::new());
    for (name, scene) in scenes::bodies() {
        for view in scenes::views(&scene) {
            let preparation = Preparation::new(&scene, &PrepareOptions::default());
            let options = LineOptions { hidden: true, ..all_lines() };
            let drawing = preparation.draw(&view, &options).unwrap();
            let oracle = LineOracle::new(&scene, &view, preparation.tolerance());
            let paper = Paper::new(&drawing);
            for line in oracle.edges(super::edges::FLAT) {
                let [a, b] = line.ends.map(|e| oracle.on_paper(e));
                for i in 0..9 {
                    let u = (f64::from(i) + 0.37) / 9.0;
                    let p = oracle.on_paper(line.ends[0].lerp(line.ends[1], u));
                    if p.min_element() < 0.01 || p.x > drawing.width - 0.01 || p.y > drawing.height - 0.01 {
                        continue;
                    }
                    let covers = match oracle.look(&line, u) {
                        Verdict::Visible => 0,
                        Verdict::Hidden(n) => n,
                        Verdict::Unsure => continue,
                    };
                    // A line with fewer covers may be drawn in its stead.
                    if a.distance(b) > 1e-3 && !paper.at(p, b - a).iter().any(|&c| c <= covers) {
                        wrong.push(format!("{name} at {p}: {covers} but {:?}", paper.at(p, b - a)));
                    }
                    right += 1;
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong of {right}; {:#?}", wrong.len(), &wrong[..wrong.len().min(12)]);
}

#[test]
fn threads_and_the_order_of_parts_do_not_change_the_drawing() {
    for (name, scene) in scenes::bodies().into_iter().chain([("many", scenes::many_triangles())]) {
        let view = scenes::views(&scene)[0];
        let draw = |scene: &Scene, threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let preparation = Preparation::new(scene, &PrepareOptions::default());
                preparation.draw(&view, &all_lines()).unwrap()
            })
        };
        let one = draw(&scene, 1);
        let two = draw(&scene, 2);
        assert_eq!(one.strokes, two.strokes, "{name}");
        assert_eq!(one.points, two.points, "{name}");
        let mut turned = scene.clone();
        turned.groups[0].nodes.reverse();
        for mesh in &mut turned.meshes {
            mesh.triangles.reverse();
        }
        let turned = draw(&turned, 1);
        let difference = (one.visible_length() - turned.visible_length()).abs();
        assert!(difference < 1e-4 * one.visible_length().max(1.0), "{name}: {difference}");
    }
}

#[test]
fn kinds_can_be_asked_for_one_by_one() {
    let (_, scene) = scenes::bodies().remove(0);
    let view = scenes::views(&scene)[0];
    let preparation = Preparation::new(&scene, &PrepareOptions::default());
    let draw = |kinds| preparation.draw(&view, &LineOptions { kinds, ..all_lines() }).unwrap();
    assert!(draw(Kinds::NONE).strokes.is_empty());
    let lines = draw(Kinds { silhouette: true, ..Kinds::NONE });
    assert!(!lines.strokes.is_empty());
    assert!(lines.strokes.iter().all(|s| s.kind == super::Kind::Silhouette));
    let lines = draw(Kinds { intersection: true, ..Kinds::NONE });
    assert!(lines.strokes.iter().all(|s| s.kind == super::Kind::Intersection));
    assert!(!lines.strokes.is_empty());
}

/// The faces at a point.
fn faces_at(drawing: &Drawing, p: DVec2) -> Vec<&super::Face> {
    let inside = |face: &&super::Face| {
        let mut crossings = 0;
        for c in &face.contours {
            for (i, &a) in c.iter().enumerate() {
                let b = c[(i + 1) % c.len()];
                if (a.y <= p.y) != (b.y <= p.y) && a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)) > p.x {
                    crossings += 1;
                }
            }
        }
        crossings % 2 == 1
    };
    drawing.faces.iter().filter(inside).collect()
}

fn judge_faces(name: &str, scene: &Scene, view: &View) -> (usize, usize) {
    let preparation = Preparation::new(scene, &PrepareOptions::default());
    let options = LineOptions { faces: Some(super::FaceColor::White), kinds: Kinds::NONE, ..all_lines() };
    let drawing = preparation.draw(view, &options).unwrap();
    let oracle = LineOracle::new(scene, view, preparation.tolerance());
    let (mut right, mut unsure) = (0, 0);
    for y in 0..view.height {
        for x in 0..view.width {
            let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some(seen) = oracle.seen_at(p) else {
                unsure += 1;
                continue;
            };
            let found = faces_at(&drawing, p);
            let parts: Vec<u32> = found.iter().map(|f| f.part).collect();
            let expected: Vec<u32> = seen.iter().map(|s| s.0).collect();
            assert_eq!(parts, expected, "{name} at {p}");
            if let (Some(face), Some((part, triangles))) = (found.first(), &seen) {
                let same =
                    |t: &u32| oracle.in_one_plane(*part, [*t, face.triangle], 4.0 * super::edges::FLAT);
                assert!(
                    triangles.iter().any(same),
                    "{name} at {p}: {} is not of {triangles:?}",
                    face.triangle
                );
            }
            right += 1;
        }
    }
    // They share borders: put together they are as large as each for itself.
    let all: Vec<Vec<Vec<DVec2>>> = drawing.faces.iter().map(|f| f.contours.clone()).collect();
    let sum: f64 = drawing.faces.iter().map(super::Face::area).sum();
    let together: f64 = super::arrangement::merged(&all)
        .iter()
        .map(|p| {
            let (through, color, contours) = (Vec::new(), [0; 3], p.clone());
            super::Face { part: 0, through, triangle: 0, cut: false, color, opacity: 1.0, contours }.area()
        })
        .sum();
    assert!((sum - together).abs() <= 1e-9 * sum.max(1.0), "{name}: {sum} and {together}");
    (right, unsure)
}

#[test]
fn faces_are_what_rays_see_and_tile() {
    let (mut right, mut unsure) = (0, 0);
    for (name, scene) in scenes::bodies() {
        for mut view in scenes::views(&scene) {
            (view.width, view.height) = (101, 83);
            let (r, u) = judge_faces(name, &scene, &view);
            right += r;
            unsure += u;
        }
    }
    for seed in 0..60 {
        let scene = trouble::scene(seed);
        if scene.bounds().is_none_or(|b| b.size().max_element() > 200.0)
            || scene.instanced_triangle_count() > 600
        {
            continue;
        }
        let mut view = trouble::view(seed);
        (view.width, view.height) = (71, 57);
        let (r, u) = judge_faces(&format!("seed {seed}"), &scene, &view);
        right += r;
        unsure += u;
    }
    assert!(unsure * 100 < right, "{unsure} unsure, {right} right");
}

#[test]
fn faces_far_from_the_origin_are_those_of_the_same_scene_around_it() {
    let moved = |scene: &Scene, by: f32| {
        let mut scene = scene.clone();
        scene.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p += by);
        scene
    };
    let draw = |scene: &Scene, mut view: View| {
        (view.width, view.height) = (101, 83);
        let options = LineOptions { faces: Some(super::FaceColor::White), kinds: Kinds::NONE, ..all_lines() };
        Preparation::new(scene, &PrepareOptions::default()).draw(&view, &options).unwrap()
    };
    let (mut differ, mut all) = (0, 0);
    for seed in 0..20 {
        for far in [8192.0, 65536.0] {
            // The same to the last bit but for where it is; what is far away is known less exactly.
            let far_scene = moved(&scenes::rods(seed), far);
            let near_scene = moved(&far_scene, -far);
            for (near, far) in scenes::views(&near_scene).into_iter().zip(scenes::views(&far_scene)) {
                let (near, far) = (draw(&near_scene, near), draw(&far_scene, far));
                for (x, y) in (0..101).flat_map(|x| (0..83).map(move |y| (x, y))) {
                    let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let part = |drawing| faces_at(drawing, p).first().map(|f| f.part);
                    differ += usize::from(part(&near) != part(&far));
                    all += 1;
                }
            }
        }
    }
    assert!(differ * 10_000 < all, "{differ} of {all}");
}

#[test]
fn the_faces_of_a_convex_body_are_as_large_as_its_outline() {
    let (positions, triangles) = scenes::cuboid([0.0; 3], [1.0, 0.7, 1.3]);
    let mut scene = Scene::new("box");
    scenes::add(&mut scene, "box", positions.clone(), triangles, crate::scene::Transform::default());
    let mut judged = 0;
    for view in scenes::views(&scene) {
        let preparation = Preparation::new(&scene, &PrepareOptions::default());
        let options = LineOptions { faces: Some(super::FaceColor::White), ..all_lines() };
        let drawing = preparation.draw(&view, &options).unwrap();
        let oracle = LineOracle::new(&scene, &view, preparation.tolerance());
        let on_paper = |p: &glam::Vec3| oracle.on_paper(view.view_from_world.transform_point3(p.as_dvec3()));
        // The hull by its definition: sides with all points to their left.
        let mut points: Vec<DVec2> = Vec::new();
        for p in positions.iter().map(on_paper) {
            if points.iter().all(|q| q.distance(p) > 1e-6) {
                points.push(p);
            }
        }
        let size = DVec2::new(drawing.width, drawing.height);
        if points.iter().any(|p| p.cmplt(DVec2::ZERO).any() || p.cmpgt(size).any()) {
            continue;
        }
        judged += 1;
        let mut twice = 0.0;
        for a in &points {
            for b in points.iter().filter(|b| *b != a) {
                let side = |p: &DVec2| (*b - *a).perp_dot(*p - *a);
                let ends = |p: &DVec2| (*p - *a).dot(*p - *b) <= 0.0;
                if points.iter().all(|p| side(p) > 1e-9 || (side(p).abs() <= 1e-9 && ends(p))) {
                    twice += a.perp_dot(*b);
                }
            }
        }
        let sum: f64 = drawing.faces.iter().map(super::Face::area).sum();
        assert!((sum - twice * 0.5).abs() < 1e-9 * sum, "{sum} {}", twice * 0.5);
    }
    assert!(judged >= 3);
}

#[test]
fn a_cut_body_shows_its_cap_and_its_outline() {
    let mut scene = Scene::new("cut");
    scenes::add_box(&mut scene, "box", [0.0; 3], [2.0; 3]);
    let view = scenes::views(&scene)[2];
    let section = super::SectionPlane { point: DVec3::Z * 0.5, normal: DVec3::Z };
    let preparation = Preparation::new(&scene, &PrepareOptions::default());
    let options = LineOptions {
        sections: vec![section],
        faces: Some(super::FaceColor::White),
        hatch: Some(7.0),
        ..all_lines()
    };
    let drawing = preparation.draw(&view, &options).unwrap();
    assert_eq!(drawing.faces.len(), 1);
    assert!(drawing.faces[0].cut);
    let scale = view.pixels_per_unit();
    assert!((drawing.faces[0].area() - 4.0 * scale * scale).abs() < 1e-6);
    let of = |kind| drawing.strokes.iter().filter(|s| s.kind == kind).count();
    assert_eq!(of(super::Kind::Section), 1);
    assert!(of(super::Kind::Hatch) > 10);
}

#[test]
fn the_outline_of_a_cut_is_not_hidden_by_its_own_cap() {
    for (name, scene) in scenes::bodies().into_iter().filter(|(name, _)| *name != "sheets") {
        let at = scene.bounds().unwrap().center() + 0.013;
        let section = super::SectionPlane { point: at, normal: DVec3::new(0.2, 0.9, 0.3) };
        for view in &scenes::views(&scene)[..2] {
            let options = LineOptions { sections: vec![section], hidden: true, ..all_lines() };
            let preparation = Preparation::new(&scene, &PrepareOptions::default());
            let drawing = preparation.draw(view, &options).unwrap();
            let cut: Vec<_> = drawing.strokes.iter().filter(|s| s.kind == super::Kind::Section).collect();
            assert!(!cut.is_empty() && cut.iter().all(|s| s.covers == 0), "{name}: {cut:?}");
        }
    }
}

#[test]
fn nothing_to_see_is_an_empty_drawing() {
    let (_, scene) = scenes::bodies().remove(0);
    let mut view = scenes::views(&scene)[0];
    view.view_from_world = glam::DAffine3::from_translation(DVec3::X * 100.0);
    let preparation = Preparation::new(&scene, &PrepareOptions::default());
    let options = LineOptions { faces: Some(super::FaceColor::Flat), hatch: Some(3.0), ..all_lines() };
    let drawing = preparation.draw(&view, &options).unwrap();
    assert!(drawing.strokes.is_empty() && drawing.faces.is_empty());
    let empty = Preparation::new(&Scene::new("empty"), &PrepareOptions::default());
    assert!(empty.draw(&view, &options).unwrap().strokes.is_empty());
}

#[test]
fn a_million_coincident_edges_are_drawn_once() {
    let mut scene = Scene::new("copies");
    let (positions, triangles) = scenes::cuboid([0.0; 3], [1.0; 3]);
    // One mesh with the box thousands of times: every edge has tens of thousands of triangles.
    let many: Vec<[u32; 3]> = (0..14_000).flat_map(|_| triangles.iter().copied()).collect();
    scenes::add(&mut scene, "copies", positions.clone(), many, crate::scene::Transform::default());
    // And the same as instances.
    for _ in 0..300 {
        scenes::add(
            &mut scene,
            "copy",
            positions.clone(),
            triangles.clone(),
            crate::scene::Transform::default(),
        );
    }
    let view = scenes::views(&scene)[0];
    let preparation = Preparation::new(&scene, &PrepareOptions::default());
    let kinds = Kinds { intersection: false, contact: false, ..Kinds::ALL };
    let drawing = preparation.draw(&view, &LineOptions { kinds, ..all_lines() }).unwrap();
    let mut single = Scene::new("one");
    scenes::add_box(&mut single, "box", [0.0; 3], [1.0; 3]);
    let one = Preparation::new(&single, &PrepareOptions::default()).draw(&view, &all_lines()).unwrap();
    assert_eq!(drawing.strokes.len(), one.strokes.len());
    assert!((drawing.visible_length() - one.visible_length()).abs() < 1e-3);
}

#[test]
fn rigid_motion_of_scene_and_eye_does_not_change_the_drawing() {
    for (name, scene) in scenes::bodies() {
        let motion = glam::DAffine3::from_rotation_translation(
            glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1),
            DVec3::new(1.5, -2.0, 0.7),
        );
        let mut moved = scene.clone();
        for node in &mut moved.groups[0].nodes {
            node.local = crate::scene::Transform::Affine(motion * node.local.matrix());
        }
        for view in scenes::views(&scene) {
            let mut from_there = view;
            from_there.view_from_world = view.view_from_world * motion.inverse();
            let length = |scene: &Scene, view: &View| {
                let preparation = Preparation::new(scene, &PrepareOptions::default());
                preparation.draw(view, &all_lines()).unwrap().visible_length()
            };
            let (a, b) = (length(&scene, &view), length(&moved, &from_there));
            assert!((a - b).abs() < 1e-4 * a, "{name}: {a} and {b}");
        }
    }
}

#[test]
fn edges_that_touch_at_the_origin_are_seen() {
    let bodies = scenes::bodies();
    let scene = &bodies.iter().find(|s| s.0 == "corner").unwrap().1;
    let preparation = Preparation::new(scene, &PrepareOptions::default());
    let random = &mut trouble::Random::new(3);
    // The edges of the three sides of the cube that are towards the eye.
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1));
    let edges: Vec<[DVec3; 2]> = (0..8u32)
        .flat_map(|k| [1, 2, 4].map(|bit| [k, k | bit]))
        .filter(|[a, b]| a != b && !(a | 2 == 7 && b | 2 == 7) && ![[1, 5], [4, 5]].contains(&[*a, *b]))
        .map(|[a, b]| [corner(a), corner(b)])
        .collect();
    assert_eq!(edges.len(), 9);
    for round in 0..100 {
        let eye = DVec3::new(-random.between(1., 6.), random.between(1.1, 5.), -random.between(1., 6.));
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view = View::look_at(eye, DVec3::splat(0.5), DVec3::Y, projection, (1280, 720));
        let on_paper = |p: DVec3| {
            let p = view.view_from_world.transform_point3(p);
            p.truncate() / -p.z * view.pixels_per_unit()
        };
        let expected: f64 = edges.iter().map(|[a, b]| on_paper(*a).distance(on_paper(*b))).sum();
        let drawing = preparation.draw(&view, &all_lines()).unwrap();
        let of_cube = drawing.strokes.iter().filter(|s| s.part == 0 && s.covers == 0);
        let length: f64 =
            of_cube.flat_map(|s| drawing.points_of(s).windows(2)).map(|w| w[0].distance(w[1])).sum();
        assert!((length - expected).abs() < 1e-6 * expected, "round {round}: {eye} {length} {expected}");
    }
}
