//! Faces that reach the near plane or leave the guard band, in f64, one triangle at a time.
//!
//! A cut point is computed from its edge's ends in a fixed order, so that two faces that share an edge share
//! the cut point to the last bit: cut or not, their edges cancel.

use super::fill::Corner;
use super::place::{GUARD_MAX, GUARD_MIN, Placing};

/// Homogeneous screen coordinates (X, Y, W, D) of a polygon, and for each corner the edge that follows.
#[derive(Clone, Copy, Debug)]
struct Polygon {
    corner: [([f64; 4], EdgeOf); 8],
    len: usize,
}

/// Where a polygon's edge comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EdgeOf {
    /// The triangle's edge from corner k.
    Triangle(u8),
    /// A plane that cuts.
    Cut,
}

/// What is left of a triangle on the screen: corners in order, each with the edge that follows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clipped {
    pub corner: [(Corner, EdgeOf); 8],
    pub len: usize,
    /// Sign of the doubled area of each triangle of the fan from corner 0; 0 if they disagree or all is empty.
    pub sign: i32,
}

/// Clips one triangle, given as (X, Y, W, D). `None` if nothing is left or a number is none.
pub(super) fn clip(v: [[f64; 4]; 3], placing: &Placing) -> Option<Clipped> {
    if v.iter().flatten().any(|c| !c.is_finite()) {
        return None;
    }
    let empty = ([0.0; 4], EdgeOf::Cut);
    let mut polygon = Polygon { corner: [empty; 8], len: 3 };
    for (k, p) in v.into_iter().enumerate() {
        polygon.corner[k] = (p, EdgeOf::Triangle(k as u8));
    }
    let (low, high) = (GUARD_MIN * 256.0, GUARD_MAX * 256.0);
    // Non-negative inside; the near plane first, so that W is positive for the others.
    let planes: [fn(&[f64; 4], f64) -> f64; 5] = [
        |p, _| p[2] - p[3],
        |p, low| p[0] - low * p[2],
        |p, high| high * p[2] - p[0],
        |p, low| p[1] - low * p[2],
        |p, high| high * p[2] - p[1],
    ];
    for (plane, bound) in planes.iter().zip([0.0, low, high, low, high]) {
        polygon = cut(&polygon, |p| plane(p, bound));
        if polygon.len < 3 {
            return None;
        }
    }
    let nothing = (Corner { x: 0, y: 0, depth: 0.0 }, EdgeOf::Cut);
    let mut clipped = Clipped { corner: [nothing; 8], len: polygon.len, sign: 0 };
    for (to, (p, edge)) in clipped.corner.iter_mut().zip(&polygon.corner[..polygon.len]) {
        *to = (snapped(p, placing), *edge);
    }
    clipped.sign = sign_of_fan(&clipped);
    Some(clipped)
}

/// Where a point is on the screen.
pub(super) fn snapped(p: &[f64; 4], placing: &Placing) -> Corner {
    // Cut points may miss the band by a rounding; snapping must not.
    let (low, high) = (GUARD_MIN * 256.0, GUARD_MAX * 256.0);
    let snap = |c: f64| (c / p[2]).clamp(low, high).round_ties_even() as i32;
    Corner { x: snap(p[0]), y: snap(p[1]), depth: placing.depth(p[3] / p[2]) }
}

/// Bit by bit the planes that a point is beyond, as [`clip`] sees it. Several points that are all beyond one plane
/// have nothing inside. A point that is no number is beyond all.
pub(super) fn beyond(p: &[f64; 4]) -> u8 {
    let (low, high) = (GUARD_MIN * 256.0, GUARD_MAX * 256.0);
    let inside = [
        p[2] - p[3] >= 0.0,
        p[0] - low * p[2] >= 0.0,
        high * p[2] - p[0] >= 0.0,
        p[1] - low * p[2] >= 0.0,
        high * p[2] - p[1] >= 0.0,
    ];
    let mut beyond = 0;
    for (bit, inside) in inside.into_iter().enumerate() {
        beyond |= u8::from(!inside) << bit;
    }
    if p.iter().all(|c| c.is_finite()) { beyond } else { 0x1F }
}

fn sign_of_fan(clipped: &Clipped) -> i32 {
    let (mut positive, mut negative) = (false, false);
    let c = &clipped.corner;
    for i in 1..clipped.len - 1 {
        let area = doubled_area(&c[0].0, &c[i].0, &c[i + 1].0);
        positive |= area > 0;
        negative |= area < 0;
    }
    i32::from(positive) - i32::from(negative)
}

/// Twice the signed area of a triangle on the screen, 1/65536 pixel.
#[inline(always)]
pub(super) fn doubled_area(a: &Corner, b: &Corner, c: &Corner) -> i64 {
    i64::from(b.x - a.x) * i64::from(c.y - a.y) - i64::from(c.x - a.x) * i64::from(b.y - a.y)
}

fn cut(polygon: &Polygon, side: impl Fn(&[f64; 4]) -> f64) -> Polygon {
    let mut out = Polygon { corner: polygon.corner, len: 0 };
    let mut push = |p: [f64; 4], edge: EdgeOf| {
        out.corner[out.len] = (p, edge);
        out.len += 1;
    };
    for i in 0..polygon.len {
        let ((p, edge), (q, _)) = (polygon.corner[i], polygon.corner[(i + 1) % polygon.len]);
        let (sp, sq) = (side(&p), side(&q));
        if sp >= 0.0 {
            // An edge in the plane itself: what is beyond is gone, whatever it was.
            push(p, if sp == 0.0 && sq == 0.0 { EdgeOf::Cut } else { edge });
        }
        if (sp >= 0.0) != (sq >= 0.0) {
            // From the inner end to the outer, whichever way the edge is walked.
            let (inner, outer, si, so) = if sp >= 0.0 { (p, q, sp, sq) } else { (q, p, sq, sp) };
            let t = si / (si - so);
            let at = std::array::from_fn(|k| inner[k] + (outer[k] - inner[k]) * t);
            // Going out, the plane's own edge follows; coming in, the rest of this one.
            push(at, if sp >= 0.0 { EdgeOf::Cut } else { edge });
        }
    }
    out
}
