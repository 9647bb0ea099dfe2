//! Signs that must be right: on which side of a line a point lies on the paper.

use glam::DVec3;
use robust::{Coord, orient2d};

/// Relative error of the determinant as computed, doubled for safety [Shewchuk 1997, §4.2].
const BOUND: f64 = 7e-16;

/// Twice the area of the triangle a, b, c on the paper, positive if it turns from +x to +y. The sign is
/// exact, zero included; the value is as rounded as f64 makes it.
#[inline(always)]
pub(super) fn cross(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let left = (a.x - c.x) * (b.y - c.y);
    let right = (a.y - c.y) * (b.x - c.x);
    let value = left - right;
    if value.abs() > BOUND * (left.abs() + right.abs()) { value } else { exact(a, b, c) }
}

#[cold]
fn exact(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let at = |p: DVec3| Coord { x: p.x, y: p.y };
    orient2d(at(a), at(b), at(c))
}

/// The sense of rotation of a triangle on the paper: 1, −1, or 0 where its corners lie on a line.
#[inline]
pub(super) fn orientation(a: DVec3, b: DVec3, c: DVec3) -> i8 {
    let value = cross(a, b, c);
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

/// Whether a point *on* the line from a to b counts as left of it (where [`cross`] is positive).
///
/// Every such point is taken to be moved by the same infinitesimal step (δ, δ²), so that it belongs to
/// exactly one of the triangles that meet at the line, and to none where they meet in a fold behind it.
#[inline]
pub(super) fn counts_as_left(a: DVec3, b: DVec3) -> bool {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    dy < 0.0 || (dy == 0.0 && dx > 0.0)
}
