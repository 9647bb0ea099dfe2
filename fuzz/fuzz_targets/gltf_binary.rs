//! GLB files; names lead nowhere.
#![no_main]

use hither_fuzz::{check, nothing};
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    check(hither_io::gltf::from_bytes(Path::new("model.glb"), bytes, &nothing));
});
