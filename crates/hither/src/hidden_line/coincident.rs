//! Lines that lie on one another are drawn once.
//!
//! Where several pieces coincide, the most important stays: visible before hidden, then by kind, then the
//! smaller part. Pieces are compared with those in the same cells of a grid; of each piece what more
//! important ones cover is taken away. What covers it is itself drawn, or covered by something more
//! important still, so nothing is lost.

use super::crew::Crew;
use super::draw::Piece;
use super::grid::{Grid, Places, Sorted};
use glam::DVec2;
use std::ops::Range;

/// Lines nearer than this, pixels, along the whole of their overlap are one line.
const SAME_PX: f64 = 1e-3;
/// Pieces are sorted into the cells that come so near to them, pixels.
const NEAR_PX: f64 = 2.0 * SAME_PX;
/// Overlaps and remainders that are shorter, pixels, do not count.
const SHORTEST_PX: f64 = 1e-6;

/// The longest side of the grid, cells.
const MOST_CELLS: usize = 4096;
/// Where a cell has more pieces than this, twins must be suspected.
const CROWD: u32 = 128;

/// Takes away what is drawn already.
pub(super) fn draw_once(crew: Crew, pieces: &mut Vec<Piece>) {
    if pieces.len() < 2 {
        return;
    }
    let sort = |laid: &Laid| Sorted::on(crew, &laid.grid, laid);
    let mut cells = sort(&Laid::new(crew, pieces));
    if cells.most() > CROWD && drop_twins(pieces, &cells) {
        cells = sort(&Laid::new(crew, pieces));
    }
    let mut lines = Vec::new();
    crew.extend(&mut lines, pieces.len(), |i| Line::of(&pieces[i]));
    let shares = crew.shares(cells.len(), 16);
    let mut covered = crew.map(shares, |range| overlaps(&cells, range, pieces, &lines)).concat();
    if covered.is_empty() {
        return;
    }
    covered.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut rest = Vec::new();
    for of_piece in covered.chunk_by(|a, b| a.0 == b.0) {
        let i = of_piece[0].0 as usize;
        let (line, piece) = (lines[i], pieces[i]);
        let (mut at, mut first) = (0.0, true);
        for &(_, from, to) in of_piece.iter().chain([&(0, line.length, line.length)]) {
            if from - at > SHORTEST_PX {
                let ends = [line.at(at, &piece), line.at(from, &piece)];
                rest.push((i, first, Piece { ends, ..piece }));
                first = false;
            }
            at = at.max(to);
        }
        if first {
            // All of it is covered.
            rest.push((i, true, Piece { ends: [piece.ends[0]; 2], ..piece }));
        }
    }
    for (i, first, piece) in rest {
        if first {
            pieces[i] = piece;
        } else {
            pieces.push(piece);
        }
    }
    pieces.retain(|p| p.ends[0] != p.ends[1]);
}

/// Pieces that a more important one lies on, and between which distances; some several times.
fn overlaps(cells: &Sorted, range: Range<usize>, pieces: &[Piece], lines: &[Line]) -> Vec<(u32, f64, f64)> {
    let mut found = Vec::new();
    let mut here: Vec<(u32, Line)> = Vec::new();
    for cell in range {
        here.clear();
        here.extend(cells.in_cell(cell).iter().map(|&i| (i, lines[i as usize])));
        for (k, (i, a)) in here.iter().enumerate() {
            for (j, b) in &here[k + 1..] {
                if !a.is_aligned(b) {
                    continue;
                }
                let first_stays = outranks(pieces, *i as usize, *j as usize);
                let (under, low, over) = if first_stays { (b, j, a) } else { (a, i, b) };
                if let Some((from, to)) = under.overlap(over) {
                    found.push((*low, from, to));
                }
            }
        }
    }
    found
}

