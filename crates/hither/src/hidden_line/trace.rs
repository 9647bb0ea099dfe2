//! A whole line against the whole scene: which parts of it are seen, and what covers the others.
//!
//! The line is followed from cell to cell of the grid. Where the cover says that it is hidden, that is all
//! that is asked; elsewhere the cell's triangles are tried, nearest first, until they are farther than the
//! line. No triangle is tried twice.

use super::cover::Cover;
use super::grid::rectangle;
use super::hide::{Hidden, hidden_part};
use super::occluders::{Bounds, Occluders};
use super::shown::Shown;
use super::topology::NONE;
use glam::{DVec2, DVec3};

/// A gap in what hides a line that is shorter than this, pixels, is rounding.
const SHORTEST_PX: f64 = 1e-6;

/// A part of a line under the same number of triangles; 0 is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    pub from: f64,
    pub to: f64,
    pub covers: u32,
}

/// What tracing looks at.
#[derive(Clone, Copy)]
pub(super) struct Tracer<'a> {
    pub shown: &'a Shown<'a>,
    pub occluders: &'a Occluders,
    /// All surfaces, also those that hide nothing.
    pub surfaces: &'a Occluders,
    /// Whether blended surfaces hide nothing, and there are any.
    pub sees_through: bool,
    /// What is known to be hidden; `None` where layers are to be counted.
    pub cover: Option<&'a Cover>,
    pub picture: DVec2,
    /// Whether parts that are hidden are wanted, with the number of triangles that cover them.
    pub counts: bool,
    /// Whether lines are seen as far as to where they pierce a surface, even if they are at the same place as it before,
    /// but for rounding: so that lines that bound a face meet.
    pub piercing: bool,
}

/// What tracing keeps from line to line; one for each thread.
pub(super) struct Scratch {
    tried: Vec<u32>,
    stamp: u32,
    hidden: Vec<Hidden>,
    /// Of the stretch that is looked at, what is before the first of these parameters and from the second on is hidden.
    open: (f64, f64),
    events: Vec<(f64, i32)>,
    /// The answer.
    pub parts: Vec<Part>,
    /// Triangles that were tried exactly.
    pub tests: u64,
}

impl Scratch {
    pub fn new(occluders: &Occluders) -> Scratch {
        Scratch {
            tried: vec![0; occluders.list.len()],
            stamp: 0,
            hidden: Vec::new(),
            open: (0.0, 1.0),
            events: Vec::new(),
            parts: Vec::new(),
            tests: 0,
        }
    }

    /// Begins a stretch of the line; whether it is known to be hidden.
    fn open(&mut self, from: f64, to: f64) -> bool {
        self.open = (from, to);
        self.close_by_last()
    }

    /// Notes a hidden part; whether the stretch is known to be hidden now.
    fn hide(&mut self, part: Hidden) -> bool {
        let before = self.open;
        self.close(part);
        let closed = self.open.0 >= self.open.1 || (self.open != before && self.close_by_last());
        self.hidden.push(part);
        closed
    }

    /// Lets the last hidden parts close the stretch, as far as they do; whether they do.
    fn close_by_last(&mut self) -> bool {
        /// More are not worth the time.
        const LAST: usize = 8;
        for k in (self.hidden.len().saturating_sub(LAST)..self.hidden.len()).rev() {
            self.close(self.hidden[k]);
        }
        self.open.0 >= self.open.1
    }

    #[inline(always)]
    fn close(&mut self, part: Hidden) {
        if part.from <= self.open.0 {
            self.open.0 = self.open.0.max(part.to);
        }
        if part.to >= self.open.1 {
            self.open.1 = self.open.1.min(part.from);
        }
    }
}

