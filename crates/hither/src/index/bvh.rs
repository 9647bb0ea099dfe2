//! Building a 16-wide bounding volume hierarchy: binned surface-area heuristic, top down.
//!
//! A wide node is made by splitting its range in two again and again, the part with the largest surface
//! first, until there are sixteen parts or all are leaves [Wald, Benthin & Boulos 2008, §4; Wald 2007 for
//! the binning]. Leaves are sets of at most `leaf_size` primitives that are drawn together, so the
//! heuristic counts *blocks* of that size, not primitives. Deterministic for any number of threads.

use super::parts::{Built, Growing, Part, Primitive, bounds_of};
use glam::Vec4;
use rayon::prelude::*;

const BINS: usize = 16;

/// Ranges longer than this are split on several threads.
const PARALLEL: usize = 8192;

/// Primitives that one thread puts into bins at a time.
const CHUNK: usize = 32_768;

/// Builds the tree over `primitives`, which are reordered. `leaf_size` is a power of two. Cost: n log n.
pub(super) fn build(primitives: &mut [Primitive], leaf_size: usize) -> Built {
    Built::from_root((!primitives.is_empty()).then(|| part(primitives, leaf_size)))
}

/// As [`build`], for a list that is not empty and becomes part of a larger tree.
pub(super) fn part(primitives: &mut [Primitive], leaf_size: usize) -> Part {
    debug_assert!(leaf_size.is_power_of_two());
    let bounds = bounds_of(primitives);
    Range { start: 0, primitives, bounds }.into_part(leaf_size)
}

/// Consecutive primitives, and where they begin among their node's.
struct Range<'a> {
    start: usize,
    primitives: &'a mut [Primitive],
    bounds: Growing,
}

impl Range<'_> {
    fn into_part(self, leaf_size: usize) -> Part {
        if self.primitives.len() <= leaf_size {
            return Part::leaf(self.primitives, self.bounds.finish());
        }
        Part::around(parts_of(self.into_sixteen(leaf_size), leaf_size))
    }
}

impl<'a> Range<'a> {
    /// At most sixteen ranges, in their order.
    fn into_sixteen(self, leaf_size: usize) -> Vec<Range<'a>> {
        let mut ranges = Vec::with_capacity(16);
        ranges.push((self.bounds.half_area(), self));
        while ranges.len() < 16 {
            let largest = ranges
                .iter()
                .enumerate()
                .filter(|(_, (_, r))| r.primitives.len() > leaf_size)
                .max_by(|(i, a), (j, b)| a.0.total_cmp(&b.0).then(j.cmp(i)));
            let Some((at, _)) = largest else { break };
            for half in ranges.swap_remove(at).1.split(leaf_size) {
                ranges.push((half.bounds.half_area(), half));
            }
        }
        ranges.sort_unstable_by_key(|(_, r)| r.start);
        ranges.into_iter().map(|(_, r)| r).collect()
    }

    /// Splits a range of at least two primitives in two that are not empty.
    fn split(self, leaf_size: usize) -> [Range<'a>; 2] {
        let (middle, bounds) = match best_plane(self.primitives, leaf_size) {
            Some((plane, bounds)) => (partition(self.primitives, |p| plane.is_before(p)), bounds),
            None => {
                // All centres coincide, or nothing tells the halves apart: cut the list.
                let n = self.primitives.len();
                let middle = (n / 2).next_multiple_of(leaf_size).min(n - 1);
                let (left, right) = self.primitives.split_at(middle);
                (middle, [bounds_of(left), bounds_of(right)])
            }
        };
        let (left, right) = self.primitives.split_at_mut(middle);
        [
            Range { start: self.start, primitives: left, bounds: bounds[0] },
            Range { start: self.start + middle, primitives: right, bounds: bounds[1] },
        ]
    }
}

fn parts_of(mut ranges: Vec<Range>, leaf_size: usize) -> Vec<Part> {
    let work: usize = ranges.iter().map(|r| r.primitives.len()).sum();
    if ranges.len() > 1 && work > PARALLEL {
        // Halves of about equal work.
        let mut sum = 0;
        let middle = ranges
            .iter()
            .position(|r| {
                sum += r.primitives.len();
                sum * 2 >= work
            })
            .map_or(1, |i| (i + 1).min(ranges.len() - 1));
        let right = ranges.split_off(middle);
        let (mut left, right) = rayon::join(|| parts_of(ranges, leaf_size), || parts_of(right, leaf_size));
        left.extend(right);
        return left;
    }
    ranges.into_iter().map(|range| range.into_part(leaf_size)).collect()
}

/// Which bin a centre falls into, on each axis.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec4,
    /// Bins a unit; 0 on an axis along which centres do not differ, or by more or less than f32 can say.
    scale: Vec4,
}

impl Binning {
    fn over(centers: &Growing) -> Binning {
        let scale = (centers.high - centers.low).to_array().map(|extent| {
            let scale = BINS as f32 / extent;
            if scale.is_finite() { scale } else { 0.0 }
        });
        Binning { origin: centers.low, scale: Vec4::from_array(scale) }
    }

    #[inline(always)]
    fn bins_of(&self, p: &Primitive) -> [usize; 3] {
        let at = (p.center() - self.origin) * self.scale - 0.5;
        let bits = (at.min(Vec4::splat(LAST)) + ROUND).to_array();
        [0, 1, 2].map(|axis| bits[axis].to_bits() as usize % BINS)
    }

