//! The occlusion graph: arcs among given parts, or among all, and the pairs that intersect.

use super::known::Says;
use super::pairs::Pair;
use super::sort::VisibilitySort;
use crate::geometry::Witness;

impl VisibilitySort {
    /// All arcs (occluder, occluded) among `parts` as seen from the eye of the last [`VisibilitySort::sort`], in
    /// ascending order. Parts that are not in the order have none. Cost: quadratic in the number of parts, and
    /// little for pairs whose extents do not meet.
    pub fn arcs_among(&mut self, parts: &[u32]) -> Vec<(u32, u32)> {
        let present = |part: &u32| self.parts[self.seats[*part as usize] as usize].present;
        let present: Vec<u32> = parts.iter().copied().filter(present).collect();
        let mut arcs = Vec::new();
        for &front in &present {
            for &behind in &present {
                if front != behind && self.part_occludes(front, behind) {
                    arcs.push((front, behind));
                }
            }
        }
        arcs.sort_unstable();
        arcs.dedup();
        arcs
    }

    /// Whether `front` occludes `behind` from the eye of the last sort; both must be in the order.
    pub fn part_occludes(&mut self, front: u32, behind: u32) -> bool {
        let [front, behind] = [front, behind].map(|part| self.seats[part as usize] as usize);
        for f in self.parts[front].pieces() {
            for b in self.parts[behind].pieces() {
                let pair = Pair { front: f as u32, behind: b as u32 };
                if self.faces.may_occlude(pair.front, pair.behind)
                    && self.occludes(pair, &mut Witness::default())
                {
                    return true;
                }
            }
        }
        false
    }

    /// Whether what is known of two parts ([`Known`](super::Known)) says that `front` does not occlude `behind` from
    /// the eye of the last sort.
    pub fn rules_out(&self, front: u32, behind: u32) -> bool {
        let seat = |part: u32| self.seats[part as usize];
        self.known_says(seat(front), seat(behind)) == Some(Says::No)
    }

    /// All arcs of the occlusion graph, ascending. Cost: linear in candidate pairs, of which there are many more
    /// than a sort looks at.
    pub fn arcs(&mut self) -> Vec<(u32, u32)> {
        self.faces.restore();
        let mut arcs = Vec::new();
        for part in 0..self.parts.len() as u32 {
            if !self.parts[part as usize].present {
                continue;
            }
            let mut pairs = Vec::new();
            for behind in self.parts[part as usize].pieces() {
                let behind = behind as u32;
                self.faces.occluders(behind, |front| pairs.push(Pair { front, behind }));
            }
            for pair in pairs {
                let front = self.pieces[pair.front as usize].part;
                if front != part && self.occludes(pair, &mut Witness::default()) {
                    arcs.push((self.number(front), self.number(part)));
                }
            }
        }
        arcs.sort_unstable();
        arcs.dedup();
        arcs
    }

    /// Pairs of parts whose hulls intersect, smaller number first, ascending: all of them, for two hulls that
    /// intersect occlude each other and so share a group. Cost: quadratic in the size of the groups.
    pub fn intersecting_pairs(&mut self) -> Vec<(u32, u32)> {
        let groups: Vec<Vec<u32>> =
            self.seated.groups().filter(|g| g.len() > 1).map(<[u32]>::to_vec).collect();
        let mut found = Vec::new();
        for group in groups {
            for (i, &a) in group.iter().enumerate() {
                for &b in &group[i + 1..] {
                    let meet = self.parts[a as usize].pieces().any(|p| {
                        self.parts[b as usize].pieces().any(|q| {
                            self.faces.may_occlude(p as u32, q as u32) && self.intersect(p as u32, q as u32)
                        })
                    });
                    if meet {
                        let (a, b) = (self.number(a), self.number(b));
                        found.push((a.min(b), a.max(b)));
                    }
                }
            }
        }
        found.sort_unstable();
        found
    }
}
