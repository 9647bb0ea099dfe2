//! Scenes out as GLB files that other software opens.
//!
//! Nested groups become node hierarchies that share meshes, one node an instance, in the order in which
//! instances are numbered. What no node shows is not written, and neither are meshes without triangles,
//! which glTF does not have: their nodes stay, without mesh. Colour factors are clamped to [0, 1] and
//! vectors made unit where glTF demands it. A texture transform with shear loses it.

mod animations;
mod binary;
mod document;
mod expand;
mod looks;
mod shapes;

use crate::{Error, atomic};
use binary::Binary;
use document::{Asset, Document, SceneEntry};
use expand::Expanded;
use hither::scene::Scene;
use std::io::{self, Write};
use std::path::Path;

/// Nodes of the largest file that is written.
const MOST_NODES: u64 = 2_000_000;

/// Writes `scene` as the binary glTF 2.0 file `path`, whole or not at all.
///
/// Cost: a node an instance, however it is nested. Errors: a scene that does not pass
/// [`Scene::validate`], expands to more than two million nodes or does not fit 4 GiB, and whatever keeps
/// the file from being written.
pub fn write_glb(scene: &Scene, path: &Path) -> Result<(), Error> {
    let refused = |message: String| Error::Unsupported { path: path.to_owned(), message };
    let (json, bin) = encode(scene).map_err(refused)?;
    let chunks = 8 + json.len() as u64 + if bin.is_empty() { 0 } else { 8 + bin.len() as u64 };
    let Ok(length) = u32::try_from(12 + chunks) else {
        return Err(refused("the file would be larger than the 4 GiB that a .glb can be; write less".into()));
    };
    atomic::write_whole(path, |file| write_chunks(file, length, &json, &bin))
}

fn write_chunks(file: &mut dyn Write, length: u32, json: &[u8], bin: &[u8]) -> io::Result<()> {
    file.write_all(b"glTF")?;
    for word in [2, length, json.len() as u32] {
        file.write_all(&word.to_le_bytes())?;
    }
    file.write_all(b"JSON")?;
    file.write_all(json)?;
    if !bin.is_empty() {
        file.write_all(&(bin.len() as u32).to_le_bytes())?;
        file.write_all(b"BIN\0")?;
        file.write_all(bin)?;
    }
    Ok(())
}

/// The JSON text and the binary chunk, both padded to multiples of four bytes.
fn encode(scene: &Scene) -> Result<(Vec<u8>, Vec<u8>), String> {
    scene.validate().map_err(|e| format!("the scene cannot be written: {e}"))?;
    let nodes = expand::node_count(scene);
    if nodes > MOST_NODES {
        return Err(format!("the scene expands to {nodes} nodes; no more than {MOST_NODES} are written"));
    }
    let mut expanded = Expanded::of(scene);
    let mut binary = Binary::default();
    let mut looks = looks::Looks::new();
    let (meshes, mesh_index) = shapes::meshes(scene, &expanded, &mut looks, &mut binary);
    let cameras = shapes::cameras(scene, &mut expanded);
    let animations = animations::animations(scene, &expanded, &mut binary);
    let looks = looks.finish(scene, &mut binary)?;
    let extensions_used = if looks.has_transforms { vec!["KHR_texture_transform"] } else { vec![] };
    let (buffers, buffer_views, accessors, mut bin) = binary.finish();
    let generator = concat!("Hither ", env!("CARGO_PKG_VERSION"));
    let document = Document {
        asset: Asset { version: "2.0", generator },
        extensions_used,
        scene: 0,
        scenes: [SceneEntry { name: &scene.name, nodes: expanded.roots() }],
        nodes: expand::Nodes { expanded: &expanded, mesh_index: &mesh_index },
        meshes,
        materials: looks.materials,
        textures: looks.textures,
        images: looks.images,
        samplers: looks.samplers,
        cameras,
        animations,
        accessors,
        buffer_views,
        buffers,
    };
    let mut json =
        serde_json::to_vec(&document).map_err(|e| format!("the scene cannot be written as JSON: {e}"))?;
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    Ok((json, bin))
}
