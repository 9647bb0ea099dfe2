//! The zero while the eye and objects move within what a buffer was told.

use super::*;
use glam::DQuat;

#[test]
fn within_the_margin_a_moved_eye_sees_no_hidden_box_however_objects_move() {
    let (wall, view) = wall();
    let random = &mut Random::new(31);
    let mut hidden = 0;
    for round in 0..60 {
        let (r, m) = (random.between(0.0, 0.2), random.between(0.0, 0.1));
        let options = OcclusionOptions { eye_moves: r, objects_move: m, ..OcclusionOptions::default() };
        let mut buffer = OcclusionBuffer::new(&view, &options).unwrap();
        let mut walls = Vec::new();
        for _ in 0..6 {
            let at =
                DVec3::new(random.between(-2.0, 2.0), random.between(-1.5, 1.5), random.between(-3.0, 2.0));
            let size =
                DVec3::new(random.between(0.5, 3.0), random.between(0.5, 3.0), random.between(0.01, 1.0));
            buffer.draw(&wall, &DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, at));
            walls.push((at, size));
        }
        for _ in 0..400 {
            let at =
                DVec3::new(random.between(-4.0, 4.0), random.between(-3.0, 3.0), random.between(-8.0, 2.0));
            if buffer.ask_box(&cube_at(at, random.between(0.0, 0.3))) != Verdict::Hidden {
                continue;
            }
            hidden += 1;
            for _ in 0..20 {
                let eye = DVec3::Z * 5.0 + step(random, r);
                let point = at + step(random, m);
                let blocked = walls.iter().any(|&(at, size)| {
                    let (place, turn) = goes(random, m, at, size);
                    let in_wall = |p: DVec3| turn.inverse() * (p - place);
                    crosses(in_wall(eye), in_wall(point), size * 0.5)
                });
                assert!(blocked, "round {round}: from {eye} the point {point} is seen; r = {r}, m = {m}");
            }
        }
    }
    assert!(hidden > 1000, "{hidden}");
}

fn step(random: &mut Random, by: f64) -> DVec3 {
    random.point(1.0).normalize_or_zero() * by
}

/// Where a wall goes whose points may go as far as m: to another place, or about an axis through its centre, or both.
fn goes(random: &mut Random, m: f64, at: DVec3, size: DVec3) -> (DVec3, DQuat) {
    let share = [0.0, 0.5, 1.0][random.below(3) as usize];
    // An arc is longer than its chord.
    let angle = m * (1.0 - share) / (size.length() * 0.5);
    let axis = random.point(1.0).normalize_or(DVec3::Y);
    (at + step(random, m * share), DQuat::from_axis_angle(axis, angle))
}

/// Whether the segment from `eye` to `point` meets a box around the origin.
fn crosses(eye: DVec3, point: DVec3, half: DVec3) -> bool {
    let way = point - eye;
    let (a, b) = ((-half - eye) / way, (half - eye) / way);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    enter <= leave && leave >= 0.0 && enter <= 1.0
}

/// Whether an eye that looks along −z sees a point: beyond its near plane and before its far one, in the picture, and
/// not behind a square that stands across its axis, as far as that is in view itself.
fn sees(view: &View, eye: DVec3, point: DVec3, square: Option<(DVec3, f64)>) -> bool {
    let way = point - eye;
    let half = DVec3::new(f64::from(view.width), f64::from(view.height), 0.0) * 0.5 / view.pixels_per_unit();
    let (near, far, on_image) = match view.projection {
        Projection::Perspective { near, .. } => (near, f64::INFINITY, way / -way.z),
        Projection::Orthographic { near, far, .. } => (near, far, way),
    };
    let in_view = -way.z > near && -way.z < far && on_image.x.abs() < half.x && on_image.y.abs() < half.y;
    let hidden = square.is_some_and(|(center, side)| {
        let before = eye.z - center.z;
        let crossing = match view.projection {
            Projection::Perspective { .. } => eye + way * (before / -way.z),
            Projection::Orthographic { .. } => point,
        };
        let off = (crossing - center).abs();
        before >= near && before < -way.z && off.x <= side * 0.5 && off.y <= side * 0.5
    });
    in_view && !hidden
}

