//! The zero far from the origin, around the eye, and with boxes of every shape: what f32 cannot tell is never hidden.

use super::*;

/// Metres from the origin to where the eye is.
const AWAY: [f64; 9] = [0.0, 1e2, 1e3, 1e4, 1e5, 1e6, 5.5e6, 1e8, 1e12];

fn lens(random: &mut Random) -> Projection {
    if random.one_in(4) {
        Projection::Orthographic { half_height: random.between(0.5, 30.0), near: 0.1, far: 1e4 }
    } else {
        Projection::Perspective {
            fov_y: random.between(0.2, 2.5),
            near: [1e-3, 0.1, 1.0][random.below(3) as usize],
        }
    }
}

fn some_eye(random: &mut Random, away: f64) -> View {
    let eye = random.point(1.0).normalize_or(DVec3::X) * away + random.point(5.0);
    View::look_at(eye, eye + random.point(1.0) * (1.0 + away * 1e-3), DVec3::Y, lens(random), (160, 120))
}

/// A box around a point near the eye: a point, a needle, a sheet, a block, or one that reaches very far.
fn near_the_eye(random: &mut Random, view: &View) -> Aabb {
    let center = view.eye_in_world() + random.point(3.0);
    let half = DVec3::from_array([0; 3].map(|_| {
        [0.0, 1e-4, 0.03, 0.3, 1.0, 20.0, 2e3, 1e5, 1e7, 1e16, 1e30, 3e38][random.below(12) as usize]
    }));
    Aabb { min: center - half, max: center + half }
}

/// Whether some of a box's points are surely in view.
fn is_in_view(view: &View, b: &Aabb, random: &mut Random) -> bool {
    let (w, h) = (f64::from(view.width) * 0.5 - 0.01, f64::from(view.height) * 0.5 - 0.01);
    (0..40).any(|_| {
        let pick = DVec3::new(random.unit(), random.unit(), random.unit());
        // Of a very large box, the part about the eye, too.
        let p = b.min + (b.max - b.min) * pick;
        let p =
            if random.one_in(2) { p } else { (view.eye_in_world() + random.point(8.0)).clamp(b.min, b.max) };
        let p = view.view_from_world.transform_point3(p);
        let (distance, scale) = (-p.z, view.pixels_per_unit());
        match view.projection {
            Projection::Perspective { near, .. } => {
                let (x, y) = (p.x / distance * scale, p.y / distance * scale);
                distance > near * 1.01 && x.abs() < w && y.abs() < h
            }
            Projection::Orthographic { near, far, .. } => {
                distance > near * 1.01
                    && distance < far * 0.99
                    && (p.x * scale).abs() < w
                    && (p.y * scale).abs() < h
            }
        }
    })
}

#[test]
fn nothing_drawn_hides_nothing_wherever_the_eye_is() {
    let random = &mut Random::new(77);
    let (mut visible, mut outside) = (0, 0);
    for (away, level) in
        AWAY.into_iter().flat_map(|away| levels().into_iter().map(move |level| (away, level)))
    {
        for _ in 0..60 {
            let view = some_eye(random, away);
            let options = OcclusionOptions {
                level,
                eye_moves: if random.one_in(4) { 0.1 } else { 0.0 },
                objects_move: if random.one_in(4) { 0.1 } else { 0.0 },
            };
            let buffer = OcclusionBuffer::new(&view, &options).unwrap();
            let bounds: Vec<Aabb> = (0..160).map(|_| near_the_eye(random, &view)).collect();
            let mut verdicts = Vec::new();
            SampledBuffer::new(&view).unwrap().ask(&bounds.iter().copied().collect(), &mut verdicts);
            assert!(!verdicts.contains(&Verdict::Hidden), "{away} m away, samples");
            buffer.ask(&bounds.iter().copied().collect(), &mut verdicts);
            for (b, verdict) in bounds.iter().zip(verdicts) {
                assert_ne!(
                    verdict,
                    Verdict::Hidden,
                    "{away} m away: {b:?} seen from {:?}",
                    view.eye_in_world()
                );
                if verdict == Verdict::Visible {
                    visible += 1;
                    continue;
                }
                outside += 1;
                // Far away, the test's own f64 tells no more than this.
                if away <= 1e8 {
                    assert!(!is_in_view(&view, b, random), "{away} m away: {b:?} is in view");
                }
            }
        }
    }
    assert!(visible > 10_000 && outside > 1000, "{visible} visible, {outside} outside");
}

