//! STL files of either kind.
#![no_main]

use hither_fuzz::check;
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    check(hither_io::stl::from_bytes(Path::new("model.stl"), bytes));
});
