//! Where a plane cuts a mesh: segments that meet in shared points, and the loops that they make.

use crate::hidden_line::lens::{HalfSpace, Lens};
use crate::hidden_line::topology::{Mix, NONE, Topology, ordered};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;

/// Loose ends beyond this many are not brought together: each is compared with each.
const MOST_LOOSE: usize = 4096;

/// The outline of a cut.
#[derive(Debug, Default)]
pub(super) struct Outline {
    /// In view space; no two at the same crossing of an edge.
    pub points: Vec<DVec3>,
    /// Pairs of points, each with the body's inside on the same side, as its faces wind.
    pub segments: Vec<[u32; 2]>,
    /// The mesh's triangle of each segment.
    pub triangles: Vec<u32>,
}

impl Outline {
    /// Cuts a mesh, just beside the plane on its kept side: a body that ends in the plane is cut there, one that is
    /// taken away and begins in it is not. Ends that no other segment continues are joined to others that rounding may put apart.
    pub fn of(topology: &Topology, view_from_mesh: &DAffine3, plane: &HalfSpace, lens: &Lens) -> Outline {
        let place = |v: u32| view_from_mesh.transform_point3(topology.positions[v as usize].as_dvec3());
        let sides: Vec<f64> = (0..topology.positions.len() as u32).map(|v| plane.side(place(v))).collect();
        let mut outline = Outline::default();
        if sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s <= 0.0) {
            return outline;
        }
        let mut known: HashMap<[u32; 2], u32, Mix> = HashMap::default();
        for (number, t) in topology.triangles.iter().enumerate().filter(|(_, t)| t[0] != NONE) {
            let of = t.map(|v| sides[v as usize]);
            if of.iter().all(|&s| s > 0.0) || of.iter().all(|&s| s <= 0.0) {
                continue;
            }
            let mut ends = [NONE; 2];
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let (sa, sb) = (of[k], of[(k + 1) % 3]);
                if (sa <= 0.0) == (sb <= 0.0) {
                    continue;
                }
                // The point on the plane: a corner in it, or a crossing, the same from both triangles.
                let (kept, lost) = if sb <= 0.0 { (a, b) } else { (b, a) };
                let whole = sides[lost as usize] == 0.0;
                let name = if whole { [lost, lost] } else { ordered(kept, lost) };
                let point = *known.entry(name).or_insert_with(|| {
                    let [low, high] = name;
                    let (sl, sh) = (sides[low as usize], sides[high as usize]);
                    let (p, q) = (place(low), place(high));
                    outline.points.push(if whole { p } else { p + (q - p) * (sl / (sl - sh)) });
                    outline.points.len() as u32 - 1
                });
                ends[usize::from(sb > 0.0)] = point;
            }
            if ends[0] != ends[1] && !ends.contains(&NONE) {
                outline.segments.push(ends);
                outline.triangles.push(number as u32);
            }
        }
        outline.join_loose_ends(lens);
        outline
    }

    /// How many segments end at each point, less those that begin.
    fn balance(&self) -> Vec<i32> {
        let mut balance = vec![0; self.points.len()];
        for &[a, b] in &self.segments {
            balance[a as usize] -= 1;
            balance[b as usize] += 1;
        }
        balance
    }

    /// Joins points at which more segments begin than end to near ones at which it is the other way round.
    fn join_loose_ends(&mut self, lens: &Lens) {
        let balance = self.balance();
        let mut loose: Vec<u32> =
            (0..self.points.len() as u32).filter(|&p| balance[p as usize] != 0).collect();
        if loose.is_empty() || loose.len() > MOST_LOOSE {
            return;
        }
        let mut name: Vec<u32> = (0..self.points.len() as u32).collect();
        while let Some(p) = loose.pop() {
            let here = self.points[p as usize];
            let reach = 4.0 * lens.rounding_of_point(here);
            let near = |q: &u32| here.distance(self.points[*q as usize]) <= reach;
            if let Some(at) = loose.iter().position(near) {
                name[p as usize] = loose[at];
            }
        }
        // Names lead to names that come later in no chain: each leads to a point that was popped after it.
        let find = |mut p: u32| {
            while name[p as usize] != p {
                p = name[p as usize];
            }
            p
        };
        for segment in &mut self.segments {
            *segment = segment.map(find);
        }
        let stays: Vec<bool> = self.segments.iter().map(|s| s[0] != s[1]).collect();
        let mut at = stays.iter();
        self.segments.retain(|_| at.next() == Some(&true));
        let mut at = stays.iter();
        self.triangles.retain(|_| at.next() == Some(&true));
    }

    /// The closed loops of the outline, and whether winding numbers tell its inside: not where faces that
    /// continue each other wind differently.
    pub fn loops(&self) -> (Vec<Vec<u32>>, bool) {
        let directed = self.balance().iter().all(|&b| b == 0);
        let mut starts = vec![0u32; self.points.len() + 1];
        let both = if directed { 1 } else { 2 };
        for s in &self.segments {
            s[..both].iter().for_each(|&p| starts[p as usize + 1] += 1);
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut leaving = vec![0u32; starts[self.points.len()] as usize];
        let mut next = starts.clone();
        for (i, s) in self.segments.iter().enumerate() {
            for &p in &s[..both] {
                leaving[next[p as usize] as usize] = i as u32;
                next[p as usize] += 1;
            }
        }
        next.copy_from_slice(&starts);
        let mut used = vec![false; self.segments.len()];
        let mut loops = Vec::new();
        for first in 0..self.segments.len() {
            if used[first] {
                continue;
            }
            let begin = self.segments[first][0];
            let (mut path, mut at) = (Vec::new(), begin);
            loop {
                let here = at as usize;
                while next[here] < starts[here + 1] && used[leaving[next[here] as usize] as usize] {
                    next[here] += 1;
                }
                if next[here] == starts[here + 1] {
                    break;
                }
                let segment = leaving[next[here] as usize] as usize;
                used[segment] = true;
                path.push(at);
                let [a, b] = self.segments[segment];
                at = if a == at { b } else { a };
                if at == begin {
                    break;
                }
            }
            // A way that does not come back is the border of an opening.
            if at == begin && path.len() > 2 {
                loops.push(path);
            }
        }
        (loops, directed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(segments: &[[u32; 2]]) -> Outline {
        let points = segments.iter().flatten().max().map_or(0, |m| m + 1);
        Outline {
            points: vec![DVec3::ZERO; points as usize],
            segments: segments.to_vec(),
            triangles: vec![0; segments.len()],
        }
    }

    #[test]
    fn loops_are_closed_and_open_ways_left_out() {
        let (loops, winding) = outline(&[[0, 1], [2, 0], [1, 2], [3, 4], [4, 5], [5, 3]]).loops();
        assert_eq!((loops.len(), winding), (2, true));
        // One segment the wrong way round.
        let (loops, winding) = outline(&[[0, 1], [0, 2], [1, 2]]).loops();
        assert_eq!((loops.len(), loops[0].len(), winding), (1, 3, false));
        let (loops, _) = outline(&[[0, 1], [1, 2], [3, 4], [4, 5], [5, 3]]).loops();
        assert_eq!(loops.len(), 1);
    }
}
