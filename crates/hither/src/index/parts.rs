//! What the builders of trees share: primitives to be placed, nested parts, and the flat array made of them.

use super::tree::{Box3, Slot, WideNode, WideTree};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// A primitive to be placed: its box and its number, in half a cache line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    /// Smallest coordinates, and 0.
    low: Vec4,
    /// Largest coordinates, and the number's bits with [`NORMAL`] set.
    high: Vec4,
}

/// Makes the bits of a number those of a float that is not denormal: arithmetic on those is slow.
const NORMAL: u32 = 1 << 30;

impl Primitive {
    /// `low` and `high` are finite; `index` is below 2³⁰.
    #[inline(always)]
    pub fn new(low: Vec3, high: Vec3, index: u32) -> Primitive {
        assert!(index < NORMAL, "a mesh or group has fewer than 2^30 triangles or instances");
        Primitive { low: low.extend(0.0), high: high.extend(f32::from_bits(index | NORMAL)) }
    }

    pub fn of_box(bounds: &Box3, index: u32) -> Primitive {
        Primitive::new(bounds.min.into(), bounds.max.into(), index)
    }

    #[inline(always)]
    pub fn index(&self) -> u32 {
        self.high.w.to_bits() ^ NORMAL
    }

    pub fn bounds(&self) -> Box3 {
        Box3 { min: self.low.xyz().to_array(), max: self.high.xyz().to_array() }
    }

    /// The box's centre; `w` means nothing. Halves first: the sum of two finite coordinates may not be finite.
    #[inline(always)]
    pub fn center(&self) -> Vec4 {
        self.low * 0.5 + self.high * 0.5
    }

    /// One coordinate of [`Primitive::center`].
    #[inline(always)]
    pub fn center_along(&self, axis: usize) -> f32 {
        self.low[axis] * 0.5 + self.high[axis] * 0.5
    }
}

/// A box that grows, in vector registers; `w` means nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growing {
    pub low: Vec4,
    pub high: Vec4,
}

impl Growing {
    pub const EMPTY: Growing = Growing { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    #[inline(always)]
    pub fn around(p: &Primitive) -> Growing {
        Growing { low: p.low, high: p.high }
    }

    #[inline(always)]
    pub fn of_point(p: Vec4) -> Growing {
        Growing { low: p, high: p }
    }

    #[inline(always)]
    pub fn union(&self, o: &Growing) -> Growing {
        Growing { low: self.low.min(o.low), high: self.high.max(o.high) }
    }

    /// Half the surface area; f64, so that no extent overflows. Meaningless for an empty box.
    #[inline(always)]
    pub fn half_area(&self) -> f64 {
        self.finish().half_area()
    }

    pub fn finish(&self) -> Box3 {
        Box3 { min: self.low.xyz().to_array(), max: self.high.xyz().to_array() }
    }
}

pub(super) fn bounds_of(primitives: &[Primitive]) -> Growing {
    primitives.iter().fold(Growing::EMPTY, |b, p| b.union(&Growing::around(p)))
}

/// A tree before it is laid out: at most sixteen parts a node.
pub(super) enum Part {
    Leaf { bounds: Box3, primitives: Vec<u32> },
    Node { bounds: Box3, parts: Vec<Part> },
}

impl Part {
    pub fn bounds(&self) -> &Box3 {
        match self {
            Part::Leaf { bounds, .. } | Part::Node { bounds, .. } => bounds,
        }
    }

    pub fn leaf(primitives: &[Primitive], bounds: Box3) -> Part {
        Part::Leaf { bounds, primitives: primitives.iter().map(Primitive::index).collect() }
    }

    /// What holds `parts`, from one to sixteen. Where slots are free, small inner nodes give way to their
    /// own parts: half-empty nodes are tested at the cost of full ones.
    pub fn around(mut parts: Vec<Part>) -> Part {
        loop {
            let room = 17 - parts.len();
            let smallest = (0..parts.len())
                .filter_map(|i| match &parts[i] {
                    Part::Node { parts, .. } if parts.len() <= room => Some((parts.len(), i)),
                    _ => None,
                })
                .min();
            let Some((_, at)) = smallest else { break };
            if let Part::Node { parts: inner, .. } = parts.swap_remove(at) {
                parts.extend(inner);
            }
        }
        if parts.len() == 1 {
            return parts.remove(0);
        }
        let bounds = parts.iter().fold(Box3::EMPTY, |b, p| b.union(p.bounds()));
        Part::Node { bounds, parts }
    }
}

/// A tree and, for each of its leaves, the numbers of the primitives in it.
#[derive(Default)]
pub(super) struct Built {
    pub tree: WideTree,
    pub order: Vec<u32>,
    /// `order[leaf_start[i]..leaf_start[i + 1]]` is leaf i.
    pub leaf_start: Vec<u32>,
}

impl Built {
    /// Lays `root` out depth-first; `None` is a tree with nothing in it.
    pub fn from_root(root: Option<Part>) -> Built {
        let mut built = Built { leaf_start: vec![0], ..Built::default() };
        match root {
            Some(Part::Node { parts, .. }) => built.push_all(parts),
            Some(leaf) => built.push_all(vec![leaf]),
            None => {}
        }
        built
    }

    fn push_all(&mut self, roots: Vec<Part>) {
        let mut stack = Vec::new();
        self.push_node(roots, &mut stack);
        while let Some((part, node, slot)) = stack.pop() {
            let at = match part {
                Part::Leaf { primitives, .. } => {
                    self.order.extend(&primitives);
                    self.leaf_start.push(self.order.len() as u32);
                    Slot::leaf(self.leaf_start.len() - 2)
                }
                Part::Node { parts, .. } => {
                    let at = Slot::node(self.tree.nodes.len());
                    self.push_node(parts, &mut stack);
                    at
                }
            };
            self.tree.nodes[node].child[slot] = at;
        }
    }

    /// Adds a node whose slots are still to be filled by what it puts on the stack: (part, node, slot).
    fn push_node(&mut self, parts: Vec<Part>, stack: &mut Vec<(Part, usize, usize)>) {
        let at = self.tree.nodes.len();
        let mut wide = WideNode::EMPTY;
        for part in &parts {
            wide.push(part.bounds(), Slot::EMPTY);
        }
        self.tree.nodes.push(wide);
        stack.extend(parts.into_iter().enumerate().rev().map(|(slot, part)| (part, at, slot)));
    }
}
