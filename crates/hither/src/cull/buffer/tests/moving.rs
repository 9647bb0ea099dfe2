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
