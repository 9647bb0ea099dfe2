//! What is certainly hidden: for each cell of the grid, a depth beyond which nothing can be seen.
//!
//! Take the nearest triangle at a cell's centre and walk from it to neighbours, over every edge that enters
//! the cell. If the walk meets no fold, no boundary and no missing triangle, then what was walked covers the
//! whole cell: projected, it is a surface without a border inside a region that is simply connected. All
//! that is farther than the farthest of it is hidden there, however small the triangles are. A walk that
//! fails says nothing about the cell.
//!
//! Conservative: a hidden thing may be missed, a visible one is never called hidden.

use super::grid::{Cells, Grid, rectangle};
use super::occluders::Occluders;
use super::predicates::cross;
use super::shown::{Fate, Shown, Solid};
use super::topology::NONE;
use glam::{DVec2, DVec3};

/// A walk that grows beyond this is given up: the cell is too rich to be settled cheaply.
const LONGEST_WALK: usize = 192;

/// Depths by cell, and what finding them needs.
pub(super) struct Cover {
    pub grid: Grid,
    /// Whatever has a smaller w, at a point in this cell, is hidden there.
    bound: Vec<f64>,
    /// Nearest surface of the present solid.
    samples: Samples,
    /// Whether everything in a cell is known: what is not hidden by its bound is seen.
    settled: Vec<bool>,
    /// The triangle that the walk which gave a cell its bound began with.
    seed: Vec<u32>,
}

impl Cover {
    pub fn new(grid: Grid) -> Cover {
        Cover {
            grid,
            bound: vec![f64::NEG_INFINITY; grid.len()],
            samples: Samples::new(&grid),
            settled: vec![false; grid.len()],
            seed: vec![NONE; grid.len()],
        }
    }

    /// Whether a line that comes no nearer than `w` in these cells, and is part of a triangle that may hide,
    /// is certainly seen in all of them.
    pub fn shows(&self, cells: Cells, w: f64) -> bool {
        (cells.rows.0..=cells.rows.1).all(|row| {
            let at = row * self.grid.columns;
            let cells = at + cells.columns.0..=at + cells.columns.1;
            cells.into_iter().all(|cell| self.settled[cell] && self.bound[cell] <= w)
        })
    }

    /// Whether what a triangle may have in a cell is hidden.
    pub fn hides_in(&self, cell: usize, &[a, b, c]: &[DVec3; 3]) -> bool {
        let bound = self.bound[cell];
        if bound > a.z.max(b.z).max(c.z) {
            return true;
        }
        if bound <= a.z.min(b.z).min(c.z) {
            return false;
        }
        // Of slivers rounding leaves too little to tell which way they are inclined.
        let [p, q] = [b - a, c - a].map(DVec3::truncate);
        if p.perp_dot(q).abs() < 1e-6 * p.length_squared().max(q.length_squared()) {
            return false;
        }
        let center = self.grid.center(cell % self.grid.columns, cell / self.grid.columns);
        Plane::through(a, b, c).most(center, self.reach(center)) < bound
    }

    /// Finds the cells in which nothing but the surface that gave them their bound is nearer than it: no line
    /// of this surface is hidden there. Call it when everything is added and sorted.
    pub fn settle_cells(&mut self, shown: &Shown, occluders: &Occluders, hides: impl Fn(u32) -> bool + Sync) {
        let start = || Walks::over(shown.triangles.len());
        let settled = shown.crew.map_with(shown.crew.ranges(self.grid.len(), 4), start, |walks, cells| {
            cells.map(|cell| self.is_settled(shown, occluders, &hides, cell, walks)).collect::<Vec<bool>>()
        });
        self.settled = settled.concat();
    }

