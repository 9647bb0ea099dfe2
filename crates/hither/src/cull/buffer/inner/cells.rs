//! A grid of cells over the lattice, closer where it matters: which cells the surface touches, and which of the
//! others it winds round.
//!
//! Rows run along x, and a row is a word of 32 bits. Large faces along an axis lie in thin cells of their own, so
//! that a wall far thinner than the grid is wide has its inside.

use super::{LatticeBox, UNITS};
use glam::DVec3;

/// Cells along an axis at most: bits of a row.
const MOST: usize = 32;
/// Units by which a cell must be clear of the surface, see the proof's step 2.
const CLEAR: i32 = 2;
/// Units from a face along an axis to the planes of the cells beside it: just clear.
const BESIDE: i32 = CLEAR + 1;
/// Extent along an axis up to which a triangle counts as across it.
const LEVEL: i32 = UNITS / 2048;
/// Offsets of faces along an axis that get cells of their own.
const OFFSETS: usize = 10;
/// Such faces have at least this part of the area of the patch's side.
const LEAST_AREA: f64 = 1.0 / 100.0;
/// Cells along the thinnest axis, at least, where there are no faces along it.
const THINNEST: i32 = 6;

/// Planes of the grid.
pub(super) type Cuts = [Vec<i32>; 3];

/// The cells.
#[derive(Debug)]
pub(super) struct Cells {
    pub cuts: Cuts,
    /// Cells along each axis.
    pub count: [usize; 3],
    /// Rows by z, then y: those round which the surface winds at least once, and which it does not touch.
    pub inside: Vec<u32>,
}

/// Where to cut: on both sides of large faces, and in between where gaps are wide.
pub(super) fn cuts(triangles: &[[[i32; 3]; 3]], size: DVec3) -> Cuts {
    let along = match triangles.len() {
        0..64 => 10,
        64..1024 => 16,
        _ => 24,
    };
    std::array::from_fn(|axis| {
        let mut cuts = vec![0, UNITS];
        for (low, high) in offsets(triangles, axis) {
            cuts.extend([low - BESIDE, high + BESIDE]);
        }
        cuts.retain(|&c| (0..=UNITS).contains(&c));
        cuts.sort_unstable();
        cuts.dedup();
        let cubic = f64::from(UNITS) * size.max_element() / (f64::from(along) * size[axis]);
        let widest = (cubic as i32).clamp(UNITS / along, UNITS / THINNEST);
        while cuts.len() <= MOST {
            let gap = |k: &usize| cuts[k + 1] - cuts[*k];
            let Some(k) = (0..cuts.len() - 1).max_by_key(gap).filter(|k| gap(k) > widest) else { break };
            cuts.insert(k + 1, (cuts[k] + cuts[k + 1]) / 2);
        }
        cuts
    })
}

/// From where to where the largest faces across an axis lie; disjoint.
fn offsets(triangles: &[[[i32; 3]; 3]], axis: usize) -> Vec<(i32, i32)> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut flat: Vec<(i32, i32, i64)> = triangles
        .iter()
        .filter_map(|t| {
            let (low, high) = range(&t.map(|p| p[axis]));
            let area = doubled_area(&t.map(|p| [p[u], p[v]])).abs();
            (high - low <= LEVEL && area > 0).then_some((low, high, area))
        })
        .collect();
    flat.sort_unstable();
    let mut groups: Vec<(i32, i32, i64)> = Vec::new();
    for (low, high, area) in flat {
        match groups.last_mut() {
            Some(last) if low <= last.1 + 2 * BESIDE && high - last.0 <= 2 * LEVEL => {
                (last.1, last.2) = (last.1.max(high), last.2 + area);
            }
            _ => groups.push((low, high, area)),
        }
    }
    let least = LEAST_AREA * 2.0 * f64::from(UNITS).powi(2);
    groups.retain(|g| g.2 as f64 >= least);
    groups.sort_by_key(|g| -g.2);
    groups.truncate(OFFSETS);
    groups.into_iter().map(|(low, high, _)| (low, high)).collect()
}

fn range<T: Copy + PartialOrd>(values: &[T; 3]) -> (T, T) {
    let [a, b, c] = *values;
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    (if c < low { c } else { low }, if c > high { c } else { high })
}

