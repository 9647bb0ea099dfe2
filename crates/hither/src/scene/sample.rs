//! What a surface looks like at a point: texels, alpha, and the holes that masks cut. The same inputs give
//! the same bits on every machine, because a hole decides what is seen.
//!
//! Alpha is never prefiltered here: whether a point is a hole depends on the point alone, not on the eye,
//! so that every algorithm answers alike. Prefiltered colour is in [`TexturePyramids`](super::TexturePyramids).
//!
//! Texel (i, j) has its centre at ((i + ½) / width, (j + ½) / height), row 0 on top, as glTF has it.

use super::{AlphaMode, Filter, Material, Mesh, Scene, Texture, TextureRef, Wrap};
use glam::{DVec2, DVec3, Vec3, Vec4};

/// Linear light, 0 to 1, of each of the 256 codes of sRGB.
pub static LINEAR_FROM_SRGB: [f32; 256] = linear_from_srgb();

const fn linear_from_srgb() -> [f32; 256] {
    let mut table = [0.0; 256];
    let mut code = 0;
    while code < 256 {
        let s = code as f64 / 255.0;
        table[code] = if s <= 0.04045 { s / 12.92 } else { power_2_4((s + 0.055) / 1.055) } as f32;
        code += 1;
    }
    table
}

/// `x` to the power 12/5 for x in (0, 1], by Newton's method for the fifth root: a library's power function
/// may differ in the last bit between platforms.
const fn power_2_4(x: f64) -> f64 {
    let mut root = 1.0;
    let mut step = 0;
    while step < 60 {
        let r4 = root * root * root * root;
        root = 0.8 * root + 0.2 * x / r4;
        step += 1;
    }
    x * x * root * root
}

/// The 2×2 texels around a point and their weights; for [`Filter::Nearest`] one texel, four times.
struct Tap {
    texels: [usize; 4],
    weights: [f64; 4],
}

/// Along one axis of `size` texels: the two texels around `t` and the weight of the second.
pub(super) fn neighbours(t: f64, size: u32, wrap: Wrap, filter: Filter) -> (u32, u32, f64) {
    let n = f64::from(size);
    // Reduced to one period first, so that a huge coordinate costs precision but never overflows.
    let t = if t.is_finite() { t } else { 0.0 };
    let reduced = match wrap {
        Wrap::Repeat => t - t.floor(),
        Wrap::Mirror => t - 2.0 * (t * 0.5).floor(),
        Wrap::Clamp => t.clamp(0.0, 1.0),
    };
    let x = match filter {
        Filter::Nearest => reduced * n,
        Filter::Linear => reduced * n - 0.5,
    };
    let first = x.floor();
    let texel = |i: i64| -> u32 {
        let period = i64::from(size);
        let i = match wrap {
            Wrap::Repeat => i.rem_euclid(period),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * period);
                if i < period { i } else { 2 * period - 1 - i }
            }
            Wrap::Clamp => i.clamp(0, period - 1),
        };
        i as u32
    };
    match filter {
        Filter::Nearest => (texel(first as i64), texel(first as i64), 0.0),
        Filter::Linear => (texel(first as i64), texel(first as i64 + 1), x - first),
    }
}

impl Texture {
    fn tap(&self, uv: DVec2, wrap: [Wrap; 2], filter: Filter) -> Tap {
        let (x0, x1, fx) = neighbours(uv.x, self.width, wrap[0], filter);
        let (y0, y1, fy) = neighbours(uv.y, self.height, wrap[1], filter);
        let at = |x: u32, y: u32| y as usize * self.width as usize + x as usize;
        Tap {
            texels: [at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1)],
            weights: [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy],
        }
    }

    /// Linear RGBA, straight alpha, at `uv` (v down), from the full-size image. Each channel is filtered by
    /// itself. Any `uv` is safe: a huge one loses precision, one that is no number counts as 0.
    pub fn sample_level0(&self, uv: DVec2, wrap: [Wrap; 2], filter: Filter) -> Vec4 {
        let tap = self.tap(uv, wrap, filter);
        let mut sum = Vec4::ZERO;
        for (&at, &weight) in tap.texels.iter().zip(&tap.weights) {
            let [r, g, b, a] = self.texels[at];
            let rgb = [r, g, b].map(|c| LINEAR_FROM_SRGB[c as usize]);
            sum += Vec3::from_array(rgb).extend(f32::from(a) / 255.0) * weight as f32;
        }
        sum
    }

    /// Alpha alone of [`Texture::sample_level0`], unrounded.
    fn alpha_level0(&self, uv: DVec2, wrap: [Wrap; 2], filter: Filter) -> f64 {
        let tap = self.tap(uv, wrap, filter);
        let sum: f64 =
            tap.texels.iter().zip(&tap.weights).map(|(&at, w)| w * f64::from(self.texels[at][3])).sum();
        sum / 255.0
    }
}

