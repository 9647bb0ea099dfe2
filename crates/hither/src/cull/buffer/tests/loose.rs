//! Loose faces, sixteen together and each alone.

use super::*;

/// Triangles before an eye, a few of them across its near plane.
fn soup(random: &mut Random) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let count = 1 + random.below(150);
    let mut positions = Vec::new();
    for _ in 0..count {
        let distance = random.between(0.2, 12.0);
        let mut around = |reach: f64| random.between(-reach, reach);
        let at = DVec3::new(around(distance), around(distance), -distance);
        let size = around(2.5);
        positions
            .extend([(); 3].map(|()| (at + DVec3::new(around(size), around(size), around(0.4))).as_vec3()));
    }
    (positions, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

#[test]
fn loose_faces_cover_together_what_each_covers_alone() {
    let random = &mut Random::new(23);
    let (mut at_border, mut within) = (0, 0);
    for seed in 0..400 {
        let (positions, triangles) = soup(random);
        let size = (1 + random.below(120), 1 + random.below(120));
        let projection = Projection::Perspective { fov_y: 1.2, near: 0.1 };
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, size);
        let drawn = |lists: &[&[[u32; 3]]]| {
            let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
            for list in lists {
                buffer.draw(&Occluder::new(&positions, list, Sides::Both).unwrap(), &DAffine3::IDENTITY);
            }
            buffer.depths()
        };
        let each: Vec<&[[u32; 3]]> = triangles.iter().map(std::slice::from_ref).collect();
        let (together, alone) = (drawn(&[&triangles]), drawn(&each));
        for (pixel, (a, b)) in together.iter().zip(&alone).enumerate() {
            let (x, y) = (pixel as u32 % size.0, pixel as u32 / size.0);
            // How large numbers may be is known of an occluder as a whole, and rounds depths.
            assert!((a - b).abs() <= a.max(*b) * 1e-6, "({x}, {y}) of {size:?}: {a} {b}, seed {seed}");
            let is_at_border = x == 0 || y == 0 || x + 1 == size.0 || y + 1 == size.1;
            *(if is_at_border { &mut at_border } else { &mut within }) += u32::from(*a > 0.0);
        }
    }
    assert!(at_border > 10_000 && within > 100_000, "{at_border} {within}");
}
