//! Materials: base colour with its texture, alpha and sidedness. Only those that meshes use are kept.

use super::fault::{Fault, Oddities, malformed, part, quoted};
use super::json::{self, Document, Index, TextureInfo, Whole};
use glam::{DAffine2, DMat2, DVec2, Vec4};
use hither::scene::{AlphaMode, Filter, Material, TextureRef, Wrap};
use std::cell::RefCell;
use std::collections::BTreeSet;

/// The document's materials, as meshes refer to them.
pub(super) struct Materials<'a> {
    document: &'a Document,
    /// Index in the scene of each of the document's materials; `None` if it is not used.
    scene_index: Vec<Option<u32>>,
    /// The scene's materials of which copies without texture follow them.
    bare: RefCell<Vec<u32>>,
}

impl<'a> Materials<'a> {
    /// Numbers the materials that the meshes in `meshes` use, in the order of the file.
    pub(super) fn used_by(document: &'a Document, meshes: &BTreeSet<usize>) -> Materials<'a> {
        let mut used = vec![false; document.materials.len()];
        for primitive in meshes.iter().flat_map(|&m| &document.meshes[m].primitives) {
            if let Some(flag) = primitive.material.and_then(|m| used.get_mut(m.at())) {
                *flag = true;
            }
        }
        let mut numbers = 0..;
        let scene_index = used.into_iter().map(|used| if used { numbers.next() } else { None }).collect();
        Materials { document, scene_index, bare: RefCell::default() }
    }

    /// The scene's index for a primitive's material.
    pub(super) fn scene_index(&self, material: Option<Index>) -> Result<Option<u32>, Fault> {
        let Some(material) = material else { return Ok(None) };
        match self.scene_index.get(material.at()) {
            Some(&index) => Ok(index),
            None => {
                let there = self.scene_index.len();
                malformed(format!("it refers to material {}, but there are {there}", material.0))
            }
        }
    }

    /// The scene's index for a copy of one of its materials, without the texture.
    pub(super) fn without_texture(&self, material: u32) -> u32 {
        let mut bare = self.bare.borrow_mut();
        let at = bare.iter().position(|&known| known == material).unwrap_or_else(|| {
            bare.push(material);
            bare.len() - 1
        });
        (self.used().count() + at) as u32
    }

    /// Appends the copies that were asked for.
    pub(super) fn add_bare(&self, all: &mut Vec<Material>) {
        for &material in &*self.bare.borrow() {
            all.push(Material { texture: None, ..all[material as usize].clone() });
        }
    }

    /// The document's indices of the materials that are used, in order.
    pub(super) fn used(&self) -> impl Iterator<Item = usize> {
        self.scene_index.iter().enumerate().filter(|(_, index)| index.is_some()).map(|(at, _)| at)
    }

    /// Which set of texture coordinates the material reads.
    pub(super) fn uv_set(&self, material: Option<Index>) -> u32 {
        let info = material.and_then(|m| self.document.materials.get(m.at())).and_then(base_texture);
        info.map_or(0, |info| {
            let overridden = info.extensions.transform.as_ref().and_then(|t| t.tex_coord);
            overridden.unwrap_or(info.tex_coord).0
        })
    }

    /// Whether the material has a base colour texture.
    pub(super) fn is_textured(&self, material: Option<Index>) -> bool {
        material.and_then(|m| self.document.materials.get(m.at())).and_then(base_texture).is_some()
    }
}

/// Factor and texture of the base colour; where there is neither, those of the older specular-glossiness
/// model's diffuse colour.
fn base(material: &json::Material) -> (Option<[f64; 4]>, Option<&TextureInfo>) {
    let pbr = &material.pbr_metallic_roughness;
    match &material.extensions.specular_glossiness {
        Some(older) if pbr.base_color_factor.is_none() && pbr.base_color_texture.is_none() => {
            (older.diffuse_factor, older.diffuse_texture.as_ref())
        }
        _ => (pbr.base_color_factor, pbr.base_color_texture.as_ref()),
    }
}

/// The texture of the base colour.
pub(super) fn base_texture(material: &json::Material) -> Option<&TextureInfo> {
    base(material).1
}

/// Reads material `index`. `texture` gives the scene's texture for one of the document's.
pub(super) fn read(
    document: &Document,
    oddities: &mut Oddities,
    index: usize,
    texture: impl Fn(Index) -> Option<u32>,
) -> Material {
    let source = &document.materials[index];
    let place = part("material", index, &source.name);
    let (factor, info) = base(source);
    let mut base_color = Vec4::from_array(factor.unwrap_or([1.0; 4]).map(|f| f as f32));
    if !base_color.is_finite() {
        base_color = Vec4::ONE;
        oddities.note(place.clone(), "its base colour is out of range; white is used");
    }
    let alpha = match source.alpha_mode.as_deref() {
        None | Some("OPAQUE") => AlphaMode::Opaque,
        Some("BLEND") => AlphaMode::Blend,
        Some("MASK") => {
            let cutoff = source.alpha_cutoff.unwrap_or(0.5) as f32;
            AlphaMode::Mask { cutoff: if cutoff.is_finite() { cutoff } else { 0.5 } }
        }
        Some(other) => {
            oddities
                .note(place.clone(), format!("its alpha mode {} is unknown; it is opaque", quoted(other)));
            AlphaMode::Opaque
        }
    };
    let texture = info.and_then(|info| {
        let scene_texture = texture(info.index)?;
        let sampler = document.textures.get(info.index.at()).and_then(|t| t.sampler);
        let sampler = sampler.and_then(|s| document.samplers.get(s.at()));
        let transform = info.extensions.transform.as_ref().map_or(DAffine2::IDENTITY, uv_transform);
        if !transform.is_finite() {
            oddities.note(place.clone(), "its texture transform is out of range; the texture is left out");
            return None;
        }
        let (wrap, filter) = sampling(sampler);
        Some(TextureRef { texture: scene_texture, transform, wrap, filter })
    });
    let (name, double_sided) = (source.name.clone(), source.double_sided);
    Material { name, base_color, texture, alpha, double_sided }
}

/// `KHR_texture_transform`. Its rotation is counter-clockwise as seen in the image, where v points down.
/// (The extension's listing has the opposite sign; its text, its examples and all implementations agree.)
fn uv_transform(from: &json::TextureTransform) -> DAffine2 {
    let (sin, cos) = from.rotation.sin_cos();
    let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let scale = DMat2::from_diagonal(DVec2::from_array(from.scale.unwrap_or([1.0; 2])));
    DAffine2 { matrix2: rotation * scale, translation: DVec2::from_array(from.offset) }
}

/// Wrapping along u and v, and filtering; glTF's numbers are OpenGL's.
fn sampling(sampler: Option<&json::Sampler>) -> ([Wrap; 2], Filter) {
    let wrap = |code: Option<Whole>| match code.map(|c| c.0) {
        Some(33_071) => Wrap::Clamp,
        Some(33_648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let Some(sampler) = sampler else { return ([Wrap::Repeat; 2], Filter::Linear) };
    let filter = match (sampler.mag_filter.map(|c| c.0), sampler.min_filter.map(|c| c.0)) {
        // NEAREST and the two NEAREST_MIPMAP; enlarging decides where it is stated.
        (Some(9728), _) | (None, Some(9728 | 9984 | 9986)) => Filter::Nearest,
        _ => Filter::Linear,
    };
    ([wrap(sampler.wrap_s), wrap(sampler.wrap_t)], filter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_transform_shows_the_quadrant_of_the_specification() {
        // "Only the lower left quadrant of the source image, rotated clockwise 90°."
        let transform = uv_transform(&json::TextureTransform {
            offset: [0.0, 1.0],
            rotation: std::f64::consts::FRAC_PI_2,
            scale: Some([0.5, 0.5]),
            tex_coord: None,
        });
        let near = |a: DVec2, b: DVec2| (a - b).length() < 1e-12;
        assert!(near(transform.transform_point2(DVec2::ZERO), DVec2::new(0.0, 1.0)));
        assert!(near(transform.transform_point2(DVec2::X), DVec2::new(0.0, 0.5)));
        assert!(near(transform.transform_point2(DVec2::ONE), DVec2::new(0.5, 0.5)));
    }

    #[test]
    fn enlarging_decides_the_filter() {
        let sampler = |mag: Option<u64>, min: Option<u64>| json::Sampler {
            mag_filter: mag.map(Whole),
            min_filter: min.map(Whole),
            ..Default::default()
        };
        assert_eq!(sampling(Some(&sampler(Some(9728), Some(9987)))).1, Filter::Nearest);
        assert_eq!(sampling(Some(&sampler(Some(9729), Some(9728)))).1, Filter::Linear);
        assert_eq!(sampling(Some(&sampler(None, Some(9984)))).1, Filter::Nearest);
        assert_eq!(sampling(None), ([Wrap::Repeat; 2], Filter::Linear));
    }
}
