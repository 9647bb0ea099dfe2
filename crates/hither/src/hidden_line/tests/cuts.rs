//! Bodies cut by planes, and surfaces that are seen through.

use super::super::{Drawing, Face, FaceColor, Kind, LineOptions, Preparation, PrepareOptions, SectionPlane};
use super::{all_lines, scenes};
use crate::conventions::{Projection, View};
use crate::reference::trouble::Random;
use crate::scene::{AlphaMode, Material, Scene, Transform};
use glam::{DVec2, DVec3, Vec3, Vec4};

/// Looks at a scene along −Z, 100 pixels to a unit.
fn front(scene: &Scene) -> View {
    let center = scene.bounds().unwrap().center();
    let projection = Projection::Orthographic { half_height: 3.0, near: 0.0, far: 100.0 };
    View::look_at(center + DVec3::Z * 20.0, center, DVec3::Y, projection, (600, 600))
}

fn draw(scene: &Scene, sections: &[SectionPlane]) -> Drawing {
    let preparation = Preparation::new(scene, &PrepareOptions::default());
    let (sections, faces) = (sections.to_vec(), Some(FaceColor::Material));
    let options = LineOptions { sections, faces, transparent_hides: false, ..all_lines() };
    preparation.draw(&front(scene), &options).unwrap()
}

fn cut_area(drawing: &Drawing) -> f64 {
    drawing.faces.iter().filter(|f| f.cut).map(Face::area).sum::<f64>() / 1e4
}

fn length(drawing: &Drawing, kind: Kind) -> f64 {
    let lines = drawing.strokes.iter().filter(|s| s.kind == kind && s.covers == 0);
    lines.flat_map(|s| drawing.points_of(s).windows(2)).map(|p| p[0].distance(p[1])).sum::<f64>() / 100.0
}

fn plane(point: DVec3, normal: DVec3) -> SectionPlane {
    SectionPlane { point, normal }
}

/// Boxes as one mesh; one that is `hollow` winds inwards.
fn boxes(list: &[([f32; 3], [f32; 3], bool)]) -> Scene {
    let mut scene = Scene::new("boxes");
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for &(min, max, hollow) in list {
        let first = positions.len() as u32;
        let (p, t) = scenes::cuboid(min, max);
        positions.extend(p);
        let turned = |t: [u32; 3]| if hollow { [t[0], t[2], t[1]] } else { t };
        triangles.extend(t.into_iter().map(|t| turned(t).map(|v| v + first)));
    }
    scenes::add(&mut scene, "boxes", positions, triangles, Transform::default());
    scene
}

#[test]
fn shells_of_a_mesh_overlap_and_are_hollow() {
    let middle = [plane(DVec3::ZERO, DVec3::Z)];
    let overlap = boxes(&[([-2., -1., -1.], [1., 1., 1.], false), ([-1., -2., -1.], [2., 2., 1.], false)]);
    let drawing = draw(&overlap, &middle);
    assert!((cut_area(&drawing) - (6.0 + 12.0 - 4.0)).abs() < 1e-9, "{}", cut_area(&drawing));
    let hollow = boxes(&[([-2.; 3], [2.; 3], false), ([-1.; 3], [1.; 3], true)]);
    let drawing = draw(&hollow, &middle);
    assert!((cut_area(&drawing) - 12.0).abs() < 1e-9);
    assert!((length(&drawing, Kind::Section) - 24.0).abs() < 1e-9);
}

#[test]
fn a_body_with_a_face_the_wrong_way_round_is_closed_all_the_same() {
    let mut scene = boxes(&[([-2.; 3], [2.; 3], false), ([-1.; 3], [1.; 3], false)]);
    scene.meshes[0].triangles[3].swap(0, 1);
    scene.meshes[0].triangles[6].swap(0, 1);
    let drawing = draw(&scene, &[plane(DVec3::ZERO, DVec3::Z)]);
    assert!((cut_area(&drawing) - 12.0).abs() < 1e-9, "{}", cut_area(&drawing));
}

#[test]
fn an_open_body_has_an_outline_and_no_cap() {
    let mut scene = boxes(&[([-1.; 3], [1.; 3], false)]);
    // Without its left side.
    scene.meshes[0].triangles.drain(0..2);
    scene.meshes[0].primitives[0].triangles.end -= 2;
    let drawing = draw(&scene, &[plane(DVec3::ZERO, DVec3::Z)]);
    assert_eq!(cut_area(&drawing), 0.0);
    assert!((length(&drawing, Kind::Section) - 6.0).abs() < 1e-9);
}

