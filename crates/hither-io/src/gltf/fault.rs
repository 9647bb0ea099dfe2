//! Why a glTF file is refused, and what was odd about one that is read: one line each, with its place.

use crate::{Diagnostic, Error};
use std::collections::HashMap;
use std::path::Path;

/// Why a file is refused; [`Fault::of_file`] adds which file.
#[derive(Debug)]
pub(super) enum Fault {
    /// The file breaks the format's rules.
    Malformed(String),
    /// The file needs something that is not supported.
    Unsupported(String),
}

pub(super) fn malformed<T>(message: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Malformed(message.into()))
}

pub(super) fn unsupported<T>(message: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Unsupported(message.into()))
}

impl Fault {
    /// Puts `place` before the message.
    pub(super) fn at(self, place: impl std::fmt::Display) -> Fault {
        match self {
            Fault::Malformed(m) => Fault::Malformed(format!("{place}: {m}")),
            Fault::Unsupported(m) => Fault::Unsupported(format!("{place}: {m}")),
        }
    }

    /// The message alone, for a part of a file that can be done without.
    pub(super) fn message(self) -> String {
        match self {
            Fault::Malformed(m) | Fault::Unsupported(m) => m,
        }
    }

    pub(super) fn of_file(self, file: &Path) -> Error {
        let path = file.to_owned();
        match self {
            Fault::Malformed(message) => Error::Malformed { path, message },
            Fault::Unsupported(message) => Error::Unsupported { path, message },
        }
    }
}

/// How a part of a file is called in a message: `mesh 2 "chair"`. Long or unprintable names are tamed.
pub(super) fn part(kind: &str, index: usize, name: &str) -> String {
    if name.is_empty() { format!("{kind} {index}") } else { format!("{kind} {index} {}", quoted(name)) }
}

/// `text` in quotes, on one line and of bounded length.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 100;
    let mut short: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    format!("\"{short}\"")
}

/// Oddities, each message once however many parts it concerns.
#[derive(Default)]
pub(super) struct Oddities {
    found: Vec<Diagnostic>,
    // Message → its position in `found`, and in how many further places it was met.
    further: HashMap<String, (usize, usize)>,
}

impl Oddities {
    pub(super) fn note(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        match self.further.get_mut(&message) {
            Some((first, more)) => {
                if self.found[*first].place != place.into() {
                    *more += 1;
                }
            }
            None => {
                self.further.insert(message.clone(), (self.found.len(), 0));
                self.found.push(Diagnostic { place: place.into(), message });
            }
        }
    }

    pub(super) fn into_diagnostics(mut self) -> Vec<Diagnostic> {
        for &(at, more) in self.further.values() {
            if more > 0 {
                self.found[at].place.push_str(&format!(" and {more} more"));
            }
        }
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_oddity_is_told_once() {
        let mut oddities = Oddities::default();
        for place in ["mesh 0", "mesh 0", "mesh 1", "mesh 2"] {
            oddities.note(place, "has lines, which are left out");
        }
        oddities.note("mesh 0", "another");
        let told: Vec<String> = oddities.into_diagnostics().iter().map(ToString::to_string).collect();
        assert_eq!(told, ["mesh 0 and 2 more: has lines, which are left out", "mesh 0: another"]);
    }

    #[test]
    fn names_stay_on_one_short_line() {
        assert_eq!(part("mesh", 1, ""), "mesh 1");
        assert_eq!(part("mesh", 1, "a\nb"), "mesh 1 \"a\\nb\"");
        assert!(part("mesh", 1, &"ü".repeat(1000)).chars().count() < 120);
    }
}
