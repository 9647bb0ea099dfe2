//! Faces that reach the near plane or leave the guard band, in f64, one triangle at a time.
//!
//! A cut point is computed from its edge's ends in a fixed order, so that two faces that share an edge share
//! the cut point to the last bit: cut or not, their edges cancel.

use super::fill::Corner;
use super::place::Placing;
use crate::raster::{GUARD_MAX, GUARD_MIN, GuardedPolygon};

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
    let edges = [EdgeOf::Triangle(0), EdgeOf::Triangle(1), EdgeOf::Triangle(2)];
    let polygon = GuardedPolygon::of_triangle(&v, edges, EdgeOf::Cut)?;
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