    fn is_settled(
        &self,
        shown: &Shown,
        occluders: &Occluders,
        hides: &impl Fn(u32) -> bool,
        cell: usize,
        walks: &mut Walks,
    ) -> bool {
        let seed = self.seed[cell];
        if seed == NONE {
            return false;
        }
        let solid = &shown.solids[shown.solid_of(seed)];
        let center = self.grid.center(cell % self.grid.columns, cell / self.grid.columns);
        let reach = self.reach(center);
        // What covers a cell covers it once if it is a sheet; nothing more need be known of it.
        let sheet = shown.sheet(solid, seed);
        if sheet.is_none() && walks.next(0, center, reach).from(shown, solid, seed, hides).is_none() {
            return false;
        }
        // Around a branch point a surface without folds can cover a cell twice.
        let mut over_center = 0;
        for &i in occluders.in_cell(cell) {
            let occluder = &occluders.list[i as usize];
            if f64::from(occluder.nearest) < self.bound[cell] {
                break;
            }
            if sheet == Some(occluder.sheet) {
                continue;
            }
            let corners = shown.corners(occluder.triangle);
            if sheet.is_none() && walks.visited[occluder.triangle as usize] == walks.last {
                over_center += usize::from(contains(&corners, center));
            } else if touches(&corners, center, reach) {
                return false;
            }
        }
        over_center <= 1
    }

    /// Half a cell's side, with room for the rounding of coordinates far outside the picture.
    fn reach(&self, center: DVec2) -> f64 {
        self.grid.size * 0.5 * (1.0 + 1e-6) + center.abs().max_element() * 1e-12
    }

    /// Whether everything in these cells that is no nearer than `w` is hidden.
    pub fn hides(&self, cells: Cells, w: f64) -> bool {
        (cells.rows.0..=cells.rows.1).all(|row| {
            let at = row * self.grid.columns;
            self.bound[at + cells.columns.0..=at + cells.columns.1].iter().all(|&bound| bound > w)
        })
    }

    /// Lets the last solid of `shown` cover what it covers. Triangles that `hides` says no to are not there.
    pub fn add(&mut self, shown: &Shown, hides: impl Fn(u32) -> bool + Sync) {
        let Some(solid) = shown.solids.last() else { return };
        let first = solid.first_triangle;
        let count = solid.triangle_count as usize;
        let mut samples = std::mem::take(&mut self.samples);
        let mut work = Vec::new();
        for (k, range) in shown.crew.shares(count, 1).into_iter().enumerate() {
            let samples = if k == 0 { std::mem::take(&mut samples) } else { Samples::new(&self.grid) };
            work.push((samples, first + range.start as u32..first + range.end as u32));
        }
        let filled = shown.crew.map(work, |(mut samples, range)| {
            for t in range {
                if shown.fate[t as usize] == Fate::Live && hides(t) {
                    samples.take(shown, &self.grid, &self.bound, t);
                }
            }
            samples
        });
        for samples_of_share in filled {
            samples.merge(samples_of_share);
        }
        let touched = std::mem::take(&mut samples.touched);
        let shares = shown.crew.shares(touched.len(), 4);
        let found = shown.crew.map_with(
            shares,
            || Walks::over(count),
            |walks, range| {
                let mut found = Vec::new();
                for &at in &touched[range] {
                    let (w, triangle) = samples.nearest[at as usize];
                    if w <= self.bound[at as usize] {
                        continue;
                    }
                    let cell = at as usize;
                    let center = self.grid.center(cell % self.grid.columns, cell / self.grid.columns);
                    let mut walk = walks.next(first, center, self.reach(center));
                    let farthest = walk.from(shown, solid, triangle, &hides);
                    found.extend(farthest.map(|w| (at, w - shown.lens.coarse(w), triangle)));
                }
                found
            },
        );
        for (at, bound, triangle) in found.into_iter().flatten() {
            if bound > self.bound[at as usize] {
                self.bound[at as usize] = bound;
                self.seed[at as usize] = triangle;
            }
        }
        touched.iter().for_each(|&at| samples.nearest[at as usize] = NO_SAMPLE);
        self.samples = samples;
    }
}

/// What is nearest of a solid at the centres of cells.
#[derive(Default)]
struct Samples {
    /// w and triangle.
    nearest: Vec<(f64, u32)>,
    /// The cells that have a triangle.
    touched: Vec<u32>,
}

const NO_SAMPLE: (f64, u32) = (f64::NEG_INFINITY, NONE);

impl Samples {
    fn new(grid: &Grid) -> Samples {
        Samples { nearest: vec![NO_SAMPLE; grid.len()], touched: Vec::new() }
    }

