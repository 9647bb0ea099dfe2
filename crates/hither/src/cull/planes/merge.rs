//! Coplanar neighbours become larger convex polygons.
//!
//! Edges are taken from the longest down; the two polygons at an edge are joined where the result is convex
//! and flat within the precision of `f32` coordinates. Vertices within a straight side stay, so that a
//! neighbour still finds its edge. What is made is only *nearly* flat; nothing that uses it relies on more
//! (see [`super::occluder`]).

use glam::DVec3;
use std::collections::HashMap;

/// A convex polygon to start from.
pub(super) struct Cell {
    /// Corners, counter-clockwise seen from the front.
    pub corners: Vec<u32>,
    /// Unit normal.
    pub normal: DVec3,
    /// Only cells of the same kind are joined.
    pub kind: u64,
}

/// A convex polygon that was made, and the cells in it, ascending.
pub(super) struct Merged {
    pub corners: Vec<u32>,
    pub members: Vec<u32>,
    pub normal: DVec3,
}

/// How far a corner may lie off the plane, relative to the largest coordinate: a few units in the last place
/// of `f32`.
const FLAT: f64 = 1e-6;
/// How far two normals may differ, and by what angle a corner may turn back.
const PARALLEL: f64 = 1e-5;
/// Times that all edges are looked at.
const MOST_ROUNDS: usize = 16;
/// No polygon grows beyond this many corners.
const MOST_CORNERS: usize = 256;

/// Joins `cells` whose corners are numbers of `points`. Cost: n log n for the edges, and the corners of
/// what is joined.
pub(super) fn merge(points: &[DVec3], cells: Vec<Cell>) -> Vec<Merged> {
    let mut growing: Vec<Option<Merged>> = Vec::with_capacity(cells.len());
    let mut kinds = Vec::with_capacity(cells.len());
    let edges = joints(points, &cells);
    for (i, cell) in cells.into_iter().enumerate() {
        kinds.push(cell.kind);
        growing.push(Some(Merged { corners: cell.corners, members: vec![i as u32], normal: cell.normal }));
    }
    // Where each cell has gone; the head of a chain is a polygon that is still there.
    let mut into: Vec<u32> = (0..growing.len() as u32).collect();
    // What does not fit now may fit once its neighbours have grown.
    for _ in 0..MOST_ROUNDS {
        let mut changed = false;
        for &(a, b, left, right) in &edges {
            let (left, right) = (find(&mut into, left), find(&mut into, right));
            if left == right || kinds[left as usize] != kinds[right as usize] {
                continue;
            }
            let (Some(p), Some(q)) = (&growing[left as usize], &growing[right as usize]) else { continue };
            let Some(corners) = joined(points, p, q, a, b) else { continue };
            let members = [p.members.as_slice(), q.members.as_slice()].concat();
            let normal = if p.members.len() >= q.members.len() { p.normal } else { q.normal };
            growing[left as usize] = Some(Merged { corners, members, normal });
            growing[right as usize] = None;
            into[right as usize] = left;
            changed = true;
        }
        if !changed {
            break;
        }
    }
    let mut made: Vec<Merged> = growing.into_iter().flatten().collect();
    made.iter_mut().for_each(|m| m.members.sort_unstable());
    made
}

/// Edges where exactly two cells meet, one along it and one against it; the longest first.
fn joints(points: &[DVec3], cells: &[Cell]) -> Vec<(u32, u32, u32, u32)> {
    let mut at: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
    for (i, cell) in cells.iter().enumerate() {
        for (a, b) in sides(&cell.corners) {
            at.entry((a, b)).or_default().push(i as u32);
        }
    }
    let mut found = Vec::new();
    for (&(a, b), left) in &at {
        let right = at.get(&(b, a));
        if let (true, [left], Some([right])) = (a < b, left.as_slice(), right.map(Vec::as_slice)) {
            let length = points[a as usize].distance_squared(points[b as usize]);
            found.push((length, a, b, *left, *right));
        }
    }
    found.sort_unstable_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    found.into_iter().map(|(_, a, b, left, right)| (a, b, left, right)).collect()
}

fn find(into: &mut [u32], mut at: u32) -> u32 {
    while into[at as usize] != at {
        into[at as usize] = into[into[at as usize] as usize];
        at = into[at as usize];
    }
    at
}

/// Pairs of consecutive corners, the last with the first.
pub(super) fn sides(corners: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]))
}

