//! Output files that appear whole or not at all.
//!
//! A file is written under another name in its own folder and renamed when it is complete; whatever fails
//! before leaves the old file, or none, and nothing else. Pipes, terminals and devices cannot be renamed to
//! and are written directly. What a loss of power destroys is not covered: nothing is synced.

use crate::Error;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Writes the file at `path` by `write`, whole or not at all; an existing file is replaced and keeps its
/// permissions. The writer is buffered. Symbolic links are followed.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    let failed = |source| refusal(path, source);
    match destination(path).map_err(failed)? {
        Destination::Stream => {
            let file = OpenOptions::new().write(true).open(path).map_err(failed)?;
            fill(file, write).map_err(failed)
        }
        Destination::File(target) => {
            let (partial, file) = create_beside(&target).map_err(failed)?;
            let written = fill(file, write)
                .and_then(|()| match fs::metadata(&target) {
                    Ok(old) => fs::set_permissions(&partial, old.permissions()),
                    Err(_) => Ok(()),
                })
                .and_then(|()| fs::rename(&partial, &target));
            written.map_err(|source| {
                // The first failure is the one to report; a file that cannot be removed either stays.
                let _ = fs::remove_file(&partial);
                failed(source)
            })
        }
    }
}

/// Checks that [`write_whole`] could write `path` now, so that a long computation need not be lost.
///
/// An existing file is not touched; a new one is not left behind.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let failed = |source| refusal(path, source);
    match destination(path).map_err(failed)? {
        // Opening a pipe can block until someone reads it; writing will tell.
        Destination::Stream => Ok(()),
        Destination::File(target) => {
            let (partial, file) = create_beside(&target).map_err(failed)?;
            drop(file);
            fs::remove_file(partial).map_err(failed)
        }
    }
}

/// The file or folder that `path` names, there or not: the same path whatever links lead to it, so that two names of
/// one file can be told. `None` for pipes, terminals and devices, which hold nothing that could be lost.
pub fn real_path(path: &Path) -> Option<PathBuf> {
    let real = |path: &Path| fs::canonicalize(path).or_else(|_| std::path::absolute(path)).ok();
    match fs::metadata(path) {
        Ok(found) if is_stream_name(path) || !(found.is_file() || found.is_dir()) => None,
        Ok(_) => real(path),
        Err(_) => match fs::read_link(path) {
            Ok(link) if fs::metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound) => {
                real_path(&folder_of(path).join(link))
            }
            _ => Some(real(folder_of(path))?.join(path.file_name()?)),
        },
    }
}

/// Where the bytes go.
enum Destination {
    /// A pipe, a terminal or a device.
    Stream,
    /// A regular file, there or not, with symbolic links resolved.
    File(PathBuf),
}

fn destination(path: &Path) -> io::Result<Destination> {
    match fs::metadata(path) {
        Ok(_) if is_stream_name(path) => Ok(Destination::Stream),
        Ok(found) if found.is_dir() => Err(because(ErrorKind::IsADirectory, "it is a folder, not a file")),
        Ok(found) if found.is_file() => {
            // Renaming over a file needs no permission on the file itself; its owner's wish still counts.
            OpenOptions::new().write(true).open(path)?;
            fs::canonicalize(path).map(Destination::File)
        }
        Ok(_) => Ok(Destination::Stream),
        Err(missing) if missing.kind() == ErrorKind::NotFound => {
            if path.file_name().is_none() || path.as_os_str().to_string_lossy().ends_with('/') {
                return Err(because(ErrorKind::InvalidInput, "the name of a file is missing"));
            }
            if let Ok(link) = fs::read_link(path) {
                // It leads to a file that is not there yet. Links that lead in a circle are another error.
                return destination(&folder_of(path).join(link));
            }
            let folder = folder_of(path);
            match fs::metadata(folder) {
                Ok(found) if found.is_dir() => Ok(Destination::File(path.to_owned())),
                Ok(_) => Err(because(
                    ErrorKind::NotADirectory,
                    &format!("\"{}\" is a file, not a folder", folder.display()),
                )),
                Err(_) => Err(because(
                    ErrorKind::NotFound,
                    &format!("there is no folder \"{}\"; make it first", folder.display()),
                )),
            }
        }
        Err(other) => Err(other),
    }
}

