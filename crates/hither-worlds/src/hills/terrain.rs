//! The ground: heights on a square grid, fractal noise and one long hill, cut into tiles that meet exactly.

use glam::{DVec3, Vec3};
use hither::scene::{Mesh, Primitive};

/// Side of a tile, metres.
pub(super) const TILE: f64 = 64.0;
/// Squares along a tile's side; each is two triangles.
const SQUARES: usize = 8;
/// Side of a square, metres.
const STEP: f64 = TILE / SQUARES as f64;
/// Two triangles a square.
pub(super) const TRIANGLES_PER_SQUARE_METRE: f64 = 2.0 / (STEP * STEP);
/// Where the hill's crest is, metres along z.
pub(super) const CREST_Z: f64 = -330.0;

/// Height of the crest above the plain, metres.
const CREST: f64 = 110.0;
/// Extent of the hill across and along the view (standard deviations of a Gaussian), metres.
const HILL: (f64, f64) = (420.0, 90.0);

/// Heights at the corners of all squares.
pub(super) struct Terrain {
    tiles_a_side: usize,
    corners_a_side: usize,
    heights: Vec<f32>,
}

impl Terrain {
    pub(super) fn new(tiles_a_side: usize, seed: u32) -> Terrain {
        let corners_a_side = tiles_a_side * SQUARES + 1;
        let mut terrain = Terrain { tiles_a_side, corners_a_side, heights: Vec::new() };
        terrain.heights = (0..corners_a_side * corners_a_side)
            .map(|i| {
                let (x, z) = terrain.corner(i % corners_a_side, i / corners_a_side);
                height(x, z, seed) as f32
            })
            .collect();
        terrain
    }

    /// Side of the land, metres.
    pub(super) fn side(&self) -> f64 {
        self.tiles_a_side as f64 * TILE
    }

    fn corner(&self, ix: usize, iz: usize) -> (f64, f64) {
        (ix as f64 * STEP - self.side() / 2.0, -(iz as f64) * STEP)
    }

    fn height_at(&self, ix: usize, iz: usize) -> f32 {
        let last = self.corners_a_side - 1;
        self.heights[iz.min(last) * self.corners_a_side + ix.min(last)]
    }

    /// The tile under (x, z), which lies on the land.
    pub(super) fn tile_of(&self, x: f64, z: f64) -> (usize, usize) {
        let clamp = |t: f64| (t.max(0.0) as usize).min(self.tiles_a_side - 1);
        (clamp((x + self.side() / 2.0) / TILE), clamp(-z / TILE))
    }

    /// Origin of a tile's own coordinates: its front left corner at height 0.
    pub(super) fn tile_corner(&self, ix: usize, iz: usize) -> DVec3 {
        DVec3::new(ix as f64 * TILE - self.side() / 2.0, 0.0, -(iz as f64) * TILE)
    }

    /// Height of the mesh, triangles and all, at (x, z).
    pub(super) fn ground(&self, x: f64, z: f64) -> f64 {
        let (u, v) = ((x + self.side() / 2.0) / STEP, -z / STEP);
        let last = (self.corners_a_side - 2) as f64;
        let (ix, iz) = (u.floor().clamp(0.0, last), v.floor().clamp(0.0, last));
        let (u, v) = (u - ix, v - iz);
        let at = |dx, dz| f64::from(self.height_at(ix as usize + dx, iz as usize + dz));
        let (near_left, far_right) = (at(0, 0), at(1, 1));
        // The diagonal runs from near left to far right.
        if u > v {
            let near_right = at(1, 0);
            near_left + (near_right - near_left) * u + (far_right - near_right) * v
        } else {
            let far_left = at(0, 1);
            near_left + (far_left - near_left) * v + (far_right - far_left) * u
        }
    }

