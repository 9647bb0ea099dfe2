//! What every reader promises, whatever it is given: a valid scene with one-line diagnostics, or one line.

use hither_io::{Error, Loaded};

/// Panics if a reader broke its promise.
pub fn check(read: Result<Loaded, Error>) {
    match read {
        Ok(loaded) => {
            if let Err(fault) = loaded.scene.validate() {
                panic!("the scene is not valid: {fault}");
            }
            for diagnostic in &loaded.diagnostics {
                check_line(&diagnostic.to_string());
            }
            // Bounds follow every transform and every triangle.
            let _ = loaded.scene.bounds();
        }
        Err(error) => check_line(&error.to_string()),
    }
}

fn check_line(text: &str) {
    assert!(!text.is_empty() && !text.contains(['\n', '\r']), "not one line: {text:?}");
    assert!(text.len() < 2000, "a long line: {text}");
}

/// A model folder with nothing in it.
pub fn nothing(_: &str) -> Result<Vec<u8>, String> {
    Err("there is no such file".into())
}

/// A model folder in which every name is this file.
pub fn everywhere(content: &[u8]) -> impl Fn(&str) -> Result<Vec<u8>, String> {
    move |_| Ok(content.to_vec())
}

/// The smallest PNG file: one grey pixel.
pub const PIXEL: &[u8] = include_bytes!("../seeds/pixel.png");
