//! Occlusion culling as an engine would use it: draw what hides, ask about what might be hidden.
//!
//! `cargo run --release -p hither --example occlusion`

use glam::{DAffine3, DVec3, Vec3};
use hither::conventions::{Projection, View};
use hither::cull::{Boxes, Occluder, OcclusionBuffer, OcclusionOptions, Sides, Verdict};
use hither::geometry::Aabb;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Once, when a mesh is loaded. Corners run counter-clockwise seen from outside.
    let corner = |k: u32| Vec3::new((k & 1) as f32 - 0.5, (k >> 1 & 1) as f32 - 0.5, (k >> 2) as f32 - 0.5);
    let positions: Vec<Vec3> = (0..8).map(corner).collect();
    let quads = [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles: Vec<[u32; 3]> =
        quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let cube = Occluder::new(&positions, &triangles, Sides::Front)?;

    // Each frame: an eye, walls that hide, and boxes around what could be drawn.
    let eye = DVec3::new(0.0, 1.7, 20.0);
    let lens = Projection::Perspective { fov_y: 1.0, near: 0.1 };
    let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, lens, (320, 180));
    let wall = |x: f64| {
        DAffine3::from_scale_rotation_translation(
            DVec3::new(12.0, 8.0, 0.5),
            glam::DQuat::IDENTITY,
            DVec3::new(x, 2.0, 0.0),
        )
    };
    let crates: Boxes = (0..1000)
        .map(|i| {
            let at = DVec3::new(f64::from(i % 40) - 20.0, 0.5, -f64::from(i / 40));
            Aabb { min: at - 0.4, max: at + 0.4 }
        })
        .collect();

    // The answer stays true for one more frame if the eye moves by at most 5 cm in it.
    let options = OcclusionOptions { eye_moves: 0.05, ..OcclusionOptions::default() };
    let mut buffer = OcclusionBuffer::new(&view, &options)?;
    buffer.draw(&cube, &wall(-7.0));
    buffer.draw(&cube, &wall(7.0));

    let mut verdicts = Vec::new();
    buffer.ask(&crates, &mut verdicts);
    let count = |wanted| verdicts.iter().filter(|v| **v == wanted).count();
    println!("{} crates to draw", count(Verdict::Visible));
    println!("{} hidden behind the walls, {} outside", count(Verdict::Hidden), count(Verdict::Outside));
    Ok(())
}
