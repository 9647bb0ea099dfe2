//! The zero for balls, rectangles and meshes: what of them is called hidden is behind something.

use super::*;

#[test]
fn no_ball_rectangle_or_mesh_that_is_hidden_can_be_seen() {
    let counts = (0..600u64).into_par_iter().map(|seed| {
        let random = &mut Random::new(seed + 9);
        let (scene, view) = match seed % 4 {
            0 => rubble(seed + 100),
            _ => (trouble::scene(seed + 9000), trouble::view(seed + 9000)),
        };
        let buffer = drawn(&scene, &view, &OcclusionOptions::default());
        let sight = Sight::new(&scene, &view);
        let mut counts = [[0u64; 3]; 3];
        for _ in 0..60 {
            counts[0][attack_ball(&buffer, &sight, random, seed) as usize] += 1;
            counts[1][attack_rect(&buffer, &sight, random, seed) as usize] += 1;
            counts[2][attack_mesh(&buffer, &sight, random, seed) as usize] += 1;
        }
        counts
    });
    let add = |a: [[u64; 3]; 3], b: [[u64; 3]; 3]| {
        std::array::from_fn(|kind| std::array::from_fn(|verdict| a[kind][verdict] + b[kind][verdict]))
    };
    let counts = counts.reduce(|| [[0; 3]; 3], add);
    assert!(counts.as_flattened().iter().all(|&c| c > 300), "{counts:?}");
}

fn attack_ball(buffer: &OcclusionBuffer, sight: &Sight, random: &mut Random, seed: u64) -> Verdict {
    let (center, radius) = (random.point(8.0), [0.0, 1e-3, 0.1, 1.0, 4.0][random.below(5) as usize]);
    let verdict = buffer.ask_sphere(center, radius);
    for _ in 0..12 {
        let p = center + random.point(1.0).normalize_or(DVec3::X) * radius * random.unit().cbrt();
        if verdict != Verdict::Visible {
            let what = || format!("seed {seed}: a ball of {radius} at {center}");
            point_is_out_of_sight(sight, &buffer.frame.view, p, verdict, &what);
        }
    }
    verdict
}

fn attack_mesh(buffer: &OcclusionBuffer, sight: &Sight, random: &mut Random, seed: u64) -> Verdict {
    let positions: Vec<Vec3> = (0..3 + random.below(30)).map(|_| random.point(1.0).as_vec3()).collect();
    let mut corner = || random.below(positions.len() as u32);
    let triangles: Vec<[u32; 3]> = (0..40).map(|_| [corner(), corner(), corner()]).collect();
    let mesh = Occludee::new(&positions, &triangles).unwrap();
    let scale = DVec3::new(random.unit(), random.unit(), random.unit()) * 2.0;
    let turn = glam::DQuat::from_rotation_y(random.between(-3.0, 3.0));
    let at = DAffine3::from_scale_rotation_translation(scale, turn, random.point(8.0));
    let verdict = buffer.ask_mesh(&mesh, &at);
    for t in triangles {
        let corners = t.map(|v| positions[v as usize].as_dvec3());
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let p = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
        if verdict != Verdict::Visible {
            let p = at.transform_point3(p);
            point_is_out_of_sight(sight, &buffer.frame.view, p, verdict, &|| format!("seed {seed}: a mesh"));
        }
    }
    verdict
}

fn attack_rect(buffer: &OcclusionBuffer, sight: &Sight, random: &mut Random, seed: u64) -> Verdict {
    let view = &buffer.frame.view;
    let (w, h) = (f64::from(view.width), f64::from(view.height));
    let (left, top) = (random.between(-0.2, 1.0) * w, random.between(-0.2, 1.0) * h);
    let (right, bottom) = (left + random.unit() * w * 0.3, top + random.unit() * h * 0.3);
    let depth = random.unit() as f32;
    let rect = ScreenRect { left, top, right, bottom, depth };
    let verdict = buffer.ask_rect(&rect);
    for _ in 0..12 {
        let (x, y) = (random.between(left, right), random.between(top, bottom));
        if x < 0.0 || y < 0.0 || x > w || y > h || verdict == Verdict::Visible {
            continue;
        }
        assert_eq!(verdict, Verdict::Hidden, "seed {seed}: {rect:?} is in view at ({x}, {y})");
        let truth = sight.depth(x, y);
        assert!(truth >= f64::from(depth), "seed {seed}: {rect:?} is seen at ({x}, {y}) before {truth}");
    }
    verdict
}

