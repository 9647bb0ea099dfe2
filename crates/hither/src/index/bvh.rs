//! Building a 16-wide bounding volume hierarchy: binned surface-area heuristic, top down.
//!
//! A wide node is made by splitting its range in two again and again, the part with the largest surface
//! first, until there are sixteen parts or all are leaves [Wald, Benthin & Boulos 2008, §4; Wald 2007 for
//! the binning]. Leaves are sets of at most `leaf_size` primitives that are drawn together, so the
//! heuristic counts *blocks* of that size, not primitives. Deterministic for any number of threads.

use super::tree::{Box3, Slot, WideNode, WideTree};

/// A primitive to be placed: its box and its number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    pub bounds: Box3,
    pub index: u32,
}

impl Primitive {
    /// Twice the box's centre along an axis.
    #[inline(always)]
    fn center2(&self, axis: usize) -> f32 {
        self.bounds.min[axis] * 0.5 + self.bounds.max[axis] * 0.5
    }
}

/// A tree and, for each of its leaves, the numbers of the primitives in it.
pub(super) struct Built {
    pub tree: WideTree,
    pub order: Vec<u32>,
    /// `order[leaf_start[i]..leaf_start[i + 1]]` is leaf i.
    pub leaf_start: Vec<u32>,
}

const BINS: usize = 16;

/// Ranges longer than this are split on two threads.
const PARALLEL: usize = 8192;

enum Part {
    Leaf { bounds: Box3, primitives: Vec<u32> },
    Node { bounds: Box3, parts: Vec<Part> },
}

impl Part {
    fn bounds(&self) -> &Box3 {
        match self {
            Part::Leaf { bounds, .. } | Part::Node { bounds, .. } => bounds,
        }
    }
}

/// Builds the tree over `primitives`, which are reordered. Cost: n log n.
pub(super) fn build(primitives: &mut [Primitive], leaf_size: usize) -> Built {
    let mut built = Built { tree: WideTree::default(), order: Vec::new(), leaf_start: vec![0] };
    if primitives.is_empty() {
        return built;
    }
    built.order.reserve(primitives.len());
    let bounds = bounds_of(primitives);
    let root = if primitives.len() <= leaf_size {
        Part::Node { bounds, parts: vec![leaf(primitives, bounds)] }
    } else {
        node(primitives, bounds, leaf_size)
    };
    flatten(root, &mut built);
    built
}

fn bounds_of(primitives: &[Primitive]) -> Box3 {
    primitives.iter().fold(Box3::EMPTY, |b, p| b.union(&p.bounds))
}

fn leaf(primitives: &[Primitive], bounds: Box3) -> Part {
    Part::Leaf { bounds, primitives: primitives.iter().map(|p| p.index).collect() }
}

fn node(primitives: &mut [Primitive], bounds: Box3, leaf_size: usize) -> Part {
    let mut ranges: Vec<(&mut [Primitive], Box3)> = vec![(primitives, bounds)];
    while ranges.len() < 16 {
        let largest = ranges
            .iter()
            .enumerate()
            .filter(|(_, r)| r.0.len() > leaf_size)
            .max_by(|(i, a), (j, b)| a.1.half_area().total_cmp(&b.1.half_area()).then(j.cmp(i)));
        let Some((at, _)) = largest else { break };
        let (range, bounds) = ranges.swap_remove(at);
        let (left, right) = split(range, &bounds, leaf_size);
        ranges.push(left);
        ranges.push(right);
    }
    let parts = parts_of(ranges, leaf_size);
    Part::Node { bounds, parts }
}

fn parts_of(mut ranges: Vec<(&mut [Primitive], Box3)>, leaf_size: usize) -> Vec<Part> {
    let work: usize = ranges.iter().map(|r| r.0.len()).sum();
    if ranges.len() > 1 && work > PARALLEL {
        // Halves of about equal work.
        let mut sum = 0;
        let middle = ranges
            .iter()
            .position(|r| {
                sum += r.0.len();
                sum * 2 >= work
            })
            .map_or(1, |i| (i + 1).min(ranges.len() - 1));
        let right = ranges.split_off(middle);
        let (mut left, right) = rayon::join(|| parts_of(ranges, leaf_size), || parts_of(right, leaf_size));
        left.extend(right);
        return left;
    }
    ranges
        .into_iter()
        .map(
            |(range, bounds)| {
                if range.len() <= leaf_size { leaf(range, bounds) } else { node(range, bounds, leaf_size) }
            },
        )
        .collect()
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box3,
    count: usize,
}

type Half<'a> = (&'a mut [Primitive], Box3);

