//! Textures: the images that base colours use, decoded by a library.
//!
//! An image that cannot be had is told of and its texture left out; the model is read all the same. All
//! images together are decoded to no more than a set total.

use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part, quoted, unsupported};
use super::json::{Document, Index};
use super::material::{Materials, base_texture};
use super::uri;
use crate::{Companions, texture};
use hither::scene::Texture;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The scene's textures, and which of them each of the document's textures is.
pub(super) struct Textures {
    pub(super) textures: Vec<Texture>,
    by_texture: BTreeMap<u32, u32>,
}

impl Textures {
    /// The scene's index for one of the document's textures, if it could be read.
    pub(super) fn scene_index(&self, texture: Index) -> Option<u32> {
        self.by_texture.get(&texture.0).copied()
    }

    /// Reads the images that the used materials need, several at a time.
    pub(super) fn load(
        buffers: &Buffers,
        materials: &Materials,
        companions: &dyn Companions,
        oddities: &mut Oddities,
    ) -> Textures {
        let document = buffers.document();
        let mut image_of: BTreeMap<u32, u32> = BTreeMap::new();
        for texture in materials.used().filter_map(|m| base_texture(&document.materials[m])).map(|t| t.index)
        {
            match image_of_texture(document, texture) {
                Ok(image) => {
                    image_of.insert(texture.0, image);
                }
                Err(fault) => oddities.note(part("texture", texture.at(), ""), left_out(fault)),
            }
        }
        let mut images: Vec<u32> = image_of.values().copied().collect();
        images.sort_unstable();
        images.dedup();
        let mut budget = texture::Budget::default();
        let fetched: Vec<(u32, Result<Vec<u8>, Fault>)> = images
            .into_iter()
            .map(|image| (image, fetch(buffers, image as usize, companions, &mut budget)))
            .collect();
        let decode = |(image, bytes): (u32, Result<Vec<u8>, Fault>)| {
            let name = name_of(document, image as usize);
            let texture = bytes.and_then(|b| texture::decode(&name, &b).or_else(malformed));
            (image, texture)
        };
        let decoded: Vec<(u32, Result<Texture, Fault>)> = fetched.into_par_iter().map(decode).collect();
        let mut textures = Vec::new();
        let mut by_image = BTreeMap::new();
        for (image, decoded) in decoded {
            match decoded {
                Ok(texture) => {
                    by_image.insert(image, textures.len() as u32);
                    textures.push(texture);
                }
                Err(fault) => {
                    let name = name_of(document, image as usize);
                    oddities.note(part("image", image as usize, &name), left_out(fault));
                }
            }
        }
        let by_texture = image_of
            .into_iter()
            .filter_map(|(texture, image)| Some((texture, *by_image.get(&image)?)))
            .collect();
        Textures { textures, by_texture }
    }
}

fn left_out(fault: Fault) -> String {
    format!("{}; the texture is left out", fault.message())
}

fn name_of(document: &Document, image: usize) -> String {
    let image = &document.images[image];
    match &image.uri {
        Some(uri) if image.name.is_empty() && !uri::is_data(uri) => uri.clone(),
        _ => image.name.clone(),
    }
}

/// The image that a texture shows: WebP where it has one, else the ordinary one.
fn image_of_texture(document: &Document, texture: Index) -> Result<u32, Fault> {
    let Some(source) = document.textures.get(texture.at()) else {
        return malformed(format!("a material refers to it, but there are {}", document.textures.len()));
    };
    let webp = source.extensions.get("EXT_texture_webp").and_then(|e| e.source);
    let Some(image) = webp.or(source.source) else {
        return match source.extensions.keys().next() {
            Some(extension) => unsupported(format!(
                "its image is only there as {}, which is not read; convert it to PNG or JPEG",
                quoted(extension)
            )),
            None => malformed("it names no image"),
        };
    };
    if image.at() >= document.images.len() {
        return malformed(format!("it names image {}, but there are {}", image.0, document.images.len()));
    }
    Ok(image.0)
}

/// The bytes of an image, paid for from `budget`.
fn fetch(
    buffers: &Buffers,
    image: usize,
    companions: &dyn Companions,
    budget: &mut texture::Budget,
) -> Result<Vec<u8>, Fault> {
    let source = &buffers.document().images[image];
    let bytes = match (&source.uri, source.buffer_view) {
        (Some(uri), _) => uri::load(uri, companions)?,
        (None, Some(view)) => buffers.view(view)?.to_vec(),
        (None, None) => return malformed("it has neither a URI nor a buffer view"),
    };
    budget.pay(&bytes).or_else(unsupported)?;
    Ok(bytes)
}
