//! A grid of square cells over the part of the paper that is drawn on.

use glam::{DVec2, DVec3};

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

    pub fn index(&self, column: usize, row: usize) -> usize {
        row * self.columns + column
    }

    pub fn center(&self, column: usize, row: usize) -> DVec2 {
        self.origin + DVec2::new(column as f64 + 0.5, row as f64 + 0.5) * self.size
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