/// Splits a range of at least two primitives in two that are not empty.
fn split<'a>(range: &'a mut [Primitive], bounds: &Box3, leaf_size: usize) -> (Half<'a>, Half<'a>) {
    let middle = match best_plane(range, leaf_size) {
        Some((axis, low, scale, bin)) => partition(range, |p| bin_of(p.center2(axis), low, scale) < bin),
        None => {
            // All centres coincide, or nothing tells the halves apart: cut the list.
            (range.len() / 2).next_multiple_of(leaf_size).min(range.len() - 1)
        }
    };
    let _ = bounds;
    let (left, right) = range.split_at_mut(middle);
    let (left_bounds, right_bounds) = (bounds_of(left), bounds_of(right));
    ((left, left_bounds), (right, right_bounds))
}

#[inline(always)]
fn bin_of(center: f32, low: f32, scale: f32) -> usize {
    (((center - low) * scale) as usize).min(BINS - 1)
}

/// Axis, origin and scale of the bins, and the first bin of the right half; `None` if nothing splits.
fn best_plane(range: &[Primitive], leaf_size: usize) -> Option<(usize, f32, f32, usize)> {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for p in range.iter() {
        for axis in 0..3 {
            let c = p.center2(axis);
            low[axis] = low[axis].min(c);
            high[axis] = high[axis].max(c);
        }
    }
    let scale: [f32; 3] = std::array::from_fn(|i| BINS as f32 / (high[i] - low[i]));
    let usable: [bool; 3] =
        std::array::from_fn(|i| high[i] > low[i] && scale[i].is_finite() && scale[i] > 0.0);
    let mut bins = [[Bin { bounds: Box3::EMPTY, count: 0 }; BINS]; 3];
    for p in range.iter() {
        for axis in 0..3 {
            if usable[axis] {
                let bin = &mut bins[axis][bin_of(p.center2(axis), low[axis], scale[axis])];
                bin.count += 1;
                bin.bounds = bin.bounds.union(&p.bounds);
            }
        }
    }
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&a| usable[a]) {
        if let Some((cost, bin)) = best_bin(&bins[axis], leaf_size)
            && best.is_none_or(|b| cost < b.0)
        {
            best = Some((cost, axis, bin));
        }
    }
    best.map(|(_, axis, bin)| (axis, low[axis], scale[axis], bin))
}

fn best_bin(bins: &[Bin; BINS], leaf_size: usize) -> Option<(f64, usize)> {
    let cost = |bounds: &Box3, count: usize| bounds.half_area() * count.div_ceil(leaf_size) as f64;
    let mut right_cost = [0.0; BINS];
    let mut sum = Bin { bounds: Box3::EMPTY, count: 0 };
    for i in (1..BINS).rev() {
        sum = Bin { bounds: sum.bounds.union(&bins[i].bounds), count: sum.count + bins[i].count };
        right_cost[i] = if sum.count > 0 { cost(&sum.bounds, sum.count) } else { f64::INFINITY };
    }
    let mut best: Option<(f64, usize)> = None;
    let mut left = Bin { bounds: Box3::EMPTY, count: 0 };
    for i in 1..BINS {
        left = Bin { bounds: left.bounds.union(&bins[i - 1].bounds), count: left.count + bins[i - 1].count };
        if left.count == 0 || right_cost[i] == f64::INFINITY {
            continue;
        }
        let total = cost(&left.bounds, left.count) + right_cost[i];
        if best.is_none_or(|b| total < b.0) {
            best = Some((total, i));
        }
    }
    best
}

/// Moves what satisfies `first` to the front and returns how many do.
fn partition(range: &mut [Primitive], first: impl Fn(&Primitive) -> bool) -> usize {
    let mut front = 0;
    for i in 0..range.len() {
        if first(&range[i]) {
            range.swap(front, i);
            front += 1;
        }
    }
    front
}

fn flatten(root: Part, built: &mut Built) {
    // (part, where its slot is)
    let mut stack: Vec<(Part, Option<(usize, usize)>)> = vec![(root, None)];
    while let Some((part, place)) = stack.pop() {
        match part {
            Part::Leaf { primitives, .. } => {
                let leaf = built.leaf_start.len() - 1;
                built.order.extend(&primitives);
                built.leaf_start.push(built.order.len() as u32);
                let (node, slot) = place.expect("the root is a node");
                built.tree.nodes[node].child[slot] = Slot::leaf(leaf);
            }
            Part::Node { parts, .. } => {
                let at = built.tree.nodes.len();
                if let Some((node, slot)) = place {
                    built.tree.nodes[node].child[slot] = Slot::node(at);
                }
                let mut wide = WideNode::EMPTY;
                for part in &parts {
                    wide.push(part.bounds(), Slot::EMPTY);
                }
                built.tree.nodes.push(wide);
                stack.extend(parts.into_iter().enumerate().rev().map(|(slot, p)| (p, Some((at, slot)))));
            }
        }
    }
}