#[test]
fn two_planes_cut_each_others_caps() {
    let scene = boxes(&[([-2.; 3], [2.; 3], false)]);
    let front = plane(DVec3::ZERO, DVec3::Z);
    let right = plane(DVec3::X, DVec3::X);
    let slant = plane(DVec3::ZERO, DVec3::new(0.0, 1.0, 1.0));
    for planes in [[front, right], [right, front]] {
        let drawing = draw(&scene, &planes);
        assert!((cut_area(&drawing) - 12.0).abs() < 1e-9, "{}", cut_area(&drawing));
        assert!((length(&drawing, Kind::Section) - 14.0).abs() < 1e-9, "{}", length(&drawing, Kind::Section));
    }
    for planes in [[front, slant], [slant, front]] {
        // Below the line where they meet the front cut, above it the slanted one, as high on the paper.
        let drawing = draw(&scene, &planes);
        assert!((cut_area(&drawing) - 16.0).abs() < 1e-9, "{}", cut_area(&drawing));
        assert!((length(&drawing, Kind::Section) - 20.0).abs() < 1e-9, "{}", length(&drawing, Kind::Section));
    }
}

#[test]
fn planes_along_faces_cut_the_same_from_everywhere() {
    let mut scene = Scene::new("storeys");
    for (name, min, max) in [
        ("low", [0.3, 0.0, 0.2], [1.3, 1.0, 1.2]),
        ("up", [0.5, 1.0, 0.4], [0.9, 2.0, 0.7]),
        ("beside", [2.0, 1.0, 0.2], [3.0, 2.0, 1.2]),
    ] {
        scenes::add_box(&mut scene, name, min, max);
    }
    let preparation = Preparation::new(&scene, &PrepareOptions::default());
    let random = &mut Random::new(5);
    let level = |up: f64| plane(DVec3::Y, DVec3::Y * up);
    for round in 0..120 {
        // From above, where the upper half is taken away, or from below.
        let up = if round % 2 == 0 { 1.0 } else { -1.0 };
        let eye =
            DVec3::new(random.between(-4., 4.), 1.0 + up * random.between(1., 5.), random.between(-4., 4.));
        let projection = match round % 3 {
            0 => Projection::Orthographic { half_height: 3.0, near: 0.0, far: 100.0 },
            _ => Projection::Perspective { fov_y: 1.5, near: 0.01 },
        };
        let view = View::look_at(eye, DVec3::new(1.3, 1.0, 0.7), DVec3::Z, projection, (500, 500));
        let draw = |sections: Vec<SectionPlane>| {
            let options = LineOptions { sections, faces: Some(FaceColor::White), ..all_lines() };
            preparation.draw(&view, &options).unwrap()
        };
        let drawing = draw(vec![level(up)]);
        let cut: &[u32] = if up > 0.0 { &[0] } else { &[1, 2] };
        let caps: Vec<u32> = drawing.faces.iter().filter(|f| f.cut).map(|f| f.part).collect();
        assert_eq!(caps, cut, "{view:?}");
        assert!(drawing.faces.iter().all(|f| cut.contains(&f.part)), "{view:?}");
        assert!(drawing.strokes.iter().all(|s| cut.contains(&s.part)), "{view:?}");
        let twice = draw(vec![level(up), level(up)]);
        let area = |d: &Drawing| d.faces.iter().map(Face::area).sum::<f64>();
        assert!((area(&drawing) - area(&twice)).abs() < 1e-6 * area(&drawing), "{view:?}");
        let lengths = [length(&drawing, Kind::Section), length(&twice, Kind::Section)];
        assert!((lengths[0] - lengths[1]).abs() < 1e-9 && lengths[0] > 0.1, "{view:?}: {lengths:?}");
    }
}

#[test]
fn a_sheet_in_a_cutting_plane_stays() {
    let mut scene = Scene::new("sheet");
    let corners = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]].map(Vec3::from).to_vec();
    scenes::add(&mut scene, "sheet", corners, vec![[0, 1, 2], [0, 2, 3]], Transform::default());
    for normal in [DVec3::Z, DVec3::NEG_Z] {
        let drawing = draw(&scene, &[plane(DVec3::ZERO, normal)]);
        assert!((drawing.faces.iter().map(Face::area).sum::<f64>() / 1e4 - 4.0).abs() < 1e-9);
        assert_eq!(cut_area(&drawing), 0.0);
    }
}

