//! A kd-tree over polygons. The paper speaks of octrees and used kd-trees; so do we.
//!
//! A polygon that crosses several leaves is in all of them, each with the piece of it that is in the leaf's
//! cell. A node's box is around its pieces, not its cell: it is what is asked about. Nodes are in
//! depth-first order, the left child right after its parent, so that a subtree is a run of nodes and a run
//! of pieces, and disjoint subtrees can be worked on at once.

use super::model::PolygonModel;
use crate::geometry::Aabb;
use glam::DVec3;

/// A node.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// Around the pieces below.
    pub bounds: Aabb,
    /// The part of space that it stands for.
    pub cell: Aabb,
    /// The right child; 0 for a leaf. The left one follows the node.
    pub right: u32,
    /// One past the last node below.
    pub end: u32,
    /// The pieces below.
    pub pieces: (u32, u32),
}

/// A polygon within a leaf's cell.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub polygon: u32,
    /// Its run in [`Tree::points`].
    pub points: (u32, u32),
    /// A ball around it.
    pub centre: DVec3,
    pub radius: f64,
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub pieces: Vec<Piece>,
    pub points: Vec<DVec3>,
    /// Nodes from the root to the deepest leaf.
    pub depth: u32,
}

/// No leaf is deeper, whatever it holds.
const DEEPEST: u32 = 24;
/// Cost of visiting a node, in pieces of a leaf, for choosing where to split.
const VISIT: f64 = 1.5;
/// Places tried for a split along each axis.
const PLACES: usize = 16;

impl Tree {
    /// Splits until a leaf holds at most `leaf_size` polygons or splitting gains nothing.
    pub fn new(model: &PolygonModel, leaf_size: usize) -> Tree {
        let mut tree = Tree::default();
        let all: Vec<u32> = (0..model.polygons().len() as u32).collect();
        let bounds = model.bounds();
        tree.split(model, all, bounds, bounds, leaf_size.max(1), 1);
        let mut placed = vec![false; model.polygons().len()];
        tree.pieces.iter().for_each(|p| placed[p.polygon as usize] = true);
        assert!(placed.iter().all(|&p| p), "a polygon is in no leaf");
        tree
    }

    /// Whether `node` has no children.
    pub fn is_leaf(&self, node: u32) -> bool {
        self.nodes[node as usize].right == 0
    }

    /// The leaf whose cell holds `eye`; `None` outside the tree.
    pub fn leaf_of(&self, eye: DVec3) -> Option<u32> {
        if !self.nodes.first()?.cell.contains(eye) {
            return None;
        }
        let mut at = 0;
        while !self.is_leaf(at) {
            let right = self.nodes[at as usize].right;
            at = if self.nodes[at as usize + 1].cell.contains(eye) { at + 1 } else { right };
        }
        Some(at)
    }

    /// Corners of a piece.
    pub fn piece(&self, piece: usize) -> &[DVec3] {
        let (first, end) = self.pieces[piece].points;
        &self.points[first as usize..end as usize]
    }

    fn split(
        &mut self,
        model: &PolygonModel,
        polygons: Vec<u32>,
        bounds: Aabb,
        cell: Aabb,
        leaf_size: usize,
        depth: u32,
    ) {
        let at = self.nodes.len();
        self.depth = self.depth.max(depth);
        let first = self.pieces.len() as u32;
        self.nodes.push(Node { bounds, cell, right: 0, end: 0, pieces: (first, first) });
        let plane = (polygons.len() > leaf_size && depth < DEEPEST)
            .then(|| best_split(model, &polygons, &bounds, &cell))
            .flatten();
        let children = plane.and_then(|plane| divide(model, &polygons, &cell, plane));
        if let Some([(left, left_cell), (right, right_cell)]) = children {
            for (polygons, cell) in [(left, left_cell), (right, right_cell)] {
                let bounds = bounds_within(model, &polygons, &cell);
                let child = self.nodes.len() as u32;
                // The second child's number stays.
                self.nodes[at].right = child;
                self.split(model, polygons, bounds, cell, leaf_size, depth + 1);
            }
        } else {
            self.fill(model, &polygons, &cell);
        }
        let union = |b: Aabb, p: &DVec3| b.union(&Aabb { min: *p, max: *p });
        let (first_point, pieces) = (self.pieces.get(first as usize).map(|p| p.points.0), self.pieces.len());
        if let Some(first_point) = first_point {
            self.nodes[at].bounds = self.points[first_point as usize..].iter().fold(Aabb::EMPTY, union);
        }
        self.nodes[at].end = self.nodes.len() as u32;
        self.nodes[at].pieces = (first, pieces as u32);
    }