impl Tracer<'_> {
    /// Whether a triangle hides what is behind it.
    pub fn hides(&self, triangle: u32) -> bool {
        !self.sees_through || !self.shown.blends(triangle)
    }

    /// Finds the parts of the line from `p` to `q` that are inside the picture, in order, into
    /// `scratch.parts`.
    pub fn trace(&self, [p, q]: [DVec3; 2], own: &Own<impl Fn(u32) -> bool>, scratch: &mut Scratch) {
        scratch.parts.clear();
        let Some((start, end)) = clip_to(p, q, self.picture) else { return };
        scratch.stamp = scratch.stamp.wrapping_add(1);
        if scratch.stamp == 0 {
            scratch.tried.fill(0);
            scratch.stamp = 1;
        }
        scratch.hidden.clear();
        let at = |t: f64| if t == 1.0 { q } else { p + (q - p) * t };
        let (a, b) = (at(start), at(end));
        let (min, max) = rectangle([a, b]);
        let grid = &self.occluders.grid;
        let cells = grid.cells(min, max);
        let (columns, rows) = (cells.columns.1 - cells.columns.0, cells.rows.1 - cells.rows.0);
        let line = Line { p, q, start, end };
        let finished = if columns <= 1 && rows <= 1 {
            self.slab(&line, (start, end), None, own, scratch)
        } else if columns >= rows {
            self.follow(&line, 0, own, scratch)
        } else {
            self.follow(&line, 1, own, scratch)
        };
        if finished {
            return;
        }
        let length = (q - p).truncate().length();
        let shortest = if length > 0.0 { SHORTEST_PX / length } else { 1.0 };
        if self.counts {
            count(start, end, shortest, scratch);
        } else {
            visible(start, end, shortest, scratch);
        }
    }

    /// Cuts the line where it crosses columns (axis 0) or rows (axis 1); true if all of it is known to be hidden.
    fn follow(
        &self,
        line: &Line,
        axis: usize,
        own: &Own<impl Fn(u32) -> bool>,
        scratch: &mut Scratch,
    ) -> bool {
        let grid = &self.occluders.grid;
        let (from, to) = (line.p[axis], line.q[axis]);
        let index = |x: f64| if axis == 0 { grid.column(x) } else { grid.row(x) };
        let border = |i: usize| grid.origin[axis] + i as f64 * grid.size;
        let (mut cell, last) = (index(from + (to - from) * line.start), index(from + (to - from) * line.end));
        let (mut t, mut hidden) = (line.start, true);
        loop {
            let next = if cell == last {
                line.end
            } else {
                let x = border(if to > from { cell + 1 } else { cell });
                ((x - from) / (to - from)).clamp(t, line.end)
            };
            hidden &= self.slab(line, (t, next), Some((axis, cell)), own, scratch);
            let whole = |h: &Hidden| h.from <= line.start && h.to >= line.end;
            if cell == last || (hidden && scratch.hidden.last().is_some_and(whole)) {
                return hidden;
            }
            cell = if to > from { cell + 1 } else { cell - 1 };
            t = next;
        }
    }

    /// Tries the triangles of the cells that the line touches between two parameters, of one column (axis 0)
    /// or row (axis 1) if `strip` says so; true if what is between them is known to be hidden.
    fn slab(
        &self,
        line: &Line,
        (t0, t1): (f64, f64),
        strip: Option<(usize, usize)>,
        own: &Own<impl Fn(u32) -> bool>,
        scratch: &mut Scratch,
    ) -> bool {
        let at = |t: f64| line.p + (line.q - line.p) * t;
        let (a, b) = (at(t0), at(t1));
        let (min, max) = rectangle([a, b]);
        let grid = &self.occluders.grid;
        // A point at a parameter is rounded and may be counted to the next cell. What lies only there is
        // far shorter than anything that is drawn.
        let mut cells = grid.cells(min, max);
        match strip {
            Some((0, column)) => cells.columns = (column, column),
            Some((_, row)) => cells.rows = (row, row),
            None => {}
        }
        let stops = !self.counts;
        if scratch.open(t0, t1) && stops {
            return true;
        }
        if let Some(cover) = self.cover
            && cover.hides(cells, a.z.max(b.z))
        {
            return scratch.hide(Hidden { from: t0, to: t1 });
        }
        if own.anchored
            && let Some(cover) = self.cover
            && cover.shows(cells, a.z.max(b.z))
        {
            return false;
        }
        let (shown, least) = (self.shown, a.z.min(b.z));
        let reach = Bounds::around(min, max).reach();
        for row in cells.rows.0..=cells.rows.1 {
            for column in cells.columns.0..=cells.columns.1 {
                for &i in self.occluders.in_cell(grid.index(column, row)) {
                    let occluder = &self.occluders.list[i as usize];
                    if f64::from(occluder.nearest) < least {
                        break;
                    }
                    if !occluder.bounds().meets(reach)
                        || own.sheets.contains(&occluder.sheet)
                        || scratch.tried[i as usize] == scratch.stamp
                    {
                        continue;
                    }
                    scratch.tried[i as usize] = scratch.stamp;
                    if (own.owns)(occluder.triangle) {
                        continue;
                    }
                    scratch.tests += 1;
                    let Some(hidden) = hidden_part(shown, line.p, line.q, occluder.triangle, self.piercing)
                    else {
                        continue;
                    };
                    if scratch.hide(hidden) && stops {
                        return true;
                    }
                }
            }
        }
        false
    }
}

/// What a line is part of.
pub(super) struct Own<F: Fn(u32) -> bool> {
    /// The triangles that the line is part of: they cannot hide it.
    pub owns: F,
    /// Whether one of them is among the occluders.
    pub anchored: bool,
    /// The sheets that it is part of ([`Shown::sheet`]), which cannot hide it either.
    pub sheets: [u32; 2],
}

/// No sheet, and not that of any triangle.
pub(super) const NO_SHEET: u32 = NONE - 1;

/// A line and the part of it inside the picture.
struct Line {
    p: DVec3,
    q: DVec3,
    start: f64,
    end: f64,
}

