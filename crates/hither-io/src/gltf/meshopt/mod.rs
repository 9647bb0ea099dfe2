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

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(hex: &str) -> Vec<u8> {
        hex.as_bytes().as_chunks::<2>().0.iter().map(|d| digit(d[0]) << 4 | digit(d[1])).collect()
    }

    fn digit(hex: u8) -> u8 {
        (hex as char).to_digit(16).unwrap() as u8
    }

    /// Twenty elements of a float, two shorts and a word, as the streams below hold them.
    fn elements() -> Vec<u8> {
        let element = |i: u16| {
            let mut e = (f32::from(i) * 0.5).to_le_bytes().to_vec();
            e.extend((300 * i).to_le_bytes());
            e.extend((65_535 - 7 * i).to_le_bytes());
            e.extend((u32::from(i % 3) * 0x0100_0001).to_le_bytes());
            e
        };
        (0..20).flat_map(element).collect()
    }

    // Made with the reference encoder of meshoptimizer, from the elements above.
    const VERSION_0: &str = "a00000070000ff80804040404020202020202020ff0000002010101005308000007e800000000700\
        585858585858585858585858585858ff00000058585858052aaeaaea0404ae000000040a0ddddddddddddddddddd000000\
        00000000060223223223223223ae000000030000060223223223223223ae00000003000000000000000000000000000000\
        0000000000000000000000ffff00000000";
    /// Channels told as words and as bytes.
    const VERSION_1: &str = "a13a976900000080804040404020202020202020201010100106007e0100585858585858585858\
        58585858585858585858052aaaaaaaaa000000020ddddddddddddddd0f000d0d0d0d060223223223223223ae0000000306\
        0223223223223223ae00000003000000000000000000000000000000ffff00000000010100";
    /// Literal bytes, and a channel told by exclusive or with a turn.
    const VERSION_1_XOR: &str = "a1689769011200070f020ff8f4c4f262e262e010f81c0f003e01030100585858585858585858\
        58585858585858585858052aaaaaaaaa000000020ddddddddddddddd0f000d0d0d0d060223223223223223ae0000000306\
        0223223223223223ae00000003000000000000000000000000000000ffff00000000520100";

    #[test]
    fn attributes_of_both_versions() {
        for stream in [VERSION_0, VERSION_1, VERSION_1_XOR] {
            let stream = bytes(stream);
            assert_eq!(decode(&stream, Mode::Attributes, None, 20, 12), Ok(elements()));
            // One byte less, and one element less or more, do not fit the stream.
            assert!(decode(&stream[..stream.len() - 1], Mode::Attributes, None, 20, 12).is_err());
            assert!(decode(&stream, Mode::Attributes, None, 300, 12).is_err());
            assert_eq!(decode(&stream, Mode::Attributes, None, 0, 12), Err(TOO_LONG));
        }
    }

    #[test]
    fn triangles_and_sequences() {
        let words = |indices: &[u32]| indices.iter().flat_map(|i| i.to_le_bytes()).collect::<Vec<u8>>();
        let stream = bytes("e1f0101010ff901ff4c801b901bc01007687566778a9866589689801690000");
        let corners = [0, 1, 2, 2, 1, 3, 3, 1, 4, 4, 1, 5, 100, 7, 2, 0, 2, 6, 6, 2, 101];
        assert_eq!(decode(&stream, Mode::Triangles, None, 21, 4), Ok(words(&corners)));
        assert_eq!(decode(&stream, Mode::Triangles, None, 18, 4), Err(TOO_LONG));
        assert!(decode(&stream, Mode::Triangles, None, 20, 4).is_err());
        let short: Vec<u8> = corners.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
        assert_eq!(decode(&stream, Mode::Triangles, None, 21, 2), Ok(short));
        let stream = bytes("d100a11f04050405b88b119b1f00000000");
        let sequence = [0, 1000, 1, 1001, 2, 1002, 70_000, 3];
        assert_eq!(decode(&stream, Mode::Indices, None, 8, 4), Ok(words(&sequence)));
        assert_eq!(decode(&stream, Mode::Indices, None, 7, 4), Err(TOO_LONG));
        assert_eq!(decode(&stream, Mode::Indices, None, 9, 4), Err(TOO_SHORT));
    }

    #[test]
    fn layouts_that_do_not_go_together_are_refused() {
        let stream = bytes(VERSION_1);
        for stride in [0, 2, 6, 260] {
            assert!(decode(&stream, Mode::Attributes, None, 20, stride).is_err());
        }
        assert!(decode(&stream, Mode::Attributes, Some(Filter::Quaternion), 20, 12).is_err());
        assert!(decode(&stream, Mode::Indices, None, 20, 4).is_err());
        assert!(decode(&[], Mode::Attributes, None, 0, 4).is_err());
    }
}