/// A floor of few or many faces that goes on below the eye and behind it, and some large walls.
fn floors(seed: u64) -> (Scene, View) {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new("floors");
    scene.materials = vec![Material { double_sided: true, ..Material::default() }];
    for k in 0..1 + random.below(6) {
        let faces = [1, 2, 9][random.below(3) as usize];
        let place = |i: u32| i as f32 / faces as f32 - 0.5;
        let corners = (0..=faces).flat_map(|z| (0..=faces).map(move |x| Vec3::new(place(x), 0.0, place(z))));
        let at = |x: u32, z: u32| z * (faces + 1) + x;
        let square =
            |x, z| [[at(x, z), at(x, z + 1), at(x + 1, z)], [at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)]];
        let triangles: Vec<_> = (0..faces).flat_map(|z| (0..faces).flat_map(move |x| square(x, z))).collect();
        let primitives = vec![Primitive { triangles: 0..triangles.len() as u32, material: Some(0) }];
        let positions = corners.collect();
        scene.meshes.push(Mesh { positions, triangles, primitives, ..Mesh::default() });
        let (middle, size, turn) = match k {
            0 => (DVec3::ZERO, 80.0, DQuat::IDENTITY),
            _ => (
                DVec3::new(random.between(-6.0, 6.0), 0.0, random.between(-6.0, 6.0)),
                random.between(1.0, 12.0),
                DQuat::from_rotation_y(random.between(0.0, 6.3)) * DQuat::from_rotation_x(1.57),
            ),
        };
        let local = Transform::Trs { translation: middle, rotation: turn, scale: DVec3::splat(size) };
        scene.groups[0].push(Node { content: Content::Mesh(k), local, ..Node::default() });
    }
    let eye = DVec3::new(random.between(-1.0, 1.0), random.between(0.1, 2.0), random.between(-1.0, 1.0));
    let target =
        eye + DVec3::new(random.between(-1.0, 1.0), random.between(-0.4, 0.1), random.between(-1.0, 1.0));
    let near = [0.01, 0.1, 0.5][random.below(3) as usize];
    let projection = Projection::Perspective { fov_y: random.between(0.3, 2.0), near };
    (
        scene,
        View::look_at(eye, target, DVec3::Y, projection, (60 + random.below(240), 60 + random.below(140))),
    )
}

fn asked(buffer: &OcclusionBuffer, b: &Aabb) -> bool {
    buffer.ask_box(b) == Verdict::Hidden
}

