//! Lines that lie on one another are drawn once.
//!
//! Where several pieces coincide, the most important stays: visible before hidden, then by kind, then the
//! smaller part. Pieces are compared with those in the same cells of a grid; of each piece what more
//! important ones cover is taken away. What covers it is itself drawn, or covered by something more
//! important still, so nothing is lost.

use super::Kind;
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
/// The shortest side of a cell, pixels: of smaller ones a piece would be in several for nothing.
const LEAST_CELL_PX: f64 = 4.0 * NEAR_PX;
/// Where a cell has more pieces than this, most are likely to lie on one another.
const CROWD: usize = 128;

/// Takes away what is drawn already.
pub(super) fn draw_once(crew: Crew, pieces: &mut Vec<Piece>) {
    if pieces.len() < 2 {
        return;
    }
    let laid = Laid::new(crew, pieces);
    let cells = Sorted::on(crew, &laid.grid, &laid);
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
        if here.len() > CROWD {
            overlaps_in_crowd(&mut here, pieces, &mut found);
            continue;
        }
        for (k, (i, a)) in here.iter().enumerate() {
            for (j, b) in &here[k + 1..] {
                if !a.is_aligned(b) {
                    continue;
                }
                let first_stays = rank(pieces, *i) < rank(pieces, *j);
                let (under, low, over) = if first_stays { (b, j, a) } else { (a, i, b) };
                if let Some((from, to)) = under.overlap(over) {
                    found.push((*low, from, to));
                }
            }
        }
    }
    found
}

/// The same for a cell of very many pieces: they come by rank, and what others cover wholly is compared with
/// nothing more. A scene as small as a pixel has all of its pieces in a few cells.
fn overlaps_in_crowd(here: &mut [(u32, Line)], pieces: &[Piece], found: &mut Vec<(u32, f64, f64)>) {
    here.sort_unstable_by_key(|&(i, _)| rank(pieces, i));
    let mut drawn: Vec<Line> = Vec::new();
    for &mut (i, line) in here {
        let before = found.len();
        for over in drawn.iter().filter(|over| line.is_aligned(over)) {
            if let Some((from, to)) = line.overlap(over) {
                found.push((i, from, to));
                if to - from >= line.length - SHORTEST_PX {
                    break;
                }
            }
        }
        let covers = &mut found[before..];
        covers.sort_unstable_by(|a, b| a.1.total_cmp(&b.1));
        let at = covers.iter().fold(0.0f64, |at, o| if o.1 - at <= SHORTEST_PX { at.max(o.2) } else { at });
        if line.length - at > SHORTEST_PX {
            drawn.push(line);
        }
    }
}

/// Of pieces that coincide the one with the least of these is kept.
fn rank(pieces: &[Piece], i: u32) -> (u32, Kind, u32, u32) {
    let piece = &pieces[i as usize];
    (piece.covers, piece.kind, piece.part, i)
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
        let side = (((pieces.len() as f64).sqrt() * 0.7) as usize + 4).min(MOST_CELLS);
        let most = ((max - min).max_element() / LEAST_CELL_PX) as usize;
        let grid = Grid::over(min, max, side.min(most).max(1));
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

    use crate::reference::trouble::Random;

    const ONE: Crew = Crew { threads: 1 };

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

    /// Pieces at random on five lines through a point, and how long the visible ones and all together should be.
    fn on_five_lines(count: usize, size: f64) -> (Vec<Piece>, [f64; 2]) {
        let mut random = Random::new(7);
        let rays = [0.0f64, 0.5, 1.0, 1.7, 2.4].map(|angle| DVec2::from_angle(angle) * size);
        let (mut pieces, mut stretches) = (Vec::new(), [Vec::new(), Vec::new()]);
        for i in 0..count {
            let (ray, covers) = (i % 5, random.below(2));
            let from = 0.1 + 0.7 * random.unit();
            let ends = [from, from + 0.02 * random.unit()];
            let [a, b] = ends.map(|t| (rays[ray] * t).to_array());
            pieces.push(piece(random.below(9), a, b, Kind::Crease, covers));
            (covers as usize..2).for_each(|k| stretches[k].push(ends.map(|t| ray as f64 + t)));
        }
        let union = |mut stretches: Vec<[f64; 2]>| -> f64 {
            stretches.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
            let (mut sum, mut end) = (0.0, 0.0f64);
            for [from, to] in stretches {
                sum += (to - from.max(end)).max(0.0);
                end = end.max(to);
            }
            sum * size
        };
        (pieces, stretches.map(union))
    }

    #[test]
    fn pieces_that_overlap_are_drawn_once_also_in_a_crowd() {
        for (count, size) in [(3_000, 1000.0), (30_000, 0.2)] {
            let (mut pieces, [of_visible, of_all]) = on_five_lines(count, size);
            draw_once(ONE, &mut pieces);
            let visible: Vec<Piece> = pieces.iter().copied().filter(|p| p.covers == 0).collect();
            let tolerance = count as f64 * SHORTEST_PX;
            assert!((length(&visible) - of_visible).abs() < tolerance, "{} {of_visible}", length(&visible));
            assert!((length(&pieces) - of_all).abs() < tolerance, "{} {of_all}", length(&pieces));
        }
    }

    #[test]
    fn of_a_drawing_that_is_one_speck_little_is_drawn() {
        let (mut pieces, _) = on_five_lines(100_000, 1e-3);
        draw_once(ONE, &mut pieces);
        assert!(!pieces.is_empty() && pieces.len() < 10_000, "{}", pieces.len());
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
