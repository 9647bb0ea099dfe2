//! Building a 16-wide bounding volume hierarchy: binned surface-area heuristic, top down, then the cut into wide nodes
//! that costs least.
//!
//! A range of primitives is split in two again and again until its parts are leaves [Wald 2007 for the binning]. Leaves
//! are sets of at most `leaf_size` primitives that are drawn together, so the heuristic counts *blocks* of that size,
//! not primitives. Of the halvings those become nodes of sixteen slots whose surfaces together are least, as a node
//! costs the same however few of its slots are used [Ylitie, Karras & Laine 2017]: for each range and number of slots,
//! what its own halves cost with so many between them. Deterministic for any number of threads.

use super::parts::{Built, Growing, Part, Primitive, bounds_of};
use super::tree::Box3;
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
    let (halved, _) = Range { primitives, bounds }.halved(leaf_size);
    let mut parts = Vec::with_capacity(1);
    halved.into_slots(1, &mut parts);
    parts.remove(0)
}

/// A range of primitives.
struct Range<'a> {
    primitives: &'a mut [Primitive],
    bounds: Growing,
}

impl<'a> Range<'a> {
    /// The range halved down to leaves, and what it costs in from one to sixteen slots: the surfaces of the nodes.
    fn halved(self, leaf_size: usize) -> (Halved, Costs) {
        if self.primitives.len() <= leaf_size {
            // There are as many leaves, and as large, whatever holds them.
            return (Halved::Leaf(Part::leaf(self.primitives, self.bounds.finish())), [0.0; 16]);
        }
        let (parallel, bounds) = (self.primitives.len() > PARALLEL, self.bounds.finish());
        let [left, right] = self.split(leaf_size);
        let ((left, of_left), (right, of_right)) = match parallel {
            true => rayon::join(|| left.halved(leaf_size), || right.halved(leaf_size)),
            false => (left.halved(leaf_size), right.halved(leaf_size)),
        };
        let (mut to_left, mut costs) = cheapest_shares(&of_left, &of_right);
        let (as_node, of_sixteen) = (costs[15] + bounds.half_area(), to_left[15]);
        for (to_left, cost) in to_left.iter_mut().zip(&mut costs) {
            if as_node < *cost {
                (*to_left, *cost) = (0, as_node);
            }
        }
        (Halved::Inner { bounds, to_left, of_sixteen, halves: Box::new([left, right]) }, costs)
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
        [Range { primitives: left, bounds: bounds[0] }, Range { primitives: right, bounds: bounds[1] }]
    }
}

/// What a range costs in at most so many slots and one more.
type Costs = [f64; 16];

/// A range's halves, and their halves, down to leaves.
enum Halved {
    Leaf(Part),
    Inner {
        bounds: Box3,
        /// How many of so many slots and one more go to the first half; none where all are best put into a node.
        to_left: [u8; 16],
        /// How many of a node's own slots go to its first half.
        of_sixteen: u8,
        halves: Box<[Halved; 2]>,
    },
}

impl Halved {
    /// Puts what takes up `slots` of a node into its parts.
    fn into_slots(self, slots: u8, parts: &mut Vec<Part>) {
        match self {
            Halved::Leaf(leaf) => parts.push(leaf),
            Halved::Inner { bounds, to_left, of_sixteen, halves } => {
                let to_left = to_left[usize::from(slots) - 1];
                let [left, right] = *halves;
                if to_left > 0 {
                    left.into_slots(to_left, parts);
                    right.into_slots(slots - to_left, parts);
                } else {
                    let mut inner = Vec::with_capacity(16);
                    left.into_slots(of_sixteen, &mut inner);
                    right.into_slots(16 - of_sixteen, &mut inner);
                    parts.push(Part::Node { bounds, parts: inner });
                }
            }
        }
    }
}