#[test]
fn whatever_was_drawn_a_moved_eye_sees_nothing_that_it_hides() {
    let counts = (0..2250u64).into_par_iter().map(|seed| {
        let random = &mut Random::new(seed + 90);
        let (scene, view) = match seed % 6 {
            0 => rubble(seed),
            1 => bodies(seed),
            2 => (lumps(seed), around(random, 4.0, (80, 60))),
            3 => round_bodies(seed),
            _ => floors(seed),
        };
        let r = [1e-6, 0.003, 0.02, 0.1, 0.4][random.below(5) as usize];
        let options = OcclusionOptions { eye_moves: r, ..OcclusionOptions::default() };
        let buffer = drawn(&scene, &view, &options);
        let reach = [4.0, 30.0][random.below(2) as usize];
        let bounds: Vec<Aabb> = (0..120)
            .map(|_| {
                let (at, half) = (random.point(reach), [0.0, 0.02, 0.3][random.below(3) as usize]);
                cube_at(at * DVec3::new(1.0, 0.2, 1.0), half)
            })
            .collect();
        let mut hidden: Vec<Aabb> = bounds.iter().copied().filter(|b| asked(&buffer, b)).collect();
        // Those that are only just hidden: between one that is and one that is not.
        for _ in 0..hidden.len().min(40) {
            let mut between =
                [hidden[random.below(hidden.len() as u32) as usize], bounds[random.below(120) as usize]];
            for _ in 0..14 {
                let [a, b] = between;
                let middle = Aabb { min: (a.min + b.min) * 0.5, max: (a.max + b.max) * 0.5 };
                between[usize::from(!asked(&buffer, &middle))] = middle;
            }
            hidden.push(between[0]);
            // What lies beyond an edge comes into sight where the eye goes the same way across the line of sight.
            let [b, shown] = between.map(|b| view.view_from_world.transform_point3((b.min + b.max) * 0.5));
            let goes = (shown - b).reject_from_normalized(b.normalize()).normalize_or_zero() * r;
            let mut moved = view;
            moved.view_from_world = DAffine3::from_translation(-goes) * view.view_from_world;
            let sight = Sight::new(&scene, &moved);
            points_are_out_of_sight(&sight, &moved, &between[0], Verdict::Hidden, random, seed);
        }
        for _ in 0..8 {
            let mut moved = view;
            moved.view_from_world = DAffine3::from_translation(step(random, r)) * view.view_from_world;
            let sight = Sight::new(&scene, &moved);
            for b in &hidden {
                points_are_out_of_sight(&sight, &moved, b, Verdict::Hidden, random, seed);
            }
        }
        [usize::from(seed % 6 < 4) * hidden.len(), usize::from(seed % 6 >= 4) * hidden.len()]
    });
    let [small, large] = counts.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    assert!(small > 2000 && large > 8000, "{small} behind what is small, {large} behind what is large");
}

/// What is only just hidden far behind the edge of a wall is so for an eye at the margin's end, however near the wall:
/// where much is eroded, and where little is.
#[test]
fn an_eye_at_the_margins_end_sees_nothing_behind_a_walls_edge() {
    let (corners, faces) = ([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], [[0, 1, 2], [0, 2, 3]]);
    let square = Occluder::new(&corners.map(|(x, y)| Vec3::new(x, y, 0.0)), &faces, Sides::Both).unwrap();
    let projection = Projection::Perspective { fov_y: 2.0, near: 0.05 };
    let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (300, 300));
    let (r, far, size) = (0.2, 90.0, 40.0);
    let options = OcclusionOptions { eye_moves: r, ..OcclusionOptions::default() };
    let mut pairs = 0;
    for distance in [0.35, 0.5, 1.0, 2.0, 4.0] {
        for part in [-0.6, -0.2, 0.3, 0.8] {
            // In the direction x, and in y, of both sides of the wall.
            for (axis, side) in [(DVec3::X, 1.0), (DVec3::X, -1.0), (DVec3::Y, 1.0), (DVec3::Y, -1.0)] {
                let edge = part * distance * 1.5;
                let middle = axis * (edge - side * size * 0.5) - DVec3::Z * distance;
                let mut buffer = OcclusionBuffer::new(&view, &options).unwrap();
                buffer.draw(
                    &square,
                    &(DAffine3::from_translation(middle) * DAffine3::from_scale(DVec3::splat(size))),
                );
                for across in [-0.9, 0.0, 0.9] {
                    let at = |along: f64| {
                        axis * along + DVec3::new(axis.y, axis.x, 0.0) * (across * far) - DVec3::Z * far
                    };
                    let hides = |along: f64| buffer.ask_box(&cube_at(at(along), 0.0)) == Verdict::Hidden;
                    let mut between = [-side * 1.4 * far, side * 1.4 * far];
                    if !hides(between[0]) || hides(between[1]) {
                        continue;
                    }
                    for _ in 0..30 {
                        let middle = (between[0] + between[1]) * 0.5;
                        between[usize::from(!hides(middle))] = middle;
                    }
                    pairs += 1;
                    for forward in [-0.9, -0.5, 0.0, 0.5, 0.9] {
                        let eye =
                            axis * (side * r * f64::sqrt(1.0 - forward * forward)) - DVec3::Z * (r * forward);
                        let way = at(between[0]) - eye;
                        let crossing = eye + way * ((-distance - eye.z) / way.z);
                        let inside = (edge - crossing.dot(axis)) * side;
                        assert!(inside >= 0.0, "{distance} m, edge at {edge}: {inside} from {eye}");
                    }
                }
            }
        }
    }
    assert!(pairs > 60, "{pairs}");
}

