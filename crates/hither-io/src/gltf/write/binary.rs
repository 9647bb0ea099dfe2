//! The binary chunk as it grows: every array has a buffer view and an accessor of its own, aligned to four
//! bytes.

use super::document::{AccessorEntry, BufferEntry, BufferViewEntry};

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;

#[derive(Default)]
pub(super) struct Binary {
    bytes: Vec<u8>,
    views: Vec<BufferViewEntry>,
    accessors: Vec<AccessorEntry>,
}

/// What an array of floats is for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A vertex attribute.
    Attribute,
    /// A vertex attribute, or the times of an animation, whose bounds must be told.
    Bounded(Use),
    /// The values of an animation.
    Values,
}

/// Who reads an array with bounds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    Vertices,
    Times,
}

impl Binary {
    /// Appends `bytes` as they are; the buffer view.
    pub(super) fn raw(&mut self, bytes: &[u8], target: Option<u32>) -> u32 {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view =
            BufferViewEntry { buffer: 0, byte_offset: self.bytes.len(), byte_length: bytes.len(), target };
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        (self.views.len() - 1) as u32
    }

    /// Appends vectors; the accessor.
    pub(super) fn floats<const N: usize>(
        &mut self,
        vectors: impl ExactSizeIterator<Item = [f32; N]>,
        purpose: Purpose,
    ) -> u32 {
        let count = vectors.len();
        let mut bytes = Vec::with_capacity(count * N * 4);
        let (mut min, mut max) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        for vector in vectors {
            for k in 0..N {
                bytes.extend_from_slice(&vector[k].to_le_bytes());
                min[k] = min[k].min(vector[k]);
                max[k] = max[k].max(vector[k]);
            }
        }
        let vertices = matches!(purpose, Purpose::Attribute | Purpose::Bounded(Use::Vertices));
        let buffer_view = self.raw(&bytes, vertices.then_some(ARRAY_BUFFER));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let bounds = |values: [f32; N]| match purpose {
            Purpose::Bounded(_) => values.map(f64::from).to_vec(),
            _ => Vec::new(),
        };
        let (min, max) = (bounds(min), bounds(max));
        self.accessor(AccessorEntry { buffer_view, component_type: FLOAT, count, kind, min, max })
    }

    /// Appends the corners of triangles in a mesh of `vertices` vertices; the accessor.
    pub(super) fn indices(&mut self, triangles: &[[u32; 3]], vertices: usize) -> u32 {
        let corners = triangles.as_flattened();
        // 65535 is not an index of 16 bits: where it is allowed at all, it restarts a strip.
        let (component_type, bytes): (u32, Vec<u8>) = if vertices <= 65_535 {
            (UNSIGNED_SHORT, corners.iter().flat_map(|&c| (c as u16).to_le_bytes()).collect())
        } else {
            (UNSIGNED_INT, corners.iter().flat_map(|&c| c.to_le_bytes()).collect())
        };
        let buffer_view = self.raw(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let (count, kind) = (corners.len(), "SCALAR");
        self.accessor(AccessorEntry { buffer_view, component_type, count, kind, min: vec![], max: vec![] })
    }

    fn accessor(&mut self, entry: AccessorEntry) -> u32 {
        self.accessors.push(entry);
        (self.accessors.len() - 1) as u32
    }

    /// Buffers, views and accessors for the document, and the chunk itself.
    pub(super) fn finish(self) -> (Vec<BufferEntry>, Vec<BufferViewEntry>, Vec<AccessorEntry>, Vec<u8>) {
        let byte_length = self.bytes.len();
        let buffers = if byte_length == 0 { vec![] } else { vec![BufferEntry { byte_length }] };
        (buffers, self.views, self.accessors, self.bytes)
    }
}
