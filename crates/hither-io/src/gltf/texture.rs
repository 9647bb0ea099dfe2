//! Textures: the images that base colours use, decoded by a library.
//!
//! An image that cannot be had is told of and its texture left out; the model is read all the same. Images of the
//! same source, a buffer view or a file, are one: it is fetched and decoded once. All images together are decoded
//! to no more than a set total.

use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part, quoted, unsupported};
use super::json::{Document, Index};
use super::material::{Materials, base_texture};
use super::uri;
use crate::{Companions, texture};
use hither::scene::Texture;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;

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
        let shared = by_source(document, &images, companions);
        let mut budget = texture::Budget::default();
        let mut fetch = |images: &Vec<u32>| fetch(buffers, images[0] as usize, companions, &mut budget);
        let fetched: Vec<Result<Cow<[u8]>, Fault>> = shared.iter().map(&mut fetch).collect();
        let decode = |(bytes, images): (Result<Cow<[u8]>, Fault>, &Vec<u32>)| {
            let name = name_of(document, images[0] as usize);
            bytes.and_then(|b| texture::decode(&name, &b).or_else(malformed))
        };
        let decoded: Vec<Result<Texture, Fault>> = fetched.into_par_iter().zip(&shared).map(decode).collect();
        let mut textures = Vec::new();
        let mut by_image = BTreeMap::new();
        for (images, decoded) in shared.iter().zip(decoded) {
            match decoded {
                Ok(texture) => {
                    by_image.extend(images.iter().map(|&image| (image, textures.len() as u32)));
                    textures.push(texture);
                }
                Err(fault) => {
                    let message = left_out(fault);
                    for &image in images {
                        let name = name_of(document, image as usize);
                        oddities.note(part("image", image as usize, &name), message.as_str());
                    }
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

/// Where the bytes of an image are, so far as another image may have the same.
#[derive(PartialEq, Eq, Hash)]
enum Source {
    View(u32),
    File(PathBuf),
}

/// The images in lists of the same source, each list by its first image.
fn by_source(document: &Document, images: &[u32], companions: &dyn Companions) -> Vec<Vec<u32>> {
    let mut lists: Vec<Vec<u32>> = Vec::new();
    let mut known: HashMap<Source, usize> = HashMap::new();
    for &image in images {
        let described = &document.images[image as usize];
        let source = match (&described.uri, described.buffer_view) {
            (Some(uri), _) => uri::file(uri, companions).map(Source::File),
            (None, view) => view.map(|view| Source::View(view.0)),
        };
        let new = lists.len();
        match source.map_or(new, |source| *known.entry(source).or_insert(new)) {
            at if at < new => lists[at].push(image),
            _ => lists.push(vec![image]),
        }
    }
    lists
}

/// The bytes of an image, paid for from `budget`.
fn fetch<'a>(
    buffers: &'a Buffers,
    image: usize,
    companions: &dyn Companions,
    budget: &mut texture::Budget,
) -> Result<Cow<'a, [u8]>, Fault> {
    let source = &buffers.document().images[image];
    let bytes = match (&source.uri, source.buffer_view) {
        (Some(uri), _) => Cow::Owned(uri::load(uri, companions)?),
        (None, Some(view)) => Cow::Borrowed(buffers.view(view)?),
        (None, None) => return malformed("it has neither a URI nor a buffer view"),
    };
    budget.pay(&bytes).or_else(unsupported)?;
    Ok(bytes)
}
