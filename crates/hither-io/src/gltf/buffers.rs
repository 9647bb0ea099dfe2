//! Buffers and buffer views: byte ranges that are checked before anyone sees them.
//!
//! A file that several buffers name is loaded once. Compressed views are decoded when first asked for.
//! Everything that is expanded from the file is paid for from a budget that follows from the length of the file
//! and of those that it names, so that a small file cannot fill the memory.

use super::fault::{Fault, malformed, part, quoted, unsupported};
use super::json::{Document, Index, Meshopt, Whole};
use super::meshopt::{self, Filter, Mode};
use super::uri;
use crate::Companions;
use std::cell::{Cell, OnceCell};
use std::collections::HashMap;
use std::ops::Range;
use std::path::PathBuf;

/// What any file may expand to, bytes.
const BUDGET_BASE: u64 = 256 << 20;
/// And how much more for each byte of the file and of its buffers: many meshes may share one buffer view.
const BUDGET_FACTOR: u64 = 256;

/// The bytes that accessors and images refer to.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    file: &'a [u8],
    contents: Vec<Content>,
    loaded: Sources,
    decoded: Vec<OnceCell<Vec<u8>>>,
    budget: Cell<u64>,
}

enum Content {
    InFile(Range<usize>),
    /// An index into what is loaded.
    Loaded(usize),
    /// Stated without content: a stand-in for data that is only there in compressed form.
    Absent,
}

/// What is loaded from other files, each once, and from data URIs.
#[derive(Default)]
struct Sources {
    bytes: Vec<Vec<u8>>,
    of_file: HashMap<PathBuf, usize>,
}

impl Sources {
    /// The index of what `uri` refers to, which is loaded if it is not there yet.
    fn index(&mut self, uri: &str, companions: &dyn Companions) -> Result<usize, Fault> {
        let file = uri::file(uri, companions);
        if let Some(&known) = file.as_ref().and_then(|file| self.of_file.get(file)) {
            return Ok(known);
        }
        let index = self.bytes.len();
        self.bytes.push(uri::load(uri, companions)?);
        self.of_file.extend(file.map(|file| (file, index)));
        Ok(index)
    }
}

