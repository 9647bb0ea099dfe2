//! Textures prefiltered for being shown small: each level half the one before, averaged in linear light.
//!
//! Two kinds, because alpha means two things. Where it is coverage (mask, blend), colours are weighted by
//! it, so that what lies under transparent texels never bleeds out. Where it is ignored (opaque), colours
//! count alike. Levels hold 16 bits a channel; the full-size image is read from the texture itself.

use super::sample::neighbours;
use super::{AlphaMode, Filter, LINEAR_FROM_SRGB, Scene, Surface, Texture, Wrap};
use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// Most samples along the longer side of a pixel's footprint, where a texture is seen at a grazing angle.
const MAX_PROBES: f64 = 8.0;

/// Prefiltered levels of a scene's textures. Belongs to one scene; its textures must not change.
#[derive(Clone, Debug, Default)]
pub struct TexturePyramids {
    /// For each texture, the kind with colours weighted by alpha, if it was asked for.
    weighted: Vec<Option<Pyramid>>,
    /// For each texture, the kind that ignores alpha, if it was asked for.
    plain: Vec<Option<Pyramid>>,
}

/// The levels below the full-size image: 1, 2, … down to one texel.
#[derive(Clone, Debug, Default)]
struct Pyramid {
    levels: Vec<Level>,
}

/// Rows from the top; linear, colours premultiplied where the pyramid is weighted; 65535 is 1.
#[derive(Clone, Debug)]
struct Level {
    width: u32,
    height: u32,
    texels: Vec<[u16; 4]>,
}

impl TexturePyramids {
    /// Nothing is built yet; see [`TexturePyramids::prepare`].
    pub fn new(scene: &Scene) -> TexturePyramids {
        let none = vec![None; scene.textures.len()];
        TexturePyramids { weighted: none.clone(), plain: none }
    }

    /// Builds what every material needs.
    pub fn build(scene: &Scene) -> TexturePyramids {
        let mut pyramids = TexturePyramids::new(scene);
        pyramids.prepare(scene, 0..scene.materials.len() as u32);
        pyramids
    }

    /// Builds what `materials` need and is not built yet. Cost: the texels of those textures, once.
    pub fn prepare(&mut self, scene: &Scene, materials: impl IntoIterator<Item = u32>) {
        assert_eq!(self.plain.len(), scene.textures.len(), "the pyramids belong to another scene");
        let mut missing: Vec<(u32, bool)> = Vec::new();
        for material in materials {
            let material = &scene.materials[material as usize];
            let weighted = material.alpha != AlphaMode::Opaque;
            if let Some(texture) = material.texture.map(|t| t.texture)
                && self.kind(weighted)[texture as usize].is_none()
            {
                missing.push((texture, weighted));
            }
        }
        missing.sort_unstable();
        missing.dedup();
        let built: Vec<Pyramid> = missing
            .par_iter()
            .map(|&(texture, weighted)| Pyramid::build(&scene.textures[texture as usize], weighted))
            .collect();
        for (&(texture, weighted), pyramid) in missing.iter().zip(built) {
            let kind = if weighted { &mut self.weighted } else { &mut self.plain };
            kind[texture as usize] = Some(pyramid);
        }
    }

    fn kind(&self, weighted: bool) -> &[Option<Pyramid>] {
        if weighted { &self.weighted } else { &self.plain }
    }
}

impl Pyramid {
    fn build(image: &Texture, weighted: bool) -> Pyramid {
        let (width, height) = (image.width, image.height);
        let mut levels: Vec<Level> = Vec::new();
        if width > 1 || height > 1 {
            levels.push(halved(width, height, |at| linear(image.texels[at], weighted)));
        }
        while let Some(last) = levels.last().filter(|l| l.width > 1 || l.height > 1) {
            levels.push(halved(last.width, last.height, |at| last.texel(at)));
        }
        Pyramid { levels }
    }
}

impl Level {
    fn texel(&self, at: usize) -> Vec4 {
        Vec4::from_array(self.texels[at].map(f32::from)) * (1.0 / 65535.0)
    }
}

/// An sRGB texel in linear light; premultiplied if `weighted`, else with alpha 1.
fn linear([r, g, b, a]: [u8; 4], weighted: bool) -> Vec4 {
    let rgb = Vec3::from_array([r, g, b].map(|c| LINEAR_FROM_SRGB[c as usize]));
    if weighted {
        let alpha = f32::from(a) / 255.0;
        (rgb * alpha).extend(alpha)
    } else {
        rgb.extend(1.0)
    }
}

