//! Model files in, pictures out: the only crate of Hither that knows file formats.
//!
//! [`read`] picks the reader by the file's name and content. Every reader returns a valid scene together
//! with what was odd about the file, or one [`Error`] that says what is wrong, where, and what to do.
//! No reader trusts a number in a file: memory is only asked for what the file's own length can fill.
#![forbid(unsafe_code)]

mod atomic;
mod companions;
mod drawing;
mod error;
mod exr;
mod format;
pub mod gltf;
mod input;
mod map;
pub mod obj;
mod oddities;
mod openraster;
pub mod ply;
mod png;
mod polygon;
mod srgb;
pub mod stl;
mod text;
mod texture;
mod weld;

pub use atomic::{check_writable, real_path, write_whole};
pub use companions::{Companions, ModelFolder};
pub use drawing::{Sheet, SheetView, Unit, write_drawing_json, write_dxf, write_svg};
pub use error::{Diagnostic, Error, Loaded};
pub use exr::{ExrImage, LayerPicture, write_exr, write_exr_layers};
pub use gltf::write_glb;
pub use map::write_map;
pub use openraster::write_openraster;
pub use png::write_png;
pub use text::one_line;
pub use texture::read_picture;

use format::Format;
use std::path::Path;

/// Reads the model file at `path`: glTF 2.0 (`.gltf`, `.glb`), OBJ, STL or PLY.
///
/// The first bytes decide where they can, else the extension.
/// Errors: no such file, a folder, an empty file, an unknown format, or what the format's reader refuses.
pub fn read(path: &Path) -> Result<Loaded, Error> {
    match format::recognise(path)? {
        Format::Gltf => gltf::read(path),
        Format::Obj => obj::read(path),
        Format::Ply => ply::read(path),
        Format::Stl => stl::read(path),
    }
}