    /// One tile in its own coordinates.
    pub(super) fn tile_mesh(&self, tile_x: usize, tile_z: usize) -> Mesh {
        let mut mesh = Mesh { name: "ground".to_owned(), ..Mesh::default() };
        for iz in 0..=SQUARES {
            for ix in 0..=SQUARES {
                let (gx, gz) = (tile_x * SQUARES + ix, tile_z * SQUARES + iz);
                let y = self.height_at(gx, gz);
                mesh.positions.push(Vec3::new((ix as f64 * STEP) as f32, y, -(iz as f64 * STEP) as f32));
                let slope_x = self.height_at(gx + 1, gz) - self.height_at(gx.saturating_sub(1), gz);
                let slope_z = self.height_at(gx, gz + 1) - self.height_at(gx, gz.saturating_sub(1));
                mesh.normals.push(Vec3::new(-slope_x, 2.0 * STEP as f32, slope_z).normalize());
            }
        }
        let row = SQUARES as u32 + 1;
        for i in 0..(SQUARES * SQUARES) as u32 {
            let near_left = i / SQUARES as u32 * row + i % SQUARES as u32;
            let (near_right, far_left, far_right) = (near_left + 1, near_left + row, near_left + row + 1);
            mesh.triangles.push([near_left, near_right, far_right]);
            mesh.triangles.push([near_left, far_right, far_left]);
        }
        mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
        mesh
    }
}

/// Height of the land, metres: rolling ground and the hill.
fn height(x: f64, z: f64, seed: u32) -> f64 {
    let (across, along) = (x / HILL.0, (z - CREST_Z) / HILL.1);
    let hill = CREST * libm::exp(-0.5 * (across * across + along * along));
    let mut rolling = 0.0;
    let (mut amplitude, mut wavelength) = (14.0, 230.0);
    for octave in 0..5 {
        rolling += amplitude * noise(x / wavelength, z / wavelength, seed.wrapping_add(octave * 7919));
        amplitude *= 0.45;
        wavelength *= 0.5;
    }
    hill + rolling
}

/// Smooth noise in [−1, 1] with a value at each whole point.
fn noise(x: f64, z: f64, seed: u32) -> f64 {
    let (ix, iz) = (x.floor(), z.floor());
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (u, v) = (fade(x - ix), fade(z - iz));
    let value = |dx: i32, dz: i32| {
        let mut h = seed ^ (ix as i32 + dx).cast_unsigned().wrapping_mul(0x9e37_79b1);
        h ^= (iz as i32 + dz).cast_unsigned().wrapping_mul(0x85eb_ca77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
        f64::from(h ^ (h >> 15)) / f64::from(u32::MAX) * 2.0 - 1.0
    };
    let near = value(0, 0) + (value(1, 0) - value(0, 0)) * u;
    let far = value(0, 1) + (value(1, 1) - value(0, 1)) * u;
    near + (far - near) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_meet_exactly() {
        let terrain = Terrain::new(4, 5);
        let world = |ix: usize, iz: usize, corner: usize| {
            terrain.tile_corner(ix, iz) + terrain.tile_mesh(ix, iz).positions[corner].as_dvec3()
        };
        for k in 0..=SQUARES {
            let row = SQUARES + 1;
            assert_eq!(world(1, 2, k * row + SQUARES), world(2, 2, k * row));
            assert_eq!(world(1, 1, SQUARES * row + k), world(1, 2, k));
        }
    }

    #[test]
    fn the_ground_is_the_mesh() {
        let terrain = Terrain::new(4, 9);
        let mesh = terrain.tile_mesh(2, 1);
        let origin = terrain.tile_corner(2, 1);
        for t in &mesh.triangles {
            let corners = t.map(|v| mesh.positions[v as usize].as_dvec3() + origin);
            let [a, b, c] = corners;
            assert!((b - a).cross(c - a).y > 0.0, "the ground faces up");
            let inside = a * 0.2 + b * 0.3 + c * 0.5;
            assert!((terrain.ground(inside.x, inside.z) - inside.y).abs() < 1e-5);
            assert_eq!(terrain.tile_of(inside.x, inside.z), (2, 1));
        }
    }
}
