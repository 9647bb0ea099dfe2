//! Accessors: typed arrays in buffer views, of every component type, strided, normalized, sparse.
//!
//! [`Elements::resolve`] checks every number against the bytes that are there before anything is allocated.

use super::buffers::Buffers;
use super::fault::{Fault, malformed, part};
use super::json::{Accessor, Index, Sparse, Whole};
use std::ops::Range;

/// A checked accessor.
pub(super) struct Elements<'a> {
    index: Index,
    buffers: &'a Buffers<'a>,
    component: Component,
    normalized: bool,
    kind: &'a str,
    count: usize,
    /// `None`: all zeros, before the sparse values.
    dense: Option<Strided<'a>>,
    sparse: Option<(Vec<u32>, Strided<'a>)>,
}

/// Elements at a regular distance; all of them lie within `bytes`.
#[derive(Clone, Copy)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: Whole) -> Result<Component, Fault> {
        match code.0 {
            5120 => Ok(Component::I8),
            5121 => Ok(Component::U8),
            5122 => Ok(Component::I16),
            5123 => Ok(Component::U16),
            5125 => Ok(Component::U32),
            5126 => Ok(Component::F32),
            other => malformed(format!("its component type {other} is none of glTF's")),
        }
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }
}

impl<'a> Elements<'a> {
    /// Checks accessor `index` against the bytes that it refers to.
    pub(super) fn resolve(buffers: &'a Buffers<'a>, index: Index) -> Result<Elements<'a>, Fault> {
        let accessors = &buffers.document().accessors;
        let Some(accessor) = accessors.get(index.at()) else {
            let there = accessors.len();
            return malformed(format!("it refers to accessor {}, but there are {there}", index.0));
        };
        Elements::check(buffers, index, accessor).map_err(|f| f.at(part("accessor", index.at(), "")))
    }

    fn check(buffers: &'a Buffers<'a>, index: Index, accessor: &'a Accessor) -> Result<Elements<'a>, Fault> {
        let component = Component::of(accessor.component_type)?;
        let Some(width) = width_of(&accessor.kind) else {
            return malformed("its type is none of SCALAR, VEC2, VEC3 and VEC4");
        };
        let element = width * component.size();
        let Whole(count) = accessor.count;
        let dense = match accessor.buffer_view {
            Some(view) => Some(Strided::new(buffers, view, accessor.byte_offset, count, element)?),
            None => {
                // Nothing in the file stands for these elements, so that the budget alone can judge.
                buffers.spend(count.saturating_mul(element as u64))?;
                None
            }
        };
        let Ok(count) = usize::try_from(count) else { return malformed("its count is out of range") };
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(check_sparse(buffers, sparse, count, element)?),
            None => None,
        };
        let (normalized, kind) = (accessor.normalized, accessor.kind.as_str());
        Ok(Elements { index, buffers, component, normalized, kind, count, dense, sparse })
    }

    /// Number of elements.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Whether the file has data for it at all.
    pub(super) fn has_data(&self) -> bool {
        self.dense.is_some() || self.sparse.is_some()
    }

    /// Number of components of an element.
    pub(super) fn width(&self) -> usize {
        width_of(self.kind).unwrap_or(0)
    }

    /// The elements as `N` floats each. Integers are scaled where the accessor says `normalized`.
    pub(super) fn floats<const N: usize>(&self) -> Result<Vec<[f32; N]>, Fault> {
        self.floats_in(0..self.count)
    }

    /// The elements in `range`, all of which exist, as `N` floats each.
    pub(super) fn floats_in<const N: usize>(&self, range: Range<usize>) -> Result<Vec<[f32; N]>, Fault> {
        if self.width() != N {
            return self.fault(format!("it is of type {}, where {N} components are needed", self.kind));
        }
        self.buffers.spend((range.len() as u64).saturating_mul(4 * N as u64))?;
        let mut all = match self.dense {
            Some(dense) => self.to_floats(dense.part(&range)),
            None => vec![[0.0; N]; range.len()],
        };
        if let Some((places, values)) = &self.sparse {
            for (&place, value) in places.iter().zip(self.to_floats(*values)) {
                if range.contains(&(place as usize)) {
                    all[place as usize - range.start] = value;
                }
            }
        }
        Ok(all)
    }

    fn to_floats<const N: usize>(&self, from: Strided) -> Vec<[f32; N]> {
        match (self.component, self.normalized) {
            (Component::F32, _) => from.gather(f32::from_le_bytes),
            (Component::U8, true) => from.gather(|b: [u8; 1]| f32::from(b[0]) / 255.0),
            (Component::U8, false) => from.gather(|b: [u8; 1]| f32::from(b[0])),
            (Component::I8, true) => from.gather(|b| (f32::from(i8::from_le_bytes(b)) / 127.0).max(-1.0)),
            (Component::I8, false) => from.gather(|b| f32::from(i8::from_le_bytes(b))),
            (Component::U16, true) => from.gather(|b| f32::from(u16::from_le_bytes(b)) / 65_535.0),
            (Component::U16, false) => from.gather(|b| f32::from(u16::from_le_bytes(b))),
            (Component::I16, true) => {
                from.gather(|b| (f32::from(i16::from_le_bytes(b)) / 32_767.0).max(-1.0))
            }
            (Component::I16, false) => from.gather(|b| f32::from(i16::from_le_bytes(b))),
            (Component::U32, true) => {
                from.gather(|b| (f64::from(u32::from_le_bytes(b)) / 4_294_967_295.0) as f32)
            }
            (Component::U32, false) => from.gather(|b| u32::from_le_bytes(b) as f32),
        }
    }

    /// The elements as indices.
    pub(super) fn indices(&self) -> Result<Vec<u32>, Fault> {
        if self.width() != 1 || self.normalized {
            return self.fault("indices must be plain scalars");
        }
        self.buffers.spend((self.count as u64).saturating_mul(4))?;
        let mut all = match self.dense {
            Some(dense) => to_indices(self.component, dense).map_err(|f| f.at(self.place()))?,
            None => vec![0; self.count],
        };
        if let Some((places, values)) = &self.sparse {
            let values = to_indices(self.component, *values).map_err(|f| f.at(self.place()))?;
            for (&place, value) in places.iter().zip(values) {
                all[place as usize] = value;
            }
        }
        Ok(all)
    }

    fn place(&self) -> String {
        part("accessor", self.index.at(), "")
    }

    fn fault<T>(&self, message: impl Into<String>) -> Result<T, Fault> {
        malformed(message).map_err(|f: Fault| f.at(self.place()))
    }
}

