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
