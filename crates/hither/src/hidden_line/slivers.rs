//! Triangles too thin to be seen, whose normals say nothing.
//!
//! Programs that unite and subtract solids leave slivers along the seams. Their corners are off by as much as they
//! are thick, so that their normals are any, and both their long sides would be creases. A sliver takes the normal
//! of the neighbour across its second longest side instead. So there the surface is flat, and across the longest
//! side it bends as it would if the sliver were not there: a true crease along a sliver is drawn once.

use super::topology::{NONE, Topology, across, bend, trait_of};
use glam::Vec3;

/// The height of a sliver, of its mesh's size: a fiftieth of a pixel where the mesh is a thousand pixels large.
const THIN: f64 = 2e-5;

/// Where nothing bends more, nothing is wrong: 1 − cos of about half a degree.
const BENT: f32 = 5e-5;

/// So many slivers side by side are seen through.
const LONGEST_CHAIN: usize = 16;

/// Gives slivers the normals of their neighbours, and edges the bend that then is theirs. Cost: a look at each
/// edge where there are none.
pub(super) fn smooth(topology: &mut Topology, normals: &mut [Vec3]) {
    let thin = THIN * size(topology);
    let mut slivers: Vec<u32> = Vec::new();
    for edge in topology.edges.iter().filter(|e| e.triangles[1] != NONE && e.bend > BENT) {
        slivers.extend(edge.triangles.iter().filter(|&&t| is_thin(topology, t, thin)));
    }
    if slivers.is_empty() {
        return;
    }
    slivers.sort_unstable();
    slivers.dedup();
    let is_sliver = |t: u32| slivers.binary_search(&t).is_ok();
    let smooth: Vec<Option<Vec3>> =
        slivers.iter().map(|&t| normal_beyond(topology, normals, t, is_sliver)).collect();
    for (&t, smooth) in slivers.iter().zip(smooth) {
        normals[t as usize] = smooth.unwrap_or(normals[t as usize]);
    }
    for edge in topology.edges.iter_mut().filter(|e| e.traits & trait_of::NON_MANIFOLD == 0) {
        let [a, b] = edge.triangles;
        if b != NONE && (is_sliver(a) || is_sliver(b)) {
            let flipped = edge.traits & trait_of::FLIPPED != 0;
            edge.bend = bend(normals[a as usize], normals[b as usize], flipped);
            edge.traits |= trait_of::THIN;
        }
    }
}

/// The diagonal of the box of all triangles.
fn size(topology: &Topology) -> f64 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &v in topology.triangles.iter().filter(|t| t[0] != NONE).flatten() {
        let p = topology.positions[v as usize];
        (low, high) = (low.min(p), high.max(p));
    }
    (high.as_dvec3() - low.as_dvec3()).length()
}

fn is_thin(topology: &Topology, triangle: u32, thin: f64) -> bool {
    let t = topology.triangles[triangle as usize];
    let longest = (0..3).map(|k| side(topology, t, k)).fold(0.0, f64::max);
    across(t, &topology.positions).length() < thin * longest
}

/// Length of the side from corner k to k + 1.
fn side(topology: &Topology, t: [u32; 3], k: usize) -> f64 {
    let at = |k: usize| topology.positions[t[k % 3] as usize].as_dvec3();
    at(k).distance(at(k + 1))
}

/// The normal of the first triangle that is no sliver across second longest sides, as seen from `sliver`. Slivers
/// that are each other's neighbours there, and those at a boundary, have none.
fn normal_beyond(
    topology: &Topology,
    normals: &[Vec3],
    sliver: u32,
    is_sliver: impl Fn(u32) -> bool,
) -> Option<Vec3> {
    let (mut at, mut sign) = (sliver, 1.0);
    for _ in 0..LONGEST_CHAIN {
        let t = topology.triangles[at as usize];
        let mut sides = [0, 1, 2].map(|k| (side(topology, t, k), k));
        sides.sort_by(|a, b| a.0.total_cmp(&b.0));
        let k = sides[1].1;
        if topology.flips[at as usize] & (1 << k) != 0 {
            sign = -sign;
        }
        at = topology.neighbours[at as usize][k];
        if at == NONE {
            return None;
        }
        if !is_sliver(at) {
            return Some(sign * normals[at as usize]);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::crew::Crew;
    use super::super::edges::FLAT;
    use super::*;
    use crate::scene::{Mesh, Primitive, Scene};

    /// Two rectangles that meet at x = 0, the right one of this slope, with slivers of any normal between them:
    /// each has a corner that is off by about as much as it is thick. The number of edges that are not flat,
    /// and how much they bend.
    fn bent_edges(slope: f32, off: [f32; 2], flip: bool) -> Vec<f32> {
        let mut at = vec![[-1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        at.extend([[1.0, 0.0, slope], [1.0, 1.0, slope], [off[0], 0.4, off[1]]]);
        // The middle is split by a point near it: a sliver between 2, 3 and 6.
        let mut triangles = vec![[0, 2, 3], [0, 3, 1], [2, 6, 3], [2, 4, 6], [6, 4, 5], [6, 5, 3]];
        if flip {
            triangles[2].swap(0, 1);
        }
        let mesh = Mesh {
            positions: at.into_iter().map(Vec3::from).collect(),
            primitives: vec![Primitive { triangles: 0..triangles.len() as u32, material: None }],
            triangles,
            ..Mesh::default()
        };
        let topology = Topology::of(Crew { threads: 1 }, &Scene::new("t"), &mesh, &[]);
        let inner = topology.edges.iter().filter(|e| e.triangles[1] != NONE);
        inner.map(|e| e.bend).filter(|&b| f64::from(b) > 2.0 * (FLAT * 0.5).powi(2)).collect()
    }

    #[test]
    fn a_sliver_in_a_plane_shows_no_edge() {
        for off in [[1e-5, 0.0], [1e-5, 1e-5], [3e-6, -1e-5], [-1e-6, 2e-5], [0.0, 1e-5]] {
            for flip in [false, true] {
                assert_eq!(bent_edges(0.0, off, flip), [], "{off:?}");
            }
        }
    }

    #[test]
    fn a_crease_along_a_sliver_is_one() {
        for off in [[1e-5, 0.0], [1e-5, 1e-5], [3e-6, -1e-5], [1e-6, 2e-5]] {
            for flip in [false, true] {
                let bent = bent_edges(1.0, off, flip);
                assert_eq!(bent.len(), 1, "{off:?}");
                assert!((bent[0] - (1.0 - 0.5f32.sqrt())).abs() < 1e-3);
            }
        }
    }
}