#[test]
fn what_lies_about_the_near_and_the_far_plane_is_asked_about_for_every_eye() {
    let random = &mut Random::new(67);
    let (corners, faces) = ([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], [[0, 1, 2], [0, 2, 3]]);
    let corners = corners.map(|(x, y)| Vec3::new(x, y, 0.0));
    let square = Occluder::new(&corners, &faces, Sides::Both).unwrap();
    let (mut outside, mut hidden) = (0, 0);
    for round in 0..300 {
        let projection = match round % 2 {
            0 => Projection::Perspective { fov_y: 2.2, near: 1.0 },
            _ => Projection::Orthographic { half_height: 4.0, near: 1.0, far: 10.0 },
        };
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (64, 64));
        let (r, m) =
            (random.between(0.0, 0.6), if random.one_in(2) { random.between(0.0, 0.3) } else { 0.0 });
        let options = OcclusionOptions { eye_moves: r, objects_move: m, ..OcclusionOptions::default() };
        let mut buffer = OcclusionBuffer::new(&view, &options).unwrap();
        let wall = (DVec3::new(0.0, 0.0, -random.between(0.5, 3.0)), 9.0);
        buffer.draw(
            &square,
            &DAffine3::from_scale_rotation_translation(DVec3::splat(wall.1), DQuat::IDENTITY, wall.0),
        );
        for _ in 0..60 {
            let z = if random.one_in(2) { random.between(0.0, 2.0) } else { random.between(2.0, 11.0) };
            let at = DVec3::new(random.between(-4.0, 4.0), random.between(-4.0, 4.0), -z);
            let half = random.between(0.0, 0.2);
            let verdicts = [buffer.ask_box(&cube_at(at, half)), buffer.ask_sphere(at, half)];
            outside += verdicts.iter().filter(|v| **v == Verdict::Outside).count();
            hidden += verdicts.iter().filter(|v| **v == Verdict::Hidden).count();
            for _ in 0..20 {
                let (eye, point) = (step(random, r), at + step(random, m) + step(random, half));
                let wall = (wall.0 + step(random, m), wall.1);
                let seen = sees(&view, eye, point, Some(wall));
                assert!(
                    !seen || verdicts == [Verdict::Visible; 2],
                    "round {round}: from {eye} the point {point} is seen beside {wall:?}, but {verdicts:?}"
                );
            }
        }
    }
    assert!(outside > 500 && hidden > 500, "{outside}, {hidden}");
}

/// The rectangle around a box that stands upright to the axis, as it is seen now.
fn rect_around(view: &View, bounds: &Aabb) -> ScreenRect {
    let scale = view.pixels_per_unit();
    let (near, far) = (-bounds.max.z, -bounds.min.z);
    let (shrinks, depth) = match view.projection {
        Projection::Perspective { near: plane, .. } => (true, plane / near),
        Projection::Orthographic { near: plane, far: end, .. } => (false, (end - near) / (end - plane)),
    };
    let half = |at: f64, z: f64| if shrinks { at / z } else { at };
    let all = |a: f64, b: f64| [half(a, near), half(a, far), half(b, near), half(b, far)].map(|v| v * scale);
    let (x, y) = (all(bounds.min.x, bounds.max.x), all(-bounds.max.y, -bounds.min.y));
    let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
    let middle = (f64::from(view.width) * 0.5, f64::from(view.height) * 0.5);
    ScreenRect {
        left: middle.0 + x.into_iter().fold(least, f64::min),
        top: middle.1 + y.into_iter().fold(least, f64::min),
        right: middle.0 + x.into_iter().fold(most, f64::max),
        bottom: middle.1 + y.into_iter().fold(most, f64::max),
        depth: (depth as f32).next_up(),
    }
}