    fn fill(&mut self, model: &PolygonModel, polygons: &[u32], cell: &Aabb) {
        for &polygon in polygons {
            let whole: Vec<DVec3> = model.corners(polygon).collect();
            let piece = clip_to(&whole, cell);
            // Its box reached the cell, it does not.
            if piece.is_empty() {
                continue;
            }
            let first = self.points.len() as u32;
            let centre = Aabb::around(piece.iter().copied()).center();
            let radius = piece.iter().map(|p| p.distance(centre)).fold(0.0, f64::max) * (1.0 + 1e-12);
            self.points.extend(piece);
            self.pieces.push(Piece { polygon, points: (first, self.points.len() as u32), centre, radius });
        }
    }
}

/// A polygon's box within a cell.
fn within(model: &PolygonModel, polygon: u32, cell: &Aabb) -> Aabb {
    let b = &model.polygons()[polygon as usize].bounds;
    Aabb { min: b.min.max(cell.min), max: b.max.min(cell.max) }
}

fn bounds_within(model: &PolygonModel, polygons: &[u32], cell: &Aabb) -> Aabb {
    polygons.iter().fold(Aabb::EMPTY, |b, &p| b.union(&within(model, p, cell)))
}

/// The split of least expected cost (the surface area heuristic), if any is better than none.
fn best_split(model: &PolygonModel, polygons: &[u32], bounds: &Aabb, cell: &Aabb) -> Option<(usize, f64)> {
    let mut best = (polygons.len() as f64 * bounds.half_area(), None);
    let boxes: Vec<Aabb> = polygons.iter().map(|&p| within(model, p, cell)).collect();
    for axis in 0..3 {
        let mut ends: Vec<f64> = boxes.iter().flat_map(|b| [b.min[axis], b.max[axis]]).collect();
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup();
        let step = (ends.len() / PLACES).max(1);
        for at in ends.iter().copied().step_by(step) {
            if at <= cell.min[axis] || at >= cell.max[axis] {
                continue;
            }
            let (mut left, mut right) = ((0.0, Aabb::EMPTY), (0.0, Aabb::EMPTY));
            for b in &boxes {
                for (side, on_left) in [(&mut left, true), (&mut right, false)] {
                    if goes(b.min[axis], b.max[axis], at, on_left) {
                        side.0 += 1.0;
                        let mut part = *b;
                        if on_left {
                            part.max[axis] = part.max[axis].min(at);
                        } else {
                            part.min[axis] = part.min[axis].max(at);
                        }
                        side.1 = side.1.union(&part);
                    }
                }
            }
            let cost =
                left.0 * left.1.half_area() + right.0 * right.1.half_area() + VISIT * bounds.half_area();
            let empty_or_useless = left.0 == 0.0 && right.0 == polygons.len() as f64;
            if cost < best.0 && !empty_or_useless {
                best = (cost, Some((axis, at)));
            }
        }
    }
    best.1
}

/// Whether what reaches from `min` to `max` belongs on a side of `at`. What lies in the plane goes left.
fn goes(min: f64, max: f64, at: f64, left: bool) -> bool {
    if left { min < at || max <= at } else { max > at }
}

type Half = (Vec<u32>, Aabb);

fn divide(
    model: &PolygonModel,
    polygons: &[u32],
    cell: &Aabb,
    (axis, at): (usize, f64),
) -> Option<[Half; 2]> {
    let on = |left: bool| -> Vec<u32> {
        let belongs = |&&p: &&u32| {
            let b = &model.polygons()[p as usize].bounds;
            goes(b.min[axis], b.max[axis], at, left)
        };
        polygons.iter().filter(belongs).copied().collect()
    };
    let (left, right) = (on(true), on(false));
    if left.len() == polygons.len() && right.len() == polygons.len() {
        return None;
    }
    let (mut low, mut high) = (*cell, *cell);
    low.max[axis] = at;
    high.min[axis] = at;
    Some([(left, low), (right, high)])
}

/// The part of a convex polygon in a cell. The cell is widened by more than what clipping rounds, so that
/// the pieces of neighbouring cells overlap and together hold all of the polygon.
fn clip_to(polygon: &[DVec3], cell: &Aabb) -> Vec<DVec3> {
    let slack = 1e-9 * (cell.size().max_element() + cell.min.abs().max(cell.max.abs()).max_element());
    let mut piece = polygon.to_vec();
    for axis in 0..3 {
        for (sign, limit) in [(1.0, cell.min[axis] - slack), (-1.0, -(cell.max[axis] + slack))] {
            let height = |p: &DVec3| sign * p[axis] - limit;
            if piece.iter().all(|p| height(p) >= 0.0) {
                continue;
            }
            let mut kept = Vec::with_capacity(piece.len() + 2);
            for (i, p) in piece.iter().enumerate() {
                let q = &piece[(i + 1) % piece.len()];
                let (hp, hq) = (height(p), height(q));
                if hp >= 0.0 {
                    kept.push(*p);
                }
                if (hp >= 0.0) != (hq >= 0.0) {
                    kept.push(p.lerp(*q, hp / (hp - hq)));
                }
            }
            piece = kept;
        }
    }
    piece
}
