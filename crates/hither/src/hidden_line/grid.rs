//! A grid of square cells over the part of the paper that is drawn on.

use super::crew::Crew;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Cells of `size` pixels from `origin` on, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub origin: DVec2,
    pub size: f64,
    per_pixel: f64,
    pub columns: usize,
    pub rows: usize,
}

/// An inclusive range of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    pub columns: (usize, usize),
    pub rows: (usize, usize),
}

impl Grid {
    /// A grid over the rectangle with about `side` cells along its longer side.
    pub fn over(min: DVec2, max: DVec2, side: usize) -> Grid {
        let extent = (max - min).max_element().max(1e-9);
        let size = extent / side as f64;
        let count = |length: f64| ((length / size).ceil() as usize).clamp(1, side + 1);
        Grid {
            origin: min,
            size,
            per_pixel: 1.0 / size,
            columns: count(max.x - min.x),
            rows: count(max.y - min.y),
        }
    }

    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Column of a coordinate; what is outside counts to the first or last column.
    #[inline]
    pub fn column(&self, x: f64) -> usize {
        // A cast of a float saturates: what is left of the grid is in column 0.
        (((x - self.origin.x) * self.per_pixel) as usize).min(self.columns - 1)
    }

    #[inline]
    pub fn row(&self, y: f64) -> usize {
        (((y - self.origin.y) * self.per_pixel) as usize).min(self.rows - 1)
    }

    /// The cells of a rectangle, at least one.
    #[inline]
    pub fn cells(&self, min: DVec2, max: DVec2) -> Cells {
        Cells { columns: (self.column(min.x), self.column(max.x)), rows: (self.row(min.y), self.row(max.y)) }
    }

    /// The columns and rows whose centres are in a rectangle, but for rounding at its border; empty ranges
    /// where there are none.
    pub fn centers(&self, min: DVec2, max: DVec2) -> [Range<usize>; 2] {
        // The number of centres before a coordinate; a cast of a float saturates.
        let before = |x: f64, count: usize| ((x * self.per_pixel + 0.5) as usize).min(count);
        let (min, max) = (min - self.origin, max - self.origin);
        [
            before(min.x, self.columns)..before(max.x, self.columns),
            before(min.y, self.rows)..before(max.y, self.rows),
        ]
    }

    pub fn index(&self, column: usize, row: usize) -> usize {
        row * self.columns + column
    }

    pub fn center(&self, column: usize, row: usize) -> DVec2 {
        self.origin + DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * self.size
    }
}

/// Things to be sorted into rows of cells: those of a grid, or any.
pub(super) trait Places: Sync {
    /// Calls `visit` for every thing and every cell of these rows that it belongs to, things in order; cells
    /// are counted from the first of the rows.
    fn visit(&self, rows: &Range<usize>, visit: impl FnMut(usize, usize));
}

/// Things by cell, each cell's in order.
#[derive(Debug)]
pub(super) struct Sorted {
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Sorted {
    /// Sorts into the cells of a grid.
    pub fn on(crew: Crew, grid: &Grid, places: &impl Places) -> Sorted {
        Sorted::new(crew, grid.rows, grid.columns, places)
    }

    /// Sorts into so many rows of so many cells. Each thread visits all things twice: to count them, and to put
    /// those of its rows in their places.
    pub fn new(crew: Crew, rows: usize, columns: usize, places: &impl Places) -> Sorted {
        let bands = crew.ranges(rows, 1);
        let cells = |rows: &Range<usize>| rows.start * columns..rows.end * columns;
        let counts = crew.map(bands.clone(), |rows| {
            let mut counts = vec![0u32; cells(&rows).len()];
            places.visit(&rows, |cell, _| counts[cell] += 1);
            counts
        });
        let mut starts = Vec::with_capacity(rows * columns + 1);
        let mut sum = 0;
        starts.push(0);
        for count in counts.iter().flatten() {
            sum += count;
            starts.push(sum);
        }
        let mut entries = vec![0u32; sum as usize];
        let mut rest = &mut entries[..];
        let mut work = Vec::new();
        for rows in bands {
            let length = starts[cells(&rows).end] - starts[cells(&rows).start];
            let (own, others) = rest.split_at_mut(length as usize);
            work.push((rows, own));
            rest = others;
        }
        crew.map(work, |(rows, own)| {
            let cells = cells(&rows);
            let mut next: Vec<u32> = starts[cells.clone()].iter().map(|s| s - starts[cells.start]).collect();
            places.visit(&rows, |cell, thing| {
                own[next[cell] as usize] = thing as u32;
                next[cell] += 1;
            });
        });
        Sorted { starts, entries }
    }

    /// A cell's things.
    #[inline]
    pub fn in_cell(&self, cell: usize) -> &[u32] {
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The number of cells.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }
}

/// The smallest rectangle around projected points.
#[inline]
pub(super) fn rectangle<const N: usize>(points: [DVec3; N]) -> (DVec2, DVec2) {
    let (mut low, mut high) = (points[0].truncate(), points[0].truncate());
    for p in &points[1..] {
        low = low.min(p.truncate());
        high = high.max(p.truncate());
    }
    (low, high)
}
