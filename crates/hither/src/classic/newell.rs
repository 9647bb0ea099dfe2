//! Newell, Newell and Sancha: sort polygons so that each may be drawn over those before it.
//!
//! The farthest polygon P may be drawn first if for each Q that it overlaps in depth one of five tests holds:
//! their x extents, or y extents, are apart; Q is all on the eye's side of P's plane; P is all on the far side
//! of Q's plane; their outlines do not overlap. Else Q is tried in P's place; and where that does not help, as
//! with cycles and polygons that pass through each other, P is split by Q's plane.

use glam::{DVec2, DVec3};

/// A flat convex polygon.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    /// Corners, z towards the eye.
    pub points: Vec<DVec3>,
    /// What it is a part of, for the caller.
    pub source: usize,
}

/// A corner nearer to a plane than this part of the scene's size is in it.
const IN_PLANE: f64 = 1e-9;

/// The facets from back to front, split where they must be.
pub fn newell_newell_sancha(facets: &[Facet]) -> Vec<Facet> {
    let size = facets.iter().flat_map(|f| &f.points).fold(1e-300, |m: f64, p| m.max(p.abs().max_element()));
    let slack = size * IN_PLANE;
    let far = |f: &Facet| f.points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    // (facet, whether it was moved to the front of the list already); the last is the farthest.
    let mut list: Vec<(Facet, bool)> =
        facets.iter().filter(|f| f.normal().z != 0.0).map(|f| (f.clone(), false)).collect();
    list.sort_by(|a, b| far(&b.0).total_cmp(&far(&a.0)));
    let mut order = Vec::new();
    while let Some((p, moved)) = list.pop() {
        match list.iter().rposition(|(q, _)| !may_precede(&p, q, slack)) {
            None => {
                // What comes next is farthest again, whatever was moved before.
                order.push(p);
                let moved = list.iter().any(|(_, moved)| *moved);
                list.iter_mut().for_each(|f| f.1 = false);
                if moved {
                    list.sort_by(|a, b| far(&b.0).total_cmp(&far(&a.0)));
                }
            }
            Some(at) if !list[at].1 && may_precede(&list[at].0, &p, slack) => {
                let (q, _) = list.remove(at);
                list.push((p, moved));
                list.push((q, true));
            }
            Some(_) => {
                // A cycle. The plane of something that overlaps P splits it, or P's plane splits that; P and Q
                // themselves may be on one side of each other.
                let crosses = |q: &Facet| overlap(&p, q, slack);
                let by_other = list.iter().filter(|q| crosses(&q.0)).find_map(|q| split(&p, &q.0, slack));
                let other = |q: &(Facet, bool)| crosses(&q.0) && split(&q.0, &p, slack).is_some();
                if let Some(pieces) = by_other {
                    list.extend(pieces.into_iter().map(|piece| (piece, false)));
                } else if let Some(at) = list.iter().position(other) {
                    let (q, _) = list.remove(at);
                    let pieces = split(&q, &p, slack).into_iter().flatten();
                    list.extend(pieces.map(|piece| (piece, false)));
                    list.push((p, false));
                } else if list.iter().all(|q| q.1) {
                    // All are in one plane: any order is right.
                    order.push(p);
                    continue;
                } else {
                    list.insert(0, (p, true));
                    continue;
                }
                list.sort_by(|a, b| far(&b.0).total_cmp(&far(&a.0)));
            }
        }
    }
    order
}

/// Whether P may be drawn before Q.
fn may_precede(p: &Facet, q: &Facet, slack: f64) -> bool {
    let extent = |f: &Facet, axis: usize| {
        let low = f.points.iter().map(|v| v[axis]).fold(f64::INFINITY, f64::min);
        let high = f.points.iter().map(|v| v[axis]).fold(f64::NEG_INFINITY, f64::max);
        [low, high]
    };
    let apart = |axis: usize| {
        let ([a, b], [c, d]) = (extent(p, axis), extent(q, axis));
        b <= c + slack || d <= a + slack
    };
    apart(0)
        || apart(1)
        || extent(p, 2)[1] <= extent(q, 2)[0] + slack
        || q.points.iter().all(|v| side(p, *v) >= -slack)
        || p.points.iter().all(|v| side(q, *v) <= slack)
        || !overlap(p, q, slack)
}