#[test]
fn what_is_masked_transparent_or_no_number_of_a_mesh_can_be_seen() {
    let (_, view) = wall();
    let buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
    let mut mesh = Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], ..Mesh::default() };
    mesh.triangles.push([0, 1, 2]);
    mesh.primitives.push(Primitive { triangles: 0..1, material: Some(0) });
    // Nothing of a mesh's materials is asked for.
    let glass = Occludee::of_mesh(&mesh).unwrap();
    assert_eq!(buffer.ask_mesh(&glass, &DAffine3::IDENTITY), Verdict::Visible);
    mesh.positions.push(Vec3::NAN);
    mesh.triangles = vec![[0, 1, 3]];
    let lost = Occludee::of_mesh(&mesh).unwrap();
    let behind = DAffine3::from_translation(DVec3::Z * 90.0);
    assert_eq!(buffer.ask_mesh(&lost, &behind), Verdict::Visible);
    assert!(Occludee::new(&mesh.positions, &[[0, 1, 4]]).is_err());
    assert_eq!(buffer.ask_mesh(&Occludee::default(), &DAffine3::IDENTITY), Verdict::Outside);
}

#[test]
fn the_rectangle_of_a_ball_touches_it() {
    let random = &mut Random::new(77);
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.5 };
    let view = View { view_from_world: DAffine3::IDENTITY, projection, width: 1000, height: 700 };
    /// A line of sight is n / ONE to the side of the axis at distance 1.
    const ONE: f64 = (1i64 << 34) as f64;
    for _ in 0..100_000 {
        let distance = 2 + random.below(8190);
        // Often the eye is just outside of it.
        let radius = if random.one_in(2) { distance - 1 } else { random.below(distance) };
        let [a, b] = [(); 2].map(|()| random.below(16384) as i32 - 8192);
        let center = DVec3::new(f64::from(a), f64::from(b), -f64::from(distance));
        let rect = Ball { center, radius: f64::from(radius) }.on_screen(&view, None).unwrap();
        let sides = [
            (a, rect.left, 500.0, 1.0),
            (a, rect.right, 500.0, -1.0),
            (-b, rect.top, 350.0, 1.0),
            (-b, rect.bottom, 350.0, -1.0),
        ];
        let reach: f64 = sides.iter().map(|(_, side, middle, _)| (side - middle).abs()).sum();
        let reach = reach / view.pixels_per_unit();
        for (a, side, middle, inwards) in sides {
            let line = (side - middle) / view.pixels_per_unit();
            // Whether it meets the circle, in whole numbers.
            let meets = |line: f64| {
                let (n, one) = ((line * ONE).round() as i128, ONE as i128);
                let (a, distance, radius) = (i128::from(a), i128::from(distance), i128::from(radius));
                (a * one - n * distance).pow(2) <= radius.pow(2) * (one * one + n * n)
            };
            assert!(!meets(line), "{center}, radius {radius}: {rect:?}");
            // The ball asked about is larger by what rounding may move it, which tells the more the nearer the eye.
            let rounding = 1e-12 * center.length() / f64::from(distance - radius);
            let closer = line + inwards * (2e-8 + reach * (4e-9 + 2.0 * rounding));
            assert!(radius == 0 || meets(closer), "{center}, radius {radius}: {rect:?} is too large");
        }
    }
}

#[test]
fn what_is_asked_about_in_a_view_that_scales_is_as_large_as_it_is_seen() {
    let random = &mut Random::new(4);
    let (wall, plain) = wall();
    let mut counts = [0; 3];
    for round in 0..300 {
        let scale = [0.01, 1.0, 2.0, 50.0][round % 4];
        let to_view = DAffine3::from_scale(DVec3::splat(scale)) * plain.view_from_world;
        let view = View { view_from_world: to_view, ..plain };
        let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
        let sampled = SampledBuffer::new(&view).unwrap();
        let at = DAffine3::from_scale_rotation_translation(
            DVec3::new(2.0, 2.0, 0.1) * random.between(0.2, 2.0),
            glam::DQuat::IDENTITY,
            random.point(1.0),
        );
        buffer.draw(&wall, &at);
        sampled.draw(&wall, &at);
        for _ in 0..40 {
            let (center, half) = (random.point(6.0), random.between(0.01, 1.0));
            // The ball holds the box: what hides it hides the box.
            let radius = half * 1.733;
            for (ball, within) in [
                (buffer.ask_sphere(center, radius), buffer.ask_box(&cube_at(center, half))),
                (sampled.ask_sphere(center, radius), sampled.ask_box(&cube_at(center, half))),
            ] {
                counts[ball as usize] += 1;
                let holds = ball == Verdict::Visible || within == ball;
                assert!(holds || within == Verdict::Outside, "{center} {half}, scaled by {scale}");
            }
        }
    }
    assert!(counts.iter().all(|&c| c > 100), "{counts:?}");
}
