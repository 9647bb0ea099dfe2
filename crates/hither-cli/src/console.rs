//! What goes to the terminal: results on standard output, everything else on standard error.
//!
//! Nothing here panics when the other end of a pipe is gone. A line on standard error stays one line, whatever names
//! of files or of things in files it holds.

use crate::failure::Failure;
use hither_io::one_line;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{ErrorKind, IsTerminal, Write};
use std::time::Duration;

/// How much is said on standard error besides errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Warnings and notes, too.
    Normal,
    /// And details.
    Verbose,
}

/// Prints `text` to standard output. If its reader has gone, the program ends well at once.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    match written {
        Err(gone) if gone.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        Err(other) => Err(Failure::work(format!("standard output: cannot write: {other}"))),
        Ok(()) => Ok(()),
    }
}

/// Prints an error line.
pub fn error(line: &str) {
    say(&format!("error: {line}"));
}

impl Verbosity {
    /// Prints something odd that does not stop the work.
    pub fn warning(self, line: &str) {
        if self >= Verbosity::Normal {
            say(&format!("warning: {line}"));
        }
    }

    /// Prints a choice that was made for the user, or what was done.
    pub fn note(self, line: &str) {
        if self >= Verbosity::Normal {
            say(line);
        }
    }

    /// Prints what only the curious want.
    pub fn detail(self, line: &str) {
        if self >= Verbosity::Verbose {
            say(line);
        }
    }

    /// A bar for `steps` steps, of which each may take long; visible on a terminal only.
    pub fn bar(self, steps: u64, what: &'static str) -> ProgressBar {
        if !self.shows_progress() {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(steps);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix} {bar:40} {pos}/{len} {msg} {eta}")
        {
            bar.set_style(style);
        }
        bar.set_prefix(what);
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// A sign of life for work whose length is unknown, visible on a terminal only.
    pub fn spinner(self, what: String) -> ProgressBar {
        if !self.shows_progress() {
            return ProgressBar::hidden();
        }
        let spinner = ProgressBar::new_spinner();
        spinner.set_message(one_line(&what).into_owned());
        spinner.enable_steady_tick(Duration::from_millis(100));
        spinner
    }

    fn shows_progress(self) -> bool {
        self >= Verbosity::Normal && std::io::stderr().is_terminal()
    }
}

fn say(line: &str) {
    // If standard error is closed there is nobody left to tell.
    let _ = writeln!(std::io::stderr(), "{}", one_line(line));
}
