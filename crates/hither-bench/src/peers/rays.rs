//! The ray through each pixel's centre, in `f32`, so that a ray's parameter is the distance along the view
//! axis.

use glam::{DVec3, Vec3};
use hither::conventions::{Projection, View};

/// Rays are traced in squares of this many pixels a side.
pub const PACKET_SIDE: u32 = 4;

/// All rays of a picture: origin and direction are linear in the pixel's column and row.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    /// Width, pixels.
    pub width: u32,
    /// Smallest distance, metres.
    pub near: f32,
    /// Largest distance, metres; +∞ for a pinhole.
    pub far: f32,
    corner_origin: Vec3,
    corner_direction: Vec3,
    origin_per_column: Vec3,
    origin_per_row: Vec3,
    direction_per_column: Vec3,
    direction_per_row: Vec3,
}

impl Rays {
    /// The rays of a view.
    pub fn new(view: &View) -> Rays {
        let world_from_view = view.view_from_world.inverse();
        let turn = |v: DVec3| world_from_view.transform_vector3(v);
        let pixel = 1.0 / view.pixels_per_unit();
        let (column, row) = (turn(DVec3::X) * pixel, turn(DVec3::NEG_Y) * pixel);
        let first = column * (0.5 - f64::from(view.width) * 0.5) + row * (0.5 - f64::from(view.height) * 0.5);
        let (eye, forward) = (world_from_view.translation, turn(DVec3::NEG_Z));
        let zero = DVec3::ZERO;
        let (far, origins, directions) = match view.projection {
            Projection::Perspective { .. } => {
                (f32::INFINITY, [eye, zero, zero], [forward + first, column, row])
            }
            Projection::Orthographic { far, .. } => {
                (far as f32, [eye + first, column, row], [forward, zero, zero])
            }
        };
        Rays {
            width: view.width,
            near: view.projection.near() as f32,
            far,
            corner_origin: origins[0].as_vec3(),
            origin_per_column: origins[1].as_vec3(),
            origin_per_row: origins[2].as_vec3(),
            corner_direction: directions[0].as_vec3(),
            direction_per_column: directions[1].as_vec3(),
            direction_per_row: directions[2].as_vec3(),
        }
    }

    /// Origin and direction of the ray through the centre of pixel (`x`, `y`). The direction advances one
    /// metre along the view axis.
    #[inline(always)]
    pub fn ray(&self, x: u32, y: u32) -> (Vec3, Vec3) {
        let (x, y) = (x as f32, y as f32);
        (
            self.corner_origin + self.origin_per_column * x + self.origin_per_row * y,
            self.corner_direction + self.direction_per_column * x + self.direction_per_row * y,
        )
    }
}