/// Whether the name is that of what a shell has opened, which may be a file.
fn is_stream_name(path: &Path) -> bool {
    path.starts_with("/dev/fd")
        || path.starts_with("/proc/self/fd")
        || ["/dev/stdout", "/dev/stderr"].iter().any(|name| path == Path::new(name))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Creates a new file with a name of its own in the folder of `target`.
fn create_beside(target: &Path) -> io::Result<(PathBuf, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        // Not derived from the target's name, which may already be as long as a name can be.
        let partial = folder_of(target).join(format!(".hither-{}-{count}.partial", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).open(&partial) {
            Ok(file) => return Ok((partial, file)),
            Err(taken) if taken.kind() == ErrorKind::AlreadyExists => continue,
            Err(other) => return Err(other),
        }
    }
}

fn fill(file: File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::with_capacity(1 << 16, file);
    let result = write(&mut buffered).and_then(|()| buffered.flush());
    if result.is_err() {
        // Dropping a `BufWriter` writes what it holds; nothing more is wanted of a failed file.
        drop(buffered.into_parts());
    }
    result
}

fn refusal(path: &Path, source: io::Error) -> Error {
    Error::Io { path: path.to_owned(), action: "cannot write", source }
}

fn because(kind: ErrorKind, reason: &str) -> io::Error {
    io::Error::new(kind, reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A new, empty folder that is removed when dropped.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Folder {
            let path = std::env::temp_dir().join(format!("hither-atomic-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            fs::create_dir(&path).unwrap();
            Folder(path)
        }

        fn entries(&self) -> usize {
            fs::read_dir(&self.0).unwrap().count()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_failure_midway_leaves_the_old_file_and_nothing_else() {
        let folder = Folder::new("midway");
        let path = folder.0.join("picture");
        write_whole(&path, |w| w.write_all(b"old")).unwrap();
        let failed = write_whole(&path, |w| {
            w.write_all(&[0; 1 << 20])?;
            Err(ErrorKind::StorageFull.into())
        });
        assert!(failed.unwrap_err().to_string().contains("picture: cannot write: no storage space"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(folder.entries(), 1);
        write_whole(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(folder.entries(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn names_of_one_file_have_one_real_path() {
        let folder = Folder::new("real");
        let path = |name: &str| folder.0.join(name);
        fs::create_dir(path("inner")).unwrap();
        fs::write(path("file"), b"").unwrap();
        std::os::unix::fs::symlink("file", path("link")).unwrap();
        std::os::unix::fs::symlink("inner", path("other")).unwrap();
        for (one, two) in [
            ("file", "link"),
            ("file", "inner/../file"),
            ("file", "./file"),
            ("inner/new", "other/new"),
            ("inner", "other"),
            ("none/new", "none/./new"),
        ] {
            assert!(real_path(&path(one)).is_some());
            assert_eq!(real_path(&path(one)), real_path(&path(two)), "{one} {two}");
        }
        assert_ne!(real_path(&path("inner/new")), real_path(&path("new")));
        for stream in ["/dev/null", "/dev/stdout"] {
            assert_eq!(real_path(Path::new(stream)), None);
        }
    }

    #[test]
    fn what_cannot_be_written_is_refused_before_the_work() {
        let folder = Folder::new("refused");
        let missing = folder.0.join("nowhere/picture");
        let text = check_writable(&missing).unwrap_err().to_string();
        assert!(text.contains("there is no folder") && !text.contains('\n'), "{text}");
        assert!(write_whole(&missing, |_| panic!("the work is not begun")).is_err());
        assert!(check_writable(&folder.0).unwrap_err().to_string().contains("is a folder"));
        let file = folder.0.join("file");
        check_writable(&file).unwrap();
        assert_eq!(folder.entries(), 0);
        write_whole(&file, |_| Ok(())).unwrap();
        assert!(check_writable(&file.join("below")).is_err());
        assert!(check_writable(Path::new("")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_devices_and_permissions_are_respected() {
        use std::os::unix::fs::PermissionsExt;
        let folder = Folder::new("links");
        let (real, link) = (folder.0.join("real"), folder.0.join("link"));
        write_whole(&real, |w| w.write_all(b"old")).unwrap();
        fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_whole(&link, |w| w.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
        // A link to what is not there yet stays one, too.
        let (new, early) = (folder.0.join("new"), folder.0.join("early"));
        std::os::unix::fs::symlink("new", &early).unwrap();
        assert_eq!(real_path(&early), real_path(&new));
        check_writable(&early).unwrap();
        write_whole(&early, |w| w.write_all(b"made")).unwrap();
        assert!(fs::symlink_metadata(&early).unwrap().is_symlink());
        assert_eq!(fs::read(&new).unwrap(), b"made");
        std::os::unix::fs::symlink("nowhere/new", folder.0.join("lost")).unwrap();
        assert!(check_writable(&folder.0.join("lost")).unwrap_err().to_string().contains("no folder"));
        std::os::unix::fs::symlink("circle", folder.0.join("circle")).unwrap();
        assert!(check_writable(&folder.0.join("circle")).is_err());
        assert!(real_path(&folder.0.join("circle")).is_some());
        check_writable(Path::new("/dev/null")).unwrap();
        write_whole(Path::new("/dev/null"), |w| w.write_all(b"gone")).unwrap();
    }
}
