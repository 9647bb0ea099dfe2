//! Whole files read into memory, long ones by several threads: a system hands out new memory and copies into it at
//! a gigabyte a second or less, which is as long as it takes to make sense of what the file says.

use crate::Error;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Bytes that a thread reads at a time.
const PART: usize = 1 << 20;

/// All bytes of the file at `path`.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    File::open(path).and_then(read_all).map_err(|source| Error::Io {
        path: path.to_owned(),
        action: "cannot read",
        source,
    })
}

fn read_all(mut file: File) -> io::Result<Vec<u8>> {
    let about = file.metadata()?;
    let length = usize::try_from(about.len()).unwrap_or(usize::MAX);
    let is_long = about.is_file() && length >= 2 * PART && rayon::current_num_threads() > 1;
    // A file that has shrunk meanwhile is read again from its beginning, as one that cannot be read in parts.
    if is_long && let Ok(bytes) = in_parts(&file, length) {
        return Ok(bytes);
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(if about.is_file() { length } else { 0 })?;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// `length` bytes from the beginning of a file, whose position stays as it is.
#[cfg(unix)]
fn in_parts(file: &File, length: usize) -> io::Result<Vec<u8>> {
    use std::os::unix::fs::FileExt;
    // Zeros are had for nothing, but not by a call that may fail: first see whether there is so much.
    Vec::<u8>::new().try_reserve_exact(length)?;
    let mut bytes = vec![0; length];
    let parts = bytes.par_chunks_mut(PART).enumerate();
    parts.try_for_each(|(i, part)| file.read_exact_at(part, (i * PART) as u64))?;
    Ok(bytes)
}

#[cfg(not(unix))]
fn in_parts(_: &File, _: usize) -> io::Result<Vec<u8>> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_of_threads_reads_the_same() {
        let path = std::env::temp_dir().join(format!("hither-input-{}", std::process::id()));
        for length in [0, 1, PART, 2 * PART, 5 * PART / 2 + 7] {
            let content: Vec<u8> = (0..length).map(|i| ((i * 31) >> 3) as u8).collect();
            std::fs::write(&path, &content).unwrap();
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                assert!(pool.install(|| read(&path)).unwrap() == content, "{length} bytes");
            }
        }
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(read(&path), Err(Error::Io { .. })));
        assert!(matches!(read(&std::env::temp_dir()), Err(Error::Io { .. })));
    }
}
