//! PLY, text and binary of either byte order: one mesh of polygons or triangle strips.
//!
//! What becomes of a file:
//! - The elements `vertex`, `face` and `tristrips` are read, other elements and properties passed over. Faces
//!   of any number of corners are cut into triangles; those without area are dropped.
//! - Of vertices: `x y z`, `nx ny nz`, colour (`red green blue alpha`; whole numbers of one and two bytes
//!   count to their type's largest, longer ones to 255, floats to 1; sRGB) and texture coordinates (`u v`, `s t`, `texture_u texture_v`; v up).
//! - Scans are often not closed: the material is double-sided. If some vertex is translucent, it blends.
//! - A file that is shorter than its header says, or a list that claims more than is left, is refused. A face
//!   with an index out of range, or with a coordinate that is no number, is left out with a diagnostic; where that is
//!   the lot of all faces, the file is refused.

mod build;
mod header;
mod numbers;
mod rows;
#[cfg(test)]
mod tests;

use crate::input;
use crate::oddities::Oddities;
use crate::{Error, Loaded};
use header::Encoding;
use numbers::{Binary, Words};
use std::path::Path;

/// Reads the PLY file at `path`.
pub fn read(path: &Path) -> Result<Loaded, Error> {
    let bytes = input::read(path)?;
    from_bytes(path, &bytes)
}

/// Reads a PLY file from memory. `path` names it in messages and gives the scene its name.
pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Loaded, Error> {
    let malformed = |message| Error::Malformed { path: path.to_owned(), message };
    let header = header::parse(bytes).map_err(malformed)?;
    let body = &bytes[header.length..];
    let mut oddities = Oddities::default();
    let rows = match header.encoding {
        Encoding::Text => rows::read(Words(body), &header.elements, &mut oddities),
        Encoding::LittleEndian => rows::read(Binary::<false>(body), &header.elements, &mut oddities),
        Encoding::BigEndian => rows::read(Binary::<true>(body), &header.elements, &mut oddities),
    };
    let scene = rows.and_then(|rows| build::build(rows, &mut oddities));
    let mut scene = scene.map_err(malformed)?;
    scene.name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Loaded::checked(path, scene, oddities.into_diagnostics())
}
