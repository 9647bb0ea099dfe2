//! In what order: whole parts, front to back, from frame to frame.
//!
//! Part A *occludes* B if a ray from the eye meets A and then B. [`VisibilitySort`] keeps an order in which no
//! part is occluded by a later one, and groups the parts for which there is none: the groups are the strongly
//! connected components of the occlusion graph [Snyder & Lengyel, *Visibility Sorting and Compositing for
//! Image-Based Rendering*, 1997]. Nothing is cut.
//!
//! A part is a union of convex pieces, each a [`Hull`](crate::geometry::Hull) and a pose. That errs on the side
//! of more occlusion: holes are filled, and hulls that touch occlude each other. What is known better can be
//! said ([`Known`]).
//!
//! Only the eye's position counts, not where it looks: the order holds all around.

mod condition;
mod extents;
mod faces;
mod graph;
mod kd_tree;
mod known;
mod pairs;
mod parts;
mod presplit;
mod seats;
mod sort;
mod split;
#[cfg(test)]
mod tests;

pub use extents::Direction;
pub use known::Known;
pub use parts::{Granularity, Part, Parts, PartsError, Shapes};
pub use presplit::{PreSplit, split_nodes};
pub use sort::VisibilitySort;
pub use split::{Seam, SplitBy, SplitMesh, split};

/// What may be chosen about a sort.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SortOptions {
    /// Widens every part by this angle, radians, and by this share of its distance. With half a pixel's angle, or
    /// less, the order holds for pictures whose edges are rounded to fractions of a pixel. 0 is exact.
    pub slack: f64,
    /// Start from the last order; without it each frame starts from the order by distance.
    pub incremental: bool,
    /// Move what is near up in the order where it may, [Snyder & Lengyel 1997, §7].
    pub conditioning: bool,
    /// How possible occluders are found. The order is the same, up to what it leaves open.
    pub broad_phase: BroadPhase,
}

/// How possible occluders are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BroadPhase {
    /// Grids on the faces of a cube around the eye, made anew each frame.
    #[default]
    Grids,
    /// By depth along the faces' axes alone, with directions compared afterwards: what grids gain.
    Depth,
    /// A kd-tree over two angles and a depth, rebalanced from frame to frame, [Snyder & Lengyel 1997, §5.2]. Slack
    /// is not in it: 0 only.
    KdTree,
}

impl Default for SortOptions {
    fn default() -> Self {
        SortOptions { slack: 0.0, incremental: true, conditioning: true, broad_phase: BroadPhase::Grids }
    }
}

/// Parts front to back. A group of several is a cycle of occlusion, nearest centre first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Order {
    parts: Vec<u32>,
    /// Where each group ends.
    ends: Vec<u32>,
}

impl Order {
    /// The groups, front to back; none is empty.
    pub fn groups(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(from, &to)| &self.parts[from as usize..to as usize])
    }

    /// All parts, front to back.
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    fn clear(&mut self) {
        self.parts.clear();
        self.ends.clear();
    }
}

/// What a sort did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Parts in the order.
    pub parts: u64,
    /// Extents found, one a piece and face of the cube around the eye.
    pub extents: u64,
    /// Cells of the grids, and entries in their lists.
    pub cells: u64,
    /// Entries in the cells' lists.
    pub cell_entries: u64,
    /// Pairs whose extents allow occlusion, among parts that were not out yet.
    pub candidates: u64,
    /// Of these, tested exactly.
    pub exact_tests: u64,
    /// Of these, found to occlude.
    pub arcs_found: u64,
    /// Groups of more than one part.
    pub groups: u64,
    /// Parts in such groups.
    pub grouped_parts: u64,
    /// Parts in the largest.
    pub largest_group: u64,
    /// Groups that the conditioning sort moved up.
    pub moved_up: u64,
}