/// What no hidden part covers.
fn visible(start: f64, end: f64, shortest: f64, scratch: &mut Scratch) {
    scratch.hidden.sort_unstable_by(|a, b| a.from.total_cmp(&b.from));
    let mut at = start;
    for h in &scratch.hidden {
        if h.from - at > shortest {
            scratch.parts.push(Part { from: at, to: h.from.min(end), covers: 0 });
        }
        at = at.max(h.to);
        if at >= end {
            return;
        }
    }
    if end - at > shortest || at == start {
        scratch.parts.push(Part { from: at, to: end, covers: 0 });
    }
}

/// Everything, with the number of triangles that cover it.
fn count(start: f64, end: f64, shortest: f64, scratch: &mut Scratch) {
    scratch.events.clear();
    for h in &scratch.hidden {
        scratch.events.push((h.from.max(start), 1));
        scratch.events.push((h.to.min(end), -1));
    }
    scratch.events.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (mut at, mut covers) = (start, 0i32);
    let mut i = 0;
    while at < end {
        // Ends and beginnings that differ by rounding are one event.
        while i < scratch.events.len() && scratch.events[i].0 - at <= shortest {
            covers += scratch.events[i].1;
            i += 1;
        }
        let next = scratch.events.get(i).map_or(end, |e| e.0.min(end));
        let part = Part { from: at, to: next, covers: covers.max(0) as u32 };
        match scratch.parts.last_mut() {
            Some(last) if last.covers == part.covers => last.to = next,
            _ => scratch.parts.push(part),
        }
        at = next;
    }
}

/// The parameters at which a line enters and leaves the picture.
fn clip_to(p: DVec3, q: DVec3, picture: DVec2) -> Option<(f64, f64)> {
    let (mut start, mut end) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let (from, step) = (p[axis], q[axis] - p[axis]);
        if step == 0.0 {
            if from < 0.0 || from > picture[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((0.0 - from) / step, (picture[axis] - from) / step);
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    (start < end).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(hidden: &[(f64, f64)]) -> Scratch {
        Scratch {
            tried: Vec::new(),
            stamp: 0,
            hidden: hidden.iter().map(|&(from, to)| Hidden { from, to }).collect(),
            open: (0.0, 1.0),
            events: Vec::new(),
            parts: Vec::new(),
            tests: 0,
        }
    }

    #[test]
    fn what_is_left_between_hidden_parts_is_seen() {
        let mut s = scratch(&[(0.5, 0.7), (0.1, 0.3), (0.3 + 1e-12, 0.4)]);
        visible(0.0, 1.0, 1e-9, &mut s);
        let found: Vec<(f64, f64)> = s.parts.iter().map(|p| (p.from, p.to)).collect();
        assert_eq!(found, [(0.0, 0.1), (0.4, 0.5), (0.7, 1.0)]);
        let mut s = scratch(&[(0.0, 0.5), (0.5, 1.0)]);
        visible(0.0, 1.0, 1e-9, &mut s);
        assert!(s.parts.is_empty());
    }

    #[test]
    fn what_is_known_to_be_hidden_shows_nowhere() {
        use crate::reference::trouble::Random;
        let mut random = Random::new(5);
        let mut known = 0;
        for _ in 0..2000 {
            let mut s = scratch(&[]);
            let mut closed = s.open(0.2, 0.8);
            for _ in 0..12 {
                let (a, b) = (f64::from(random.below(11)) * 0.1, f64::from(random.below(11)) * 0.1);
                closed |= s.hide(Hidden { from: a.min(b), to: a.max(b) });
                s.parts.clear();
                visible(0.2, 0.8, 0.0, &mut s);
                assert!(!closed || s.parts.is_empty());
            }
            known += u32::from(closed);
        }
        assert!(known > 1000, "{known}");
    }

    #[test]
    fn covers_are_counted() {
        let mut s = scratch(&[(0.0, 0.6), (0.4, 0.8), (0.8 + 1e-12, 1.0)]);
        count(0.0, 1.0, 1e-9, &mut s);
        let found: Vec<(f64, u32)> = s.parts.iter().map(|p| (p.to, p.covers)).collect();
        assert_eq!(found, [(0.4, 1), (0.6, 2), (1.0, 1)]);
    }

    #[test]
    fn lines_are_cut_at_the_picture() {
        let size = DVec2::new(10.0, 10.0);
        let clip = |a: [f64; 2], b: [f64; 2]| {
            clip_to(DVec3::new(a[0], a[1], 0.0), DVec3::new(b[0], b[1], 0.0), size)
        };
        assert_eq!(clip([-5.0, 5.0], [15.0, 5.0]), Some((0.25, 0.75)));
        assert_eq!(clip([-5.0, -1.0], [15.0, -1.0]), None);
        assert_eq!(clip([3.0, 3.0], [3.0, 30.0]), Some((0.0, 7.0 / 27.0)));
    }
}
