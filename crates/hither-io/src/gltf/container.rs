//! The outer shell: one JSON text, and for a binary file one block of bytes beside it.
//!
//! Every length in a GLB header is held against the file's own before it is used.

use super::fault::{Fault, malformed, unsupported};
use std::ops::Range;

const MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;

/// Where the parts of a file lie in its bytes.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Parts {
    /// The JSON text.
    pub(super) json: Range<usize>,
    /// The binary chunk of a GLB.
    pub(super) bin: Option<Range<usize>>,
}

/// Finds the parts of a `.gltf` or `.glb` file. Whether it is binary is seen from the content;
/// `named_glb` only serves the message.
pub(super) fn split(bytes: &[u8], named_glb: bool) -> Result<Parts, Fault> {
    if bytes.starts_with(MAGIC) {
        return split_glb(bytes);
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let first = text.iter().find(|b| !b.is_ascii_whitespace());
    if first == Some(&b'{') {
        return Ok(Parts { json: 0..bytes.len(), bin: None });
    }
    let start = bytes[..bytes.len().min(4)].escape_ascii();
    if named_glb {
        malformed(format!("this is not a binary glTF file: it begins with \"{start}\", not with \"glTF\""))
    } else {
        malformed(format!(
            "this is not a glTF file: it begins with \"{start}\", neither with {{ nor with \"glTF\""
        ))
    }
}

fn split_glb(bytes: &[u8]) -> Result<Parts, Fault> {
    let (Some(version), Some(claimed)) = (word(bytes, 4), word(bytes, 8)) else {
        return malformed("the file ends within its 12-byte header; fetch it again");
    };
    if version != 2 {
        return unsupported(format!("this is binary glTF version {version}; convert it to version 2"));
    }
    let claimed = claimed as usize;
    if claimed > bytes.len() {
        let have = bytes.len();
        return malformed(format!(
            "the file is cut short: its header says {claimed} bytes, but there are {have}; fetch it again"
        ));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    while at + 8 <= claimed {
        let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) else { break };
        let start = at + 8;
        let length = length as usize;
        if length > claimed - start {
            let left = claimed - start;
            return malformed(format!(
                "the chunk at byte {at} claims {length} bytes, but {left} are left; fetch the file again"
            ));
        }
        let range = start..start + length;
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(range),
            BIN_CHUNK if bin.is_none() => bin = Some(range),
            // Other kinds are reserved for extensions, and to be skipped.
            _ => {}
        }
        // Chunks begin at multiples of 4; a length that is none is an exporter's slip.
        at = (start + length).next_multiple_of(4);
    }
    match json {
        Some(json) => Ok(Parts { json, bin }),
        None => malformed("this binary glTF file has no JSON chunk"),
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    four.try_into().ok().map(u32::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(version: u32, length: u32, chunks: &[(u32, u32, &[u8])]) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.extend(version.to_le_bytes());
        out.extend(length.to_le_bytes());
        for (claimed, kind, content) in chunks {
            out.extend(claimed.to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend(*content);
        }
        out
    }

    fn refusal(bytes: &[u8]) -> String {
        split(bytes, true).unwrap_err().message()
    }

    #[test]
    fn chunks_are_found_and_strangers_skipped() {
        let file = glb(2, 48, &[(4, JSON_CHUNK, b"{}  "), (4, 7, b"????"), (4, BIN_CHUNK, b"abcd")]);
        assert_eq!(split(&file, true).unwrap(), Parts { json: 20..24, bin: Some(44..48) });
        let text = b"\xef\xbb\xbf\n {}";
        assert_eq!(split(text, false).unwrap(), Parts { json: 0..7, bin: None });
    }

    #[test]
    fn lengths_beyond_the_file_are_refused() {
        let json: (u32, u32, &[u8]) = (4, JSON_CHUNK, b"{}  ");
        assert!(refusal(&glb(2, 25, &[json])).contains("cut short"));
        assert!(refusal(&glb(2, 24, &[(5, JSON_CHUNK, b"{}  ")])).contains("claims 5 bytes, but 4 are left"));
        assert!(refusal(&glb(2, 24, &[(u32::MAX, JSON_CHUNK, b"{}  ")])).contains("claims 4294967295"));
        assert!(refusal(&glb(2, 12, &[])).contains("no JSON"));
        assert!(refusal(&glb(1, 24, &[json])).contains("version 1"));
        assert!(refusal(b"glTF\x02").contains("header"));
        assert!(refusal(b"glTX").contains("begins with \"glTX\""));
        assert!(refusal(b"").contains("not a binary"));
    }
}
