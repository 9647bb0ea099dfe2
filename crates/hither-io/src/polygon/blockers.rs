//! The corners that may block an ear, in a k-d tree that asks for those in a triangle [Bentley 1975].
//!
//! The tree is built once and its corners only leave it; corners that come later, which is rare, are in a list. Long
//! thin triangles are what ears of combs and coasts are, and their boxes hold everything: so a box of the tree is
//! passed over, too, where it lies beyond a side of the triangle, with a bound on the rounding.

use robust::Coord;

/// Up to so many corners are looked at one by one.
const LEAF: usize = 8;

/// Of a corner that is not in the tree.
const OUTSIDE: u32 = u32::MAX;

/// The corners that block.
#[derive(Debug, Default)]
pub(super) struct Blockers {
    /// By corner.
    blocks: Vec<bool>,
    /// The tree's corners; each node has a part of them, its children the halves of it.
    order: Vec<u32>,
    /// By corner its place in `order`, or [`OUTSIDE`].
    place: Vec<u32>,
    /// The root is 1, the children of `n` are `2 n` and `2 n + 1`.
    nodes: Vec<Node>,
    late: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: [f64; 2],
    max: [f64; 2],
    /// Corners in it that block still.
    left: u32,
}

const EMPTY: Node = Node { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2], left: 0 };

impl Blockers {
    /// None, of so many corners.
    pub(super) fn clear(&mut self, corners: usize) {
        self.blocks.clear();
        self.blocks.resize(corners, false);
        self.place.clear();
        self.place.resize(corners, OUTSIDE);
        self.order.clear();
        self.late.clear();
    }

    /// One more, before [`Blockers::build`].
    pub(super) fn add(&mut self, corner: u32) {
        self.blocks[corner as usize] = true;
        self.order.push(corner);
    }

    /// One more, after.
    pub(super) fn add_late(&mut self, corner: u32) {
        self.blocks[corner as usize] = true;
        let place = self.place[corner as usize];
        if place == OUTSIDE {
            // One that was there before may be there twice then, which does no harm.
            self.late.push(corner);
        } else {
            self.on_path(place, |node| node.left += 1);
        }
    }

    /// Whether `corner` blocks.
    pub(super) fn contains(&self, corner: u32) -> bool {
        self.blocks[corner as usize]
    }

    /// `corner` does not block, or no longer.
    pub(super) fn remove(&mut self, corner: u32) {
        let was = std::mem::replace(&mut self.blocks[corner as usize], false);
        let place = self.place[corner as usize];
        if was && place != OUTSIDE {
            self.on_path(place, |node| node.left -= 1);
        }
    }

    /// Makes the tree of what was added.
    pub(super) fn build(&mut self, points: &[Coord<f64>]) {
        let leaves = self.order.len().div_ceil(LEAF).next_power_of_two();
        self.nodes.clear();
        self.nodes.resize(2 * leaves, EMPTY);
        fill(&mut self.nodes, 1, &mut self.order, points);
        for (place, &corner) in (0..).zip(&self.order) {
            self.place[corner as usize] = place;
        }
    }

    /// Changes all nodes that hold a place.
    fn on_path(&mut self, place: u32, change: impl Fn(&mut Node)) {
        let (mut node, mut first, mut length) = (1, 0, self.order.len());
        while node < self.nodes.len() {
            change(&mut self.nodes[node]);
            let half = length / 2;
            node *= 2;
            if (place as usize) < first + half {
                length = half;
            } else {
                (node, first, length) = (node + 1, first + half, length - half);
            }
        }
    }

    /// A corner that blocks, lies in the box of the triangle, and of which `forbids` is true. All that are in the
    /// closed triangle, which turns left, are asked of. `looks` counts what was looked at.
    pub(super) fn find_in(
        &mut self,
        triangle: [Coord<f64>; 3],
        points: &[Coord<f64>],
        looks: &mut u64,
        forbids: impl Fn(u32) -> bool,
    ) -> Option<u32> {
        let area = Area::of(triangle);
        let is_found =
            |p: u32, blocks: &[bool]| blocks[p as usize] && area.has(points[p as usize]) && forbids(p);
        let mut at = 0;
        while let Some(&p) = self.late.get(at) {
            *looks += 1;
            if is_found(p, &self.blocks) {
                return Some(p);
            }
            if self.blocks[p as usize] {
                at += 1;
            } else {
                self.late.swap_remove(at);
            }
        }
        if self.nodes.len() == 2 {
            // A single leaf, as most polygons have.
            *looks += self.order.len() as u64;
            return self.order.iter().copied().find(|&p| is_found(p, &self.blocks));
        }
        // Depth first; what is left to do is at most one node a level.
        let mut stack = [(0usize, 0usize, 0usize); 40];
        let mut depth = 1;
        stack[0] = (1, 0, self.order.len());
        while depth > 0 {
            depth -= 1;
            let (node, first, length) = stack[depth];
            *looks += 1;
            if self.nodes[node].left == 0 || area.misses(&self.nodes[node]) {
                continue;
            }
            if 2 * node >= self.nodes.len() {
                *looks += length as u64;
                let corners = &self.order[first..first + length];
                if let Some(&found) = corners.iter().find(|&&p| is_found(p, &self.blocks)) {
                    return Some(found);
                }
                continue;
            }
            let half = length / 2;
            stack[depth] = (2 * node + 1, first + half, length - half);
            stack[depth + 1] = (2 * node, first, half);
            depth += 2;
        }
        None
    }
}

