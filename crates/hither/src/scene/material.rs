//! Base colour, texture, alpha and sidedness: what decides visibility, and what a plain shading needs.

use super::{Scene, SceneError, fault};
use glam::{DAffine2, Vec4};

/// How a surface looks and what it hides.
#[derive(Clone, Debug)]
pub struct Material {
    /// The material's name in its file, possibly empty.
    pub name: String,
    /// Linear RGBA factor, not premultiplied.
    pub base_color: Vec4,
    /// Texture multiplied onto `base_color`.
    pub texture: Option<TextureRef>,
    /// What alpha means.
    pub alpha: AlphaMode,
    /// Whether back faces are drawn too.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: Vec4::ONE,
            texture: None,
            alpha: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

/// What a surface's alpha means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored; the surface hides what is behind it.
    Opaque,
    /// Where alpha is at least the cutoff the surface is opaque, elsewhere it is a hole.
    Mask {
        /// Threshold, glTF's default is 0.5.
        cutoff: f32,
    },
    /// The surface tints what is behind it and hides nothing.
    Blend,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Applied to a vertex's texture coordinates first (`KHR_texture_transform`).
    pub transform: DAffine2,
    /// Behaviour outside [0, 1] along u and v.
    pub wrap: [Wrap; 2],
    /// How texels are combined.
    pub filter: Filter,
}

/// What lies outside a texture's unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// The texture mirrored.
    Mirror,
    /// Its border texel.
    Clamp,
}

/// How texels are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The nearest texel; prefiltered as `Linear` is where the texture is shrunk on screen.
    Nearest,
    /// Bilinear; prefiltered by halving where the texture is shrunk on screen.
    Linear,
}

/// A decoded image.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The image's name or path in its file, possibly empty.
    pub name: String,
    /// Width, pixels, at least 1.
    pub width: u32,
    /// Height, pixels, at least 1.
    pub height: u32,
    /// Rows from the top; sRGB colour with straight alpha.
    pub texels: Vec<[u8; 4]>,
}

pub(super) fn validate(scene: &Scene) -> Result<(), SceneError> {
    for (i, material) in scene.materials.iter().enumerate() {
        let place = || format!("material {i} (\"{}\")", material.name);
        if !material.base_color.is_finite() {
            return Err(fault(place(), "its base colour is not finite"));
        }
        if let AlphaMode::Mask { cutoff } = material.alpha
            && !cutoff.is_finite()
        {
            return Err(fault(place(), "its alpha cutoff is not finite"));
        }
        if let Some(r) = material.texture {
            if r.texture as usize >= scene.textures.len() {
                return Err(fault(place(), "it names a texture that does not exist"));
            }
            if !r.transform.is_finite() {
                return Err(fault(place(), "its texture transform is not finite"));
            }
        }
    }
    for (i, t) in scene.textures.iter().enumerate() {
        if t.width == 0 || t.height == 0 || t.texels.len() as u64 != u64::from(t.width) * u64::from(t.height)
        {
            return Err(fault(format!("texture {i} (\"{}\")", t.name), "its size and its texels disagree"));
        }
    }
    Ok(())
}
