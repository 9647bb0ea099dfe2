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
    place: Place,
    message: String,
    count: u64,
}

#[derive(Debug)]
enum Place {
    /// A line of the text, from 1.
    Line(u64),
    At(String),
}

impl Oddities {
    /// Counts one more of `kind`; `place` and `message` are made only for the first.
    pub(crate) fn note(
        &mut self,
        kind: &'static str,
        place: impl FnOnce() -> String,
        message: impl FnOnce() -> String,
    ) {
        self.add(kind, || Place::At(place()), message);
    }

    /// One more oddity in line `line`, where the kind says it all.
    pub(crate) fn in_line(&mut self, line: u64, kind: &'static str) {
        self.in_line_with(line, kind, || kind.to_owned());
    }

    /// One more of `kind`, in line `line`; `message` is made only for the first.
    pub(crate) fn in_line_with(&mut self, line: u64, kind: &'static str, message: impl FnOnce() -> String) {
        self.add(kind, || Place::Line(line), message);
    }

    fn add(&mut self, kind: &'static str, place: impl FnOnce() -> Place, message: impl FnOnce() -> String) {
        match self.found.iter_mut().find(|o| o.kind == kind) {
            Some(known) => known.count += 1,
            None => self.found.push(Oddity { kind, place: place(), message: message(), count: 1 }),
        }
    }

    /// What was odd about the next piece of the text, which begins after `lines` lines.
    pub(crate) fn append(&mut self, piece: Oddities, lines: u64) {
        for mut oddity in piece.found {
            if let Some(known) = self.found.iter_mut().find(|o| o.kind == oddity.kind) {
                known.count += oddity.count;
                continue;
            }
            if let Place::Line(line) = &mut oddity.place {
                *line += lines;
            }
            self.found.push(oddity);
        }
    }

    /// Whether nothing was odd.
    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// One diagnostic for each kind.
    pub(crate) fn into_diagnostics(self) -> Vec<Diagnostic> {
        let told = |o: Oddity| {
            let place = match o.place {
                Place::Line(line) => format!("line {line}"),
                Place::At(place) => place,
            };
            match o.count {
                1 => Diagnostic { place, message: o.message },
                more => Diagnostic { place, message: format!("{} ({more} times)", o.message) },
            }
        };
        self.found.into_iter().map(told).collect()
    }
}

/// How many of a file's faces were lost, and why the first was. A face that only has no area is not lost.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    count: u64,
    /// The number of its line or of itself, and why.
    first: Option<(u64, &'static str)>,
    any_understood: bool,
}

impl Losses {
    /// The face of this number, or in the line of this number, is left out.
    #[cold]
    pub(crate) fn lost(&mut self, number: u64, why: &'static str) {
        self.count += 1;
        if self.first.is_none_or(|(first, _)| number < first) {
            self.first = Some((number, why));
        }
    }

    /// What was lost in the next piece of the text, which begins after `lines` lines.
    pub(crate) fn append(&mut self, piece: Losses, lines: u64) {
        self.count += piece.count;
        self.first = self.first.or(piece.first.map(|(line, why)| (line + lines, why)));
        self.any_understood |= piece.any_understood;
    }

    /// A face means something.
    pub(crate) fn understood(&mut self) {
        self.any_understood = true;
    }

    /// The line that refuses a file whose faces are all lost. `what` the numbers are of: lines or faces.
    pub(crate) fn refusal(&self, what: &str) -> Option<String> {
        let (number, why) = self.first.filter(|_| !self.any_understood)?;
        let why = why.trim_end_matches(" is left out").trim_end_matches(" and").trim_end_matches("; it");
        let all = match self.count {
            1 => "its only face is lost".to_owned(),
            n => format!("all of its {n} faces are lost"),
        };
        Some(format!("{all} ({what} {number}: {why}); nothing is left to draw, so export or fetch it again"))
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

    #[test]
    fn lines_of_a_further_piece_are_counted_on() {
        let piece = |line| {
            let mut oddities = Oddities::default();
            oddities.in_line(line, "a point is left out");
            oddities
        };
        let mut all = Oddities::default();
        all.append(piece(3), 0);
        all.append(piece(4), 10);
        let mut other = Oddities::default();
        other.in_line(1, "something else");
        all.append(other, 20);
        let told: Vec<String> = all.into_diagnostics().iter().map(ToString::to_string).collect();
        assert_eq!(told, ["line 3: a point is left out (2 times)", "line 21: something else"]);
    }
}
