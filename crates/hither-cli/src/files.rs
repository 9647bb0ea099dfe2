//! The files that a command line names: none that is written takes the place of another, or of what is read.
//!
//! All is refused before anything is read, but for what a model's file names in turn, its textures and buffers: that is
//! known when it is read, and refused then.

use crate::failure::Failure;
use crate::{outputs, source};
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A file that the command line names.
struct Named {
    /// What the command line calls it.
    what: String,
    /// It is going to be written.
    written: bool,
}

/// Files by their real path.
#[derive(Default)]
pub struct Files {
    named: HashMap<PathBuf, Named>,
}

impl Files {
    /// Of a command that reads the scene called `name`.
    pub fn of_scene(name: &str) -> Files {
        let mut files = Files::default();
        if let Some(path) = source::file(name) {
            files.reads("the scene", path);
        }
        files
    }

    /// Option `what` reads `path`; others may, too.
    pub fn reads(&mut self, what: &str, path: &Path) {
        let named = Named { what: what.to_owned(), written: false };
        self.named.extend(hither_io::real_path(path).map(|real| (real, named)));
    }

    /// Option `what` has `path` for itself.
    pub fn takes(&mut self, what: &str, path: &Path) -> Result<(), Failure> {
        let Some(real) = hither_io::real_path(path) else { return Ok(()) };
        match self.named.insert(real, Named { what: what.to_owned(), written: true }) {
            None => Ok(()),
            Some(Named { what: other, .. }) => {
                let why = format!("this is the file of {other}, too, and one would be lost; name another");
                Err(Failure::work(format!("{what} {}: {why}", path.display())))
            }
        }
    }

    /// Option `what` writes `path`, or one file for each of `frames`; refused where one cannot be written.
    pub fn writes(
        &mut self,
        what: &str,
        path: Option<&Path>,
        frames: Option<&Range<u32>>,
    ) -> Result<(), Failure> {
        let Some(path) = path else { return Ok(()) };
        for path in outputs::of_frames(path, frames) {
            self.takes(what, &path)?;
            hither_io::check_writable(&path)?;
        }
        Ok(())
    }

    /// Refuses files that are going to be written and that the scene was read from.
    pub fn spare(&self, read: &[PathBuf]) -> Result<(), Failure> {
        let written = |real: PathBuf| self.named.get(&real).filter(|named| named.written);
        let lost = read.iter().find_map(|path| Some((path, written(hither_io::real_path(path)?)?)));
        let Some((path, Named { what, .. })) = lost else { return Ok(()) };
        let why = "the scene is read from this file, too, and it would be lost; name another";
        Err(Failure::work(format!("{what} {}: {why}", path.display())))
    }

    /// The report goes to `to`, if one is asked for; `-` is standard output.
    pub fn reports(&mut self, to: Option<&Path>) -> Result<(), Failure> {
        self.writes("--json", to.filter(|to| *to != Path::new("-")), None)
    }
}