/// Which texels of an axis of `size` a texel of the halved axis covers, and how much of each.
fn cover(size: u32, halved: u32, at: u32) -> (u32, [f32; 3]) {
    if size == 1 {
        return (0, [1.0, 0.0, 0.0]);
    }
    if size == 2 * halved {
        return (2 * at, [0.5, 0.5, 0.0]);
    }
    // An odd size n = 2m + 1: each of the m texels covers n / m of the old ones, the middle one wholly.
    let n = size as f32;
    (2 * at, [(halved - at) as f32 / n, halved as f32 / n, (at + 1) as f32 / n])
}

fn halved(width: u32, height: u32, texel: impl Fn(usize) -> Vec4) -> Level {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let mut texels = Vec::with_capacity(w as usize * h as usize);
    for y in 0..h {
        let (y0, wy) = cover(height, h, y);
        for x in 0..w {
            let (x0, wx) = cover(width, w, x);
            let mut sum = Vec4::ZERO;
            for (dy, &wy) in wy.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                for (dx, &wx) in wx.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    let at = (y0 as usize + dy) * width as usize + x0 as usize + dx;
                    sum += texel(at) * (wx * wy);
                }
            }
            texels.push((sum * 65535.0).round().to_array().map(|c| c as u16));
        }
    }
    Level { width: w, height: h, texels }
}

/// A texture with its pyramid, ready to be looked at.
struct Prefiltered<'a> {
    image: &'a Texture,
    levels: &'a [Level],
    wrap: [Wrap; 2],
    filter: Filter,
    weighted: bool,
}

impl Prefiltered<'_> {
    /// Bilinear within one level (the full-size one as the filter says).
    fn bilinear(&self, level: usize, uv: DVec2) -> Vec4 {
        let (width, height, filter) = match level.checked_sub(1) {
            None => (self.image.width, self.image.height, self.filter),
            Some(i) => (self.levels[i].width, self.levels[i].height, Filter::Linear),
        };
        let (x0, x1, fx) = neighbours(uv.x, width, self.wrap[0], filter);
        let (y0, y1, fy) = neighbours(uv.y, height, self.wrap[1], filter);
        let texel = |x: u32, y: u32| {
            let at = y as usize * width as usize + x as usize;
            match level.checked_sub(1) {
                None => linear(self.image.texels[at], self.weighted),
                Some(i) => self.levels[i].texel(at),
            }
        };
        if filter == Filter::Nearest {
            return texel(x0, y0);
        }
        let (fx, fy) = (fx as f32, fy as f32);
        texel(x0, y0).lerp(texel(x1, y0), fx).lerp(texel(x0, y1).lerp(texel(x1, y1), fx), fy)
    }

    /// Between two levels; `level` 0 is the full-size image.
    fn trilinear(&self, level: f64, uv: DVec2) -> Vec4 {
        let last = self.levels.len();
        let low = level.max(0.0).min(last as f64);
        let (floor, part) = (low.floor(), low.fract());
        let coarse = self.bilinear(floor as usize, uv);
        if part == 0.0 { coarse } else { coarse.lerp(self.bilinear(floor as usize + 1, uv), part as f32) }
    }

    /// The mean over a pixel whose sides are `sides` in texture coordinates.
    fn over_footprint(&self, uv: DVec2, sides: [DVec2; 2]) -> Vec4 {
        let size = DVec2::new(f64::from(self.image.width), f64::from(self.image.height));
        let texels = sides.map(|s| s * size);
        let lengths = texels.map(|t| t.length());
        let longer = if lengths[0] >= lengths[1] { 0 } else { 1 };
        let long = lengths[longer];
        if !long.is_finite() {
            return self.trilinear(self.levels.len() as f64, uv);
        }
        if long <= 1.0 {
            return self.bilinear(0, uv);
        }
        let short = texels[0].perp_dot(texels[1]).abs() / long;
        let probes = (long / short.max(1.0)).ceil().clamp(1.0, MAX_PROBES);
        let level = (long / probes).log2();
        let mut sum = Vec4::ZERO;
        for k in 0..probes as u32 {
            let offset = (f64::from(k) + 0.5) / probes - 0.5;
            sum += self.trilinear(level, uv + sides[longer] * offset);
        }
        sum / probes as f32
    }
}

