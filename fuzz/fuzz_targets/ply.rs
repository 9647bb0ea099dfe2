//! PLY files of every encoding.
#![no_main]

use hither_fuzz::check;
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    check(hither_io::ply::from_bytes(Path::new("model.ply"), bytes));
});
