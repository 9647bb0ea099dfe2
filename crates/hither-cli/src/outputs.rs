//! Where results go: names of picture files, and reports as JSON.

use crate::console;
use crate::failure::Failure;
use serde_json::Value;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A picture format, by the extension of its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// 8-bit sRGB.
    Png,
    /// Floating point, with depth and ids.
    Exr,
}

impl PictureFormat {
    /// The format that the extension of `path` says.
    pub fn of(path: &Path) -> Result<PictureFormat, Failure> {
        if has_extension(path, "png") {
            Ok(PictureFormat::Png)
        } else if has_extension(path, "exr") {
            Ok(PictureFormat::Exr)
        } else {
            Err(Failure::usage(format!("-o {}: give the file the extension .png or .exr", path.display())))
        }
    }
}

/// Whether `path` ends in `.extension`, in whatever case.
pub fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// The file of picture `frame`: a run of `#` in the file's name becomes the number, filled with zeros to the
/// run's length; without one the number, four digits, goes before the extension.
pub fn numbered(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = match name.find('#') {
        Some(start) => {
            let width = name[start..].chars().take_while(|&c| c == '#').count();
            format!("{}{frame:0width$}{}", &name[..start], &name[start + width..])
        }
        None => {
            let (stem, extension) = name.rsplit_once('.').unwrap_or((&name, ""));
            format!("{stem}.{frame:04}.{extension}")
        }
    };
    path.with_file_name(name)
}

/// The file `path`, or one for each of `frames`. Of many the first: the folder is the same for all, and a thousand
/// names show most other obstacles.
pub fn of_frames(path: &Path, frames: Option<&Range<u32>>) -> Vec<PathBuf> {
    match frames {
        Some(frames) => frames.clone().take(1000).map(|frame| numbered(path, frame)).collect(),
        None => vec![path.to_owned()],
    }
}

/// Writes a report to `to`, if one is asked for; `-` is standard output.
pub fn write_report(to: Option<&Path>, report: &Value) -> Result<(), Failure> {
    let Some(path) = to else { return Ok(()) };
    let text = format!("{report:#}\n");
    if path == Path::new("-") {
        return console::print(&text);
    }
    Ok(hither_io::write_whole(path, |file| file.write_all(text.as_bytes()))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_where_the_name_says() {
        let name = |path: &str, frame| numbered(Path::new(path), frame).display().to_string();
        assert_eq!(name("a/out.png", 7), "a/out.0007.png");
        assert_eq!(name("out.v2.exr", 12345), "out.v2.12345.exr");
        assert_eq!(name("a#b/walk-###.png", 7), "a#b/walk-007.png");
        assert_eq!(name("#_é.png", 42), "42_é.png");
    }

    #[test]
    fn formats_go_by_extension() {
        assert_eq!(PictureFormat::of(Path::new("a.PNG")).unwrap(), PictureFormat::Png);
        assert_eq!(PictureFormat::of(Path::new("a.b.exr")).unwrap(), PictureFormat::Exr);
        assert!(["a.jpg", "png", "a.", ""].iter().all(|p| PictureFormat::of(Path::new(p)).is_err()));
    }
}
