//! What was odd about a text or triangle file: each kind of oddity once, with its first place and a count.

use crate::Diagnostic;

/// Kinds of oddities in the order they were met.
#[derive(Debug, Default)]
pub(crate) struct Oddities {
    found: Vec<Oddity>,
}

#[derive(Debug)]
struct Oddity {
    /// What is met again and again under one heading.
    kind: &'static str,
    place: String,
    message: String,
    count: u64,
}

impl Oddities {
    /// Counts one more of `kind`; `place` and `message` are made only for the first.
    pub(crate) fn note(
        &mut self,
        kind: &'static str,
        place: impl FnOnce() -> String,
        message: impl FnOnce() -> String,
    ) {
        match self.found.iter_mut().find(|o| o.kind == kind) {
            Some(known) => known.count += 1,
            None => self.found.push(Oddity { kind, place: place(), message: message(), count: 1 }),
        }
    }

    /// One more oddity in line `line`, where the kind says it all.
    pub(crate) fn in_line(&mut self, line: u64, kind: &'static str) {
        self.note(kind, || format!("line {line}"), || kind.to_owned());
    }

    /// Whether nothing was odd.
    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// One diagnostic for each kind.
    pub(crate) fn into_diagnostics(self) -> Vec<Diagnostic> {
        let told = |o: Oddity| match o.count {
            1 => Diagnostic { place: o.place, message: o.message },
            more => Diagnostic { place: o.place, message: format!("{} ({more} times)", o.message) },
        };
        self.found.into_iter().map(told).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_once_with_its_first_place() {
        let mut oddities = Oddities::default();
        for line in 3..8 {
            oddities.in_line(line, "a point is left out");
        }
        oddities.note("other", || "here".into(), || "something else".into());
        let told: Vec<String> = oddities.into_diagnostics().iter().map(ToString::to_string).collect();
        assert_eq!(told, ["line 3: a point is left out (5 times)", "here: something else"]);
    }
}
