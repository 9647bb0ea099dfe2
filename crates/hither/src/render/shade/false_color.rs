//! Pictures that are not of light: which surface, how far, which way it faces, where the work was done.
//!
//! Greys are even steps to the eye: a value v in [0, 1] is stored as the linear light of sRGB code v × 255.

use super::{Frame, Image};
use crate::conventions::{Projection, SurfaceId};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// As many visits to a pixel are white in a picture of complexity; the scale is fixed, so that pictures of
/// different algorithms compare.
pub const COMPLEXITY_WHITE: f32 = 256.0;

/// The panels of [Greene 1995, fig. 3.8].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComplexityPanel {
    /// Visits by z-pyramid tests of cubes.
    Cubes,
    /// Visits by tests and scan conversion of polygons.
    Polygons,
    /// Both.
    Sum,
}

/// One log-scale panel of a frame's complexity: a pixel visited n times has grey
/// log(1 + n) / log(1 + [`COMPLEXITY_WHITE`]). `None` if the frame did not record it.
pub fn complexity_image(frame: &Frame, panel: ComplexityPanel) -> Option<Image> {
    let complexity = frame.complexity.as_ref()?;
    let visits = complexity.cubes.iter().zip(&complexity.polygons).map(|(&cubes, &polygons)| match panel {
        ComplexityPanel::Cubes => cubes,
        ComplexityPanel::Polygons => polygons,
        ComplexityPanel::Sum => cubes + polygons,
    });
    let scale = 1.0 / COMPLEXITY_WHITE.ln_1p();
    let pixels = visits.map(|n| opaque(grey(n.max(0.0).ln_1p() * scale))).collect();
    Some(Image { width: frame.view.width, height: frame.view.height, pixels })
}

/// Cubes, polygons and their sum side by side, in this order, as the bottom row of [Greene 1995, fig. 3.8],
/// with `gap` transparent columns between them. `None` if the frame did not record its complexity.
pub fn complexity_panels(frame: &Frame, gap: u32) -> Option<Image> {
    let panels = [ComplexityPanel::Cubes, ComplexityPanel::Polygons, ComplexityPanel::Sum];
    let [a, b, c] = panels.map(|panel| complexity_image(frame, panel));
    let panels = [a?, b?, c?];
    let (width, height) = (frame.view.width as usize, frame.view.height as usize);
    let mut pixels = Vec::with_capacity((3 * width + 2 * gap as usize) * height);
    for y in 0..height {
        for (i, panel) in panels.iter().enumerate() {
            if i > 0 {
                pixels.resize(pixels.len() + gap as usize, [0.0; 4]);
            }
            pixels.extend_from_slice(&panel.pixels[y * width..][..width]);
        }
    }
    Some(Image { width: 3 * frame.view.width + 2 * gap, height: frame.view.height, pixels })
}

/// The nearest and the farthest distance in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthRange {
    near: f64,
    far: f64,
    logarithmic: bool,
}

impl DepthRange {
    pub(super) fn of(frame: &Frame) -> DepthRange {
        const NOTHING: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);
        let rows = (0..frame.view.height).into_par_iter().map(|y| {
            let seen = (0..frame.view.width).filter(|&x| frame.id(x, y).is_some());
            let distances = seen.map(|x| frame.distance(x, y));
            distances.fold(NOTHING, |(near, far), d| (near.min(d), far.max(d)))
        });
        let (near, far) = rows.reduce(|| NOTHING, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let logarithmic = matches!(frame.view.projection, Projection::Perspective { .. });
        DepthRange { near, far, logarithmic }
    }

    /// White at the nearest, dark grey at the farthest; a pinhole's distances by their logarithm.
    pub(super) fn color(&self, distance: f64) -> [f32; 4] {
        let (at, near, far) = if self.logarithmic {
            (distance.ln(), self.near.ln(), self.far.ln())
        } else {
            (distance, self.near, self.far)
        };
        let part = if far > near { ((at - near) / (far - near)).clamp(0.0, 1.0) } else { 0.0 };
        opaque(grey(1.0 - 0.9 * part as f32))
    }
}

/// A colour for each instance, a little lighter or darker from triangle to triangle.
pub(super) fn id_color(id: SurfaceId) -> [f32; 4] {
    let instance = scrambled(u64::from(id.instance) + 1);
    let triangle = scrambled((u64::from(id.instance) << 32) ^ u64::from(id.triangle) ^ 0x5bd1_e995);
    let part = |bits: u64| (bits & 0xffff) as f32 / 65535.0;
    let hue = part(instance) * std::f32::consts::TAU;
    let chroma = 0.08 + 0.07 * part(instance >> 16);
    let lightness = 0.58 + 0.24 * part(instance >> 32) + 0.05 * (part(triangle) - 0.5);
    opaque(linear_from_oklab(lightness, chroma * hue.cos(), chroma * hue.sin()))
}

/// A unit normal in world space as the usual colour: the file's channels are (n + 1) / 2.
pub(super) fn normal_color(normal: DVec3) -> [f32; 4] {
    let half = normal.as_vec3() * 0.5 + 0.5;
    opaque(Vec3::from_array(half.to_array().map(linear)))
}

fn opaque(rgb: Vec3) -> [f32; 4] {
    rgb.extend(1.0).to_array()
}

fn grey(value: f32) -> Vec3 {
    Vec3::splat(linear(value.clamp(0.0, 1.0)))
}

/// Linear light of an sRGB value in [0, 1].
fn linear(s: f32) -> f32 {
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// A permutation of 64 bits in which neighbours have nothing in common (SplitMix64's finaliser).
fn scrambled(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Linear sRGB of an Oklab colour, clipped to what sRGB can show.
fn linear_from_oklab(lightness: f32, a: f32, b: f32) -> Vec3 {
    let cube = |x: f32| x * x * x;
    let l = cube(lightness + 0.396_337_78 * a + 0.215_803_76 * b);
    let m = cube(lightness - 0.105_561_346 * a - 0.063_854_17 * b);
    let s = cube(lightness - 0.089_484_18 * a - 1.291_485_5 * b);
    let rgb = Vec3::new(
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_38 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    );
    rgb.clamp(Vec3::ZERO, Vec3::ONE)
}
