//! Decoding of `EXT_meshopt_compression` and `KHR_meshopt_compression` buffer views, in safe Rust.
//!
//! The bitstreams and filters are those of the appendices of the extensions' specifications (attributes in
//! version 0 and 1). Damaged streams are refused; the output is only allocated when the input is long
//! enough to fill it.

mod filter;
mod index;
mod vertex;

/// What a stream encodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// What is done to attributes after decoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filter {
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// What is wrong with a stream.
pub(super) type Damage = &'static str;

const TOO_SHORT: Damage = "it ends too early";
const TOO_LONG: Damage = "it has bytes left over";

/// `count` elements of `stride` bytes each.
pub(super) fn decode(
    source: &[u8],
    mode: Mode,
    filter: Option<Filter>,
    count: usize,
    stride: usize,
) -> Result<Vec<u8>, Damage> {
    if mode != Mode::Attributes {
        if !(stride == 2 || stride == 4) || filter.is_some() {
            return Err("indices must be of 2 or 4 bytes, without filter");
        }
        let indices = match mode {
            Mode::Triangles => index::triangles(source, count)?,
            _ => index::sequence(source, count)?,
        };
        return Ok(match stride {
            2 => indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect(),
            _ => indices.iter().flat_map(|&i| i.to_le_bytes()).collect(),
        });
    }
    if !stride.is_multiple_of(4) || !(4..=256).contains(&stride) {
        return Err("the stride of attributes must be a multiple of 4 up to 256");
    }
    let mut elements = vertex::decode(source, count, stride)?;
    if let Some(filter) = filter {
        filter::apply(filter, &mut elements, stride)?;
    }
    Ok(elements)
}

/// Reads forwards through a stream, never beyond its end.
struct Cursor<'a> {
    rest: &'a [u8],
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(TOO_SHORT)?;
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Damage> {
        let (&first, rest) = self.rest.split_first().ok_or(TOO_SHORT)?;
        self.rest = rest;
        Ok(first)
    }

    /// An unsigned LEB128 number of at most 5 bytes; bits beyond 32 are dropped.
    fn number(&mut self) -> Result<u32, Damage> {
        let mut value = 0u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("a number in it has more than 5 bytes")
    }
}

/// The signed difference that an interleaved code stands for, modulo 2^32.
fn unzigzag(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}