    /// Notes a triangle at the centres that it covers, if it is the nearest there and before `bound`.
    fn take(&mut self, shown: &Shown, grid: &Grid, bound: &[f64], triangle: u32) {
        let [a, b, c] = shown.corners(triangle);
        let (min, max) = rectangle([a, b, c]);
        let [columns, rows] = grid.centers(min, max);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let plane = Plane::through(a, b, c);
        for row in rows {
            let y = grid.center(0, row).y;
            let Some((from, to)) = span([a, b, c], y) else { continue };
            let first = grid.column(from).max(columns.start);
            for column in first..columns.end.min(grid.column(to) + 1) {
                let center = grid.center(column, row);
                if center.x < from || center.x > to {
                    continue;
                }
                let at = grid.index(column, row);
                let w = plane.at(center).min(a.z.max(b.z).max(c.z));
                if w > bound[at] {
                    self.note(at as u32, (w, triangle));
                }
            }
        }
    }

    fn note(&mut self, at: u32, sample: (f64, u32)) {
        let nearest = &mut self.nearest[at as usize];
        if sample.0 > nearest.0 {
            if nearest.1 == NONE {
                self.touched.push(at);
            }
            *nearest = sample;
        }
    }

    /// Takes over another share's; of the same depth the earlier stays.
    fn merge(&mut self, other: Samples) {
        if self.nearest.is_empty() {
            *self = other;
            return;
        }
        other.touched.iter().for_each(|&at| self.note(at, other.nearest[at as usize]));
    }
}

/// Walks by one thread.
struct Walks {
    /// The walk that came to a triangle last.
    visited: Vec<u32>,
    last: u32,
}

impl Walks {
    fn over(triangles: usize) -> Walks {
        Walks { visited: vec![0; triangles], last: 0 }
    }

    /// Begins a walk over a cell; `first` is the first triangle that may be visited.
    fn next(&mut self, first: u32, center: DVec2, reach: f64) -> Walk<'_> {
        self.last += 1;
        Walk { visited: &mut self.visited, first, number: self.last, center, reach }
    }
}

/// A walk over one cell.
struct Walk<'a> {
    /// The walk that came to a triangle last, from `first` on.
    visited: &'a mut [u32],
    first: u32,
    number: u32,
    center: DVec2,
    reach: f64,
}

impl Walk<'_> {
    /// Walks from one triangle on; the smallest w of what covers the cell, if it is covered.
    fn from(
        &mut self,
        shown: &Shown,
        solid: &Solid,
        triangle: u32,
        hides: &impl Fn(u32) -> bool,
    ) -> Option<f64> {
        let mut farthest = f64::INFINITY;
        let mut stack = [triangle; LONGEST_WALK];
        let (mut height, mut steps) = (1, 0);
        self.visited[(triangle - self.first) as usize] = self.number;
        while height > 0 {
            height -= 1;
            steps += 1;
            let t = stack[height];
            let corners = shown.corners(t);
            let lowest = corners[0].z.min(corners[1].z).min(corners[2].z);
            let [a, b, c] = corners;
            if lowest < farthest {
                let least = Plane::through(a, b, c).least(self.center, self.reach);
                farthest = farthest.min(lowest.max(least));
            }
            for k in 0..3 {
                if !enters(corners[k], corners[(k + 1) % 3], self.center, self.reach) {
                    continue;
                }
                let next = across(shown, solid, t, k)?;
                if !hides(next) {
                    return None;
                }
                let seen = &mut self.visited[(next - self.first) as usize];
                if *seen != self.number {
                    *seen = self.number;
                    if height == LONGEST_WALK || steps + height >= LONGEST_WALK {
                        return None;
                    }
                    stack[height] = next;
                    height += 1;
                }
            }
        }
        Some(farthest)
    }
}

/// Whether a triangle may have a point in the square around `center`. Errs towards yes.
fn touches(corners: &[DVec3; 3], center: DVec2, reach: f64) -> bool {
    let at = |k: usize| corners[k].truncate() - center;
    let p = [at(0), at(1), at(2)];
    let (low, high) = (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]));
    if low.x > reach || low.y > reach || high.x < -reach || high.y < -reach {
        return false;
    }
    let turn = (p[1] - p[0]).perp_dot(p[2] - p[0]).signum();
    (0..3).all(|k| {
        let d = p[(k + 1) % 3] - p[k];
        let slack = 1e-12 * d.abs().max_element() * p[k].abs().max_element();
        turn * d.perp_dot(-p[k]) >= -reach * (d.x.abs() + d.y.abs()) - slack
    })
}