impl<'a> Buffers<'a> {
    /// Loads all buffers. `bin` is the binary chunk's place in `file`, the whole file's bytes.
    pub(super) fn load(
        document: &'a Document,
        file: &'a [u8],
        bin: Option<Range<usize>>,
        companions: &dyn Companions,
    ) -> Result<Buffers<'a>, Fault> {
        let mut contents = Vec::with_capacity(document.buffers.len());
        let mut loaded = Sources::default();
        for (i, buffer) in document.buffers.iter().enumerate() {
            let place = || match &buffer.uri {
                Some(uri) if !uri::is_data(uri) => part("buffer", i, uri),
                _ => part("buffer", i, ""),
            };
            let Whole(length) = buffer.byte_length;
            let content = match &buffer.uri {
                _ if buffer.extensions.meshopt.fallback => Content::Absent,
                Some(uri) => Content::Loaded(loaded.index(uri, companions).map_err(|f| f.at(place()))?),
                None => match &bin {
                    Some(range) if i == 0 => Content::InFile(range.clone()),
                    _ => Content::Absent,
                },
            };
            let have = match &content {
                Content::InFile(range) => range.len() as u64,
                Content::Loaded(index) => loaded.bytes[*index].len() as u64,
                Content::Absent => length,
            };
            if have < length {
                return malformed(format!(
                    "it is to have {length} bytes, but there are {have}; fetch it again"
                ))
                .map_err(|f: Fault| f.at(place()));
            }
            contents.push(content);
        }
        let decoded = document.buffer_views.iter().map(|_| OnceCell::new()).collect();
        let total = file.len() as u64 + loaded.bytes.iter().map(|b| b.len() as u64).sum::<u64>();
        let budget = Cell::new(BUDGET_BASE.saturating_add(total.saturating_mul(BUDGET_FACTOR)));
        Ok(Buffers { document, file, contents, loaded, decoded, budget })
    }

    /// The document that the buffers belong to.
    pub(super) fn document(&self) -> &'a Document {
        self.document
    }

    /// Accounts for `bytes` of memory before they are asked for.
    pub(super) fn spend(&self, bytes: u64) -> Result<(), Fault> {
        match self.budget.get().checked_sub(bytes) {
            Some(left) => {
                self.budget.set(left);
                Ok(())
            }
            None => malformed("the data that it describes is out of all proportion to the file's size"),
        }
    }

    /// The bytes of buffer view `index`, decompressed where it is compressed.
    pub(super) fn view(&self, index: Index) -> Result<&[u8], Fault> {
        let Some(view) = self.document.buffer_views.get(index.at()) else {
            let there = self.document.buffer_views.len();
            return malformed(format!("it refers to buffer view {}, but there are {there}", index.0));
        };
        let place = || part("buffer view", index.at(), "");
        let Some(compressed) = &view.extensions.meshopt else {
            return self.slice(view.buffer, view.byte_offset, view.byte_length).map_err(|f| f.at(place()));
        };
        if self.decoded[index.at()].get().is_none() {
            let bytes = self.decompress(compressed).map_err(|f| f.at(place()))?;
            if (bytes.len() as u64) < view.byte_length.0 {
                return malformed("it is longer than its decompressed data")
                    .map_err(|f: Fault| f.at(place()));
            }
            let _ = self.decoded[index.at()].set(bytes);
        }
        Ok(self.decoded[index.at()].get().map_or(&[], Vec::as_slice))
    }

    /// Distance between elements that buffer view `index` prescribes, bytes.
    pub(super) fn stride(&self, index: Index) -> Option<u64> {
        self.document.buffer_views.get(index.at())?.byte_stride.map(|s| s.0)
    }

    fn slice(&self, buffer: Index, offset: Whole, length: Whole) -> Result<&[u8], Fault> {
        let bytes: &[u8] = match self.contents.get(buffer.at()) {
            Some(Content::InFile(range)) => &self.file[range.clone()],
            Some(Content::Loaded(index)) => &self.loaded.bytes[*index],
            Some(Content::Absent) => {
                return malformed(format!("buffer {} has no content: neither a URI nor a chunk", buffer.0));
            }
            None => {
                let there = self.contents.len();
                return malformed(format!("it refers to buffer {}, but there are {there}", buffer.0));
            }
        };
        let range = offset.0.checked_add(length.0).and_then(|end| {
            let (start, end) = (usize::try_from(offset.0).ok()?, usize::try_from(end).ok()?);
            bytes.get(start..end)
        });
        match range {
            Some(range) => Ok(range),
            None => malformed(format!(
                "it takes {} bytes at byte {}, but buffer {} has {}",
                length.0,
                offset.0,
                buffer.0,
                bytes.len()
            )),
        }
    }

    fn decompress(&self, from: &Meshopt) -> Result<Vec<u8>, Fault> {
        let mode = match from.mode.as_str() {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => return unsupported(format!("its compression mode is {}", quoted(other))),
        };
        let filter = match from.filter.as_deref() {
            None | Some("NONE") => None,
            Some("OCTAHEDRAL") => Some(Filter::Octahedral),
            Some("QUATERNION") => Some(Filter::Quaternion),
            Some("EXPONENTIAL") => Some(Filter::Exponential),
            Some("COLOR") => Some(Filter::Color),
            Some(other) => return unsupported(format!("its compression filter is {}", quoted(other))),
        };
        let source = self.slice(from.buffer, from.byte_offset, from.byte_length)?;
        let size = from.count.0.saturating_mul(from.byte_stride.0);
        self.spend(size)?;
        let (Ok(count), Ok(stride)) = (usize::try_from(from.count.0), usize::try_from(from.byte_stride.0))
        else {
            return malformed("its count or stride is out of range");
        };
        meshopt::decode(source, mode, filter, count, stride)
            .or_else(|e| malformed(format!("its compressed data is damaged: {e}; fetch the file again")))
    }
}
