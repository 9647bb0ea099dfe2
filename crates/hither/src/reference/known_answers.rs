//! Both witnesses on scenes whose answers can be worked out by hand, and the judge on wrong answers.

use super::{Caster, Judgement, Probe, trouble, zbuffer};
use crate::conventions::{Projection, SurfaceId, View};
use crate::scene::{AlphaMode, Content, Material, Mesh, Node, Primitive, Scene, Transform};
use glam::{DVec3, Vec3, Vec4};

/// Triangles that each cover a 16 × 16 image from 4 m in front of the eye and farther, as `wall` has them.
fn walls(walls: &[(f32, Option<u32>)]) -> Scene {
    let mut scene = Scene::new("walls");
    scene.materials = vec![
        Material { double_sided: true, ..Material::default() },
        Material { alpha: AlphaMode::Blend, ..Material::default() },
        Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..Material::default() },
    ];
    let mut mesh = Mesh::default();
    for (i, &(z, material)) in walls.iter().enumerate() {
        let i = i as u32;
        mesh.positions.extend([[-99.0, -99.0, z], [99.0, -99.0, z], [0.0, 99.0, z]].map(Vec3::from));
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        mesh.primitives.push(Primitive { triangles: i..i + 1, material });
    }
    scene.meshes.push(mesh);
    scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
    scene
}

fn pinhole(direction: DVec3) -> View {
    let lens = Projection::Perspective { fov_y: 1.0, near: 1.0 };
    View::look_at(DVec3::ZERO, direction, DVec3::Y, lens, (16, 16))
}

fn probe(scene: &Scene, view: &View) -> Probe {
    Caster::new(scene, view).probe(5, 6)
}

/// What both witnesses see at a pixel: the triangle and the distance.
fn seen(scene: &Scene, view: &View) -> Option<(u32, f64)> {
    let found = probe(scene, view).nearest().map(|m| (m.id.triangle, m.distance));
    let drawn = zbuffer::draw(scene, view).seen(5, 6);
    let drawn = drawn.map(|(id, depth)| (id.triangle, view.projection.distance(depth)));
    assert_eq!(found.map(|f| f.0), drawn.map(|d| d.0));
    if let (Some(f), Some(d)) = (found, drawn) {
        assert!((f.1 - d.1).abs() < 1e-5, "{} m and {} m", f.1, d.1);
    }
    found
}

fn id(triangle: u32) -> SurfaceId {
    SurfaceId { instance: 0, triangle }
}

#[test]
fn the_nearest_wall_is_seen_and_the_near_plane_cuts() {
    assert_eq!(
        seen(&walls(&[(-8.0, None), (-4.0, None), (-6.0, None)]), &pinhole(DVec3::NEG_Z)),
        Some((1, 4.0))
    );
    assert_eq!(
        seen(&walls(&[(-8.0, None), (-0.9, None), (3.0, Some(0))]), &pinhole(DVec3::NEG_Z)),
        Some((0, 8.0))
    );
    assert_eq!(seen(&walls(&[(-1.0, None)]), &pinhole(DVec3::NEG_Z)), Some((0, 1.0)));
    assert_eq!(seen(&walls(&[]), &pinhole(DVec3::NEG_Z)), None);
}

#[test]
fn backs_are_seen_only_of_two_sided_surfaces() {
    let backwards = pinhole(DVec3::Z);
    assert_eq!(seen(&walls(&[(4.0, None), (5.0, Some(0))]), &backwards), Some((1, 5.0)));
}

#[test]
fn a_mirrored_instance_keeps_its_facing() {
    let mut scene = walls(&[(-4.0, None)]);
    scene.groups[0].nodes[0].local = Transform::Trs {
        translation: DVec3::ZERO,
        rotation: glam::DQuat::IDENTITY,
        scale: DVec3::new(-1.0, 1.0, 1.0),
    };
    assert_eq!(seen(&scene, &pinhole(DVec3::NEG_Z)), Some((0, 4.0)));
    let turned = Transform::Trs {
        translation: DVec3::ZERO,
        rotation: glam::DQuat::IDENTITY,
        scale: DVec3::new(1.0, 1.0, -1.0),
    };
    scene.groups[0].nodes[0].local = turned;
    // Mirrored to behind the eye: looking there, one sees the side that faced the eye before.
    assert_eq!(seen(&scene, &pinhole(DVec3::Z)), Some((0, 4.0)));
    assert_eq!(seen(&scene, &pinhole(DVec3::NEG_Z)), None);
}

#[test]
fn a_parallel_view_sees_from_its_near_plane_to_its_far_plane() {
    let parallel = |near, far| {
        let lens = Projection::Orthographic { half_height: 2.0, near, far };
        View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, lens, (16, 16))
    };
    let scene = walls(&[(-8.0, None), (2.0, None), (-4.0, None)]);
    assert_eq!(seen(&scene, &parallel(0.0, 9.0)), Some((2, 4.0)));
    assert_eq!(seen(&scene, &parallel(-3.0, 9.0)), Some((1, -2.0)));
    assert_eq!(seen(&scene, &parallel(5.0, 9.0)), Some((0, 8.0)));
    assert_eq!(seen(&scene, &parallel(0.0, 4.0)), None);
}