impl Surface<'_> {
    /// The base colour, as [`Surface::base_color`] gives it, if it is the same at every point.
    pub fn uniform_color(&self) -> Option<Vec4> {
        let uniform = self.colors.is_none() && self.texture.is_none();
        uniform.then(|| self.bounded(self.base_color))
    }

    /// Whether a texture is looked at, so that a pixel's size matters.
    pub fn is_textured(&self) -> bool {
        self.texture.is_some()
    }

    /// Linear RGBA with straight alpha in [0, 1], at barycentric weights `at`, averaged over a pixel:
    /// `per_pixel` is how the weights change from one pixel to the next, in x and in y. Material × vertices
    /// × texture, prefiltered where the texture is shrunk. Alpha is 1 unless the surface is blended.
    ///
    /// `pyramids` must have been prepared for the surface's material. Colours that are no numbers are 0.
    pub fn base_color(&self, at: DVec3, per_pixel: [DVec3; 2], pyramids: &TexturePyramids) -> Vec4 {
        let mut color = self.base_color;
        if let Some([a, b, c]) = self.colors {
            color *= a * at.x as f32 + b * at.y as f32 + c * at.z as f32;
        }
        if let Some(t) = &self.texture {
            let weighted = self.alpha_mode != AlphaMode::Opaque;
            let pyramid = pyramids.kind(weighted)[t.how.texture as usize].as_ref();
            let prefiltered = Prefiltered {
                image: t.image,
                levels: &pyramid.expect("the pyramids are prepared for what is shaded").levels,
                wrap: t.how.wrap,
                filter: t.how.filter,
                weighted,
            };
            let uv = t.uv(at);
            let texel = prefiltered.over_footprint(uv, per_pixel.map(|d| t.uv(d)));
            color *= if texel.w > 0.0 {
                (texel.truncate() / texel.w).extend(texel.w)
            } else {
                // Nothing but wholly transparent texels: a mask that keeps them shows their own colour.
                let own = t.image.sample_level0(uv, t.how.wrap, t.how.filter);
                own.truncate().extend(0.0)
            };
        }
        self.bounded(color)
    }

    fn bounded(&self, color: Vec4) -> Vec4 {
        let finite = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
        let alpha = if self.alpha_mode == AlphaMode::Blend { finite(color.w).min(1.0) } else { 1.0 };
        Vec4::new(finite(color.x), finite(color.y), finite(color.z), alpha)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh, Primitive, TextureRef};
    use glam::{DAffine2, Vec2};
    use proptest::prelude::*;

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let at = |i: u32| texel(i % width, i / width);
        Texture { name: String::new(), width, height, texels: (0..width * height).map(at).collect() }
    }

    /// A triangle whose texture coordinates are its weights of corners 1 and 2.
    fn scene(image: Texture, alpha: AlphaMode, filter: Filter) -> Scene {
        let how = TextureRef { texture: 0, transform: DAffine2::IDENTITY, wrap: [Wrap::Repeat; 2], filter };
        Scene {
            textures: vec![image],
            materials: vec![Material { texture: Some(how), alpha, ..Material::default() }],
            meshes: vec![Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
                triangles: vec![[0, 1, 2]],
                primitives: vec![Primitive { triangles: 0..1, material: Some(0) }],
                ..Mesh::default()
            }],
            ..Scene::new("")
        }
    }

    /// Colour at (u, v) of a pixel `du` by `dv` wide in texture coordinates.
    fn seen(scene: &Scene, uv: (f64, f64), size: (f64, f64)) -> Vec4 {
        let weights = |u: f64, v: f64, sum: f64| DVec3::new(sum - u - v, u, v);
        let sides = [weights(size.0, 0.0, 0.0), weights(0.0, size.1, 0.0)];
        scene.surface(0, 0).base_color(weights(uv.0, uv.1, 1.0), sides, &TexturePyramids::build(scene))
    }

    fn close(a: Vec4, b: Vec4, tolerance: f32) -> bool {
        (a - b).abs().max_element() <= tolerance
    }

    #[test]
    fn a_pixel_the_size_of_a_texel_sees_that_texel() {
        let t = image(8, 4, |x, y| [(x * 30) as u8, (y * 60) as u8, 7, 255]);
        for filter in [Filter::Nearest, Filter::Linear] {
            let scene = scene(t.clone(), AlphaMode::Opaque, filter);
            let color = seen(&scene, (5.5 / 8.0, 2.5 / 4.0), (1.0 / 8.0, 1.0 / 4.0));
            let expected = [150, 120, 7].map(|c: usize| LINEAR_FROM_SRGB[c]);
            assert!(close(color, Vec3::from_array(expected).extend(1.0), 1e-6), "{color}");
        }
    }

    #[test]
    fn a_checkerboard_seen_from_afar_is_half_as_bright_in_linear_light() {
        let t = image(64, 64, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        let scene = scene(t, AlphaMode::Opaque, Filter::Linear);
        for size in [0.1, 1.0, 50.0, f64::MAX, f64::INFINITY, f64::NAN] {
            let color = seen(&scene, (0.3, 0.4), (size, size));
            assert!(close(color, Vec4::new(0.5, 0.5, 0.5, 1.0), 1e-3), "{size}: {color}");
        }
    }

    #[test]
    fn transparent_texels_do_not_bleed_and_opaque_surfaces_ignore_alpha() {
        // Green leaf texels between transparent magenta ones.
        let t = image(16, 16, |x, _| if x % 2 == 0 { [0, 255, 0, 255] } else { [255, 0, 255, 0] });
        let leaf = scene(t.clone(), AlphaMode::Mask { cutoff: 0.5 }, Filter::Linear);
        assert!(close(seen(&leaf, (0.5, 0.5), (0.4, 0.4)), Vec4::new(0.0, 1.0, 0.0, 1.0), 1e-3));
        let glass = scene(t.clone(), AlphaMode::Blend, Filter::Linear);
        assert!(close(seen(&glass, (0.5, 0.5), (0.4, 0.4)), Vec4::new(0.0, 1.0, 0.0, 0.5), 1e-3));
        let wall = scene(t, AlphaMode::Opaque, Filter::Linear);
        assert!(close(seen(&wall, (0.5, 0.5), (0.4, 0.4)), Vec4::new(0.5, 0.5, 0.5, 1.0), 1e-3));
    }

    #[test]
    fn a_mask_that_keeps_transparent_texels_shows_their_colour() {
        let t = image(2, 2, |_, _| [255, 0, 0, 0]);
        let scene = scene(t, AlphaMode::Mask { cutoff: 0.0 }, Filter::Linear);
        assert!(close(seen(&scene, (0.5, 0.5), (0.1, 0.1)), Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6));
    }

    #[test]
    fn a_grazing_view_does_not_blur_across() {
        // Columns of 8 texels, black and white; a footprint 1 texel wide and 8 high stays within one.
        let t = image(64, 64, |x, _| if (x / 8) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        let scene = scene(t, AlphaMode::Opaque, Filter::Linear);
        let white = seen(&scene, (4.0 / 64.0, 0.5), (1.0 / 64.0, 8.0 / 64.0));
        let black = seen(&scene, (12.0 / 64.0, 0.5), (1.0 / 64.0, 8.0 / 64.0));
        assert!(white.x > 0.99 && black.x < 0.01, "{white} {black}");
    }

    #[test]
    fn colours_that_are_no_numbers_are_black_and_alpha_is_bounded() {
        let mut scene = scene(image(1, 1, |_, _| [255; 4]), AlphaMode::Blend, Filter::Linear);
        scene.meshes[0].colors = vec![Vec4::new(f32::NAN, f32::INFINITY, -2.0, 40.0); 3];
        assert_eq!(seen(&scene, (0.2, 0.2), (0.1, 0.1)), Vec4::new(0.0, 0.0, 0.0, 1.0));
    }

    #[test]
    fn only_what_is_asked_for_is_built() {
        let scene = scene(image(4, 4, |_, _| [255; 4]), AlphaMode::Opaque, Filter::Linear);
        let mut pyramids = TexturePyramids::new(&scene);
        pyramids.prepare(&scene, []);
        assert!(pyramids.plain[0].is_none() && pyramids.weighted[0].is_none());
        pyramids.prepare(&scene, [0, 0]);
        assert!(pyramids.plain[0].is_some() && pyramids.weighted[0].is_none());
    }

    proptest! {
        /// Halving loses and invents no light, whatever the size, odd ones included.
        #[test]
        fn every_level_has_the_mean_of_the_image(
            width in 1u32..20, height in 1u32..20, seed in any::<u32>(), weighted in any::<bool>(),
        ) {
            let byte = |x: u32, y: u32, c: u32| {
                (x.wrapping_mul(31).wrapping_add(y * 17).wrapping_add(c * 7).wrapping_mul(seed) >> 13) as u8
            };
            let t = image(width, height, |x, y| [0, 1, 2, 3].map(|c| byte(x, y, c)));
            let mean = t.texels.iter().map(|&p| linear(p, weighted)).sum::<Vec4>() / t.texels.len() as f32;
            let pyramid = Pyramid::build(&t, weighted);
            let mut size = (width, height);
            for level in &pyramid.levels {
                size = ((size.0 / 2).max(1), (size.1 / 2).max(1));
                prop_assert_eq!((level.width, level.height), size);
                let n = level.texels.len();
                let level_mean = (0..n).map(|i| level.texel(i)).sum::<Vec4>() / n as f32;
                prop_assert!(close(level_mean, mean, 1e-4), "{} is not {}", level_mean, mean);
            }
            prop_assert_eq!(size, (1, 1));
        }
    }
}
