//! STL as text: solids of facets of loops of vertices. Lenient: only what says where corners are matters.

use super::{Odd, Solid};
use crate::oddities::{Losses, Oddities};
use crate::polygon::{Fit, Triangulator};
use crate::text::{self, Lines, quoted};
use glam::Vec3;
use hither::scene::Scene;

/// Appends a part for each solid; on failure a line that says why.
pub(super) fn read(bytes: &[u8], scene: &mut Scene, oddities: &mut Oddities) -> Result<(), String> {
    let mut reader = Reader::default();
    let mut odd = Odd { unit: "line", oddities, losses: Losses::default() };
    let mut lines = Lines::plain(text::without_mark(bytes));
    let mut number = 0;
    while let Some(line) = lines.next() {
        number += 1;
        let mut rest = line;
        let Some(word) = text::word(&mut rest) else { continue };
        let is = |name: &str| word.eq_ignore_ascii_case(name.as_bytes());
        if is("vertex") {
            reader.vertex(rest);
        } else if is("outer") || is("endloop") {
            reader.close_loop(number, &mut odd);
        } else if is("facet") || is("endfacet") {
            reader.close_facet(number, &mut odd);
            reader.is_bare = is("facet");
            reader.facets += u64::from(is("facet"));
        } else if is("solid") {
            reader.end_solid(scene);
            reader.solid.name = String::from_utf8_lossy(rest.trim_ascii()).into_owned();
            reader.is_open = true;
        } else if is("endsolid") {
            reader.close_facet(number, &mut odd);
            reader.end_solid(scene);
        } else {
            odd.oddities.note(
                "unknown",
                || format!("line {number}"),
                || format!("{} is not a word of the format; the line is left out", quoted(word)),
            );
        }
    }
    if reader.facets == 0 && (reader.is_open || !odd.oddities.is_empty()) {
        return Err("it begins with \"solid\" but holds no facet; is it damaged, or another format?".into());
    }
    if reader.is_open {
        if reader.is_bare || !reader.outline.is_empty() {
            odd.losses.lost(number, "the file ends within a facet");
        }
        odd.note(number, "the file ends within a solid; what was complete is read");
    }
    reader.end_solid(scene);
    odd.refusal().map_or(Ok(()), Err)
}

#[derive(Default)]
struct Reader {
    solid: Solid,
    is_open: bool,
    facets: u64,
    /// A facet has begun, and no corner of it was met.
    is_bare: bool,
    /// Corners since the last loop began.
    outline: Vec<Vec3>,
    triangulator: Triangulator,
    cut: Vec<[u32; 3]>,
}

impl Reader {
    fn vertex(&mut self, mut line: &[u8]) {
        let mut position = Vec3::NAN;
        for axis in 0..3 {
            let Some(value) = text::word(&mut line).and_then(text::number) else { break };
            position[axis] = value;
        }
        self.outline.push(position);
        self.is_bare = false;
    }

    fn close_facet(&mut self, number: u64, odd: &mut Odd) {
        self.close_loop(number, odd);
        if std::mem::take(&mut self.is_bare) {
            odd.lose(number, "a facet has no corners and is left out");
        }
    }

    /// Makes triangles of the corners that were given, if any.
    fn close_loop(&mut self, number: u64, odd: &mut Odd) {
        match self.outline[..] {
            [] => return,
            [_] | [_, _] => {
                odd.lose(number, "a loop has fewer than three corners and is left out");
            }
            [a, b, c] => self.solid.triangle([a, b, c], number, odd),
            _ => self.polygon(number, odd),
        }
        self.outline.clear();
    }

    /// The format knows triangles alone, but some software writes more corners.
    fn polygon(&mut self, number: u64, odd: &mut Odd) {
        if !self.outline.iter().all(|p| p.is_finite()) {
            let what = match self.outline.iter().any(|p| p.is_nan()) {
                true => "a loop has a coordinate that is no number and is left out",
                false => "a loop has a coordinate that is infinite or beyond 32-bit floats and is left out",
            };
            return odd.lose(number, what);
        }
        odd.losses.understood();
        self.cut.clear();
        if self.triangulator.triangulate(&self.outline, &mut self.cut) != Fit::Exact {
            odd.note(number, "a loop crosses itself or is too intricate; its triangles are a guess");
        }
        for triangle in &self.cut {
            let corners = triangle.map(|i| self.outline[i as usize]);
            self.solid.triangle(corners, number, odd);
        }
    }

    fn end_solid(&mut self, scene: &mut Scene) {
        self.outline.clear();
        (self.is_open, self.is_bare) = (false, false);
        std::mem::take(&mut self.solid).finish(scene);
    }
}
