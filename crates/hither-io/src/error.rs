//! What can go wrong with a file, and what can be odd about one that is read all the same.

use crate::text::one_line;
use hither::scene::Scene;
use std::path::{Path, PathBuf};

/// Why a file was not read or written. The text is one line for the user: what, where, what to do; whatever names it
/// holds, it is one line, and acts on no terminal.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("{}", one_line(&format!("{}: {action}: {source}", path.display())))]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, for example `cannot read`.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not what its format demands.
    #[error("{}", one_line(&format!("{}: {message}", path.display())))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        message: String,
    },
    /// The file is sound but needs something that is not supported.
    #[error("{}", one_line(&format!("{}: {message}", path.display())))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it needs, and what to do.
        message: String,
    },
}

/// Something odd in a file that was read all the same; one line for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Which part of the file, for example `mesh 2 "chair"`.
    pub place: String,
    /// What was odd and what was done about it.
    pub message: String,
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&one_line(&format!("{}: {}", self.place, self.message)))
    }
}

/// A scene as read, and what was odd about its file (each thing once).
#[derive(Debug)]
pub struct Loaded {
    /// The scene; it passes [`Scene::validate`].
    pub scene: Scene,
    /// Oddities, each once.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that it names and that were read: buffers, materials, textures.
    pub companions: Vec<PathBuf>,
}

impl Loaded {
    /// A scene read from `path`, checked.
    pub(crate) fn checked(path: &Path, scene: Scene, diagnostics: Vec<Diagnostic>) -> Result<Loaded, Error> {
        match scene.validate() {
            Ok(()) => Ok(Loaded { scene, diagnostics, companions: Vec::new() }),
            Err(fault) => Err(Error::Malformed { path: path.to_owned(), message: fault.to_string() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_diagnostics_are_one_line_whatever_names_they_hold() {
        let path = PathBuf::from("a\nb\u{1b}[31m.obj");
        let message = "texture \"x\r\u{1b}[2J\"".to_owned();
        let source = std::io::Error::other("because\nof this");
        let texts = [
            Error::Io { path: path.clone(), action: "cannot read", source }.to_string(),
            Error::Malformed { path: path.clone(), message: message.clone() }.to_string(),
            Error::Unsupported { path, message: message.clone() }.to_string(),
            Diagnostic { place: "node \"\n\"".into(), message }.to_string(),
        ];
        for text in texts {
            assert!(!text.contains(char::is_control), "{text:?}");
        }
    }
}