fn width_of(kind: &str) -> Option<usize> {
    match kind {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        // Matrices belong to skins, which are not read.
        _ => None,
    }
}

fn check_sparse<'a>(
    buffers: &'a Buffers<'a>,
    sparse: &Sparse,
    count: usize,
    element: usize,
) -> Result<(Vec<u32>, Strided<'a>), Fault> {
    let component = Component::of(sparse.indices.component_type)?;
    let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
    let places = Strided::new(buffers, view, offset, sparse.count.0, component.size())?;
    let values =
        Strided::new(buffers, sparse.values.buffer_view, sparse.values.byte_offset, sparse.count.0, element)?;
    buffers.spend(sparse.count.0.saturating_mul(4 + element as u64))?;
    let places = to_indices(component, places)?;
    match places.iter().position(|&p| p as usize >= count) {
        Some(bad) => {
            malformed(format!("its sparse index {bad} is {}, but there are {count} elements", places[bad]))
        }
        None => Ok((places, values)),
    }
}

fn to_indices(component: Component, from: Strided) -> Result<Vec<u32>, Fault> {
    let all: Vec<[u32; 1]> = match component {
        Component::U8 => from.gather(|b: [u8; 1]| u32::from(b[0])),
        Component::U16 => from.gather(|b| u32::from(u16::from_le_bytes(b))),
        Component::U32 => from.gather(u32::from_le_bytes),
        _ => return malformed("indices must be unsigned integers"),
    };
    Ok(all.into_iter().map(|[index]| index).collect())
}

impl<'a> Strided<'a> {
    fn new(
        buffers: &'a Buffers<'a>,
        view: Index,
        offset: Whole,
        count: u64,
        element: usize,
    ) -> Result<Strided<'a>, Fault> {
        let bytes = buffers.view(view)?;
        let stride = buffers.stride(view).unwrap_or(element as u64);
        if stride < element as u64 {
            return malformed(format!("its elements of {element} bytes overlap: their stride is {stride}"));
        }
        let needed = match count.checked_sub(1) {
            Some(steps) => steps
                .checked_mul(stride)
                .and_then(|s| s.checked_add(element as u64))
                .and_then(|s| s.checked_add(offset.0)),
            None => Some(0),
        };
        if needed.is_none_or(|n| n > bytes.len() as u64) {
            let (have, at, view) = (bytes.len(), offset.0, view.0);
            return malformed(format!(
                "it claims {count} elements of {element} bytes at byte {at}, but buffer view {view} has {have} bytes"
            ));
        }
        // Both fit: `count` elements do, and a stride that does not is never taken.
        let (count, start) = (count as usize, if count == 0 { 0 } else { offset.0 as usize });
        let stride = usize::try_from(stride).unwrap_or(usize::MAX);
        Ok(Strided { bytes: &bytes[start..], stride, count })
    }

    /// The elements in `range`, all of which exist.
    fn part(&self, range: &Range<usize>) -> Strided<'a> {
        let bytes = if range.is_empty() { &[] } else { &self.bytes[range.start * self.stride..] };
        Strided { bytes, stride: self.stride, count: range.len() }
    }

    /// All elements, `N` components of `W` bytes each.
    fn gather<T, const N: usize, const W: usize>(&self, convert: impl Fn([u8; W]) -> T) -> Vec<[T; N]> {
        let element = |bytes: &[u8]| -> [T; N] {
            std::array::from_fn(|c| {
                let mut component = [0; W];
                component.copy_from_slice(&bytes[c * W..(c + 1) * W]);
                convert(component)
            })
        };
        if self.stride == N * W {
            // Without gaps, the length of every chunk is known when this is compiled.
            return self.bytes.chunks_exact(N * W).take(self.count).map(element).collect();
        }
        self.bytes.chunks(self.stride).take(self.count).map(element).collect()
    }
}