#[test]
fn a_rectangle_is_asked_about_wherever_its_object_moves() {
    let random = &mut Random::new(68);
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let square = Occluder::new(&corners, &[[0, 1, 2], [0, 2, 3]], Sides::Both).unwrap();
    let (mut hidden, mut verges) = (0, 0);
    for round in 0..300 {
        let projection = match round % 2 {
            0 => Projection::Perspective { fov_y: random.between(0.5, 2.0), near: 0.1 },
            _ => Projection::Orthographic { half_height: 4.0, near: 0.1, far: 30.0 },
        };
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (400, 400));
        let m = random.between(0.01, 0.3);
        let options = OcclusionOptions { objects_move: m, ..OcclusionOptions::default() };
        let mut buffer = OcclusionBuffer::new(&view, &options).unwrap();
        let (place, side) = (DVec3::new(-1.0, 0.0, -random.between(2.0, 5.0)), 2.0);
        buffer.draw(
            &square,
            &DAffine3::from_scale_rotation_translation(DVec3::splat(side), DQuat::IDENTITY, place),
        );
        let (half, behind) = (random.between(0.0, 0.2), random.between(0.01, 3.0));
        let bounds = |x: f64| cube_at(DVec3::new(x, 0.0, place.z - half - behind), half);
        let ask = |x: f64| buffer.ask_rect(&rect_around(&view, &bounds(x)));
        // How far to the right a cube behind the square may be: hidden here, at any rate visible there.
        let (mut left, mut right) = (-1.0, 5.0);
        if ask(left) != Verdict::Hidden {
            continue;
        }
        hidden += 1;
        for _ in 0..30 {
            let x = (left + right) * 0.5;
            if ask(x) == Verdict::Hidden { left = x } else { right = x }
        }
        // The cube goes to the right and nearer or farther, and the square to the left.
        for step in [0.0, -0.7, 0.7f64] {
            let way = m * (1.0 - step * step).sqrt();
            let corner = DVec3::new(left + half + way, 0.0, place.z - behind + m * step);
            for corner in [corner, corner - DVec3::Z * 2.0 * half] {
                let away = place - DVec3::X * way;
                verges += 1;
                assert!(
                    !sees(&view, DVec3::ZERO, corner, Some((away, side))),
                    "round {round}: {corner} is seen beside {away} for m = {m}"
                );
            }
        }
    }
    assert!(hidden > 200 && verges > 1000, "{hidden}, {verges}");
}

#[test]
fn a_sky_is_in_view_and_can_be_hidden() {
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
    let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (40, 40));
    let flat =
        View { projection: Projection::Orthographic { half_height: 1.0, near: 0.1, far: 9.0 }, ..view };
    let sky = ScreenRect { left: 10.0, top: 10.0, right: 12.0, bottom: 12.0, depth: 0.0 };
    let corners = [(-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)].map(|(x, y)| Vec3::new(x, y, -1.0));
    let wall = Occluder::new(&corners, &[[0, 1, 2]], Sides::Both).unwrap();
    for (view, seen, behind) in
        [(view, Verdict::Visible, Verdict::Hidden), (flat, Verdict::Outside, Verdict::Outside)]
    {
        let mut conservative = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
        let sampled = SampledBuffer::new(&view).unwrap();
        assert_eq!([conservative.ask_rect(&sky), sampled.ask_rect(&sky)], [seen; 2]);
        conservative.draw(&wall, &DAffine3::IDENTITY);
        sampled.draw(&wall, &DAffine3::IDENTITY);
        assert_eq!([conservative.ask_rect(&sky), sampled.ask_rect(&sky)], [behind; 2]);
    }
}