    /// The same for one axis, with the same operations.
    #[inline(always)]
    fn bin_of(&self, p: &Primitive, axis: usize) -> usize {
        let at = (p.center_along(axis) - self.origin[axis]) * self.scale[axis] - 0.5;
        let at = if at < LAST { at } else { LAST };
        (at + ROUND).to_bits() as usize % BINS
    }
}

/// Adding this rounds to a whole number and leaves it in the low bits.
const ROUND: f32 = 12_582_912.0; // 1.5 · 2²³

/// The last bin. Where an extent is beyond f32 a place may be no number; it then counts as this.
const LAST: f32 = (BINS - 1) as f32;

/// The boundary before bin `bin` of an axis.
struct Plane {
    binning: Binning,
    axis: usize,
    bin: usize,
}

impl Plane {
    #[inline(always)]
    fn is_before(&self, p: &Primitive) -> bool {
        self.binning.bin_of(p, self.axis) < self.bin
    }
}

#[derive(Clone)]
struct Bins {
    bounds: [[Growing; BINS]; 3],
    count: [[u32; BINS]; 3],
}

impl Bins {
    const EMPTY: Bins = Bins { bounds: [[Growing::EMPTY; BINS]; 3], count: [[0; BINS]; 3] };

    fn add(&mut self, primitives: &[Primitive], binning: &Binning) {
        for p in primitives {
            let bins = binning.bins_of(p);
            let bounds = Growing::around(p);
            for (axis, bin) in bins.into_iter().enumerate() {
                self.bounds[axis][bin] = self.bounds[axis][bin].union(&bounds);
                self.count[axis][bin] += 1;
            }
        }
    }

    fn merged(mut self, other: &Bins) -> Bins {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.bounds[axis][bin] = self.bounds[axis][bin].union(&other.bounds[axis][bin]);
                self.count[axis][bin] += other.count[axis][bin];
            }
        }
        self
    }
}

/// The cheapest plane and the bounds of what lies on either side; `None` if no plane separates anything.
fn best_plane(primitives: &[Primitive], leaf_size: usize) -> Option<(Plane, [Growing; 2])> {
    let binning = Binning::over(&centers_of(primitives));
    let mut bins = Bins::EMPTY;
    if primitives.len() > 2 * CHUNK {
        // What the chunks' bins come to does not depend on who fills them.
        let parts: Vec<Bins> = primitives
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut bins = Bins::EMPTY;
                bins.add(chunk, &binning);
                bins
            })
            .collect();
        bins = parts.iter().fold(bins, Bins::merged);
    } else {
        bins.add(primitives, &binning);
    }
    let mut best: Option<Split> = None;
    for axis in (0..3).filter(|&axis| binning.scale[axis] > 0.0) {
        best = cheaper_split(&bins, axis, leaf_size, best);
    }
    best.map(|b| (Plane { binning, axis: b.axis, bin: b.bin }, b.bounds))
}

fn centers_of(primitives: &[Primitive]) -> Growing {
    let around = |chunk: &[Primitive]| {
        chunk.iter().fold(Growing::EMPTY, |b, p| b.union(&Growing::of_point(p.center())))
    };
    if primitives.len() > 2 * CHUNK {
        let parts: Vec<Growing> = primitives.par_chunks(CHUNK).map(around).collect();
        return parts.iter().fold(Growing::EMPTY, |b, p| b.union(p));
    }
    around(primitives)
}

struct Split {
    cost: f64,
    axis: usize,
    bin: usize,
    bounds: [Growing; 2],
}

/// `best`, or a cheaper split along `axis`: surface times number of leaves, summed over both sides.
fn cheaper_split(bins: &Bins, axis: usize, leaf_size: usize, mut best: Option<Split>) -> Option<Split> {
    let (bounds, count) = (&bins.bounds[axis], &bins.count[axis]);
    let shift = leaf_size.trailing_zeros();
    let cost = |b: &Growing, n: u32| b.half_area() * f64::from((n + leaf_size as u32 - 1) >> shift);
    let mut right = [(f64::INFINITY, Growing::EMPTY); BINS];
    let mut sum = (Growing::EMPTY, 0);
    for i in (1..BINS).rev() {
        if count[i] > 0 {
            sum = (sum.0.union(&bounds[i]), sum.1 + count[i]);
            // Where a bin is empty the next boundary is the same split.
            right[i] = (cost(&sum.0, sum.1), sum.0);
        }
    }
    let mut left = (Growing::EMPTY, 0);
    for i in 1..BINS {
        if count[i - 1] > 0 {
            left = (left.0.union(&bounds[i - 1]), left.1 + count[i - 1]);
        }
        if left.1 == 0 || right[i].0 == f64::INFINITY {
            continue;
        }
        let total = cost(&left.0, left.1) + right[i].0;
        if best.as_ref().is_none_or(|b| total < b.cost) {
            best = Some(Split { cost: total, axis, bin: i, bounds: [left.0, right[i].1] });
        }
    }
    best
}

/// Moves what satisfies `first` to the front and returns how many do.
#[inline(always)]
fn partition(range: &mut [Primitive], first: impl Fn(&Primitive) -> bool) -> usize {
    let mut front = 0;
    for i in 0..range.len() {
        // Always a swap: which way it goes cannot be foreseen, and a branch would be guessed wrongly.
        let before = first(&range[i]);
        range.swap(i, front);
        front += usize::from(before);
    }
    front
}