#[test]
fn the_smaller_id_wins_a_tie() {
    let scene = walls(&[(-8.0, None), (-4.0, None), (-4.0, None)]);
    assert_eq!(seen(&scene, &pinhole(DVec3::NEG_Z)), Some((1, 4.0)));
}

#[test]
fn holes_are_looked_through() {
    let mut scene = walls(&[(-4.0, Some(2)), (-6.0, None)]);
    scene.materials[2].base_color = Vec4::new(1.0, 1.0, 1.0, 0.4);
    assert_eq!(seen(&scene, &pinhole(DVec3::NEG_Z)), Some((1, 6.0)));
    scene.materials[2].base_color.w = 0.5;
    assert_eq!(seen(&scene, &pinhole(DVec3::NEG_Z)), Some((0, 4.0)));
}

#[test]
fn blended_surfaces_hide_nothing_and_are_listed_nearest_first() {
    let scene = walls(&[(-5.0, Some(1)), (-6.0, None), (-4.0, Some(1)), (-7.0, Some(1))]);
    let view = pinhole(DVec3::NEG_Z);
    assert_eq!(seen(&scene, &view), Some((1, 6.0)));
    let tints: Vec<u32> = probe(&scene, &view).tints().map(|m| m.id.triangle).collect();
    assert_eq!(tints, [2, 0]);
}

#[test]
fn the_judge_accepts_the_truth_and_nothing_else() {
    let scene = walls(&[(-8.0, None), (-4.0, None), (-4.0, None)]);
    let probe = probe(&scene, &pinhole(DVec3::NEG_Z));
    assert_eq!(probe.judge(Some((id(1), 0.25))), Judgement::Agrees);
    for wrong in [
        None,
        Some((id(2), 0.25)),
        Some((id(0), 0.125)),
        Some((id(1), 0.2501)),
        Some((id(7), 0.25)),
        Some((id(1), f32::NAN)),
    ] {
        assert!(matches!(probe.judge(wrong), Judgement::Wrong(_)), "{wrong:?}");
    }
    assert_eq!(probe.second_distance(), 4.0);
    assert!(probe.edge_distance_px() > 10.0);
}

#[test]
fn an_edge_within_a_256th_of_a_pixel_excuses_either_answer() {
    // The right edge of the triangle passes 0.002 pixels beside the centre of pixel (5, 6).
    let view = View::look_at(
        DVec3::ZERO,
        DVec3::NEG_Z,
        DVec3::Y,
        Projection::Orthographic { half_height: 8.0, near: 0.0, far: 10.0 },
        (16, 16),
    );
    for (offset, excused) in [(0.002, true), (-0.002, true), (0.01, false), (-0.01, false)] {
        let mut scene = walls(&[(-4.0, None)]);
        let x = -2.5 + offset;
        scene.meshes[0].positions = [[x - 9.0, 0.0, -4.0], [x, -20.0, -4.0], [x, 20.0, -4.0]]
            .map(|p: [f32; 3]| Vec3::from(p))
            .to_vec();
        let probe = probe(&scene, &view);
        let truth = probe.nearest().map(|m| (m.id, 0.6f32));
        let other = if truth.is_some() { None } else { Some((id(0), 0.6)) };
        assert_eq!(truth.is_some(), offset > 0.0);
        assert_eq!(probe.judge(truth), Judgement::Agrees, "{offset}");
        assert_eq!(probe.judge(other) == Judgement::Excused, excused, "{offset}");
    }
}

#[test]
fn a_shared_edge_is_drawn_exactly_once() {
    // A sheet larger than the view: every centre is covered by one triangle, also where edges pass through it.
    let mut random = trouble::Random::new(3);
    for round in 0..200 {
        let mut scene = Scene::new("sheet");
        let mut mesh = Mesh::default();
        for i in 0..81u8 {
            let (x, y) = (f32::from(i % 9) - 4.0, f32::from(i / 9) - 4.0);
            let stir = if round % 2 == 0 { 0.0 } else { 0.15 };
            let mut off = || random.between(-stir, stir) as f32;
            mesh.positions.push(Vec3::new(x + off(), y + off(), -3.0 + off()));
        }
        for i in 0..64u32 {
            let a = i / 8 * 9 + i % 8;
            mesh.triangles.extend([[a, a + 1, a + 10], [a, a + 10, a + 9]]);
        }
        mesh.primitives.push(Primitive { triangles: 0..128, material: None });
        scene.meshes.push(mesh);
        scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
        let lens = if round % 4 < 2 {
            Projection::Orthographic { half_height: 2.0, near: 0.0, far: 10.0 }
        } else {
            Projection::Perspective { fov_y: 1.0, near: [0.5, 2.9][round / 4 % 2] }
        };
        let tilt = DVec3::new(random.between(-0.1, 0.1), random.between(-0.1, 0.1), -1.0);
        let tilt = if round % 3 == 0 { DVec3::NEG_Z } else { tilt };
        let view = View::look_at(DVec3::ZERO, tilt, DVec3::Y, lens, (32, 32));
        let drawing = zbuffer::draw(&scene, &view);
        let seen = drawing.depth.iter().filter(|&&d| d > 0.0).count() as u64;
        // The near plane may cut the front off, but what is covered is covered once.
        assert_eq!(drawing.work.samples_covered, seen, "round {round}");
        if view.projection.near() < 1.0 {
            assert_eq!(seen, 32 * 32, "round {round}");
        }
    }
}