/// Twice the area, positive if the corners run from the first axis to the second. Below 2³⁶.
fn doubled_area(t: &[[i32; 2]; 3]) -> i64 {
    turn(t[0], t[1], t[2])
}

fn turn(a: [i32; 2], b: [i32; 2], p: [i32; 2]) -> i64 {
    let side = |i: usize, q: [i32; 2]| i64::from(q[i] - a[i]);
    side(0, b) * side(1, p) - side(1, b) * side(0, p)
}

impl Cells {
    pub(super) fn new(cuts: Cuts, triangles: &[[[i32; 3]; 3]]) -> Cells {
        let count = [0, 1, 2].map(|axis| cuts[axis].len() - 1);
        let rows = count[1] * count[2];
        let mut cells = Cells { cuts, count, inside: Vec::new() };
        let mut touched = vec![0; rows];
        let mut crossings = vec![0; rows * count[0]];
        let middles = [1, 2].map(|axis| {
            let cuts: &[i32] = &cells.cuts[axis];
            cuts.windows(2).map(|w| w[0] + (w[1] - w[0]) / 2).collect::<Vec<i32>>()
        });
        for t in triangles {
            cells.touch(t, &mut touched);
            cells.cross(t, &middles, &mut crossings);
        }
        let wound = crossings.chunks_exact(count[0]).map(|row| {
            let (mut bits, mut number) = (0, 0);
            for (i, signs) in row.iter().enumerate().rev() {
                bits |= u32::from(number >= 1) << i;
                number += signs;
            }
            bits
        });
        cells.inside = wound.zip(&touched).map(|(wound, touched)| wound & !touched).collect();
        cells
    }

    /// The cells whose closed intervals, made wider, meet one.
    fn slots(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let cuts = &self.cuts[axis];
        let before = cuts[1..].partition_point(|&c| f64::from(c + CLEAR) < low);
        let until = cuts[..cuts.len() - 1].partition_point(|&c| f64::from(c - CLEAR) <= high);
        before..until.max(before)
    }

    /// Marks the cells that a triangle touches.
    fn touch(&self, triangle: &[[i32; 3]; 3], touched: &mut [u32]) {
        let whole = Polygon::new(triangle);
        let slab = |axis: usize, k: usize| {
            let cuts = &self.cuts[axis];
            (f64::from(cuts[k] - CLEAR), f64::from(cuts[k + 1] + CLEAR))
        };
        let (low, high) = whole.range(2);
        for z in self.slots(2, low, high) {
            let layer = whole.within(2, slab(2, z));
            let (low, high) = layer.range(1);
            for y in self.slots(1, low, high) {
                let (low, high) = layer.within(1, slab(1, y)).range(0);
                let x = self.slots(0, low, high);
                let bits = ((1u64 << x.end) - (1u64 << x.start)) as u32;
                touched[z * self.count[1] + y] |= bits;
            }
        }
    }

    /// Adds a triangle's sign to the cells in which it meets the middle lines of rows: 1 where a line that runs
    /// along x leaves through it.
    fn cross(&self, triangle: &[[i32; 3]; 3], middles: &[Vec<i32>; 2], crossings: &mut [i32]) {
        let flat = triangle.map(|p| [p[1], p[2]]);
        let area = doubled_area(&flat);
        if area == 0 {
            return;
        }
        let met = |axis: usize| {
            let (low, high) = range(&flat.map(|p| p[axis]));
            let middles = &middles[axis];
            middles.partition_point(|&m| m < low)..middles.partition_point(|&m| m <= high)
        };
        let columns = met(0);
        for z in met(1) {
            for y in columns.clone() {
                let at = [middles[0][y], middles[1][z]];
                // Twice the areas of the triangles that the line's point forms with each edge.
                let parts = [0, 1, 2].map(|k| turn(flat[(k + 1) % 3], flat[(k + 2) % 3], at));
                let covers = (0..3).all(|k| {
                    let (a, b) = (flat[(k + 1) % 3], flat[(k + 2) % 3]);
                    // The line stands for one that is shifted by (ε², ε).
                    let tie = if b[0] == a[0] { a[1] - b[1] } else { b[0] - a[0] };
                    let side = if parts[k] == 0 { i64::from(tie) } else { parts[k] };
                    side.signum() == area.signum()
                });
                if covers {
                    let weighted: i64 = (0..3).map(|k| parts[k] * i64::from(triangle[k][0])).sum();
                    let x = (weighted * area.signum()).div_euclid(area.abs());
                    let cuts = &self.cuts[0];
                    let slot = cuts[1..self.count[0]].partition_point(|&c| i64::from(c) <= x);
                    crossings[(z * self.count[1] + y) * self.count[0] + slot] += area.signum() as i32;
                }
            }
        }
    }
}

