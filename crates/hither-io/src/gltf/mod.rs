//! glTF 2.0, text and binary, in and out.
//!
//! Reading goes shell → JSON → buffers → nodes → meshes → materials and textures → cameras, animations; each
//! step checks every number that it uses, so that later ones need not. Only what the default scene shows
//! is read. The scene that comes out has one group, the scene's nodes depth-first.

mod accessor;
mod animation;
mod attributes;
mod buffers;
mod camera;
mod container;
mod fault;
mod json;
mod lines;
mod material;
mod mesh;
mod meshopt;
mod node;
#[cfg(test)]
mod tests;
mod texture;
mod uri;
mod write;

pub use write::write_glb;

use crate::input;
use crate::{Companions, Error, Loaded, ModelFolder};
use buffers::Buffers;
use fault::{Fault, Oddities, malformed, quoted, unsupported};
use hither::scene::{Content, Scene};
use json::Document;
use material::Materials;
use std::collections::BTreeSet;
use std::path::Path;
use texture::Textures;

/// Extensions that a file may require: read, or without influence on what Hither shows.
const KNOWN_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];
/// They change how light plays on a surface, and leave its base colour.
const MATERIAL_EXTENSIONS: &str = "KHR_materials_";
const DRACO: &str = "KHR_draco_mesh_compression";

/// Reads the `.gltf` or `.glb` file at `path`.
///
/// Errors: the file cannot be read, it breaks glTF's rules, or it needs what is not supported.
pub fn read(path: &Path) -> Result<Loaded, Error> {
    let bytes = input::read(path)?;
    let folder = ModelFolder::of(path);
    let loaded = from_bytes(path, &bytes, &folder)?;
    Ok(Loaded { companions: folder.into_opened(), ..loaded })
}

/// Reads a `.gltf` or `.glb` file's content. `path` is for messages; files that it names come from
/// `companions`. Errors: as [`read`].
pub fn from_bytes(path: &Path, bytes: &[u8], companions: &dyn Companions) -> Result<Loaded, Error> {
    let named_glb = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    read_parts(bytes, named_glb, companions).map_err(|fault| fault.of_file(path))
}

fn read_parts(bytes: &[u8], named_glb: bool, companions: &dyn Companions) -> Result<Loaded, Fault> {
    let parts = container::split(bytes, named_glb)?;
    let document = json::parse(&bytes[parts.json])
        .or_else(|e| malformed(format!("its JSON is not that of a glTF file: {}", one_line(&e))))?;
    check_version(&document)?;
    check_extensions(&document)?;
    let mut oddities = Oddities::default();
    let buffers = Buffers::load(&document, bytes, parts.bin, companions)?;
    let scene = assemble(&buffers, companions, &mut oddities)?;
    match scene.validate() {
        Ok(()) => {
            let diagnostics = oddities.into_diagnostics();
            Ok(Loaded { scene, diagnostics, companions: Vec::new() })
        }
        Err(e) => malformed(one_line(&e.to_string())),
    }
}

fn assemble(buffers: &Buffers, companions: &dyn Companions, oddities: &mut Oddities) -> Result<Scene, Fault> {
    let document = buffers.document();
    let mut hierarchy = node::read(buffers, oddities)?;
    let contents = hierarchy.group.nodes.iter().map(|n| n.content);
    let shown = |content| if let Content::Mesh(m) = content { Some(m as usize) } else { None };
    let used: BTreeSet<usize> = contents.filter_map(shown).collect();
    let mut scene_index = vec![0u32; document.meshes.len()];
    for (new, &old) in used.iter().enumerate() {
        scene_index[old] = new as u32;
    }
    let materials = Materials::used_by(document, &used);
    let meshes =
        used.iter().map(|&m| mesh::read(buffers, &materials, oddities, m)).collect::<Result<_, _>>()?;
    let textures = Textures::load(buffers, &materials, companions, oddities);
    let read_material = |m| material::read(document, oddities, m, |t| textures.scene_index(t));
    let mut scene_materials = materials.used().map(read_material).collect();
    materials.add_bare(&mut scene_materials);
    let cameras = camera::read(document, &hierarchy, oddities);
    let animations = animation::read(buffers, &hierarchy, oddities);
    for node in &mut hierarchy.group.nodes {
        if let Content::Mesh(mesh) = &mut node.content {
            *mesh = scene_index[*mesh as usize];
        }
    }
    Ok(Scene {
        name: hierarchy.name,
        meshes,
        materials: scene_materials,
        textures: textures.textures,
        groups: vec![hierarchy.group],
        root: 0,
        cameras,
        animations,
    })
}

fn check_version(document: &Document) -> Result<(), Fault> {
    let Some(version) = &document.asset.version else {
        return malformed("it does not say which version of glTF it is (asset.version)");
    };
    if version != "2" && !version.starts_with("2.") {
        return unsupported(format!("it is glTF version {}; convert it to version 2.0", quoted(version)));
    }
    match &document.asset.min_version {
        Some(least) if least != "2.0" => {
            unsupported(format!("it needs glTF version {} at least; only 2.0 is read", quoted(least)))
        }
        _ => Ok(()),
    }
}

fn check_extensions(document: &Document) -> Result<(), Fault> {
    for name in &document.extensions_required {
        if name == DRACO {
            return unsupported(mesh::DRACO_IS_NOT_READ);
        }
        if !KNOWN_EXTENSIONS.contains(&name.as_str()) && !name.starts_with(MATERIAL_EXTENSIONS) {
            return unsupported(format!(
                "it requires the extension {}, which is not supported; export it without",
                quoted(name)
            ));
        }
    }
    Ok(())
}

/// A library's message with whatever it quotes from the file kept on one line.
fn one_line(message: &str) -> String {
    message.chars().map(|c| if c.is_control() { ' ' } else { c }).take(300).collect()
}
