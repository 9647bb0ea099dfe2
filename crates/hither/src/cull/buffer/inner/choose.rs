//! Which boxes of inside cells to take: the one that covers most first, then what covers most of the rest.
//!
//! A box covers, along each of the three axes, columns of cells; what is seen from the two ends of a column counts
//! half each, so that both walls of a house are worth something. Boxes may overlap, for where two only meet, the
//! seam between them would be seen through.
//!
//! All boxes that cannot be extended are enumerated once: for each run of layers the cells inside in all of them,
//! for each run of rows the same again, and the runs of bits that are left. That is at most 32⁴/4 steps of a few
//! instructions, and far fewer where the solid is simple, because a run of layers that could be longer at no loss
//! is skipped at once. What covers little is not looked at.

use super::LatticeBox;
use super::cells::Cells;
use glam::DVec3;

/// A box is taken only if it adds this part of what the ones before cover.
const LEAST_GAIN: f64 = 0.02;
/// A box covers at least this part of the largest.
const LEAST_PART: f64 = 0.02;
/// Candidates that are kept, of those with the largest faces.
const CANDIDATES: usize = 4096;

/// From which cell to which, half open.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    min: [u8; 3],
    max: [u8; 3],
    /// Half its surface: what it covers along the three axes.
    area: f64,
}

/// At most `most` boxes, the most useful first.
pub(super) fn boxes(cells: &Cells, size: DVec3, most: usize) -> Vec<LatticeBox> {
    let scale = (size / size.max_element()).to_array();
    let place: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let unit = scale[axis] / f64::from(super::UNITS);
        cells.cuts[axis].iter().map(|&c| f64::from(c) * unit).collect()
    });
    let mut candidates = Vec::new();
    enumerate(cells, |min, max| {
        let [x, y, z] = [0, 1, 2].map(|i| place[i][max[i]] - place[i][min[i]]);
        let [min, max] = [min, max].map(|ends| ends.map(|k| k as u8));
        candidates.push(Candidate { min, max, area: x * y + y * z + z * x });
    });
    // The order of enumeration decides between equals.
    candidates.sort_by(|a, b| b.area.total_cmp(&a.area));
    let Some(largest) = candidates.first().map(|c| c.area) else { return Vec::new() };
    candidates.retain(|c| c.area > largest * LEAST_PART);
    candidates.truncate(CANDIDATES);
    let mut covered = [0, 1, 2].map(|axis| Columns::new(&place, axis));
    let mut taken = Vec::new();
    let mut total = 0.0;
    while taken.len() < most {
        let mut best: Option<(f64, &Candidate)> = None;
        for c in &candidates {
            if best.is_some_and(|(gain, _)| gain >= c.area) {
                break;
            }
            let gain = covered.iter().map(|columns| columns.gain(c)).sum();
            if best.is_none_or(|(most, _)| gain > most) {
                best = Some((gain, c));
            }
        }
        let Some((gain, c)) = best.filter(|(gain, _)| *gain > LEAST_GAIN * total) else { break };
        total += gain;
        covered.iter_mut().for_each(|columns| columns.cover(c));
        taken.push(LatticeBox {
            min: [0, 1, 2].map(|i| cells.cuts[i][usize::from(c.min[i])]),
            max: [0, 1, 2].map(|i| cells.cuts[i][usize::from(c.max[i])]),
        });
    }
    taken
}

/// All boxes of inside cells that cannot be extended.
fn enumerate(cells: &Cells, mut found: impl FnMut([usize; 3], [usize; 3])) {
    let [_, rows, layers] = cells.count;
    let layer = |z: usize| &cells.inside[z * rows..][..rows];
    let holds = |outer: &[u32], inner: &[u32]| inner.iter().zip(outer).all(|(i, o)| i & !o == 0);
    let mut common = vec![0; rows];
    for z0 in 0..layers {
        common.copy_from_slice(layer(z0));
        for z1 in z0..layers {
            common.iter_mut().zip(layer(z1)).for_each(|(c, l)| *c &= l);
            if common.iter().all(|&c| c == 0) || (z0 > 0 && holds(layer(z0 - 1), &common)) {
                break;
            }
            if z1 + 1 < layers && holds(layer(z1 + 1), &common) {
                continue;
            }
            let extends = |run: u32, [y0, y1]: [usize; 2]| {
                let full = |z: usize| layer(z)[y0..=y1].iter().all(|l| run & !l == 0);
                (z0 > 0 && full(z0 - 1)) || (z1 + 1 < layers && full(z1 + 1))
            };
            rectangles(&common, |[x0, x1], [y0, y1], run| {
                if !extends(run, [y0, y1]) {
                    found([x0, y0, z0], [x1 + 1, y1 + 1, z1 + 1]);
                }
            });
        }
    }
}

