//! What the tests of the command line share: folders of their own, and the program.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

/// A folder of its own for a test, removed when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    /// Empty. `name` is no other test's.
    pub fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("hither-cli-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    /// A file in it.
    pub fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Runs the program.
pub fn hither(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hither")).args(arguments).output().unwrap()
}

/// Runs it on what must succeed.
#[track_caller]
pub fn done(arguments: &[&str]) -> Output {
    let output = hither(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}
