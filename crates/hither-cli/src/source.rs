//! Scenes by name: a model file, or a generated world.

use crate::console::Verbosity;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::count;
use hither::scene::Scene;
use std::path::Path;

/// The prefix of a generated world.
const WORLD: &str = "world:";

/// The file that the scene called `name` is read from; `None` for a world.
pub fn file(name: &str) -> Option<&Path> {
    (!name.starts_with(WORLD)).then(|| Path::new(name))
}

/// Reads or generates the scene called `name`, and prints what was odd about its file. Refused where one of `files` that
/// are going to be written is one that the scene names.
pub fn open(name: &str, files: &Files, verbosity: Verbosity) -> Result<Scene, Failure> {
    if let Some(spec) = name.strip_prefix(WORLD) {
        return generate(spec, verbosity);
    }
    if name.is_empty() {
        return Err(Failure::usage(
            "the name of the scene is empty; name a file, or a world as world:office",
        ));
    }
    let path = Path::new(name);
    let spinner = verbosity.spinner(format!("reading {name}"));
    let loaded = hither_io::read(path);
    spinner.finish_and_clear();
    let loaded = loaded.map_err(|error| unknown(name, error))?;
    files.spare(&loaded.companions)?;
    for diagnostic in &loaded.diagnostics {
        verbosity.warning(&format!("{name}: {diagnostic}"));
    }
    Ok(loaded.scene)
}

/// As [`open`], for what draws or sorts surfaces alone: lines that the scene has are told of as left out.
pub fn open_surfaces(name: &str, files: &Files, verbosity: Verbosity) -> Result<Scene, Failure> {
    let scene = open(name, files, verbosity)?;
    let lines: u64 = scene.meshes.iter().map(|mesh| mesh.lines.len() as u64).sum();
    if lines > 0 {
        let (lines, verb) = (count(lines, "line"), if lines == 1 { "is" } else { "are" });
        verbosity
            .warning(&format!("{name}: {lines} of its meshes {verb} left out; `hither lines` draws them"));
    }
    Ok(scene)
}

/// Generates a world from its spec, with or without the prefix.
pub fn generate(spec: &str, verbosity: Verbosity) -> Result<Scene, Failure> {
    let spec = spec.strip_prefix(WORLD).unwrap_or(spec);
    let spinner = verbosity.spinner(format!("generating {spec}"));
    let scene = hither_worlds::generate(spec);
    spinner.finish_and_clear();
    scene.map_err(|error| Failure::work(format!("{WORLD}{spec}: {error}")))
}

/// A missing file that is called like a world was probably meant to be one.
fn unknown(name: &str, error: hither_io::Error) -> Failure {
    let stem = name.split('?').next().unwrap_or(name);
    if hither_worlds::list().iter().any(|world| world.name == stem) && !Path::new(name).exists() {
        return Failure::work(format!("{error}; for the generated world write \"{WORLD}{name}\""));
    }
    error.into()
}
