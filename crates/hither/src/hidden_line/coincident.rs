//! Lines that lie on one another are drawn once.
//!
//! Where several pieces coincide, the most important stays: visible before hidden, then by kind, then the
//! smaller part. Pieces are compared with those in the same cells of a grid; of each piece what more
//! important ones cover is taken away. What covers it is itself drawn, or covered by something more
//! important still, so nothing is lost.

use super::draw::Piece;
use super::grid::Grid;
use glam::DVec2;

/// Lines nearer than this, pixels, along the whole of their overlap are one line.
const SAME_PX: f64 = 1e-3;
/// Overlaps and remainders that are shorter, pixels, do not count.
const SHORTEST_PX: f64 = 1e-6;

/// Takes away what is drawn already.
pub(super) fn draw_once(pieces: &mut Vec<Piece>) {
    if pieces.len() < 2 {
        return;
    }
    let mut cells = Cells::new(pieces);
    if cells.is_crowded() {
        drop_twins(pieces);
        cells = Cells::new(pieces);
    }
    let lines: Vec<Line> = pieces.iter().map(Line::of).collect();
    let mut covered = overlaps(&cells, pieces, &lines);
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
fn overlaps(cells: &Cells, pieces: &[Piece], lines: &[Line]) -> Vec<(u32, f64, f64)> {
    let mut found = Vec::new();
    let mut here: Vec<(u32, Line)> = Vec::new();
    for cell in 0..cells.grid.len() {
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

/// Of pieces with the same ends only the most important stays: so many on one another would be compared each
/// with each.
fn drop_twins(pieces: &mut Vec<Piece>) {
    let key = |p: &Piece| {
        let ends = p.ends.map(|e| (e + 0.0).to_array().map(f64::to_bits));
        [ends[0].min(ends[1]), ends[0].max(ends[1])]
    };
    pieces.sort_by_cached_key(|p| (key(p), p.covers, p.kind, p.part));
    pieces.dedup_by(|later, first| key(later) == key(first));
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

/// Pieces by cell.
struct Cells {
    grid: Grid,
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Cells {
    fn new(pieces: &[Piece]) -> Cells {
        let ends = || pieces.iter().flat_map(|p| p.ends);
        let min = ends().fold(DVec2::INFINITY, DVec2::min);
        let max = ends().fold(DVec2::NEG_INFINITY, DVec2::max);
        let grid = Grid::over(min, max, ((pieces.len() as f64).sqrt() * 0.7) as usize + 4);
        let mut cells = Cells { grid, starts: vec![0; grid.len() + 1], entries: Vec::new() };
        for p in pieces {
            walk(&grid, p, |cell| cells.starts[cell + 1] += 1);
        }
        for i in 1..cells.starts.len() {
            cells.starts[i] += cells.starts[i - 1];
        }
        cells.entries = vec![0; cells.starts[grid.len()] as usize];
        let mut next = cells.starts.clone();
        for (i, p) in pieces.iter().enumerate() {
            walk(&grid, p, |cell| {
                cells.entries[next[cell] as usize] = i as u32;
                next[cell] += 1;
            });
        }
        cells
    }

    /// Whether some cell has so many pieces that twins must be suspected.
    fn is_crowded(&self) -> bool {
        self.starts.windows(2).any(|w| w[1] - w[0] > 128)
    }

    fn in_cell(&self, cell: usize) -> &[u32] {
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// The cells that a piece comes near to, column by column.
fn walk(grid: &Grid, piece: &Piece, mut visit: impl FnMut(usize)) {
    let [a, b] = if piece.ends[0].x <= piece.ends[1].x { piece.ends } else { [piece.ends[1], piece.ends[0]] };
    let near = 2.0 * SAME_PX;
    let (first, last) = (grid.column(a.x - near), grid.column(b.x + near));
    for column in first..=last {
        let left = (grid.origin.x + column as f64 * grid.size - near).max(a.x);
        let right = (grid.origin.x + (column + 1) as f64 * grid.size + near).min(b.x);
        let y = |x: f64| {
            if b.x > a.x { a.y + (b.y - a.y) * ((x - a.x) / (b.x - a.x)).clamp(0.0, 1.0) } else { a.y }
        };
        let (y0, y1) = if b.x - a.x > near { (y(left), y(right)) } else { (a.y, b.y) };
        for row in grid.row(y0.min(y1) - near)..=grid.row(y0.max(y1) + near) {
            visit(grid.index(column, row));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        draw_once(&mut pieces);
        assert!((length(&pieces) - 30.0).abs() < 1e-6, "{pieces:?}");
        let visible: Vec<Piece> = pieces.iter().copied().filter(|p| p.covers == 0).collect();
        assert!((length(&visible) - 26.0).abs() < 1e-6);
    }

    #[test]
    fn a_million_twins_become_one() {
        let mut pieces = vec![piece(3, [1.0, 1.0], [9.0, 5.0], Kind::Crease, 0); 1000];
        draw_once(&mut pieces);
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
        draw_once(&mut pieces);
        assert_eq!(pieces, before);
    }
}