/// The box with each side moved outwards, one after the other, until the surface is near.
pub(super) fn grown(mut found: LatticeBox, triangles: &[[[i32; 3]; 3]]) -> LatticeBox {
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let sides = |axis: usize| (found.min[axis] - CLEAR, found.max[axis] + CLEAR);
        let (mut low, mut high) = (f64::from(-CLEAR), f64::from(UNITS + CLEAR));
        let middle = f64::from(found.min[axis]) * 0.5 + f64::from(found.max[axis]) * 0.5;
        for t in triangles {
            let apart = |axis: usize| {
                let ((from, to), (first, last)) = (sides(axis), range(&t.map(|p| p[axis])));
                last < from || first > to
            };
            if apart(u) || apart(v) {
                continue;
            }
            let wide = |axis: usize| (f64::from(sides(axis).0), f64::from(sides(axis).1));
            let (first, last) = Polygon::new(t).within(u, wide(u)).within(v, wide(v)).range(axis);
            // The box is clear: what is left of the triangle lies on one side of it, or is nothing.
            if first > last {
                continue;
            }
            if first > middle {
                high = high.min(first);
            } else {
                low = low.max(last);
            }
        }
        found.min[axis] = found.min[axis].min(low.ceil() as i32 + BESIDE);
        found.max[axis] = found.max[axis].max(high.floor() as i32 - BESIDE);
    }
    found
}

/// Corners of a triangle after four cuts. A cut adds one, of what is convex; were it bent by rounding, so that
/// every other corner lies beyond, then 3 could become 4, 6, 9, 13.
const CORNERS: usize = 13;

/// A triangle cut by at most two slabs.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [[f64; 3]; CORNERS],
    count: usize,
}

impl Polygon {
    fn new(triangle: &[[i32; 3]; 3]) -> Polygon {
        let mut corners = [[0.0; 3]; CORNERS];
        corners[..3].copy_from_slice(&triangle.map(|p| p.map(f64::from)));
        Polygon { corners, count: 3 }
    }

    fn corners(&self) -> &[[f64; 3]] {
        &self.corners[..self.count]
    }

    /// Smallest and largest coordinate; the first is larger if nothing is left.
    fn range(&self, axis: usize) -> (f64, f64) {
        let wider = |(low, high): (f64, f64), p: &[f64; 3]| (low.min(p[axis]), high.max(p[axis]));
        self.corners().iter().fold((f64::INFINITY, f64::NEG_INFINITY), wider)
    }

    /// What lies in the slab.
    fn within(&self, axis: usize, (low, high): (f64, f64)) -> Polygon {
        let (first, last) = self.range(axis);
        let mut left = *self;
        if first < low {
            left = left.cut(axis, low, 1.0);
        }
        if last > high {
            left = left.cut(axis, high, -1.0);
        }
        left
    }

    /// What lies beyond `limit` in the direction of `sign`.
    fn cut(&self, axis: usize, limit: f64, sign: f64) -> Polygon {
        let mut left = Polygon { corners: [[0.0; 3]; CORNERS], count: 0 };
        let mut push = |p: [f64; 3]| {
            left.corners[left.count] = p;
            left.count += 1;
        };
        let beyond = |p: &[f64; 3]| (p[axis] - limit) * sign;
        let corners = self.corners();
        for (k, p) in corners.iter().enumerate() {
            let next = &corners[(k + 1) % corners.len()];
            let (here, there) = (beyond(p), beyond(next));
            if here >= 0.0 {
                push(*p);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                let part = here / (here - there);
                let mut q: [f64; 3] = std::array::from_fn(|i| p[i] + (next[i] - p[i]) * part);
                q[axis] = limit;
                push(q);
            }
        }
        left
    }
}
