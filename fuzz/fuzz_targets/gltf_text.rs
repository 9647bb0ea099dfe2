//! glTF as JSON; every file that it names is 256 bytes that are also numbers.
#![no_main]

use hither_fuzz::{check, everywhere};
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let buffer: Vec<u8> = (0..=255).collect();
    check(hither_io::gltf::from_bytes(Path::new("model.gltf"), bytes, &everywhere(&buffer)));
});
