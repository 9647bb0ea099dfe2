//! The other files that a model names: only those in the model's own folder are ever opened.

use crate::text::one_line;
use std::cell::RefCell;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Where a reader gets the files that a model names.
///
/// The error is one line for the user, to follow the name of the file.
pub trait Companions {
    /// The content of the file called `name` in the model.
    fn load(&self, name: &str) -> Result<Vec<u8>, String>;

    /// Which file that is: names for which this is the same stand for the same content, which is loaded once.
    fn identity(&self, name: &str) -> PathBuf {
        name.into()
    }
}

impl<F: Fn(&str) -> Result<Vec<u8>, String>> Companions for F {
    fn load(&self, name: &str) -> Result<Vec<u8>, String> {
        self(name)
    }
}

/// The folder of a model file. Names are relative to it, with `/` or `\` between steps, and cannot lead out
/// of it, neither by `..` nor by symbolic links.
#[derive(Clone, Debug)]
pub struct ModelFolder {
    model: PathBuf,
    /// The files that were read.
    opened: RefCell<Vec<PathBuf>>,
}

impl ModelFolder {
    /// The folder of the model file at `model`.
    pub fn of(model: &Path) -> ModelFolder {
        ModelFolder { model: model.to_owned(), opened: RefCell::default() }
    }

    /// The files that were read, in the order in which they were.
    pub fn into_opened(self) -> Vec<PathBuf> {
        self.opened.into_inner()
    }

    fn path(&self) -> &Path {
        match self.model.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }

    /// Where `name` leads by its text alone.
    fn locate(&self, name: &str) -> Result<PathBuf, String> {
        let outside = || Err("it leads out of the model's folder; put the file inside".to_owned());
        if name.is_empty() || name.contains('\0') {
            return Err("it is not a file name".into());
        }
        let drive = name.as_bytes().get(1) == Some(&b':');
        if drive || name.starts_with(['/', '\\']) {
            return outside();
        }
        let mut steps: Vec<&str> = Vec::new();
        for step in name.split(['/', '\\']) {
            match step {
                "" | "." => {}
                ".." => {
                    if steps.pop().is_none() {
                        return outside();
                    }
                }
                // `file:stream` means more than a name on Windows.
                step if cfg!(windows) && step.contains(':') => return outside(),
                step => steps.push(step),
            }
        }
        let mut path = self.path().to_owned();
        path.extend(steps);
        Ok(path)
    }

    /// Whether `path` is really inside the folder of the model, or of what the model's name links to (as
    /// stores of linked files have it).
    fn holds(&self, path: &Path) -> std::io::Result<bool> {
        let real = fs::canonicalize(path)?;
        let folder = fs::canonicalize(self.path())?;
        let linked = fs::canonicalize(&self.model).ok();
        let other = linked.as_deref().and_then(Path::parent);
        Ok(real.starts_with(folder) || other.is_some_and(|f| real.starts_with(f)))
    }
}

impl Companions for ModelFolder {
    fn load(&self, name: &str) -> Result<Vec<u8>, String> {
        let path = self.locate(name)?;
        let shown = path.display().to_string();
        let shown = one_line(&shown);
        let failed = |e: std::io::Error| format!("cannot read {shown}: {e}");
        let found = fs::metadata(&path).map_err(failed)?;
        if !found.is_file() {
            return Err(format!("{shown} is not a regular file"));
        }
        if !self.holds(&path).map_err(failed)? {
            return Err("it is a link that leads out of the model's folder; put the file inside".into());
        }
        let mut bytes = Vec::new();
        File::open(&path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(failed)?;
        self.opened.borrow_mut().push(path);
        Ok(bytes)
    }

    /// The file's real path, where there is one.
    fn identity(&self, name: &str) -> PathBuf {
        let real = self.locate(name).ok().and_then(|path| fs::canonicalize(path).ok());
        real.unwrap_or_else(|| name.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder() {
        let folder = ModelFolder::of(Path::new("models/chair.obj"));
        for (name, path) in [
            ("a b.mtl", "models/a b.mtl"),
            ("tex\\wood.png", "models/tex/wood.png"),
            ("./x/../wood.png", "models/wood.png"),
            ("100%.png", "models/100%.png"),
        ] {
            assert_eq!(folder.locate(name).unwrap(), Path::new(path));
        }
        for name in ["../x", "a/../../x", "/etc/passwd", "\\x", "..\\x", "C:\\x", "c:x", "", "a\0b"] {
            assert!(folder.locate(name).is_err(), "{name:?}");
        }
        assert_eq!(ModelFolder::of(Path::new("chair.obj")).locate("x").unwrap(), Path::new("./x"));
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_folder_are_refused() {
        let top = std::env::temp_dir().join(format!("hither-companions-{}", std::process::id()));
        let _ = fs::remove_dir_all(&top);
        fs::create_dir_all(top.join("inside")).unwrap();
        fs::write(top.join("secret"), b"secret").unwrap();
        fs::write(top.join("inside/near"), b"near").unwrap();
        std::os::unix::fs::symlink(top.join("secret"), top.join("inside/far")).unwrap();
        let folder = ModelFolder::of(&top.join("inside/model.obj"));
        assert_eq!(folder.load("near").unwrap(), b"near");
        assert!(folder.load("far").unwrap_err().contains("link"));
        assert!(folder.load(".").unwrap_err().contains("regular"));
        assert!(folder.load("none").unwrap_err().contains("cannot read"));
        std::os::unix::fs::symlink("near", top.join("inside/nearer")).unwrap();
        for other in ["./near", "x/../near", "x\\..\\near", "nearer"] {
            assert_eq!(folder.identity(other), folder.identity("near"), "{other}");
        }
        assert_ne!(folder.identity("none"), folder.identity("none at all"));
        let told = folder.load("a\nb\u{1b}[31m.bin").unwrap_err();
        assert!(told.contains("a\\nb\\u{1b}[31m.bin") && !told.contains(char::is_control), "{told:?}");
        assert_eq!(folder.into_opened(), [top.join("inside/near")]);
        fs::remove_dir_all(&top).unwrap();
    }
}
