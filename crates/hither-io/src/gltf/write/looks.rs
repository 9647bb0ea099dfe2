//! Materials, textures, samplers and images as they are written: those that meshes use, each once.

use super::binary::Binary;
use super::document::{
    BaseColor, ImageEntry, MaterialEntry, SamplerEntry, TextureEntry, TextureInfo, TextureInfoExtensions,
    TextureTransform,
};
use glam::{DAffine2, DVec2, Vec4};
use hither::scene::{AlphaMode, Filter, Material, Scene, Texture, TextureRef, Wrap};
use std::collections::HashMap;
use std::hash::Hash;

/// Numbers the materials in the order in which they are met.
pub(super) struct Looks {
    used: Numbering<u32>,
}

/// Things numbered in the order in which they are first met.
struct Numbering<T> {
    order: Vec<T>,
    numbers: HashMap<T, u32>,
}

impl<T: Copy + Eq + Hash> Numbering<T> {
    fn new() -> Numbering<T> {
        Numbering { order: Vec::new(), numbers: HashMap::new() }
    }

    fn of(&mut self, thing: T) -> u32 {
        *self.numbers.entry(thing).or_insert_with(|| {
            self.order.push(thing);
            (self.order.len() - 1) as u32
        })
    }
}

/// What goes into the document.
#[derive(Default)]
pub(super) struct Written<'a> {
    pub(super) materials: Vec<MaterialEntry<'a>>,
    pub(super) textures: Vec<TextureEntry>,
    pub(super) images: Vec<ImageEntry<'a>>,
    pub(super) samplers: Vec<SamplerEntry>,
    pub(super) has_transforms: bool,
}

impl Looks {
    pub(super) fn new() -> Looks {
        Looks { used: Numbering::new() }
    }

    /// The written index of the scene's material `index`.
    pub(super) fn material(&mut self, index: u32) -> u32 {
        self.used.of(index)
    }

    /// Writes all that are used. Fails if an image cannot be encoded.
    pub(super) fn finish<'a>(self, scene: &'a Scene, binary: &mut Binary) -> Result<Written<'a>, String> {
        let mut written = Written::default();
        let mut images = Numbering::new();
        let mut samplers = Numbering::new();
        let mut textures = Numbering::new();
        for &m in &self.used.order {
            let material = &scene.materials[m as usize];
            let texture = material.texture.map(|r| {
                let source = images.of(r.texture);
                let sampler = samplers.of(sampler(r.wrap, r.filter));
                let index = textures.of(TextureEntry { sampler, source });
                let extensions = uv_transform(&r);
                written.has_transforms |= extensions.is_some();
                TextureInfo { index, extensions }
            });
            written.materials.push(entry(material, texture));
        }
        for image in images.order {
            let texture = &scene.textures[image as usize];
            let png =
                encode(texture).map_err(|e| format!("texture {image} cannot be written as PNG: {e}"))?;
            let buffer_view = binary.raw(&png, None);
            written.images.push(ImageEntry { name: &texture.name, mime_type: "image/png", buffer_view });
        }
        written.samplers = samplers.order;
        written.textures = textures.order;
        Ok(written)
    }
}

fn entry(material: &Material, base_color_texture: Option<TextureInfo>) -> MaterialEntry<'_> {
    let base_color_factor = material.base_color.clamp(Vec4::ZERO, Vec4::ONE).to_array();
    let (alpha_mode, alpha_cutoff) = match material.alpha {
        AlphaMode::Opaque => (None, None),
        AlphaMode::Mask { cutoff } => (Some("MASK"), Some(cutoff.max(0.0))),
        AlphaMode::Blend => (Some("BLEND"), None),
    };
    MaterialEntry {
        name: &material.name,
        pbr_metallic_roughness: BaseColor { base_color_factor, base_color_texture, metallic_factor: 0.0 },
        alpha_mode,
        alpha_cutoff,
        double_sided: material.double_sided,
    }
}

/// Offset, rotation and scale of `KHR_texture_transform`; `None` for the identity.
fn uv_transform(of: &TextureRef) -> Option<TextureInfoExtensions> {
    if of.transform == DAffine2::IDENTITY {
        return None;
    }
    // The columns are scale.x · (cos, −sin) and scale.y · (sin, cos).
    let (u, v) = (of.transform.matrix2.x_axis, of.transform.matrix2.y_axis);
    let rotation = if u != DVec2::ZERO { (-u.y).atan2(u.x) } else { v.x.atan2(v.y) };
    let (sin, cos) = rotation.sin_cos();
    let scale = [u.dot(DVec2::new(cos, -sin)), v.dot(DVec2::new(sin, cos))];
    let offset = of.transform.translation.to_array();
    Some(TextureInfoExtensions { transform: TextureTransform { offset, rotation, scale } })
}

fn sampler(wrap: [Wrap; 2], filter: Filter) -> SamplerEntry {
    let code = |wrap| match wrap {
        Wrap::Repeat => 10_497,
        Wrap::Mirror => 33_648,
        Wrap::Clamp => 33_071,
    };
    let (mag_filter, min_filter) = match filter {
        Filter::Nearest => (9728, 9728),
        // LINEAR, and LINEAR_MIPMAP_LINEAR.
        Filter::Linear => (9729, 9987),
    };
    SamplerEntry { mag_filter, min_filter, wrap_s: code(wrap[0]), wrap_t: code(wrap[1]) }
}

/// A PNG of the texture, without alpha where it has none.
fn encode(texture: &Texture) -> Result<Vec<u8>, png::EncodingError> {
    let opaque = texture.texels.iter().all(|t| t[3] == 255);
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, texture.width, texture.height);
    encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    if opaque {
        let rgb: Vec<u8> = texture.texels.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect();
        writer.write_image_data(&rgb)?;
    } else {
        writer.write_image_data(texture.texels.as_flattened())?;
    }
    writer.finish()?;
    Ok(out)
}
