//! References from a model to other files: data in the reference itself, or a file in the model's folder.
//!
//! Nothing outside the model's folder is ever opened, nor anything on a network.

use super::fault::{Fault, malformed, quoted, unsupported};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The first `limit` bytes of what `uri` refers to, seen from the model file `model`.
pub(super) fn load(uri: &str, model: &Path, limit: u64) -> Result<Vec<u8>, Fault> {
    if let Some(content) = data_content(uri) {
        return decode_data(content);
    }
    let path = locate(uri, model)?;
    let failed = |source| Fault::Io(path.clone(), source);
    let found = fs::metadata(&path).map_err(failed)?;
    if !found.is_file() {
        return Err(failed(io::Error::other("it is not a regular file")));
    }
    stay_inside(&path, model)?;
    let mut bytes = Vec::with_capacity(found.len().min(limit).min(1 << 32) as usize);
    File::open(&path).and_then(|f| f.take(limit).read_to_end(&mut bytes)).map_err(failed)?;
    Ok(bytes)
}

/// What follows `data:` in a data URI.
fn data_content(uri: &str) -> Option<&str> {
    let (scheme, content) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then_some(content)
}

fn decode_data(content: &str) -> Result<Vec<u8>, Fault> {
    let Some((header, body)) = content.split_once(',') else {
        return malformed("its data URI has no comma before the data");
    };
    let base64 = header.rsplit(';').next().is_some_and(|last| last.trim().eq_ignore_ascii_case("base64"));
    if !base64 {
        return Ok(percent_decode_str(body).collect());
    }
    let decoded = if body.contains('%') {
        BASE64.decode(percent_decode_str(body).collect::<Vec<u8>>())
    } else {
        BASE64.decode(body)
    };
    decoded.or_else(|e| malformed(format!("its data URI is not base64: {e}")))
}

/// The file that `uri` means, by its text alone.
fn locate(uri: &str, model: &Path) -> Result<PathBuf, Fault> {
    let shown = quoted(uri);
    // A scheme is a letter and then letters, digits, `+`, `-`, `.`; `C:` of Windows looks the same.
    if let Some((scheme, _)) = uri.split_once(':')
        && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    {
        return unsupported(format!(
            "it refers to {shown}; only files in the model's folder are opened, so put it there"
        ));
    }
    let Ok(decoded) = percent_decode_str(uri).decode_utf8() else {
        return malformed(format!("its reference {shown} is not UTF-8 once decoded"));
    };
    let outside = || {
        unsupported(format!("its reference {shown} leads out of the model's folder; put the file inside it"))
    };
    if decoded.contains('\0') || decoded.is_empty() {
        return malformed(format!("its reference {shown} is not a file name"));
    }
    if decoded.starts_with(['/', '\\']) {
        return outside();
    }
    let mut inside: Vec<&str> = Vec::new();
    for step in decoded.split(['/', '\\']) {
        match step {
            "" | "." => {}
            ".." => {
                if inside.pop().is_none() {
                    return outside();
                }
            }
            // `c:file` and `file:stream` mean more than a name on Windows.
            name if cfg!(windows) && name.contains(':') => return outside(),
            name => inside.push(name),
        }
    }
    let mut path = folder_of(model).to_owned();
    path.extend(inside);
    Ok(path)
}

/// Refuses a file that symbolic links put outside the folder of the model (or of the file that the
/// model's own name links to, as stores of linked files do).
fn stay_inside(path: &Path, model: &Path) -> Result<(), Fault> {
    let failed = |source| Fault::Io(path.to_owned(), source);
    let real = fs::canonicalize(path).map_err(failed)?;
    let folder = fs::canonicalize(folder_of(model)).map_err(failed)?;
    let linked = fs::canonicalize(model).ok();
    let also = linked.as_deref().and_then(Path::parent);
    if real.starts_with(folder) || also.is_some_and(|f| real.starts_with(f)) {
        return Ok(());
    }
    let shown = quoted(&path.display().to_string());
    unsupported(format!("{shown} is a link that leads out of the model's folder; put the file inside it"))
}

fn folder_of(model: &Path) -> &Path {
    match model.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(uri: &str) -> Result<PathBuf, String> {
        locate(uri, Path::new("models/chair.gltf")).map_err(Fault::message)
    }

    #[test]
    fn references_are_decoded_and_stay_in_the_folder() {
        assert_eq!(place("a%20b/c.bin").unwrap(), Path::new("models/a b/c.bin"));
        assert_eq!(place("a\\c.bin").unwrap(), Path::new("models/a/c.bin"));
        assert_eq!(place("./a/../c.bin").unwrap(), Path::new("models/c.bin"));
        assert_eq!(place("ü.png").unwrap(), Path::new("models/ü.png"));
        for out in
            ["../c.bin", "a/../../c.bin", "/etc/passwd", "\\etc", "%2e%2e/c.bin", "%2Fetc/passwd", "..\\c"]
        {
            assert!(place(out).unwrap_err().contains("leads out of the model's folder"), "{out}");
        }
        for other in ["http://example.com/c.bin", "file:///c.bin", "C:/c.bin", "c:\\c.bin"] {
            assert!(place(other).unwrap_err().contains("only files in the model's folder"), "{other}");
        }
        for bad in ["", "a%00b", "%ff%fe"] {
            assert!(place(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn data_is_decoded_whatever_its_dress() {
        let get = |uri: &str| load(uri, Path::new("x.gltf"), 9).map_err(Fault::message);
        assert_eq!(get("data:application/octet-stream;base64,AAEC").unwrap(), [0, 1, 2]);
        assert_eq!(get("DATA:;base64,AAE").unwrap(), [0, 1]);
        assert_eq!(get("data:;base64,AAE%3D").unwrap(), [0, 1]);
        assert_eq!(get("data:text/plain,a%20b").unwrap(), b"a b");
        assert!(get("data:;base64,A*==").unwrap_err().contains("base64"));
        assert!(get("data:AAEC").unwrap_err().contains("comma"));
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_folder_are_refused() {
        let top = std::env::temp_dir().join(format!("hither-uri-{}", std::process::id()));
        let _ = fs::remove_dir_all(&top);
        fs::create_dir_all(top.join("inside")).unwrap();
        fs::write(top.join("secret"), b"secret").unwrap();
        fs::write(top.join("inside/near"), b"near").unwrap();
        std::os::unix::fs::symlink(top.join("secret"), top.join("inside/far")).unwrap();
        let model = top.join("inside/model.gltf");
        fs::write(&model, b"{}").unwrap();
        assert_eq!(load("near", &model, 100).unwrap(), b"near");
        assert_eq!(load("near", &model, 2).unwrap(), b"ne");
        assert!(load("far", &model, 100).unwrap_err().message().contains("leads out"));
        assert!(load("none", &model, 100).unwrap_err().message().contains("none"));
        assert!(load(".", &model, 100).unwrap_err().message().contains("regular file"));
        fs::remove_dir_all(&top).unwrap();
    }
}