/// One triangle's material and attributes, gathered for being asked about many of its points.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    pub(super) base_color: Vec4,
    pub(super) alpha_mode: AlphaMode,
    pub(super) texture: Option<Textured<'a>>,
    pub(super) colors: Option<[Vec4; 3]>,
}

/// A texture and where its coordinates are at the three corners, transformed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Textured<'a> {
    pub(super) image: &'a Texture,
    pub(super) how: &'a TextureRef,
    pub(super) uvs: [DVec2; 3],
}

impl Textured<'_> {
    pub(super) fn uv(&self, at: DVec3) -> DVec2 {
        self.uvs[0] * at.x + self.uvs[1] * at.y + self.uvs[2] * at.z
    }
}

impl Surface<'_> {
    /// What the surface's alpha means.
    pub fn alpha_mode(&self) -> AlphaMode {
        self.alpha_mode
    }

    /// Alpha at barycentric weights `at` (of corners 0, 1, 2; sum 1): material × vertices × full-size
    /// texture. Not clamped; not a number where the vertices' alpha is none.
    pub fn alpha(&self, at: DVec3) -> f32 {
        let mut alpha = f64::from(self.base_color.w);
        if let Some(colors) = &self.colors {
            alpha *= at.dot(Vec3::new(colors[0].w, colors[1].w, colors[2].w).as_dvec3());
        }
        if let Some(t) = &self.texture {
            alpha *= t.image.alpha_level0(t.uv(at), t.how.wrap, t.how.filter);
        }
        // Rounding to f32 absorbs the last bits of weights that should sum to 1 but do not quite.
        alpha as f32
    }

    /// Whether a masked surface has a hole at `at`; opaque and blended surfaces have none. An alpha that is
    /// no number is a hole.
    pub fn is_hole(&self, at: DVec3) -> bool {
        match self.alpha_mode {
            AlphaMode::Mask { cutoff } => {
                let alpha = self.alpha(at);
                alpha < cutoff || alpha.is_nan()
            }
            AlphaMode::Opaque | AlphaMode::Blend => false,
        }
    }
}

