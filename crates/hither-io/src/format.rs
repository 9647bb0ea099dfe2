//! Which format a file is in: its first bytes decide where they can, else its extension.
//!
//! What cannot be a model file at all (missing, a folder, a device, empty) is refused here with a clear line.

use crate::Error;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

/// A model format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// glTF 2.0, as text or binary.
    Gltf,
    /// Wavefront OBJ.
    Obj,
    /// PLY, as text or binary.
    Ply,
    /// STL, as text or binary.
    Stl,
}

const KNOWN: &str = ".glb, .gltf, .obj, .ply or .stl";

/// The format of the file at `path`.
pub(crate) fn recognise(path: &Path) -> Result<Format, Error> {
    let refused = |action, source| Error::Io { path: path.to_owned(), action, source };
    let malformed = |message: String| Error::Malformed { path: path.to_owned(), message };
    let found = fs::metadata(path).map_err(|e| refused("cannot read", e))?;
    if found.is_dir() {
        return Err(malformed(format!("this is a folder; name a {KNOWN} file")));
    }
    if !found.is_file() {
        return Err(malformed(format!("this is not a regular file; name a {KNOWN} file")));
    }
    let mut start = Vec::with_capacity(64);
    File::open(path)
        .and_then(|file| file.take(64).read_to_end(&mut start))
        .map_err(|e| refused("cannot read", e))?;
    if start.is_empty() {
        return Err(malformed("the file is empty".into()));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    by_content(&start).or_else(|| by_extension(&extension)).ok_or_else(|| {
        let what =
            if extension.is_empty() { "a name without extension".into() } else { format!(".{extension}") };
        let message = format!("{what} does not say which model format this is; known are {KNOWN}");
        Error::Unsupported { path: path.to_owned(), message }
    })
}

fn by_content(start: &[u8]) -> Option<Format> {
    if start.starts_with(b"glTF") {
        return Some(Format::Gltf);
    }
    if start.starts_with(b"ply\n") || start.starts_with(b"ply\r") {
        return Some(Format::Ply);
    }
    None
}

fn by_extension(extension: &str) -> Option<Format> {
    match extension {
        "glb" | "gltf" => Some(Format::Gltf),
        "obj" => Some(Format::Obj),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_wins_over_extension() {
        assert_eq!(by_content(b"glTF\x02\0\0\0"), Some(Format::Gltf));
        assert_eq!(by_content(b"ply\r\nformat"), Some(Format::Ply));
        assert_eq!(by_content(b"plywood"), None);
        assert_eq!(by_content(b"{}"), None);
        assert_eq!(by_extension("glb"), Some(Format::Gltf));
        assert_eq!(by_extension("docx"), None);
    }

    #[test]
    fn what_is_no_model_file_is_refused_in_one_line() {
        let folder = std::env::temp_dir().join(format!("hither-format-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (empty, other) = (folder.join("empty.glb"), folder.join("letter.docx"));
        fs::write(&empty, b"").unwrap();
        fs::write(&other, b"PK").unwrap();
        for (path, part) in [
            (folder.join("missing.glb"), "cannot read"),
            (folder.clone(), "folder"),
            (empty, "empty"),
            (other, ".docx does not say"),
        ] {
            let text = recognise(&path).unwrap_err().to_string();
            assert!(text.contains(part) && !text.contains('\n'), "{text}");
        }
        fs::remove_dir_all(&folder).unwrap();
    }
}