/// The outline of `p` and `q` together, which meet at the edge a → b of `p`; `None` if that is not a convex
/// polygon.
fn joined(points: &[DVec3], p: &Merged, q: &Merged, a: u32, b: u32) -> Option<Vec<u32>> {
    if p.normal.distance(q.normal) > PARALLEL || p.corners.len() + q.corners.len() > MOST_CORNERS {
        return None;
    }
    let origin = points[a as usize];
    let flat = |&v: &u32| {
        let v = points[v as usize];
        let size = v.abs().max_element().max(origin.abs().max_element());
        (v - origin).dot(p.normal).abs() <= FLAT * size
    };
    if !q.corners.iter().all(flat) {
        return None;
    }
    // p from b round to a, then q from a round to b, without naming a and b twice.
    let from = |corners: &[u32], first: u32| {
        let at = corners.iter().position(|&v| v == first)?;
        Some(corners[at..].iter().chain(&corners[..at]).copied().collect::<Vec<u32>>())
    };
    let mut outline = from(&p.corners, b)?;
    outline.extend(&from(&q.corners, a)?[1..q.corners.len() - 1]);
    if outline[p.corners.len() - 1] != a {
        return None;
    }
    drop_spikes(&mut outline);
    let mut seen = outline.clone();
    seen.sort_unstable();
    seen.dedup();
    (outline.len() >= 3 && seen.len() == outline.len() && is_convex(points, &outline, p.normal))
        .then_some(outline)
}

/// Removes edges that are walked there and back: polygons may have met along several.
fn drop_spikes(outline: &mut Vec<u32>) {
    while outline.len() >= 3 {
        let n = outline.len();
        let Some(tip) = (0..n).find(|&i| outline[(i + n - 1) % n] == outline[(i + 1) % n]) else { return };
        let next = (tip + 1) % n;
        outline.remove(tip.max(next));
        outline.remove(tip.min(next));
    }
}

fn is_convex(points: &[DVec3], outline: &[u32], normal: DVec3) -> bool {
    let n = outline.len();
    let mut turned = 0.0;
    for i in 0..n {
        let [a, b, c] = [i, (i + 1) % n, (i + 2) % n].map(|k| points[outline[k] as usize]);
        let (back, on) = (b - a, c - b);
        let sine = back.cross(on).dot(normal);
        if sine < -PARALLEL * back.length() * on.length() {
            return false;
        }
        turned += sine.atan2(back.dot(on));
    }
    // Once round, not twice.
    turned < std::f64::consts::TAU * 1.25
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: u32) -> (Vec<DVec3>, Vec<Cell>) {
        let points = (0..(side + 1) * (side + 1))
            .map(|i| DVec3::new(f64::from(i % (side + 1)), f64::from(i / (side + 1)), 0.0))
            .collect();
        let mut cells = Vec::new();
        for i in 0..side * side {
            let a = i / side * (side + 1) + i % side;
            let (b, c, d) = (a + 1, a + side + 2, a + side + 1);
            for corners in [vec![a, b, c], vec![a, c, d]] {
                cells.push(Cell { corners, normal: DVec3::Z, kind: 0 });
            }
        }
        (points, cells)
    }

    #[test]
    fn a_flat_grid_becomes_one_polygon() {
        for side in [1, 2, 5] {
            let (points, cells) = grid(side);
            let made = merge(&points, cells);
            assert_eq!(made.len(), 1, "{side}");
            assert_eq!(made[0].corners.len(), 4 * side as usize);
            assert_eq!(made[0].members.len(), 2 * (side * side) as usize);
        }
    }

    #[test]
    fn what_would_not_be_convex_stays_apart() {
        let (points, mut cells) = grid(2);
        cells.drain(6..8);
        let made = merge(&points, cells);
        assert!(made.len() == 2, "{}", made.len());
        let area: f64 = made.iter().map(|m| area(&points, &m.corners)).sum();
        assert!((area - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_fold_and_another_kind_stay_apart() {
        let (mut points, cells) = grid(1);
        points[3].z = 1e-3;
        let normal = |c: &Cell| {
            let [a, b, c] = [0, 1, 2].map(|k| points[c.corners[k] as usize]);
            (b - a).cross(c - a).normalize()
        };
        let cells = cells.into_iter().map(|c| Cell { normal: normal(&c), ..c }).collect();
        assert_eq!(merge(&points, cells).len(), 2);
        let (points, mut cells) = grid(1);
        cells[1].kind = 1;
        assert_eq!(merge(&points, cells).len(), 2);
    }

    fn area(points: &[DVec3], corners: &[u32]) -> f64 {
        let cross = sides(corners).map(|(a, b)| points[a as usize].cross(points[b as usize]));
        cross.sum::<DVec3>().z / 2.0
    }
}