/// Distance of a point from a facet's plane, positive on the eye's side.
fn side(facet: &Facet, v: DVec3) -> f64 {
    let n = facet.normal().normalize_or_zero();
    n.dot(v - facet.points[0]) * n.z.signum()
}

/// Whether two convex outlines overlap: no edge of either has the other beyond it.
fn overlap(p: &Facet, q: &Facet, slack: f64) -> bool {
    let separates = |f: &Facet, g: &Facet| {
        let turn = f.normal().z.signum();
        (0..f.points.len()).any(|i| {
            let a = f.points[i].truncate();
            let d: DVec2 = (f.points[(i + 1) % f.points.len()].truncate() - a).normalize_or_zero();
            g.points.iter().all(|v| d.perp_dot(v.truncate() - a) * turn <= slack)
        })
    };
    !separates(p, q) && !separates(q, p)
}

/// Splits P by the plane of Q; `None` if P is on one side of it.
fn split(p: &Facet, q: &Facet, slack: f64) -> Option<[Facet; 2]> {
    let sides: Vec<f64> = p
        .points
        .iter()
        .map(|v| {
            let s = side(q, *v);
            if s.abs() <= slack { 0.0 } else { s }
        })
        .collect();
    if sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0) {
        return None;
    }
    let mut pieces = [Vec::new(), Vec::new()];
    for (i, &a) in p.points.iter().enumerate() {
        let k = (i + 1) % p.points.len();
        let (b, sa, sb) = (p.points[k], sides[i], sides[k]);
        if sa >= 0.0 {
            pieces[0].push(a);
        }
        if sa <= 0.0 {
            pieces[1].push(a);
        }
        if sa * sb < 0.0 {
            let cut = a + (b - a) * (sa / (sa - sb));
            pieces[0].push(cut);
            pieces[1].push(cut);
        }
    }
    Some(pieces.map(|points| Facet { points, source: p.source }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(a: [f64; 3], b: [f64; 3], width: f64, source: usize) -> Facet {
        let (a, b) = (DVec3::from(a), DVec3::from(b));
        let aside = (b - a).truncate().perp().normalize().extend(0.0) * width;
        Facet { points: vec![a - aside, b - aside, b + aside, a + aside], source }
    }

    #[test]
    fn a_cycle_of_three_is_split() {
        let bars = [
            bar([0.0, 0.0, 0.0], [10.0, 0.0, 4.0], 0.5, 0),
            bar([9.0, -2.0, 0.0], [4.0, 9.0, 4.0], 0.5, 1),
            bar([6.0, 9.0, 0.0], [1.0, -2.0, 4.0], 0.5, 2),
        ];
        let order = newell_newell_sancha(&bars);
        assert!((4..=6).contains(&order.len()), "{}", order.len());
        for (i, p) in order.iter().enumerate() {
            for q in &order[i + 1..] {
                assert!(may_precede(p, q, 1e-8));
            }
        }
    }

    #[test]
    fn the_lectures_penetrating_triangle_is_split_by_the_rectangle() {
        let at = |points: &[[f64; 3]], source| Facet {
            points: points.iter().map(|&p| p.into()).collect(),
            source,
        };
        let rectangle = at(&[[10., 5., 10.], [10., 25., 10.], [25., 25., 10.], [25., 5., 10.]], 0);
        let triangle = at(&[[15., 15., 15.], [25., 25., 5.], [30., 10., 5.]], 1);
        let order = newell_newell_sancha(&[triangle, rectangle]);
        let sources: Vec<usize> = order.iter().map(|f| f.source).collect();
        assert_eq!(sources, [1, 0, 1]);
    }
}
