//! Textures: the images that base colours use, decoded by a library.
//!
//! An image that cannot be had is told of and its texture left out; the model is read all the same. No
//! image is decoded to a size that its bytes do not make likely, nor all of them to more than a set total.

use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part, quoted, unsupported};
use super::json::{Document, Index};
use super::material::{Materials, base_texture};
use super::uri;
use hither::scene::Texture;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Longest side of an image, pixels.
const LONGEST_SIDE: u32 = 16_384;
/// An image of so many pixels is decoded whatever its file's length.
const FREE_PIXELS: u64 = 4096 * 4096;
/// A larger one needs a byte of its file for so many pixels. (A PNG of one colour takes one for about 350.)
const PIXELS_PER_BYTE: u64 = 4096;
/// All images of a file together, pixels: 2 GiB.
const ALL_PIXELS: u64 = 1 << 29;
/// An image's file, bytes.
const LONGEST_FILE: u64 = 1 << 30;

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
        path: &Path,
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
        let mut pixels_left = ALL_PIXELS;
        let sources: Vec<Result<Vec<u8>, Fault>> =
            images.iter().map(|&i| fetch(buffers, i as usize, path, &mut pixels_left)).collect();
        let decoded: Vec<Result<Texture, Fault>> =
            sources.into_par_iter().map(|bytes| bytes.and_then(|b| decode(&b))).collect();
        let mut textures = Vec::new();
        let mut by_image = BTreeMap::new();
        for (&image, decoded) in images.iter().zip(decoded) {
            let name = name_of(document, image as usize);
            match decoded {
                Ok(texture) => {
                    by_image.insert(image, textures.len() as u32);
                    textures.push(Texture { name, ..texture });
                }
                Err(fault) => oddities.note(part("image", image as usize, &name), left_out(fault)),
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
        Some(uri) if image.name.is_empty() && !uri.starts_with("data:") => uri.clone(),
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

/// The bytes of an image whose header is found acceptable.
fn fetch(buffers: &Buffers, image: usize, path: &Path, pixels_left: &mut u64) -> Result<Vec<u8>, Fault> {
    let source = &buffers.document().images[image];
    let bytes = match (&source.uri, source.buffer_view) {
        (Some(uri), _) => uri::load(uri, path, LONGEST_FILE)?,
        (None, Some(view)) => buffers.view(view)?.to_vec(),
        (None, None) => return malformed("it has neither a URI nor a buffer view"),
    };
    let (width, height) = open(&bytes)?.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return malformed(format!("its size is {width}x{height} pixels"));
    }
    if pixels > FREE_PIXELS && pixels / PIXELS_PER_BYTE > bytes.len() as u64 {
        let length = bytes.len();
        return malformed(format!("{width}x{height} pixels cannot be in its {length} bytes"));
    }
    match pixels_left.checked_sub(pixels) {
        Some(left) => *pixels_left = left,
        None => return unsupported("the images together are larger than 2 GiB; make them smaller"),
    }
    Ok(bytes)
}

fn open(bytes: &[u8]) -> Result<impl ImageDecoder, Fault> {
    let damaged = |e: image::ImageError| Fault::Malformed(format!("it is not a readable image: {e}"));
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| damaged(image::ImageError::IoError(e)))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    // Sixteen bits a channel, and as much again for the decoder's own tables.
    limits.max_alloc = Some(16 * ALL_PIXELS);
    reader.limits(limits);
    reader.into_decoder().map_err(damaged)
}

fn decode(bytes: &[u8]) -> Result<Texture, Fault> {
    let image = DynamicImage::from_decoder(open(bytes)?)
        .map_err(|e| Fault::Malformed(format!("it is not a readable image: {e}")))?
        .into_rgba8();
    let (width, height) = image.dimensions();
    Ok(Texture { name: String::new(), width, height, texels: image.as_raw().as_chunks().0.to_vec() })
}
