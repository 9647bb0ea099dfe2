//! A 16-wide tree of boxes: one flat array of nodes, whatever built it.
//!
//! A node holds its children's boxes as a structure of arrays, ready for one SIMD test. Boxes are f32,
//! rounded outwards. A child is another node or a leaf; what a leaf number means is up to the owner (a
//! block of triangles, an instance). Depth-first layout: children come after their parent.

use crate::geometry::Aabb;
use glam::DVec3;

/// What a slot of a node refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Child {
    Node(u32),
    Leaf(u32),
}

/// A [`Child`] in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot(u32);

impl Slot {
    const LEAF: u32 = 1 << 31;
    pub const EMPTY: Slot = Slot(u32::MAX);

    pub fn node(index: usize) -> Slot {
        assert!(index < 1 << 27, "a tree has fewer than 2^27 nodes");
        Slot(index as u32)
    }

    pub fn leaf(index: usize) -> Slot {
        assert!(index < Slot::LEAF as usize - 1, "a tree has fewer than 2^31 leaves");
        Slot(index as u32 | Slot::LEAF)
    }

    #[inline(always)]
    pub fn child(self) -> Child {
        if self.0 & Slot::LEAF != 0 { Child::Leaf(self.0 & !Slot::LEAF) } else { Child::Node(self.0) }
    }
}

/// Sixteen boxes and what they hold. Slots `0..used` are in use, in any order; a slot in use may be
/// vacant (`Slot::EMPTY`, empty box).
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct WideNode {
    pub min: [[f32; 16]; 3],
    pub max: [[f32; 16]; 3],
    pub child: [Slot; 16],
    pub used: u32,
}

impl WideNode {
    pub const EMPTY: WideNode = WideNode {
        min: [[f32::INFINITY; 16]; 3],
        max: [[f32::NEG_INFINITY; 16]; 3],
        child: [Slot::EMPTY; 16],
        used: 0,
    };

    pub fn push(&mut self, bounds: &Box3, child: Slot) -> usize {
        let slot = self.used as usize;
        self.used += 1;
        self.set(slot, bounds, child);
        slot
    }

    pub fn set(&mut self, slot: usize, bounds: &Box3, child: Slot) {
        for axis in 0..3 {
            self.min[axis][slot] = bounds.min[axis];
            self.max[axis][slot] = bounds.max[axis];
        }
        self.child[slot] = child;
    }

    pub fn bounds_of(&self, slot: usize) -> Box3 {
        Box3 { min: self.min.map(|a| a[slot]), max: self.max.map(|a| a[slot]) }
    }

    pub fn bounds(&self) -> Box3 {
        (0..self.used as usize).fold(Box3::EMPTY, |b, s| b.union(&self.bounds_of(s)))
    }
}

/// A box in f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Box3 {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

impl Box3 {
    pub const EMPTY: Box3 = Box3 { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// The box rounded outwards to f32. Beyond f32 it ends at the largest number; one that is no box reaches
    /// everywhere.
    pub fn around(b: &Aabb) -> Box3 {
        if b.is_empty() {
            return Box3::EMPTY;
        }
        let down = |v: f64| match v as f32 {
            n if n.is_nan() => f32::MIN,
            n if f64::from(n) > v => n.next_down(),
            n => n,
        };
        let up = |v: f64| match v as f32 {
            n if n.is_nan() => f32::MAX,
            n if f64::from(n) < v => n.next_up(),
            n => n,
        };
        Box3 {
            min: b.min.to_array().map(|v| down(v).clamp(f32::MIN, f32::MAX)),
            max: b.max.to_array().map(|v| up(v).clamp(f32::MIN, f32::MAX)),
        }
    }

    /// The same about another origin.
    pub fn about(b: &Aabb, origin: DVec3) -> Box3 {
        if origin == DVec3::ZERO || b.is_empty() {
            return Box3::around(b);
        }
        // Differences are rounded to the nearest.
        let min = (b.min - origin).to_array().map(f64::next_down);
        let max = (b.max - origin).to_array().map(f64::next_up);
        Box3::around(&Aabb { min: min.into(), max: max.into() })
    }

    pub fn to_aabb(self) -> Aabb {
        let v = |p: [f32; 3]| DVec3::new(p[0].into(), p[1].into(), p[2].into());
        Aabb { min: v(self.min), max: v(self.max) }
    }

    #[inline(always)]
    pub fn union(&self, o: &Box3) -> Box3 {
        // Written out: closures over arrays are not always inlined here.
        let (a, b) = (self, o);
        Box3 {
            min: [a.min[0].min(b.min[0]), a.min[1].min(b.min[1]), a.min[2].min(b.min[2])],
            max: [a.max[0].max(b.max[0]), a.max[1].max(b.max[1]), a.max[2].max(b.max[2])],
        }
    }

    pub fn is_empty(&self) -> bool {
        (0..3).any(|i| self.min[i] > self.max[i])
    }

    pub fn contains(&self, o: &Box3) -> bool {
        o.is_empty() || (0..3).all(|i| self.min[i] <= o.min[i] && self.max[i] >= o.max[i])
    }

    /// Half the surface area; f64, so that no extent overflows.
    #[inline(always)]
    pub fn half_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|i| f64::from(self.max[i]) - f64::from(self.min[i]));
        x * y + y * z + z * x
    }

    /// Largest coordinate magnitudes.
    pub fn reach(&self) -> [f64; 3] {
        std::array::from_fn(|i| f64::from(self.min[i].abs().max(self.max[i].abs())))
    }
}

/// The nodes of a tree; node 0 is the root. Empty if there is nothing in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideTree {
    pub nodes: Vec<WideNode>,
}

impl WideTree {
    pub fn bounds(&self) -> Box3 {
        self.nodes.first().map_or(Box3::EMPTY, WideNode::bounds)
    }

    /// Asserts that every leaf number below `leaves` occurs once, every node is reached once from the root,
    /// and every slot's box contains what lies below it.
    pub fn validate(&self, leaves: usize, bounds_of_leaf: impl Fn(usize) -> Box3) {
        let mut seen = vec![false; leaves];
        let mut reached = vec![false; self.nodes.len()];
        if let Some(root) = reached.first_mut() {
            *root = true;
        }
        for (n, node) in self.nodes.iter().enumerate() {
            assert!(node.used <= 16, "node {n} has {} slots", node.used);
            assert!(reached[n], "node {n} is not below the root, or comes before its parent");
            for slot in (0..node.used as usize).filter(|&s| node.child[s] != Slot::EMPTY) {
                let inner = match node.child[slot].child() {
                    Child::Leaf(leaf) => {
                        let leaf = leaf as usize;
                        assert!(!seen[leaf], "leaf {leaf} has two parents");
                        seen[leaf] = true;
                        bounds_of_leaf(leaf)
                    }
                    Child::Node(child) => {
                        assert!(child as usize > n, "node {child} comes before its parent {n}");
                        assert!(!reached[child as usize], "node {child} has two parents");
                        reached[child as usize] = true;
                        self.nodes[child as usize].bounds()
                    }
                };
                assert!(node.bounds_of(slot).contains(&inner), "slot {slot} of node {n} is too small");
            }
        }
        assert!(seen.iter().all(|&s| s), "a leaf is nowhere in the tree");
    }
}