/// Fills `node` and all below with `corners`, each half of them on one side of the longer way across.
fn fill(nodes: &mut [Node], node: usize, corners: &mut [u32], points: &[Coord<f64>]) {
    let mut all = Node { left: corners.len() as u32, ..EMPTY };
    for &corner in corners.iter() {
        let Coord { x, y } = points[corner as usize];
        all.min = [all.min[0].min(x), all.min[1].min(y)];
        all.max = [all.max[0].max(x), all.max[1].max(y)];
    }
    nodes[node] = all;
    if 2 * node >= nodes.len() {
        return;
    }
    let half = corners.len() / 2;
    if half > 0 {
        let upright = all.max[1] - all.min[1] > all.max[0] - all.min[0];
        let key = |&corner: &u32| {
            let Coord { x, y } = points[corner as usize];
            if upright { y } else { x }
        };
        corners.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
    }
    let (low, high) = corners.split_at_mut(half);
    fill(nodes, 2 * node, low, points);
    fill(nodes, 2 * node + 1, high, points);
}

/// A triangle that turns left, and its box.
struct Area {
    corners: [Coord<f64>; 3],
    min: Coord<f64>,
    max: Coord<f64>,
}

impl Area {
    fn of(corners: [Coord<f64>; 3]) -> Area {
        let [a, b, c] = corners;
        let min = Coord { x: a.x.min(b.x).min(c.x), y: a.y.min(b.y).min(c.y) };
        let max = Coord { x: a.x.max(b.x).max(c.x), y: a.y.max(b.y).max(c.y) };
        Area { corners, min, max }
    }

    /// Whether a point is in the triangle's box.
    fn has(&self, p: Coord<f64>) -> bool {
        p.x >= self.min.x && p.x <= self.max.x && p.y >= self.min.y && p.y <= self.max.y
    }

    /// True only if no point of the node's box is in the closed triangle.
    fn misses(&self, node: &Node) -> bool {
        let (low, high) = (node.min, node.max);
        if high[0] < self.min.x || low[0] > self.max.x || high[1] < self.min.y || low[1] > self.max.y {
            return true;
        }
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)].into_iter().any(|(p, q)| {
            let (dx, dy) = (q.x - p.x, q.y - p.y);
            // The corner of the box that is farthest to the left of the side.
            let x = if dy > 0.0 { low[0] } else { high[0] } - p.x;
            let y = if dx > 0.0 { high[1] } else { low[1] } - p.y;
            // Each difference is within 2^-53 of itself, each product within 2^-53 more, and so is the last
            // difference: the sum of all is below 5 * 2^-53 of the products. Nothing that comes of `f32`s underflows.
            let (left, right) = (dx * y, dy * x);
            left - right < -1e-15 * (left.abs() + right.abs())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coord((x, y): (i8, i8)) -> Coord<f64> {
        Coord { x: x.into(), y: y.into() }
    }

    proptest! {
        #[test]
        fn whatever_is_in_the_closed_triangle_is_found(
            points in prop::collection::vec((-9i8..9, -9i8..9), 1..200),
            triangle in [(-9i8..9, -9i8..9), (-9i8..9, -9i8..9), (-9i8..9, -9i8..9)],
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 0..60),
            late in any::<prop::sample::Index>(),
        ) {
            let points: Vec<Coord<f64>> = points.into_iter().map(coord).collect();
            let mut triangle = triangle.map(coord);
            let turn = |a, b, c| robust::orient2d(a, b, c);
            if turn(triangle[0], triangle[1], triangle[2]) < 0.0 {
                triangle.swap(0, 1);
            }
            let [a, b, c] = triangle;
            prop_assume!(turn(a, b, c) > 0.0);
            let mut blockers = Blockers::default();
            blockers.clear(points.len());
            // The last ones come later.
            let early = late.index(points.len()) + 1;
            (0..early as u32).for_each(|i| blockers.add(i));
            blockers.build(&points);
            (early as u32..points.len() as u32).for_each(|i| blockers.add_late(i));
            for (at, there) in changes {
                let at = at.index(points.len()) as u32;
                match there {
                    true if !blockers.contains(at) => blockers.add_late(at),
                    true => {}
                    false => blockers.remove(at),
                }
            }
            let inside = |p: &u32| {
                let p = points[*p as usize];
                turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
            };
            let expected: Vec<u32> =
                (0..points.len() as u32).filter(|&p| blockers.contains(p)).filter(inside).collect();
            for wanted in expected.clone() {
                let found = blockers.find_in(triangle, &points, &mut 0, |p| p == wanted);
                prop_assert_eq!(found, Some(wanted));
            }
            let found = blockers.find_in(triangle, &points, &mut 0, |p| inside(&p));
            prop_assert_eq!(found.is_some(), !expected.is_empty());
        }
    }
}