impl Scene {
    /// Gathers what is needed to look at triangle `triangle` of mesh `mesh`. Both must exist.
    ///
    /// A texture on a mesh without texture coordinates is ignored.
    pub fn surface(&self, mesh: u32, triangle: u32) -> Surface<'_> {
        let mesh: &Mesh = &self.meshes[mesh as usize];
        let corners = mesh.triangles[triangle as usize].map(|v| v as usize);
        let colors = (!mesh.colors.is_empty()).then(|| corners.map(|v| mesh.colors[v]));
        let Some(material) = mesh.material_of(triangle) else {
            return Surface { base_color: Vec4::ONE, alpha_mode: AlphaMode::Opaque, texture: None, colors };
        };
        let material: &Material = &self.materials[material as usize];
        let texture = material.texture.as_ref().filter(|_| !mesh.uvs.is_empty()).map(|how| Textured {
            image: &self.textures[how.texture as usize],
            how,
            uvs: corners.map(|v| how.transform.transform_point2(mesh.uvs[v].as_dvec2())),
        });
        Surface { base_color: material.base_color, alpha_mode: material.alpha, texture, colors }
    }

    /// Whether surfaces of `material` tint what is behind them and hide nothing.
    pub fn is_blended(&self, material: Option<u32>) -> bool {
        material.is_some_and(|m| self.materials[m as usize].alpha == AlphaMode::Blend)
    }

    /// [`Surface::alpha`] of one point.
    pub fn surface_alpha(&self, mesh: u32, triangle: u32, barycentric: DVec3) -> f32 {
        self.surface(mesh, triangle).alpha(barycentric)
    }

    /// [`Surface::is_hole`] of one point.
    pub fn is_hole(&self, mesh: u32, triangle: u32, barycentric: DVec3) -> bool {
        self.surface(mesh, triangle).is_hole(barycentric)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Primitive;
    use glam::{DAffine2, Vec2};
    use proptest::prelude::*;

    const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

    /// Width × 1, alpha as given.
    fn strip(alphas: &[u8]) -> Texture {
        Texture {
            name: String::new(),
            width: alphas.len() as u32,
            height: 1,
            texels: alphas.iter().map(|&a| [a, 0, 255, a]).collect(),
        }
    }

    fn alpha(t: &Texture, u: f64, wrap: Wrap, filter: Filter) -> f64 {
        t.alpha_level0(DVec2::new(u, 0.5), [wrap, Wrap::Clamp], filter) * 255.0
    }

    /// A unit right triangle with texture coordinates equal to its positions.
    fn masked(texture: Texture, cutoff: f32) -> Scene {
        let mut scene = Scene::new("");
        scene.textures.push(texture);
        scene.materials.push(Material {
            alpha: AlphaMode::Mask { cutoff },
            texture: Some(TextureRef {
                texture: 0,
                transform: DAffine2::IDENTITY,
                wrap: [Wrap::Clamp; 2],
                filter: Filter::Nearest,
            }),
            ..Material::default()
        });
        scene.meshes.push(Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            triangles: vec![[0, 1, 2]],
            primitives: vec![Primitive { triangles: 0..1, material: Some(0) }],
            ..Mesh::default()
        });
        scene
    }

    #[test]
    fn srgb_table_follows_its_formula_and_its_ends_are_exact() {
        assert_eq!(LINEAR_FROM_SRGB[0], 0.0);
        assert_eq!(LINEAR_FROM_SRGB[255], 1.0);
        for (code, &linear) in LINEAR_FROM_SRGB.iter().enumerate() {
            let s = code as f64 / 255.0;
            let expected = if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            assert!((f64::from(linear) - expected).abs() < 1e-7, "code {code}: {linear} is not {expected}");
        }
    }

    #[test]
    fn texel_centres_return_the_texel_and_midpoints_the_mean() {
        let t = strip(&[0, 100, 200, 40]);
        for (i, expected) in [0.0, 100.0, 200.0, 40.0].into_iter().enumerate() {
            let u = (i as f64 + 0.5) / 4.0;
            for wrap in WRAPS {
                assert_eq!(alpha(&t, u, wrap, Filter::Nearest), expected);
                assert_eq!(alpha(&t, u, wrap, Filter::Linear), expected);
            }
        }
        assert_eq!(alpha(&t, 0.25, Wrap::Clamp, Filter::Linear), 50.0);
        assert_eq!(alpha(&t, 0.25, Wrap::Clamp, Filter::Nearest), 100.0);
    }

    #[test]
    fn wrap_modes_meet_their_neighbours_at_the_border() {
        let t = strip(&[0, 100, 200, 40]);
        assert_eq!(alpha(&t, 0.0, Wrap::Repeat, Filter::Linear), 20.0);
        assert_eq!(alpha(&t, 1.0, Wrap::Repeat, Filter::Linear), 20.0);
        assert_eq!(alpha(&t, 1.0, Wrap::Mirror, Filter::Linear), 40.0);
        assert_eq!(alpha(&t, 2.0, Wrap::Mirror, Filter::Linear), 0.0);
        assert_eq!(alpha(&t, 1.375, Wrap::Mirror, Filter::Linear), 200.0);
        assert_eq!(alpha(&t, -0.375, Wrap::Mirror, Filter::Linear), 100.0);
        assert_eq!(alpha(&t, -7.0, Wrap::Clamp, Filter::Linear), 0.0);
        assert_eq!(alpha(&t, 7.0, Wrap::Clamp, Filter::Nearest), 40.0);
        assert_eq!(alpha(&t, 1.0, Wrap::Repeat, Filter::Nearest), 0.0);
    }

    #[test]
    fn coordinates_that_are_huge_or_no_numbers_are_safe() {
        let t = strip(&[9, 90]);
        let awful =
            [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 1e300, -1e-320, -0.0, 1e18];
        for u in awful {
            for v in awful {
                for wrap in WRAPS {
                    for filter in [Filter::Nearest, Filter::Linear] {
                        let texel = t.sample_level0(DVec2::new(u, v), [wrap; 2], filter);
                        assert!(texel.is_finite() && texel.w >= 0.035 && texel.w <= 0.353, "{texel}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_mask_cuts_a_hole_exactly_where_alpha_is_below_the_cutoff() {
        let scene = masked(strip(&[127, 128]), 128.0 / 255.0);
        assert!(scene.validate().is_ok());
        assert!(scene.is_hole(0, 0, DVec3::new(0.6, 0.4, 0.0)));
        assert!(!scene.is_hole(0, 0, DVec3::new(0.4, 0.6, 0.0)));
        assert_eq!(scene.surface_alpha(0, 0, DVec3::new(0.4, 0.6, 0.0)), 128.0 / 255.0);
    }

    #[test]
    fn only_masks_have_holes_and_a_missing_number_is_one() {
        let mut scene = masked(strip(&[0]), 0.5);
        let centre = DVec3::splat(1.0 / 3.0);
        assert!(scene.is_hole(0, 0, centre));
        scene.materials[0].alpha = AlphaMode::Opaque;
        assert!(!scene.is_hole(0, 0, centre));
        scene.materials[0].alpha = AlphaMode::Blend;
        assert!(!scene.is_hole(0, 0, centre));
        scene.materials[0].alpha = AlphaMode::Mask { cutoff: 0.0 };
        assert!(!scene.is_hole(0, 0, centre));
        scene.meshes[0].colors = vec![Vec4::NAN; 3];
        assert!(scene.is_hole(0, 0, centre));
    }

    #[test]
    fn vertex_alpha_at_the_cutoff_everywhere_leaves_no_hole() {
        let mut scene = masked(strip(&[255]), 0.3);
        scene.meshes[0].colors = vec![Vec4::new(1.0, 1.0, 1.0, 0.3); 3];
        for i in 0..1000 {
            let (a, b) = (f64::from(i % 31) / 77.7, f64::from(i % 37) / 99.9);
            assert!(!scene.is_hole(0, 0, DVec3::new(a, b, 1.0 - a - b)), "weights {a} {b}");
        }
    }

    #[test]
    fn the_texture_transform_comes_before_wrapping() {
        let mut scene = masked(strip(&[0, 255]), 0.5);
        let how = scene.materials[0].texture.as_mut().unwrap();
        how.transform = DAffine2::from_translation(DVec2::new(0.5, 0.0));
        how.wrap = [Wrap::Repeat; 2];
        assert!(!scene.is_hole(0, 0, DVec3::new(0.75, 0.25, 0.0)));
        assert!(scene.is_hole(0, 0, DVec3::new(0.25, 0.75, 0.0)));
    }

    proptest! {
        #[test]
        fn every_sample_lies_between_the_extremes(
            alphas in prop::collection::vec(any::<u8>(), 1..9),
            u in -20.0..20.0f64,
            wrap in 0usize..3,
            linear in any::<bool>(),
        ) {
            let t = strip(&alphas);
            let filter = if linear { Filter::Linear } else { Filter::Nearest };
            let a = alpha(&t, u, WRAPS[wrap], filter);
            let (low, high) = (alphas.iter().min().unwrap(), alphas.iter().max().unwrap());
            prop_assert!(a >= f64::from(*low) - 1e-9 && a <= f64::from(*high) + 1e-9);
        }

        #[test]
        fn repeating_and_mirroring_have_their_periods(u in -4.0..4.0f64, k in -5i32..5) {
            let t = strip(&[1, 50, 7, 200, 90]);
            let k = f64::from(k);
            for (wrap, period) in [(Wrap::Repeat, 1.0), (Wrap::Mirror, 2.0)] {
                let (a, b) = (alpha(&t, u, wrap, Filter::Linear), alpha(&t, u + k * period, wrap, Filter::Linear));
                prop_assert!((a - b).abs() < 1e-9);
            }
            let (a, b) = (alpha(&t, u, Wrap::Mirror, Filter::Linear), alpha(&t, -u, Wrap::Mirror, Filter::Linear));
            prop_assert!((a - b).abs() < 1e-9);
        }
    }
}
