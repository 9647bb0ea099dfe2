//! Material libraries, and textures: a name that ends in a letter of its own is the input itself.
#![no_main]

use hither_fuzz::{PIXEL, check};
use std::path::Path;

/// Uses the materials that the seeds define.
const MODEL: &str = "mtllib library\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n\
    usemtl b\nf 1 2 3\nusemtl c\nf 1 2 3\nusemtl\nf 1 2 3\n";

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let files = |name: &str| match name {
        "library" => Ok(bytes.to_vec()),
        "pixel.png" => Ok(PIXEL.to_vec()),
        "self" => Ok(bytes.to_vec()),
        _ => Err("there is no such file".to_owned()),
    };
    check(hither_io::obj::from_bytes(Path::new("model.obj"), MODEL.as_bytes(), &files));
});
