//! The light that pictures are shaded in: made to keep forms apart, indoors and out, on surfaces of one grey.
//!
//! A sky and a ground (so that floors, walls and ceilings differ), two far lamps from unlike directions (so
//! that no two walls that meet are alike), and a headlight (so that what turns away from the eye darkens). No
//! shadows. Dark materials are shown lighter than they are, so that stone and wood are not lost in the dark; a
//! white surface never exceeds 1.

use glam::{DMat3, DVec3, Vec3, Vec4};

const SKY: Vec3 = Vec3::new(0.265, 0.28, 0.305);
const GROUND: Vec3 = Vec3::new(0.18, 0.17, 0.16);
const KEY: Vec3 = Vec3::new(0.47, 0.46, 0.44);
const FILL: Vec3 = Vec3::new(0.12, 0.13, 0.145);
const HEADLIGHT: f32 = 0.17;

/// How much brighter a nearly black surface is shown, and how much brighter a white one.
const EXPOSURE_OF_BLACK: f32 = 2.05;
const EXPOSURE_OF_WHITE: f32 = 1.05;

/// Towards the lamps, in world space, not normalised.
const KEY_DIRECTION: DVec3 = DVec3::new(0.6, 0.7, 0.3);
const FILL_DIRECTION: DVec3 = DVec3::new(-0.25, 0.2, -0.9);

/// How far a lamp reaches around a form: 0 stops where the surface turns away, 1 goes all around.
const KEY_WRAP: f32 = 0.25;

/// The lights as seen from one eye.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct Light {
    up: DVec3,
    key: DVec3,
    fill: DVec3,
}

impl Light {
    /// `view_from_world` is the rotation of the view.
    pub(in crate::render) fn new(view_from_world: DMat3) -> Light {
        Light {
            up: view_from_world * DVec3::Y,
            key: view_from_world * KEY_DIRECTION.normalize(),
            fill: view_from_world * FILL_DIRECTION.normalize(),
        }
    }

    /// Light that leaves a white surface with unit `normal` in view space, the headlight's apart.
    pub(in crate::render) fn around(&self, normal: DVec3) -> Vec3 {
        let facing = |direction: DVec3| normal.dot(direction) as f32;
        let key = ((facing(self.key) + KEY_WRAP) / (1.0 + KEY_WRAP)).clamp(0.0, 1.0);
        GROUND.lerp(SKY, (facing(self.up) * 0.5 + 0.5).clamp(0.0, 1.0))
            + KEY * (key * key)
            + FILL * facing(self.fill).clamp(0.0, 1.0)
    }

    /// The headlight's share, for a surface that is seen from `toward_eye`, unit, in view space.
    pub(in crate::render) fn ahead(&self, normal: DVec3, toward_eye: DVec3) -> Vec3 {
        Vec3::splat(HEADLIGHT * (normal.dot(toward_eye) as f32).clamp(0.0, 1.0))
    }
}

/// A surface's colour as shown: linear base colour under `light`, exposed; alpha is kept. What is brighter
/// stays brighter, and hues stay as they are.
pub(in crate::render) fn exposed(base: Vec4, light: Vec3) -> Vec4 {
    let value = base.truncate().max_element().min(1.0);
    let exposure = EXPOSURE_OF_BLACK + (EXPOSURE_OF_WHITE - EXPOSURE_OF_BLACK) * value;
    (base.truncate() * light * exposure).extend(base.w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_within_bounds_and_the_sides_of_a_box_differ() {
        let light = Light::new(DMat3::IDENTITY);
        let mut dark_to_bright = 1.0f32..0.0;
        for i in 0..40 {
            for j in 0..40 {
                let (a, b) = (f64::from(i) * 0.08, f64::from(j) * 0.16);
                let normal = DVec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin());
                let white = exposed(Vec4::ONE, light.around(normal) + light.ahead(normal, normal));
                dark_to_bright.start = dark_to_bright.start.min(white.truncate().min_element());
                dark_to_bright.end = dark_to_bright.end.max(white.max_element());
            }
        }
        assert!(dark_to_bright.start > 0.15 && dark_to_bright.end <= 1.0, "{dark_to_bright:?}");
        // Seen from a corner, where the headlight tells nothing apart.
        let corner = DVec3::ONE.normalize();
        let leaving =
            |n: DVec3| exposed(Vec4::ONE, light.around(n) + light.ahead(n, corner * n.dot(corner).signum()));
        let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        for (i, a) in sides.iter().enumerate() {
            for b in sides[..i].iter().filter(|b| a.dot(**b) == 0.0) {
                let difference = (leaving(*a) - leaving(*b)).abs().max_element();
                assert!(difference > 0.025, "{a} and {b} differ by {difference}");
            }
        }
    }
}
