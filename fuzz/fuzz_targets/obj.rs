//! OBJ files; every library and texture that they name is one pixel.
#![no_main]

use hither_fuzz::{PIXEL, check, everywhere};
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    check(hither_io::obj::from_bytes(Path::new("model.obj"), bytes, &everywhere(PIXEL)));
});
