//! Wavefront OBJ: polygons with texture coordinates, normals, vertex colours, groups and materials.
//!
//! What becomes of a file:
//! - Each combination of object (`o`) and group (`g`) that has faces or lines becomes one mesh and one node called
//!   `object/group`, wherever its faces are in the file; nodes are in order of first appearance. A new object
//!   begins without a group.
//! - Faces of any number of corners are cut into triangles; triangles without area are dropped. Vertices
//!   are shared where position, texture coordinate and normal are the same index.
//! - OBJ knows no sides, and many files do not care: every material is double-sided, so that nothing that
//!   other software shows is missing.
//! - `Kd` and vertex colours are taken as sRGB, which is what software without colour management makes of
//!   them. `d` or `Tr` below full opacity blends. Of textures only `map_Kd` is used.
//! - Lines (`l`) become the mesh's own lines, which drawings show. Points, curves and surfaces are left out with
//!   a diagnostic. `call` is never followed.
//! - Faces with an index out of range, or with a coordinate that is no number, are left out likewise. Where that is
//!   the lot of all faces, or the file ends within a vertex before any face, it is refused.

mod build;
mod join;
mod materials;
mod parse;
#[cfg(test)]
mod tests;

use crate::companions::{Companions, ModelFolder};
use crate::input;
use crate::oddities::Oddities;
use crate::text;
use crate::{Error, Loaded};
use std::path::Path;

/// Reads the OBJ file at `path`, and the material libraries and textures that it names from its folder.
pub fn read(path: &Path) -> Result<Loaded, Error> {
    let bytes = input::read(path)?;
    let folder = ModelFolder::of(path);
    let loaded = from_bytes(path, &bytes, &folder)?;
    Ok(Loaded { companions: folder.into_opened(), ..loaded })
}

/// Reads an OBJ file from memory. `path` names it in messages and gives the scene its name; nothing is opened
/// but what `companions` loads.
pub fn from_bytes(path: &Path, bytes: &[u8], companions: &dyn Companions) -> Result<Loaded, Error> {
    let mut oddities = Oddities::default();
    let statements = parse::parse(bytes, &mut oddities).map_err(|parse::TooLarge| Error::Unsupported {
        path: path.to_owned(),
        message: "it has more than 4,294,967,293 vertices or corners; split it".into(),
    })?;
    let says_nothing =
        statements.positions.is_empty() && statements.faces.is_empty() && statements.known_lines == 0;
    if says_nothing && !oddities.is_empty() {
        let message = "none of its lines is OBJ; is it another format, or damaged?".into();
        return Err(Error::Malformed { path: path.to_owned(), message });
    }
    let has_no_face = statements.faces.is_empty() && statements.polylines.is_empty();
    if has_no_face && !statements.positions.is_empty() && ends_within_a_vertex(bytes) {
        let message = "it ends within a vertex and has no face; it is truncated, fetch it again".into();
        return Err(Error::Malformed { path: path.to_owned(), message });
    }
    let materials = materials::load(&statements, companions, &mut oddities);
    let scene = build::build(statements, materials, &mut oddities);
    let mut scene = scene.map_err(|message| Error::Malformed { path: path.to_owned(), message })?;
    scene.name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Loaded::checked(path, scene, oddities.into_diagnostics())
}

/// Whether the last line has no end and is a vertex or a normal that lacks numbers.
fn ends_within_a_vertex(bytes: &[u8]) -> bool {
    let start = memchr::memrchr2(b'\n', b'\r', bytes).map_or(0, |end| end + 1);
    let mut rest = &bytes[start..];
    let is_vertex = matches!(text::word(&mut rest), Some(b"v" | b"vn"));
    is_vertex && std::iter::from_fn(|| text::word(&mut rest)).take(3).count() < 3
}
