//! Why the program ends without success: one line for the user, and an exit code.

use std::panic::PanicHookInfo;

/// Exit code: the input or the work failed.
pub const WORK: u8 = 1;
/// Exit code: the command line is wrong.
pub const USAGE: u8 = 2;

/// What went wrong, where, and what to do, in a line.
#[derive(Debug)]
pub struct Failure {
    /// [`WORK`] or [`USAGE`].
    pub exit_code: u8,
    /// Without `error:` and without a line end.
    pub line: String,
}

impl Failure {
    /// The command line is wrong.
    pub fn usage(line: impl Into<String>) -> Failure {
        Failure { exit_code: USAGE, line: line.into() }
    }

    /// The input or the work failed.
    pub fn work(line: impl Into<String>) -> Failure {
        Failure { exit_code: WORK, line: line.into() }
    }
}

impl From<hither_io::Error> for Failure {
    fn from(error: hither_io::Error) -> Failure {
        Failure::work(error.to_string())
    }
}

/// A panic in a line: where it happened and what it said.
pub fn of_panic(panic: &PanicHookInfo) -> String {
    let said = panic.payload_as_str().unwrap_or("no message");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let place = panic.location().map(|l| format!(" at {}:{}", l.file(), l.line())).unwrap_or_default();
    format!("internal error{place}: {said}; this is a bug in hither, please report it with the command line")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn a_panic_is_one_line() {
        static SAID: Mutex<String> = Mutex::new(String::new());
        std::panic::set_hook(Box::new(|panic| *SAID.lock().unwrap() = of_panic(panic)));
        let result = std::panic::catch_unwind(|| panic!("first\nsecond {}", 3));
        drop(std::panic::take_hook());
        assert!(result.is_err());
        let said = SAID.lock().unwrap().clone();
        assert!(said.contains("failure.rs:") && said.contains(": first second 3; "), "{said}");
        assert!(!said.contains('\n'));
    }
}
