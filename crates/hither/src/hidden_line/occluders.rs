//! The triangles that may hide something, by cell of the grid, nearest first.

use super::cover::Cover;
use super::grid::{Grid, rectangle};
use super::shown::{Fate, Shown};
use super::topology::NONE;
use glam::{DVec2, DVec3, Vec4, Vec4Swizzles};

/// Triangles by cell.
pub(super) struct Occluders {
    pub grid: Grid,
    starts: Vec<u32>,
    entries: Vec<u32>,
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
        let w = corners.map(|c| c.z);
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
    pub fn new(shown: &Shown, grid: Grid, cover: Option<&Cover>, hides: impl Fn(u32) -> bool) -> Occluders {
        let (list, large) = sorted(shown, &grid, hides);
        let mut starts = vec![0u32; grid.len() + 1];
        let hidden = |i: usize, cell: usize| {
            large[i] && cover.is_some_and(|c| c.bound(cell) > f64::from(list[i].nearest))
        };
        for (i, o) in list.iter().enumerate() {
            let count = |cell: usize| starts[cell + 1] += u32::from(!hidden(i, cell));
            visit_cells(shown, &grid, o, large[i], count);
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut entries = vec![0u32; starts[grid.len()] as usize];
        let mut next = starts.clone();
        for (i, o) in list.iter().enumerate() {
            visit_cells(shown, &grid, o, large[i], |cell| {
                if hidden(i, cell) {
                    return;
                }
                entries[next[cell] as usize] = i as u32;
                next[cell] += 1;
            });
        }
        Occluders { grid, starts, entries, list, large }
    }

    /// Indices into [`Occluders::list`] of a cell's triangles, nearest first.
    #[inline]
    pub fn in_cell(&self, cell: usize) -> &[u32] {
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// The live triangles that may hide, nearest first, and which of them are large.
fn sorted(shown: &Shown, grid: &Grid, hides: impl Fn(u32) -> bool) -> (Vec<Occluder>, Vec<bool>) {
    let live = |t: &u32| shown.fate[*t as usize] == Fate::Live && hides(*t);
    let mut found = Vec::new();
    for solid in &shown.solids {
        for t in (solid.first_triangle..solid.first_triangle + solid.triangle_count).filter(live) {
            let sheet = shown.sheet(solid, t).unwrap_or(NONE);
            found.push(Occluder::new(&shown.corners(t), t, sheet));
        }
    }
    let caps = (shown.triangles.len() - shown.caps.len()) as u32..shown.triangles.len() as u32;
    found.extend(caps.filter(live).map(|t| Occluder::new(&shown.corners(t), t, NONE)));
    // Negated and mapped to integers in the same order; then by triangle.
    let mut order: Vec<u64> = (0..found.len() as u64)
        .map(|i| {
            let bits = (-found[i as usize].nearest).to_bits();
            let rising = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
            u64::from(rising) << 32 | i
        })
        .collect();
    order.sort_unstable();
    let list: Vec<Occluder> = order.iter().map(|&key| found[key as u32 as usize]).collect();
    let is_large = |o: &Occluder| {
        let cells = grid.cells(o.bounds.min(), o.bounds.max());
        cells.columns.1 - cells.columns.0 > 1 && cells.rows.1 - cells.rows.0 > 1
    };
    let large = list.iter().map(is_large).collect();
    (list, large)
}

/// Calls `visit` for every cell that a triangle may touch. Errs towards yes.
#[inline]
fn visit_cells(shown: &Shown, grid: &Grid, o: &Occluder, large: bool, mut visit: impl FnMut(usize)) {
    let cells = grid.cells(o.bounds.min(), o.bounds.max());
    for row in cells.rows.0..=cells.rows.1 {
        let (first, last) =
            if large { columns_in_row(&shown.corners(o.triangle), grid, row) } else { cells.columns };
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