/// Of pieces with the same ends in crowded cells only the most important stays: so many on one another would be
/// compared each with each. Whether there were any.
fn drop_twins(pieces: &mut Vec<Piece>, cells: &Sorted) -> bool {
    let key = |i: &u32| {
        let p = &pieces[*i as usize];
        let ends = p.ends.map(|e| (e + 0.0).to_array().map(f64::to_bits));
        [ends[0].min(ends[1]), ends[0].max(ends[1])]
    };
    let crowds = (0..cells.len()).map(|cell| cells.in_cell(cell)).filter(|list| list.len() > CROWD as usize);
    let mut suspects: Vec<u32> = crowds.flatten().copied().collect();
    suspects.sort_unstable();
    suspects.dedup();
    suspects.sort_by_cached_key(|i| {
        let p = &pieces[*i as usize];
        (key(i), p.covers, p.kind, p.part)
    });
    let mut is_twin = vec![false; pieces.len()];
    for same in suspects.chunk_by(|a, b| key(a) == key(b)) {
        same[1..].iter().for_each(|&i| is_twin[i as usize] = true);
    }
    let before = pieces.len();
    let mut twin = is_twin.into_iter();
    pieces.retain(|_| twin.next() != Some(true));
    pieces.len() < before
}

/// Whether piece `a` is kept where it coincides with piece `b`.
fn outranks(pieces: &[Piece], a: usize, b: usize) -> bool {
    let rank = |i: usize| (pieces[i].covers, pieces[i].kind, pieces[i].part, i);
    rank(a) < rank(b)
}

/// A piece as a ray with a length.
#[derive(Clone, Copy)]
struct Line {
    from: DVec2,
    direction: DVec2,
    length: f64,
}

impl Line {
    fn of(piece: &Piece) -> Line {
        let step = piece.ends[1] - piece.ends[0];
        let length = step.length();
        let direction = if length > 0.0 { step / length } else { DVec2::ZERO };
        Line { from: piece.ends[0], direction, length }
    }

    /// The point at a distance; the ends of the piece in every bit.
    fn at(&self, distance: f64, piece: &Piece) -> DVec2 {
        if distance <= 0.0 {
            piece.ends[0]
        } else if distance >= self.length {
            piece.ends[1]
        } else {
            self.from + self.direction * distance
        }
    }

    /// Whether the lines are so nearly parallel that they may be one where they overlap.
    #[inline(always)]
    fn is_aligned(&self, other: &Line) -> bool {
        let turn = self.direction.perp_dot(other.direction);
        turn.abs() * self.length.min(other.length) <= 2.0 * SAME_PX
    }

    /// The distances between which `other`, which is aligned, lies on this line.
    fn overlap(&self, other: &Line) -> Option<(f64, f64)> {
        let turn = self.direction.perp_dot(other.direction);
        let start = other.from - self.from;
        let along = self.direction.dot(other.direction);
        let (t0, step) = (self.direction.dot(start), along * other.length);
        let (low, high) = (t0.min(t0 + step).max(0.0), t0.max(t0 + step).min(self.length));
        if high - low <= SHORTEST_PX {
            return None;
        }
        let aside = self.direction.perp_dot(start);
        let offset = |t: f64| aside + (t - t0) * turn / along;
        (offset(low).abs() <= SAME_PX && offset(high).abs() <= SAME_PX).then_some((low, high))
    }
}

/// Pieces on a grid.
struct Laid<'a> {
    grid: Grid,
    pieces: &'a [Piece],
    /// The first and the last row of each piece.
    rows: Vec<[u16; 2]>,
}

impl Laid<'_> {
    fn new(crew: Crew, pieces: &[Piece]) -> Laid<'_> {
        let ends = || pieces.iter().flat_map(|p| p.ends);
        let min = ends().fold(DVec2::INFINITY, DVec2::min);
        let max = ends().fold(DVec2::NEG_INFINITY, DVec2::max);
        let grid = Grid::over(min, max, (((pieces.len() as f64).sqrt() * 0.7) as usize + 4).min(MOST_CELLS));
        let mut rows = Vec::new();
        crew.extend(&mut rows, pieces.len(), |i| {
            let [a, b] = pieces[i].ends;
            [a.y.min(b.y) - NEAR_PX, a.y.max(b.y) + NEAR_PX].map(|y| grid.row(y) as u16)
        });
        Laid { grid, pieces, rows }
    }
}

