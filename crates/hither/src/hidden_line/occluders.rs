//! The triangles that may hide something, by cell of the grid, nearest first.

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
    pub fn new(shown: &Shown, grid: Grid, hides: impl Fn(u32) -> bool) -> Occluders {
        let live =
            (0..shown.triangles.len() as u32).filter(|&t| shown.fate[t as usize] == Fate::Live && hides(t));
        let mut list: Vec<Occluder> = live.map(|t| occluder(shown.corners(t), t, &grid)).collect();
        list.sort_unstable_by(|a, b| b.nearest.total_cmp(&a.nearest).then(a.triangle.cmp(&b.triangle)));
        let mut starts = vec![0u32; grid.len() + 1];
        for o in &list {
            visit_cells(shown, &grid, o, |cell| starts[cell + 1] += 1);
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut entries = vec![0u32; starts[grid.len()] as usize];
        let mut next = starts.clone();
        for (i, o) in list.iter().enumerate() {
            visit_cells(shown, &grid, o, |cell| {
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

/// Calls `visit` for every cell that a triangle may touch.
#[inline]
fn visit_cells(shown: &Shown, grid: &Grid, o: &Occluder, mut visit: impl FnMut(usize)) {
    let min = DVec2::new(f64::from(o.min[0]), f64::from(o.min[1]));
    let max = DVec2::new(f64::from(o.max[0]), f64::from(o.max[1]));
    let cells = grid.cells(min, max);
    let corners = shown.corners(o.triangle);
    for row in cells.rows.0..=cells.rows.1 {
        for column in cells.columns.0..=cells.columns.1 {
            if !o.large || may_touch(&corners, grid, column, row) {
                visit(grid.index(column, row));
            }
        }
    }
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

/// Whether a large triangle may touch a cell: no side of it has the whole cell beyond it. Errs towards yes.
pub(super) fn may_touch(corners: &[DVec3; 3], grid: &Grid, column: usize, row: usize) -> bool {
    let center = grid.center(column, row);
    // The first and the last cells stand for all that is outside the grid.
    if column == 0 || row == 0 || column + 1 == grid.columns || row + 1 == grid.rows {
        return true;
    }
    let reach = grid.size * 0.501;
    let p = corners.map(|c| c.truncate() - center);
    let turn = (p[1] - p[0]).perp_dot(p[2] - p[0]).signum();
    (0..3).all(|k| {
        let d = p[(k + 1) % 3] - p[k];
        let offset = turn * d.perp_dot(-p[k]);
        let slack = 1e-12 * d.abs().max_element() * p[k].abs().max_element();
        offset >= -reach * (d.x.abs() + d.y.abs()) - slack
    })
}