/// A wall, and bolts close behind it, in a country's coordinates: asked about together, one by one, and as meshes.
#[test]
fn small_boxes_far_from_the_origin_are_hidden_as_they_are_at_home() {
    for origin in [DVec3::ZERO, DVec3::new(512_345.6, 30.0, -5_412_345.7)] {
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view = View::look_at(origin, origin + DVec3::NEG_Z, DVec3::Y, projection, (320, 240));
        let wall = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [9.0, 9.0, 0.0], [-9.0, 9.0, 0.0]].map(Vec3::from);
        let (quad, at) = ([[0, 1, 2], [0, 2, 3]], DAffine3::from_translation(origin + DVec3::NEG_Z * 5.0));
        let wall = Occluder::new(&wall, &quad, Sides::Front).unwrap();
        let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
        buffer.draw(&wall, &at);
        let bolt = |x: i32, y: i32| origin + DVec3::new(f64::from(x) * 0.1, f64::from(y) * 0.1, -5.1);
        let around = |center: DVec3| Aabb { min: center - 0.01, max: center + 0.01 };
        let bolts: Vec<DVec3> = (-9..10).flat_map(|y| (-9..10).map(move |x| bolt(x, y))).collect();
        let mut verdicts = Vec::new();
        buffer.ask(&bolts.iter().map(|center| around(*center)).collect(), &mut verdicts);
        assert_eq!(verdicts, vec![Verdict::Hidden; bolts.len()]);
        let mut told = Boxes::about(origin);
        bolts.iter().for_each(|center| told.push(&around(*center)));
        buffer.ask(&told, &mut verdicts);
        assert_eq!(verdicts, vec![Verdict::Hidden; bolts.len()]);
        let mesh = Occludee::new(&[Vec3::ZERO, Vec3::X * 0.01, Vec3::Y * 0.01], &[[0, 1, 2]]).unwrap();
        for center in bolts {
            assert_eq!(buffer.ask_box(&around(center)), Verdict::Hidden, "{center}");
            let at = DAffine3::from_translation(center);
            assert_eq!(buffer.ask_mesh(&mesh, &at), Verdict::Hidden, "{center}");
        }
    }
}

/// A scene moved so far from the origin, its eye with it: by its nodes, or by the coordinates of its meshes, which f32
/// rounds.
fn moved_away(scene: &mut Scene, view: &mut View, offset: DVec3, in_meshes: bool) {
    let away = DAffine3::from_translation(offset);
    view.view_from_world *= away.inverse();
    let root = scene.root as usize;
    if in_meshes {
        // Each instance becomes a mesh of its own.
        let instances = scene.instances();
        let meshes = instances.iter().map(|instance| {
            let mut mesh = scene.meshes[instance.mesh as usize].clone();
            let at = away * instance.world_from_mesh;
            mesh.positions.iter_mut().for_each(|p| *p = at.transform_point3(p.as_dvec3()).as_vec3());
            if instance.world_from_mesh.matrix3.determinant() < 0.0 {
                mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            mesh
        });
        scene.meshes = meshes.collect();
        scene.groups[root].nodes.clear();
        for mesh in 0..instances.len() as u32 {
            scene.groups[root].push(Node { content: Content::Mesh(mesh), ..Node::default() });
        }
    } else {
        for node in scene.groups[root].nodes.iter_mut().filter(|n| n.parent.is_none()) {
            node.local = Transform::Affine(away * node.local.matrix());
        }
    }
}

#[test]
fn no_pixel_holds_more_than_is_there_far_from_the_origin() {
    let random = &mut Random::new(5);
    let (mut covered, mut shot) = (0, 0);
    for seed in 0..1200u64 {
        let (mut scene, mut view) = match seed % 4 {
            0 => rubble(seed),
            1 => bodies(seed),
            2 => round_bodies(seed),
            _ => (trouble::scene(seed), trouble::view(seed)),
        };
        let away = [1e2, 1e3, 1e4, 1e5, 1e6, 5.5e6][random.below(6) as usize];
        let offset = random.point(1.0).normalize_or(DVec3::X) * away;
        moved_away(&mut scene, &mut view, offset, random.one_in(2));
        let (c, s) = attack(&scene, &view, random, 4, &format!("seed {seed}, {away} m away"));
        (covered, shot) = (covered + c, shot + s);
    }
    assert!(covered > 50_000 && shot > 200_000, "{covered} pixels, {shot} rays");
}

/// Few vertices and many triangles among them: edges with three triangles and more, triangles that are there twice or
/// the other way round, or have no area.
fn tangle(seed: u64) -> (Scene, View) {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new("tangle");
    scene.materials = vec![Material { double_sided: random.one_in(2), ..Material::default() }];
    let vertices = 4 + random.below(9);
    let points = (0..vertices).map(|_| (random.point(2.0) * 4.0).round().as_vec3() / 4.0);
    let mut mesh = Mesh { positions: points.collect(), ..Mesh::default() };
    let corner = |random: &mut Random| random.below(vertices);
    mesh.triangles = (0..6 + random.below(60)).map(|_| [(); 3].map(|()| corner(random))).collect();
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
    scene.meshes.push(mesh);
    scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
    (scene, some_view(random, 70, 9.0))
}

#[test]
fn no_pixel_holds_more_than_is_there_where_surfaces_are_no_manifolds() {
    let (covered, shot) = attack_all(1200, tangle, 5, 21);
    assert!(covered > 100_000 && shot > 500_000, "{covered} pixels, {shot} rays");
}

#[test]
fn nothing_drawn_hides_nothing_in_a_view_of_any_scale() {
    let random = &mut Random::new(12);
    let mut seen = 0;
    for exponent in -50..=24 {
        let scale = 10f64.powi(exponent);
        let mut view = some_eye(random, 0.0);
        let Projection::Perspective { fov_y, near } = view.projection else { continue };
        view.projection = Projection::Perspective { fov_y, near: near * scale };
        view.view_from_world = DAffine3::from_scale(DVec3::splat(scale)) * view.view_from_world;
        let Ok(buffer) = OcclusionBuffer::new(&view, &OcclusionOptions::default()) else { continue };
        for _ in 0..400 {
            let b = near_the_eye(random, &view);
            let middle = b.center();
            let b = if random.one_in(4) { b } else { Aabb { min: middle, max: middle } };
            if is_in_view(&view, &b, random) {
                assert_eq!(buffer.ask_box(&b), Verdict::Visible, "{b:?} at a scale of {scale}");
                seen += 1;
            }
        }
    }
    assert!(seen > 2000, "{seen}");
}