/// All rectangles of set bits that cannot be extended: first and last bit, first and last row, and the bits.
fn rectangles(rows: &[u32], mut found: impl FnMut([usize; 2], [usize; 2], u32)) {
    for y0 in 0..rows.len() {
        let before = if y0 > 0 { rows[y0 - 1] } else { 0 };
        let mut common = u32::MAX;
        for y1 in y0..rows.len() {
            common &= rows[y1];
            if common & !before == 0 {
                break;
            }
            let after = rows.get(y1 + 1).copied().unwrap_or(0);
            if common & !after == 0 {
                continue;
            }
            let mut left = common;
            while left != 0 {
                let x0 = left.trailing_zeros();
                let length = (left >> x0).trailing_ones();
                let run = (u32::MAX >> (32 - length)) << x0;
                left &= !run;
                if run & !before != 0 && run & !after != 0 {
                    found([x0 as usize, (x0 + length - 1) as usize], [y0, y1], run);
                }
            }
        }
    }
}

/// The columns along an axis, each in two halves, and which of them are covered.
struct Columns {
    axis: usize,
    /// Cells before the middle.
    middle: u8,
    sizes: [Vec<f64>; 2],
    free: [Vec<bool>; 2],
    /// Sums of the free area over all columns below and left.
    sums: [Vec<f64>; 2],
}

impl Columns {
    fn new(place: &[Vec<f64>; 3], axis: usize) -> Columns {
        let sizes =
            [(axis + 1) % 3, (axis + 2) % 3].map(|i| place[i].windows(2).map(|w| w[1] - w[0]).collect());
        let [across, up]: &[Vec<f64>; 2] = &sizes;
        let (columns, sums) = (across.len() * up.len(), (across.len() + 1) * (up.len() + 1));
        let half = place[axis].last().map_or(0.0, |p| p / 2.0);
        let middle = place[axis].iter().filter(|&&p| p <= half).count() as u8 - 1;
        let mut made = Columns {
            axis,
            middle: middle.max(1),
            sizes,
            free: [0, 1].map(|_| vec![true; columns]),
            sums: [0, 1].map(|_| vec![0.0; sums]),
        };
        made.add_up();
        made
    }

    fn add_up(&mut self) {
        let [across, up] = &self.sizes;
        let width = across.len();
        for (free, sums) in self.free.iter().zip(&mut self.sums) {
            for (v, height) in up.iter().enumerate() {
                let mut row = 0.0;
                for (u, breadth) in across.iter().enumerate() {
                    row += if free[v * width + u] { breadth * height } else { 0.0 };
                    sums[(v + 1) * (width + 1) + u + 1] = sums[v * (width + 1) + u + 1] + row;
                }
            }
        }
    }

    /// Which halves a box lies in.
    fn halves(&self, c: &Candidate) -> [bool; 2] {
        [c.min[self.axis] < self.middle, c.max[self.axis] > self.middle]
    }

    fn ends(&self, c: &Candidate) -> [[usize; 2]; 2] {
        [1, 2].map(|i| [c.min, c.max].map(|ends| usize::from(ends[(self.axis + i) % 3])))
    }

    /// Area that a box would cover and that is not covered yet.
    fn gain(&self, c: &Candidate) -> f64 {
        let [[u0, u1], [v0, v1]] = self.ends(c);
        let width = self.sizes[0].len() + 1;
        let halves = self.halves(c).into_iter().zip(&self.sums).filter(|(half, _)| *half);
        halves
            .map(|(_, sums)| {
                let sum = |u: usize, v: usize| sums[v * width + u];
                0.5 * (sum(u1, v1) - sum(u0, v1) - sum(u1, v0) + sum(u0, v0))
            })
            .sum()
    }

    fn cover(&mut self, c: &Candidate) {
        let ([[u0, u1], [v0, v1]], halves) = (self.ends(c), self.halves(c));
        let width = self.sizes[0].len();
        for (_, free) in halves.into_iter().zip(&mut self.free).filter(|(half, _)| *half) {
            for v in v0..v1 {
                free[v * width + u0..v * width + u1].fill(false);
            }
        }
        self.add_up();
    }
}
