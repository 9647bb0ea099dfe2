//! The triangles that may hide something, by cell of the grid, nearest first.

use super::cover::Cover;
use super::grid::{Grid, rectangle};
use super::shown::{Fate, Shown};
use glam::{DVec2, DVec3};

/// Triangles by cell.
pub(super) struct Occluders {
    pub grid: Grid,
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// The triangles, nearest first.
    pub list: Vec<Occluder>,
}

/// What the quick tests need of a triangle: its box, rounded outwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Occluder {
    min: [f32; 2],
    max: [f32; 2],
    /// w of its nearest and of its farthest corner.
    pub nearest: f64,
    pub farthest: f64,
    pub triangle: u32,
    /// Whether it is large enough to be left out of cells that only its box touches.
    pub large: bool,
}

impl Occluder {
    /// Whether its box meets the rectangle, rounded outwards like itself.
    #[inline(always)]
    pub fn meets(&self, rectangle: &[f32; 4]) -> bool {
        // Without short cuts: four comparisons that rarely agree are cheaper than four guesses.
        (self.max[0] >= rectangle[0])
            & (self.max[1] >= rectangle[1])
            & (self.min[0] <= rectangle[2])
            & (self.min[1] <= rectangle[3])
    }

    pub fn rectangle(&self) -> [f32; 4] {
        [self.min[0], self.min[1], self.max[0], self.max[1]]
    }
}

/// A rectangle in f32 that holds the one given.
#[inline]
pub(super) fn outwards(min: DVec2, max: DVec2) -> [f32; 4] {
    let down = |x: f64| (x as f32).next_down();
    let up = |x: f64| (x as f32).next_up();
    [down(min.x), down(min.y), up(max.x), up(max.y)]
}

impl Occluders {
    /// Sorts the live triangles of `shown` that `hides` says yes to.
    /// Large ones are left out of cells where `cover` hides them.
    pub fn new(shown: &Shown, grid: Grid, cover: Option<&Cover>, hides: impl Fn(u32) -> bool) -> Occluders {
        let live =
            (0..shown.triangles.len() as u32).filter(|&t| shown.fate[t as usize] == Fate::Live && hides(t));
        let mut list: Vec<Occluder> = live.map(|t| occluder(shown.corners(t), t, &grid)).collect();
        list.sort_unstable_by(|a, b| b.nearest.total_cmp(&a.nearest).then(a.triangle.cmp(&b.triangle)));
        let mut starts = vec![0u32; grid.len() + 1];
        let hidden = |o: &Occluder, cell: usize| o.large && cover.is_some_and(|c| c.bound(cell) > o.nearest);
        for o in &list {
            visit_cells(shown, &grid, o, |cell| starts[cell + 1] += u32::from(!hidden(o, cell)));
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut entries = vec![0u32; starts[grid.len()] as usize];
        let mut next = starts.clone();
        for (i, o) in list.iter().enumerate() {
            visit_cells(shown, &grid, o, |cell| {
                if hidden(o, cell) {
                    return;
                }
                entries[next[cell] as usize] = i as u32;
                next[cell] += 1;
            });
        }
        Occluders { grid, starts, entries, list }
    }

    /// Indices into [`Occluders::list`] of a cell's triangles, nearest first.
    #[inline]
    pub fn in_cell(&self, cell: usize) -> &[u32] {
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// Calls `visit` for every cell that a triangle may touch. Errs towards yes.
#[inline]
fn visit_cells(shown: &Shown, grid: &Grid, o: &Occluder, mut visit: impl FnMut(usize)) {
    let min = DVec2::new(f64::from(o.min[0]), f64::from(o.min[1]));
    let max = DVec2::new(f64::from(o.max[0]), f64::from(o.max[1]));
    let cells = grid.cells(min, max);
    let corners = shown.corners(o.triangle);
    for row in cells.rows.0..=cells.rows.1 {
        let (first, last) = if o.large { columns_in_row(&corners, grid, row) } else { cells.columns };
        for column in first..=last {
            visit(grid.index(column, row));
        }
    }
}

/// The columns that a triangle touches in a row. The first and the last row stand for all beyond them.
#[inline]
fn columns_in_row(corners: &[DVec3; 3], grid: &Grid, row: usize) -> (usize, usize) {
    let hair = grid.size * 1e-3;
    let top = if row == 0 { f64::NEG_INFINITY } else { grid.origin.y + row as f64 * grid.size - hair };
    let below = if row + 1 == grid.rows {
        f64::INFINITY
    } else {
        grid.origin.y + (row + 1) as f64 * grid.size + hair
    };
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut previous = corners[2];
    for &corner in corners {
        let (low, high) = if previous.y <= corner.y { (previous, corner) } else { (corner, previous) };
        previous = corner;
        if high.y < top || low.y > below {
            continue;
        }
        let slope = if high.y > low.y { (high.x - low.x) / (high.y - low.y) } else { 0.0 };
        let at = |y: f64| low.x + (y - low.y) * slope;
        let from = if low.y < top { at(top) } else { low.x };
        let to = if high.y > below { at(below) } else { high.x };
        left = left.min(from.min(to));
        right = right.max(from.max(to));
        if high.y == low.y {
            left = left.min(high.x);
            right = right.max(high.x);
        }
    }
    (grid.column(left - hair), grid.column(right + hair))
}

fn occluder(corners: [DVec3; 3], triangle: u32, grid: &Grid) -> Occluder {
    let (min, max) = rectangle(corners);
    let r = outwards(min, max);
    let w = corners.map(|c| c.z);
    let cells = grid.cells(min, max);
    let large = cells.columns.1 - cells.columns.0 > 1 && cells.rows.1 - cells.rows.0 > 1;
    Occluder {
        min: [r[0], r[1]],
        max: [r[2], r[3]],
        nearest: w[0].max(w[1]).max(w[2]),
        farthest: w[0].min(w[1]).min(w[2]),
        triangle,
        large,
    }
}
