//! One line and one triangle: which part of the line the triangle hides.
//!
//! A line from p to q on the paper, with parameter t from 0 to 1; w is linear in t. The part inside the
//! triangle's outline comes from exact signs, so that triangles which share an edge leave no gap between
//! them and count no point twice. Depths at its ends come from interpolation along the triangle's own edges,
//! so that they never leave the triangle, however thin or edge-on it is.

use super::predicates::{counts_as_left, cross};
use super::shown::Shown;
use glam::{DVec2, DVec3};

/// The hidden part of a line, in its parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hidden {
    pub from: f64,
    pub to: f64,
}

/// The part of the line from `p` to `q` that `triangle` hides: where it is nearer by more than the lens's
/// tolerance at one end of the part, and not farther by it at the other; else up to where they cross. With `piercing`
/// up to there, too, if the triangle is farther by less than the tolerance.
pub(super) fn hidden_part(
    shown: &Shown,
    p: DVec3,
    q: DVec3,
    triangle: u32,
    piercing: bool,
) -> Option<Hidden> {
    let corners = shown.corners(triangle);
    let inside = inside(p, q, &corners, shown.facing[triangle as usize])?;
    let depth = |end: &End| {
        let on_line = p.z + (q.z - p.z) * end.t;
        (end.w - on_line, on_line)
    };
    let (mut d0, w0) = depth(&inside.0);
    let (mut d1, w1) = depth(&inside.1);
    let coarse = shown.lens.coarse(w0.max(w1).max(w0 + d0).max(w1 + d1));
    if d0.abs() <= coarse || d1.abs() <= coarse {
        let in_view = shown.corners_in_view(triangle);
        // What is at the same place is neither before nor behind.
        let (before0, before1) = (d0, d1);
        if d0.abs() <= shown.lens.same_depth(in_view, p + (q - p) * inside.0.t) {
            d0 = 0.0;
        }
        if d1.abs() <= shown.lens.same_depth(in_view, p + (q - p) * inside.1.t) {
            d1 = 0.0;
        }
        if piercing && d0 == 0.0 && d1 > 0.0 {
            d0 = before0.min(0.0);
        } else if piercing && d1 == 0.0 && d0 > 0.0 {
            d1 = before1.min(0.0);
        }
    }
    let (from, to) = (inside.0.t, inside.1.t);
    if d0 <= 0.0 && d1 <= 0.0 {
        return None;
    }
    if d0 >= 0.0 && d1 >= 0.0 {
        return Some(Hidden { from, to });
    }
    let crossing = from + (to - from) * (d0 / (d0 - d1));
    Some(if d0 > 0.0 { Hidden { from, to: crossing } } else { Hidden { from: crossing, to } })
}

/// An end of the part inside a triangle: where, and w of the triangle there.
#[derive(Clone, Copy, Debug)]
struct End {
    t: f64,
    w: f64,
}

/// The part of a line inside a triangle's outline, if there is any. `facing` is the triangle's orientation.
fn inside(p: DVec3, q: DVec3, corners: &[DVec3; 3], facing: i8) -> Option<(End, End)> {
    let mut of_p = [0.0; 3];
    let mut of_q = [0.0; 3];
    let (mut from, mut to) = (0.0f64, 1.0f64);
    let (mut entry, mut exit) = (3, 3);
    for (k, (of_p, of_q)) in of_p.iter_mut().zip(&mut of_q).enumerate() {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (sp, sq) = (cross(a, b, p), cross(a, b, q));
        let (sp, sq) = if facing < 0 { (-sp, -sq) } else { (sp, sq) };
        (*of_p, *of_q) = (sp, sq);
        let left = || counts_as_left(a, b) == (facing > 0);
        let p_in = sp > 0.0 || (sp == 0.0 && left());
        let q_in = sq > 0.0 || (sq == 0.0 && left());
        match (p_in, q_in) {
            (true, true) => {}
            (false, false) => return None,
            (false, true) => {
                let t = sp / (sp - sq);
                if t > from || entry == 3 {
                    (from, entry) = (from.max(t), k);
                }
            }
            (true, false) => {
                let t = sp / (sp - sq);
                if t < to || exit == 3 {
                    (to, exit) = (to.min(t), k);
                }
            }
        }
    }
    if from >= to {
        return None;
    }
    let w_at = |edge: usize, t: f64, signs: &[f64; 3]| {
        if edge == 3 {
            weighted(signs, corners)
        } else {
            along((p + (q - p) * t).truncate(), corners[edge], corners[(edge + 1) % 3])
        }
    };
    Some((End { t: from, w: w_at(entry, from, &of_p) }, End { t: to, w: w_at(exit, to, &of_q) }))
}

/// w of a triangle at a point inside it, from the areas that the point makes with its edges.
fn weighted(signs: &[f64; 3], corners: &[DVec3; 3]) -> f64 {
    // The area at edge k belongs to the corner that is not on it.
    let area = |corner: usize| signs[(corner + 1) % 3].max(0.0);
    let sum = area(0) + area(1) + area(2);
    (area(0) * corners[0].z + area(1) * corners[1].z + area(2) * corners[2].z) / sum
}

/// w of the edge from `a` to `b` at a point of it on the paper.
fn along(point: DVec2, a: DVec3, b: DVec3) -> f64 {
    let step = (b - a).truncate();
    // By projection: where the line runs along the edge, the place of a crossing means little, but both
    // depths must be taken at the same point.
    let u = (step.dot(point - a.truncate()) / step.length_squared()).clamp(0.0, 1.0);
    if u.is_nan() { a.z } else { a.z + (b.z - a.z) * u }
}