/// Whether a point is clearly in a triangle, or on its outline.
fn contains(corners: &[DVec3; 3], p: DVec2) -> bool {
    let p = p.extend(0.0);
    let [a, b, c] = *corners;
    let (s, t, u) = (cross(a, b, p), cross(b, c, p), cross(c, a, p));
    s.min(t).min(u) >= 0.0 || s.max(t).max(u) <= 0.0
}

/// The triangle that continues the surface over edge `k` of `t`; `None` at a fold or where there is none.
fn across(shown: &Shown, solid: &Solid, t: u32, k: usize) -> Option<u32> {
    let origin = shown.origin(solid, t) as usize;
    if solid.cut.as_ref().is_some_and(|cut| !cut.whole[origin]) {
        return None;
    }
    let neighbour = solid.topology.neighbours[origin][k];
    if neighbour == NONE || solid.cut.as_ref().is_some_and(|cut| !cut.whole[neighbour as usize]) {
        return None;
    }
    let next = shown.place(solid, neighbour);
    let sense = if solid.topology.flips[origin] >> k & 1 == 1 { -1 } else { 1 };
    (next != NONE && shown.facing[t as usize] * shown.facing[next as usize] * sense > 0).then_some(next)
}

/// Whether the segment may come within the square around `center`. Errs towards yes.
fn enters(p: DVec3, q: DVec3, center: DVec2, reach: f64) -> bool {
    let (p, q) = (p.truncate() - center, q.truncate() - center);
    let (low, high) = (p.min(q), p.max(q));
    if low.x > reach || low.y > reach || high.x < -reach || high.y < -reach {
        return false;
    }
    let d = q - p;
    let offset = d.perp_dot(-p).abs();
    offset
        <= reach * (d.x.abs() + d.y.abs()) * (1.0 + 1e-9)
            + 1e-12 * p.abs().max_element() * d.abs().max_element()
}

/// Where a horizontal line is inside a triangle.
fn span(corners: [DVec3; 3], y: f64) -> Option<(f64, f64)> {
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        if (p.y <= y) != (q.y <= y) {
            let x = p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y));
            from = from.min(x);
            to = to.max(x);
        }
    }
    (from <= to).then_some((from, to))
}

/// w over the paper as a plane.
pub(super) struct Plane {
    at: DVec3,
    slope: DVec2,
}

impl Plane {
    pub fn through(a: DVec3, b: DVec3, c: DVec3) -> Plane {
        let n = (b - a).cross(c - a);
        Plane { at: a, slope: DVec2::new(-n.x, -n.y) / n.z }
    }

    pub fn at(&self, p: DVec2) -> f64 {
        self.at.z + self.slope.dot(p - self.at.truncate())
    }

    /// The largest value within the square; NaN or ∞ for a plane seen edge-on.
    fn most(&self, center: DVec2, reach: f64) -> f64 {
        let middle = self.at(center);
        let error = middle.abs() * 1e-12;
        middle + (self.slope.x.abs() + self.slope.y.abs()) * reach + error
    }

    /// The smallest value within the square; NaN or −∞ for a plane seen edge-on.
    fn least(&self, center: DVec2, reach: f64) -> f64 {
        let middle = self.at(center);
        let error = middle.abs() * 1e-12;
        middle - (self.slope.x.abs() + self.slope.y.abs()) * reach - error
    }
}

/// Marks what cannot be seen: triangles outside the picture, and those that `cover` hides.
pub(super) fn settle(shown: &mut Shown, cover: Option<&Cover>, picture: DVec2) {
    let fate = |t: usize| {
        if shown.fate[t] != Fate::Live {
            return shown.fate[t];
        }
        let [a, b, c] = shown.corners(t as u32);
        let (min, max) = rectangle([a, b, c]);
        let nearest = a.z.max(b.z).max(c.z);
        if max.x < 0.0 || max.y < 0.0 || min.x > picture.x || min.y > picture.y {
            Fate::Outside
        } else if cover.is_some_and(|cover| cover.hides(cover.grid.cells(min, max), nearest)) {
            Fate::Hidden
        } else {
            Fate::Live
        }
    };
    let mut fates = Vec::new();
    shown.crew.extend(&mut fates, shown.triangles.len(), fate);
    shown.fate = fates;
}
