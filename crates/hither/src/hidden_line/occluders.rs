//! The triangles that may hide something, by cell of the grid, nearest first.

use super::cover::Cover;
use super::grid::{Grid, Places, Sorted, rectangle};
use super::shown::{Fate, Shown};
use super::topology::NONE;
use glam::{DVec2, DVec3, Vec4, Vec4Swizzles};
use std::ops::Range;

/// Triangles by cell.
pub(super) struct Occluders {
    pub grid: Grid,
    cells: Sorted,
    /// The triangles, nearest first.
    pub list: Vec<Occluder>,
    /// Which of them are so large that they are left out of cells that only their box touches.
    pub large: Vec<bool>,
}

/// What the quick tests need of a triangle, in half a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Occluder {
    bounds: Bounds,
    /// w of its nearest corner, rounded up.
    pub nearest: f32,
    /// w of its farthest corner, rounded down.
    pub farthest: f32,
    pub triangle: u32,
    /// The body whose front it is part of and covers once, or [`NONE`].
    pub sheet: u32,
}

/// A rectangle in f32, rounded outwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Smallest x and y, and largest x and y negated.
    low: Vec4,
}

impl Bounds {
    /// A rectangle that holds the one given.
    #[inline]
    pub fn around(min: DVec2, max: DVec2) -> Bounds {
        let down = |x: f64| (x as f32).next_down();
        Bounds { low: Vec4::new(down(min.x), down(min.y), down(-max.x), down(-max.y)) }
    }

    /// What [`Bounds::meets`] compares with.
    #[inline]
    pub fn reach(&self) -> Vec4 {
        -self.low.zwxy()
    }

    /// Whether it meets the rectangle whose reach is given.
    #[inline(always)]
    pub fn meets(&self, reach: Vec4) -> bool {
        self.low.cmple(reach).all()
    }

    pub fn min(&self) -> DVec2 {
        self.low.xy().as_dvec2()
    }

    pub fn max(&self) -> DVec2 {
        -self.low.zw().as_dvec2()
    }
}

impl Occluder {
    fn new(corners: &[DVec3; 3], triangle: u32, sheet: u32) -> Occluder {
        let (min, max) = rectangle(*corners);
        let w = [corners[0].z, corners[1].z, corners[2].z];
        Occluder {
            bounds: Bounds::around(min, max),
            nearest: (w[0].max(w[1]).max(w[2]) as f32).next_up(),
            farthest: (w[0].min(w[1]).min(w[2]) as f32).next_down(),
            triangle,
            sheet,
        }
    }

    #[inline(always)]
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }
}

impl Occluders {
    /// Sorts the live triangles of `shown` that `hides` says yes to.
    /// Large ones are left out of cells where `cover` hides them.
    pub fn new(
        shown: &Shown,
        grid: Grid,
        cover: Option<&Cover>,
        hides: impl Fn(u32) -> bool + Sync,
    ) -> Occluders {
        let list = sorted(shown, hides);
        let mut cells = Vec::new();
        let cells_of = |i: usize| {
            let o: &Occluder = &list[i];
            let cells = grid.cells(o.bounds.min(), o.bounds.max());
            [cells.columns.0, cells.columns.1, cells.rows.0, cells.rows.1].map(|n| n as u16)
        };
        shown.crew.extend(&mut cells, list.len(), cells_of);
        let binning = Binning { shown, grid: &grid, cover, list: &list, cells: &cells };
        let sorted = Sorted::on(shown.crew, &grid, &binning);
        let large = cells.iter().map(is_large).collect();
        Occluders { grid, cells: sorted, list, large }
    }

    /// Indices into [`Occluders::list`] of a cell's triangles, nearest first.
    #[inline]
    pub fn in_cell(&self, cell: usize) -> &[u32] {
        self.cells.in_cell(cell)
    }
}

/// Whether a triangle in these cells is left out of those that only its box touches.
fn is_large(&[left, right, top, bottom]: &[u16; 4]) -> bool {
    right - left > 1 && bottom - top > 1
}

/// The live triangles that may hide, nearest first.
fn sorted(shown: &Shown, hides: impl Fn(u32) -> bool + Sync) -> Vec<Occluder> {
    let live = |t: &u32| shown.fate[*t as usize] == Fate::Live && hides(*t);
    let crew = shown.crew;
    let mut work = Vec::new();
    for solid in &shown.solids {
        let first = solid.first_triangle as usize;
        work.extend(crew.shares(solid.triangle_count as usize, 4).into_iter().map(|r| (solid, first, r)));
    }
    let mut found: Vec<Occluder> = Vec::with_capacity(shown.triangles.len() / 2);
    let shares = crew.map(work, |(solid, first, range)| {
        let triangles = (range.start + first) as u32..(range.end + first) as u32;
        let sheet = |t: u32| shown.sheet(solid, t).unwrap_or(NONE);
        triangles.filter(live).map(|t| Occluder::new(&shown.corners(t), t, sheet(t))).collect::<Vec<_>>()
    });
    shares.into_iter().for_each(|share| found.extend(share));
    let caps = (shown.triangles.len() - shown.caps.len()) as u32..shown.triangles.len() as u32;
    found.extend(caps.filter(live).map(|t| Occluder::new(&shown.corners(t), t, NONE)));
    // Negated and mapped to integers in the same order; then by triangle.
    let key = |i: usize| {
        let bits = (-found[i].nearest).to_bits();
        let rising = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
        u64::from(rising) << 32 | i as u64
    };
    let mut order = Vec::new();
    crew.extend(&mut order, found.len(), key);
    crew.sort_by_key(&mut order, |key| *key);
    let mut list = Vec::new();
    crew.extend(&mut list, order.len(), |i| found[order[i] as u32 as usize]);
    list
}

/// What is sorted into cells.
struct Binning<'a> {
    shown: &'a Shown<'a>,
    grid: &'a Grid,
    cover: Option<&'a Cover>,
    list: &'a [Occluder],
    /// The first and last column and the first and last row of each.
    cells: &'a [[u16; 4]],
}

impl Places for Binning<'_> {
    /// The cells that a triangle may touch, and is not certainly hidden in. Errs towards yes.
    #[inline(always)]
    fn visit(&self, rows: &Range<usize>, mut visit: impl FnMut(usize, usize)) {
        let (grid, start) = (self.grid, self.grid.index(0, rows.start));
        for (i, of) in self.cells.iter().enumerate() {
            let [left, right, top, bottom] = of.map(usize::from);
            if top >= rows.end || bottom < rows.start {
                continue;
            }
            let large = is_large(of);
            for row in top.max(rows.start)..=bottom.min(rows.end - 1) {
                if !large {
                    (left..=right).for_each(|column| visit(grid.index(column, row) - start, i));
                    continue;
                }
                let o = &self.list[i];
                let (first, last) = columns_in_row(&self.shown.corners(o.triangle), grid, row);
                for cell in grid.index(first, row)..=grid.index(last, row) {
                    if !self.cover.is_some_and(|c| c.hides_in(cell, &self.shown.corners(o.triangle))) {
                        visit(cell - start, i);
                    }
                }
            }
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
