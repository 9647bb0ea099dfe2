//! References from a model to other data: within the reference itself, or in a file of the model's folder.
//!
//! What the folder's files are, and that nothing outside it is opened, is the [`Companions`]' business.

use super::fault::{Fault, malformed, quoted, unsupported};
use crate::Companions;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::path::PathBuf;

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The bytes that `uri` refers to.
pub(super) fn load(uri: &str, companions: &dyn Companions) -> Result<Vec<u8>, Fault> {
    match data_content(uri) {
        Some(content) => decode_data(content),
        None => companions.load(&file_name(uri)?).or_else(malformed),
    }
}

/// Which file `uri` refers to, however it is written; `None` if it refers to none, or the data is in it.
pub(super) fn file(uri: &str, companions: &dyn Companions) -> Option<PathBuf> {
    let name = if is_data(uri) { None } else { file_name(uri).ok() };
    name.map(|name| companions.identity(&name))
}

/// The name of the file that `uri` refers to.
fn file_name(uri: &str) -> Result<Cow<'_, str>, Fault> {
    // A scheme is a letter and then letters, digits, `+`, `-`, `.`; `C:` of Windows looks the same.
    if let Some((scheme, _)) = uri.split_once(':')
        && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    {
        return unsupported(format!(
            "it is at {}; only files in the model's folder are opened, so put it there",
            quoted(uri)
        ));
    }
    match percent_decode_str(uri).decode_utf8() {
        Ok(name) => Ok(name),
        Err(_) => malformed("its name is not UTF-8 once decoded"),
    }
}

/// Whether the data is in the reference itself.
pub(super) fn is_data(uri: &str) -> bool {
    data_content(uri).is_some()
}

/// What follows `data:` in a data URI.
fn data_content(uri: &str) -> Option<&str> {
    let (scheme, content) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then_some(content)
}

fn decode_data(content: &str) -> Result<Vec<u8>, Fault> {
    let Some((header, body)) = content.split_once(',') else {
        return malformed("its data URI has no comma before the data");
    };
    let base64 = header.rsplit(';').next().is_some_and(|last| last.trim().eq_ignore_ascii_case("base64"));
    if !base64 {
        return Ok(percent_decode_str(body).collect());
    }
    let decoded = if body.contains('%') {
        BASE64.decode(percent_decode_str(body).collect::<Vec<u8>>())
    } else {
        BASE64.decode(body)
    };
    decoded.or_else(|e| malformed(format!("its data URI is not base64: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get(uri: &str) -> Result<Vec<u8>, String> {
        let echo = |name: &str| Ok(name.as_bytes().to_vec());
        load(uri, &echo).map_err(Fault::message)
    }

    #[test]
    fn names_are_decoded_and_networks_left_alone() {
        assert_eq!(get("a%20b/c%3f.bin").unwrap(), b"a b/c?.bin");
        assert_eq!(get("%2e%2e/c.bin").unwrap(), b"../c.bin");
        for other in ["http://example.com/c.bin", "file:///c.bin", "C:/c.bin", "c:\\c.bin"] {
            assert!(get(other).unwrap_err().contains("only files in the model's folder"), "{other}");
        }
        assert!(get("%ff%fe").unwrap_err().contains("UTF-8"));
    }

    #[test]
    fn data_is_decoded_whatever_its_dress() {
        assert_eq!(get("data:application/octet-stream;base64,AAEC").unwrap(), [0, 1, 2]);
        assert_eq!(get("DATA:;base64,AAE").unwrap(), [0, 1]);
        assert_eq!(get("data:;base64,AAE%3D").unwrap(), [0, 1]);
        assert_eq!(get("data:text/plain,a%20b").unwrap(), b"a b");
        assert!(get("data:;base64,A*==").unwrap_err().contains("base64"));
        assert!(get("data:AAEC").unwrap_err().contains("comma"));
    }
}
