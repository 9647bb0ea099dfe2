//! Brute-force occlusion between convex bodies given by their points, and what follows from it.
//!
//! Two convex polyhedra are disjoint exactly if a plane parallel to a face of one of them, or to an edge of
//! each, separates them. [`gap`] tries the planes through *all* triples and pairs of points, whether they are
//! faces and edges or not: more than needed, and nothing to get wrong.

use glam::DVec3;

/// By how much the body spanned by `behind` *and the origin*, where the eye is, can be separated from the body
/// spanned by `front`, metres. Below zero: a ray from the eye meets `front` and then `behind`. Above: none does.
pub fn gap(front: &[DVec3], behind: &[DVec3]) -> f64 {
    let shadow: Vec<DVec3> = behind.iter().copied().chain([DVec3::ZERO]).collect();
    distance(&shadow, front)
}

/// The distance of two bodies spanned by points, metres; below zero where they intersect: how deep, at most.
pub fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let mut best = f64::NEG_INFINITY;
    let mut attempt = |normal: DVec3| {
        if let Some(n) = normal.try_normalize() {
            let reach = |points: &[DVec3], n: DVec3| {
                points.iter().map(|p| p.dot(n)).fold(f64::NEG_INFINITY, f64::max)
            };
            best = best.max(-reach(b, -n) - reach(a, n)).max(-reach(a, -n) - reach(b, n));
        }
    };
    for points in [a, b] {
        for (i, &p) in points.iter().enumerate() {
            for (j, &q) in points.iter().enumerate().skip(i + 1) {
                points.iter().skip(j + 1).for_each(|&r| attempt((q - p).cross(r - p)));
            }
        }
    }
    for edge in edges(a) {
        edges(b).for_each(|other| attempt(edge.cross(other)));
    }
    best
}

fn edges(points: &[DVec3]) -> impl Iterator<Item = DVec3> {
    points.iter().enumerate().flat_map(|(i, &p)| points.iter().skip(i + 1).map(move |&q| q - p))
}

/// The strongly connected components of a graph on 0..`n` given by its arcs, each ascending, in ascending order
/// of their first members: by who reaches whom.
pub fn components(n: usize, arcs: &[(u32, u32)]) -> Vec<Vec<u32>> {
    let mut reaches = vec![vec![false; n]; n];
    for &(from, to) in arcs {
        reaches[from as usize][to as usize] = true;
    }
    for via in 0..n {
        for from in 0..n {
            if reaches[from][via] {
                let beyond = reaches[via].clone();
                reaches[from].iter_mut().zip(beyond).for_each(|(reached, b)| *reached |= b);
            }
        }
    }
    let mut done = vec![false; n];
    let mut found = Vec::new();
    for a in 0..n {
        if !done[a] {
            let together = |b: &usize| *b == a || (reaches[a][*b] && reaches[*b][a]);
            let members: Vec<u32> = (0..n).filter(together).map(|b| b as u32).collect();
            members.iter().for_each(|&m| done[m as usize] = true);
            found.push(members);
        }
    }
    found
}