/// How many slots the first of two halves is best given of each number, and what both cost then. One slot is not
/// enough.
fn cheapest_shares(left: &Costs, right: &Costs) -> ([u8; 16], Costs) {
    let (mut to_left, mut costs) = ([0; 16], [f64::INFINITY; 16]);
    for slots in 2..17 {
        for share in 1..slots {
            let cost = left[share - 1] + right[slots - share - 1];
            if cost < costs[slots - 1] {
                (to_left[slots - 1], costs[slots - 1]) = (share as u8, cost);
            }
        }
    }
    (to_left, costs)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::trouble::Random;
    use glam::Vec3;

    fn surfaces_of_nodes(part: &Part) -> f64 {
        match part {
            Part::Leaf { .. } => 0.0,
            Part::Node { bounds, parts } => {
                assert!((2..=16).contains(&parts.len()));
                bounds.half_area() + parts.iter().map(surfaces_of_nodes).sum::<f64>()
            }
        }
    }

    /// The same of a cut into wide nodes that opens the largest half first.
    fn surfaces_opening_the_largest(halved: &Halved) -> f64 {
        let area = |h: &&Halved| match h {
            Halved::Leaf(_) => -1.0,
            Halved::Inner { bounds, .. } => bounds.half_area(),
        };
        if area(&halved) < 0.0 {
            return 0.0;
        }
        let mut open = vec![halved];
        while open.len() < 16 {
            open.sort_by(|a, b| area(a).total_cmp(&area(b)));
            let Some(Halved::Inner { halves, .. }) = open.pop_if(|h| area(&&**h) >= 0.0) else { break };
            open.extend(halves.iter());
        }
        area(&halved) + open.into_iter().map(surfaces_opening_the_largest).sum::<f64>()
    }

    #[test]
    fn nodes_have_the_surfaces_that_were_promised_and_less_than_by_opening_the_largest_first() {
        let random = &mut Random::new(9);
        let mut less = 0;
        for _ in 0..300 {
            let mut point = || Vec3::from_array([(); 3].map(|()| random.between(-1.0, 1.0) as f32));
            let mut primitives: Vec<Primitive> = (0..200)
                .map(|i| {
                    let (at, size) = (point(), point().abs() * 0.1);
                    Primitive::new(at - size, at + size, i)
                })
                .collect();
            let leaf_size = [1, 4, 16][random.below(3) as usize];
            let primitives = &mut primitives[..1 + random.below(200) as usize];
            let bounds = bounds_of(primitives);
            let (halved, costs) = Range { primitives, bounds }.halved(leaf_size);
            let greedy = surfaces_opening_the_largest(&halved);
            let mut parts = Vec::new();
            halved.into_slots(1, &mut parts);
            assert_eq!(parts.len(), 1);
            let surfaces = surfaces_of_nodes(&parts[0]);
            assert!((surfaces - costs[0]).abs() <= costs[0] * 1e-12, "{surfaces} {costs:?}");
            assert!(surfaces <= greedy * (1.0 + 1e-12), "{surfaces} {greedy}");
            less += u32::from(surfaces < greedy * 0.9);
        }
        assert!(less > 30, "{less}");
    }

    /// How many nodes lie below each other.
    fn depth(part: &Part) -> usize {
        match part {
            Part::Leaf { .. } => 0,
            Part::Node { parts, .. } => 1 + parts.iter().map(depth).max().unwrap_or(0),
        }
    }

    #[test]
    fn lopsided_halves_are_no_deeper_than_a_small_stack() {
        // Ever smaller steps along each axis, and boxes that hold nearly the same: each cut takes off a little.
        let steps = (0..120_000u32).map(|i| {
            let at = Vec3::from([0, 1, 2].map(|axis| (-((i + axis * 83) as f32 % 250.0) / 2.0).exp2()));
            Primitive::new(at, at, i)
        });
        let alike = (0..120_000u32).map(|i| {
            let at = Vec3::splat(i as f32 * 1e-3);
            Primitive::new(at - 1e9, at + 1e9, i)
        });
        let small = rayon::ThreadPoolBuilder::new().stack_size(1 << 19).build().unwrap();
        for mut primitives in [steps.collect::<Vec<_>>(), alike.collect()] {
            let deep = small.install(|| depth(&part(&mut primitives, 1)));
            assert!((2..200).contains(&deep), "{deep}");
        }
    }
}