#[test]
fn what_is_too_far_away_for_f64_to_tell_stays_on_the_paper() {
    for size in [1e12, 1e14, 1e16, 1e18, 1e25f32] {
        let scene = boxes(&[([-0.5 * size; 3], [0.5 * size; 3], false)]);
        let preparation = Preparation::new(&scene, &PrepareOptions::default());
        let size = f64::from(size);
        for eye in [DVec3::new(2.7, 4.5, -1.004), DVec3::new(2.0, 3.0, 4.0) * size, DVec3::ONE * 0.2 * size] {
            let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
            let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, projection, (64, 48));
            let sections = vec![plane(DVec3::X * 0.1 * size, DVec3::X)];
            let options = LineOptions { sections, faces: Some(FaceColor::White), ..all_lines() };
            let drawing = preparation.draw(&view, &options).unwrap();
            let near = |p: &DVec2| (p.x - 32.0).abs() < 33.1 && (p.y - 24.0).abs() < 25.1;
            assert!(drawing.points.iter().all(near), "{size}, {eye}: {:?}", drawing.points);
        }
    }
}

#[test]
fn a_cut_through_a_hundred_thousand_triangles_is_capped() {
    let mut scene = Scene::new("ball");
    let rows = 230;
    scenes::ball(&mut scene, "ball", DVec3::ZERO, 2.0, rows);
    let drawing = draw(&scene, &[plane(DVec3::ZERO, DVec3::new(0.0, 0.1, 1.0))]);
    let circle = std::f64::consts::PI * 4.0 / 1.01f64.sqrt();
    assert!((cut_area(&drawing) / circle - 1.0).abs() < 1e-3, "{} {circle}", cut_area(&drawing));
    // Nothing of the outline is hidden, however thin the pieces are that the plane leaves along it. On the paper
    // the circle is an ellipse, nearly.
    let around = std::f64::consts::TAU * 2.0 * (1.0 + 1.0 / 1.01f64.sqrt()) * 0.5;
    let outline = length(&drawing, Kind::Section);
    assert!((outline / around - 1.0).abs() < 1e-3, "{outline} {around}");
}

/// A red wall behind a blue pane, half of which is behind a green one; the panes pass through each other.
fn panes() -> Scene {
    let mut scene = Scene::new("panes");
    let quad = |scene: &mut Scene, corners: [[f32; 3]; 4], color: Vec4, alpha: AlphaMode| {
        let material = Material { base_color: color, alpha, double_sided: true, ..Material::default() };
        scene.materials.push(material);
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        scenes::add(scene, "quad", corners.map(Vec3::from).to_vec(), triangles, Transform::default());
        let last = scene.meshes.len() - 1;
        scene.meshes[last].primitives[0].material = Some(last as u32);
    };
    let wall = [[-2., -2., 0.], [2., -2., 0.], [2., 2., 0.], [-2., 2., 0.]];
    quad(&mut scene, wall, Vec4::new(1., 0., 0., 1.), AlphaMode::Opaque);
    let pane = [[-1., -1., 1.], [2.5, -1., 1.], [2.5, 1., 1.], [-1., 1., 1.]];
    quad(&mut scene, pane, Vec4::new(0., 0., 1., 0.5), AlphaMode::Blend);
    let slanted = [[-1., -1., 0.5], [1., -1., 1.5], [1., 1., 1.5], [-1., 1., 0.5]];
    quad(&mut scene, slanted, Vec4::new(0., 1., 0., 0.25), AlphaMode::Blend);
    // Of these nothing shows.
    let before = [[-2., -2., 3.], [2., -2., 3.], [2., 2., 3.], [-2., 2., 3.]];
    quad(&mut scene, before, Vec4::new(1., 1., 1., 0.0), AlphaMode::Blend);
    quad(&mut scene, before, Vec4::new(1., 1., 1., 0.4), AlphaMode::Mask { cutoff: 0.5 });
    scene
}

#[test]
fn panes_tint_what_is_behind_them() {
    let drawing = draw(&panes(), &[]);
    let mut found: Vec<(u32, Vec<u32>, f64)> = drawing
        .faces
        .iter()
        .map(|f| (f.part, f.through.clone(), (f.area() / 1e4 * 1e9).round() / 1e9))
        .collect();
    found.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
    let expected = [
        (0, vec![], 16.0 - 6.0),
        (0, vec![1], 2.0),
        (0, vec![1, 2], 2.0),
        (0, vec![2, 1], 2.0),
        (1, vec![], 1.0),
    ];
    assert_eq!(found, expected);
    assert!((length(&drawing, Kind::Intersection) - 2.0).abs() < 1e-9);
    let of = |through: &[u32]| drawing.faces.iter().find(|f| f.part == 0 && f.through == through).unwrap();
    // Half blue over red; linear halves are 188.
    assert_eq!((of(&[1]).color, of(&[1]).opacity), ([188, 0, 188], 1.0));
    assert_ne!(of(&[1, 2]).color, of(&[2, 1]).color);
    let alone = drawing.faces.iter().find(|f| f.part == 1).unwrap();
    assert_eq!((alone.color, alone.opacity), ([0, 0, 255], 0.5));
    assert_eq!(alone.color_on_white(), [128, 128, 255]);
}