impl Places for Laid<'_> {
    /// The cells that a piece comes near to, column by column.
    #[inline(always)]
    fn visit(&self, rows: &Range<usize>, mut visit: impl FnMut(usize, usize)) {
        let (grid, start) = (&self.grid, self.grid.index(0, rows.start));
        for (i, of) in self.rows.iter().enumerate() {
            let [top, bottom] = of.map(usize::from);
            if top >= rows.end || bottom < rows.start {
                continue;
            }
            let piece = &self.pieces[i];
            let [a, b] =
                if piece.ends[0].x <= piece.ends[1].x { piece.ends } else { [piece.ends[1], piece.ends[0]] };
            let (first, last) = (grid.column(a.x - NEAR_PX), grid.column(b.x + NEAR_PX));
            let mut visit_column = |column: usize, top: usize, bottom: usize| {
                for row in top.max(rows.start)..=bottom.min(rows.end - 1) {
                    visit(grid.index(column, row) - start, i);
                }
            };
            if first == last || top == bottom {
                (first..=last).for_each(|column| visit_column(column, top, bottom));
                continue;
            }
            let slope = if b.x - a.x > NEAR_PX { (b.y - a.y) / (b.x - a.x) } else { 0.0 };
            for column in first..=last {
                let left = (grid.origin.x + column as f64 * grid.size - NEAR_PX).max(a.x);
                let right = (grid.origin.x + (column + 1) as f64 * grid.size + NEAR_PX).min(b.x);
                let y = |x: f64| a.y + slope * (x - a.x).clamp(0.0, b.x - a.x);
                let (y0, y1) = if b.x - a.x > NEAR_PX { (y(left), y(right)) } else { (a.y, b.y) };
                visit_column(column, grid.row(y0.min(y1) - NEAR_PX), grid.row(y0.max(y1) + NEAR_PX));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Crew = Crew { threads: 1 };
    use crate::hidden_line::Kind;

    fn piece(part: u32, a: [f64; 2], b: [f64; 2], kind: Kind, covers: u32) -> Piece {
        Piece { ends: [a.into(), b.into()], part, kind, covers }
    }

    fn length(pieces: &[Piece]) -> f64 {
        pieces.iter().map(|p| p.ends[0].distance(p.ends[1])).sum()
    }

    #[test]
    fn overlapping_lines_are_drawn_once_and_the_better_one_stays() {
        let mut pieces = vec![
            piece(0, [0.0, 0.0], [10.0, 0.0], Kind::Crease, 1),
            piece(1, [8.0, 1e-5], [2.0, 0.0], Kind::Crease, 0),
            piece(1, [0.0, 0.0], [0.0, 10.0], Kind::Crease, 0),
            piece(0, [0.0, 5.0], [0.0, 20.0], Kind::Silhouette, 0),
        ];
        draw_once(ONE, &mut pieces);
        assert!((length(&pieces) - 30.0).abs() < 1e-6, "{pieces:?}");
        let visible: Vec<Piece> = pieces.iter().copied().filter(|p| p.covers == 0).collect();
        assert!((length(&visible) - 26.0).abs() < 1e-6);
    }

    #[test]
    fn a_million_twins_become_one() {
        let mut pieces = vec![piece(3, [1.0, 1.0], [9.0, 5.0], Kind::Crease, 0); 1000];
        draw_once(ONE, &mut pieces);
        assert_eq!(pieces.len(), 1);
    }

    #[test]
    fn lines_that_cross_or_only_touch_stay() {
        let mut pieces = vec![
            piece(0, [0.0, 0.0], [10.0, 10.0], Kind::Crease, 0),
            piece(0, [0.0, 10.0], [10.0, 0.0], Kind::Crease, 0),
            piece(0, [10.0, 10.0], [20.0, 20.0], Kind::Crease, 0),
            piece(0, [0.0, 0.01], [10.0, 10.01], Kind::Crease, 0),
        ];
        let before = pieces.clone();
        draw_once(ONE, &mut pieces);
        assert_eq!(pieces, before);
    }
}
