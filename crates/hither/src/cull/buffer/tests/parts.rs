//! Surfaces that lie before themselves, and flat ones of any outline, hide at the depth of what is near.

use super::*;

/// A sheet over the points of `profile` (z, y), from the eye on, 8 metres wide and in `across` columns of squares, one
/// connected surface, both sides drawn.
fn sheet(profile: &[(f32, f32)], across: u32) -> Occluder {
    let mut positions = Vec::new();
    for &(z, y) in profile {
        positions.extend((0..=across).map(|i| Vec3::new(8.0 * i as f32 / across as f32 - 4.0, y, -z)));
    }
    let at = |row: u32, i: u32| row * (across + 1) + i;
    let mut triangles = Vec::new();
    for row in 0..profile.len() as u32 - 1 {
        for i in 0..across {
            let [a, b, c, d] = [at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Occluder::new(&positions, &triangles, Sides::Front).unwrap()
}

/// The triangles of so many squares each way, with corners in rows.
fn grid(cells: u32) -> Vec<[u32; 3]> {
    let at = |row: u32, i: u32| row * (cells + 1) + i;
    let squares = (0..cells).flat_map(|row| (0..cells).map(move |i| (row, i)));
    squares
        .flat_map(|(row, i)| {
            let [a, b, c, d] = [at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// Points from one to another, the first left out.
fn along(from: (f32, f32), to: (f32, f32), steps: u32) -> impl Iterator<Item = (f32, f32)> {
    let share = move |i: u32| i as f32 / steps as f32;
    (1..=steps).map(move |i| (from.0 + (to.0 - from.0) * share(i), from.1 + (to.1 - from.1) * share(i)))
}

fn looking_ahead(size: (u32, u32)) -> View {
    let projection = Projection::Perspective { fov_y: 0.5, near: 0.1 };
    View::look_at(DVec3::Y, DVec3::new(0.0, 1.0, -1.0), DVec3::Y, projection, size)
}

/// Whether a ball of 5 cm is hidden at (0, y, −z).
fn is_hidden(occluder: &Occluder, size: (u32, u32), [z, y]: [f64; 2]) -> bool {
    let mut buffer = OcclusionBuffer::new(&looking_ahead(size), &OcclusionOptions::default()).unwrap();
    buffer.draw(occluder, &DAffine3::IDENTITY);
    buffer.ask_sphere(DVec3::new(0.0, y, -z), 0.05) == Verdict::Hidden
}

#[test]
fn a_wall_hides_what_is_between_it_and_a_farther_wall_of_the_same_surface() {
    // Up a wall, over its top, down behind it, along the ground, and up a higher wall at its end.
    let corners = [(5.0, -1.0), (5.0, 2.0), (5.5, 2.0), (5.5, -1.0), (20.0, -1.0), (20.0, 6.0)];
    for (steps, across, size) in [(8, 16, (160, 120)), (20, 40, (160, 120)), (20, 40, (640, 480))] {
        let mut profile = vec![corners[0]];
        corners.windows(2).for_each(|two| profile.extend(along(two[0], two[1], steps)));
        let occluder = sheet(&profile, across);
        assert_eq!(occluder.patch_count(), 1);
        let at = |z, y| is_hidden(&occluder, size, [z, y]);
        assert!(at(8.0, 1.2), "{steps}, {size:?}: behind the near wall");
        assert!(at(25.0, 4.0), "{steps}, {size:?}: behind the far wall, seen above the near one");
        assert!(!at(15.0, 4.0) && !at(4.0, 1.0), "{steps}, {size:?}: before them");
    }
}

#[test]
fn a_hill_hides_what_is_on_the_ground_far_behind_it() {
    // A bell in a plain: its near and far ground are one surface, connected around it.
    let cells = 60;
    let mut positions = Vec::new();
    for (row, i) in (0..=cells).flat_map(|row| (0..=cells).map(move |i| (row, i))) {
        let (x, z) = (i as f32 * 2.0 - 60.0, 3.0 + row as f32 * 2.0);
        let from_top = ((x / 10.0).powi(2) + ((z - 30.0) / 8.0).powi(2)) * 0.5;
        positions.push(Vec3::new(x, 8.0 * (-from_top).exp() - 1.0, -z));
    }
    let occluder = Occluder::new(&positions, &grid(cells), Sides::Front).unwrap();
    assert!(is_hidden(&occluder, (640, 480), [90.0, 0.0]));
    assert!(!is_hidden(&occluder, (640, 480), [25.0, 8.0]));
}

#[test]
fn a_flat_wall_with_a_front_and_a_back_hides_whatever_its_outline_is() {
    // An L of two rectangles, and the same turned over, welded along its outline.
    let corners = [(-3.0, -1.0), (3.0, -1.0), (3.0, 0.5), (0.0, 0.5), (0.0, 3.0), (-3.0, 3.0)];
    let positions = corners.map(|(x, y)| Vec3::new(x, y, -5.0));
    let front = [[0u32, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let back = front.map(|[a, b, c]| [a, c, b]);
    let occluder = Occluder::new(&positions, &[front, back].concat(), Sides::Front).unwrap();
    let hidden = |x: f64, y: f64| {
        let mut buffer =
            OcclusionBuffer::new(&looking_ahead((640, 480)), &OcclusionOptions::default()).unwrap();
        buffer.draw(&occluder, &DAffine3::IDENTITY);
        buffer.ask_sphere(DVec3::new(x, y, -8.0), 0.1) == Verdict::Hidden
    };
    assert!(hidden(-1.0, 1.5) && hidden(1.5, 0.0));
    assert!(!hidden(1.5, 2.0));
}

#[test]
fn a_rough_valley_that_turns_away_and_reaches_the_eye_hides_nothing() {
    // Its squares are not flat, so that each is two faces. It is seen from below, and begins before the near plane.
    let cells = 30;
    let mut positions = Vec::new();
    for (row, i) in (0..=cells).flat_map(|row| (0..=cells).map(move |i| (row, i))) {
        let (x, z) = (i as f32 * 8.0 / 30.0 - 4.0, 5.0 + row as f32 * 0.5);
        let bent = 1.6 + (12.0 - z).max(0.0) * 0.09;
        positions.push(Vec3::new(x, bent + 0.002 * ((i * 7 + row * 13) % 5) as f32, -z));
    }
    let occluder = Occluder::new(&positions, &grid(cells), Sides::Front).unwrap();
    assert_eq!(occluder.patch_count(), 1);
    let projection = Projection::Perspective { fov_y: 0.5, near: 6.0 };
    let view = View { projection, ..looking_ahead((640, 480)) };
    for eye_moves in [0.0, 0.01, 0.3] {
        let options = OcclusionOptions { eye_moves, ..OcclusionOptions::default() };
        let mut buffer = OcclusionBuffer::new(&view, &options).unwrap();
        buffer.draw(&occluder, &DAffine3::IDENTITY);
        assert!(buffer.depths().iter().all(|depth| *depth == 0.0), "{eye_moves}");
    }
}
