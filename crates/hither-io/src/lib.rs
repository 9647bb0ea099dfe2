//! Model files in, pictures out: the only crate of Hither that knows file formats.
//!
//! [`read`] picks the reader by the file's name and content. Every reader returns a valid scene together
//! with what was odd about the file, or one [`Error`] that says what is wrong, where, and what to do.
//! No reader trusts a number in a file: memory is only asked for what the file's own length can fill.
#![forbid(unsafe_code)]

mod atomic;
mod error;

pub use atomic::{check_writable, write_whole};
pub use error::{Diagnostic, Error, Loaded};
