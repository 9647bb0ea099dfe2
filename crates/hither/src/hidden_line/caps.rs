//! Where a plane cuts a closed body, the cut is closed by a cap: a flat face that hides what is behind it.
//!
//! The outline of a cut is what `shown` collected while clipping: segments in the plane, that meet in every
//! bit. What they enclose an odd number of times is inside. It is cut along horizontal lines through all its
//! corners, into trapezoids, and those into triangles. A body that is open where it is cut has no cap there.

use super::arrangement;
use super::predicates::orientation;
use super::shown::{Cap, Fate, Shown};
use glam::{DVec2, DVec3};

/// Outlines with more segments are not capped: trapezoids take their square.
const MOST_SEGMENTS: usize = 20_000;

/// Adds the caps of all cuts to what is shown.
pub(super) fn add(shown: &mut Shown) {
    let mut sections = std::mem::take(&mut shown.sections);
    sections.sort_by_key(|s| (s.solid, s.plane));
    for cut in sections.chunk_by(|a, b| (a.solid, a.plane) == (b.solid, b.plane)) {
        if cut.len() > MOST_SEGMENTS || !shown.planes[cut[0].plane as usize].section {
            continue;
        }
        let plane = shown.planes[cut[0].plane as usize];
        let normal = plane.normal.normalize_or(DVec3::Z);
        let across = normal.any_orthonormal_vector();
        let up = normal.cross(across);
        let origin = normal * -(plane.offset / plane.normal.length());
        let flat = |v: u32| {
            let p = shown.in_view[v as usize] - origin;
            DVec2::new(p.dot(across), p.dot(up))
        };
        let outline: Vec<[DVec2; 2]> = cut.iter().map(|s| s.vertices.map(flat)).collect();
        let triangles = triangles(&outline);
        for t in triangles {
            add_triangle(shown, t.map(|p| origin + across * p.x + up * p.y), cut[0].plane, cut[0].solid);
        }
    }
    shown.sections = sections;
}

fn add_triangle(shown: &mut Shown, corners: [DVec3; 3], plane: u32, solid: u32) {
    let first = shown.in_view.len() as u32;
    for corner in corners {
        shown.in_view.push(corner);
        shown.screen.push(shown.lens.project(corner));
    }
    let vertices = [first, first + 1, first + 2];
    let facing = orientation(vertices.map(|v| shown.screen[v as usize]));
    shown.triangles.push(vertices);
    shown.facing.push(facing);
    shown.fate.push(if facing == 0 { Fate::EdgeOn } else { Fate::Live });
    shown.caps.push(Cap { plane, solid });
}

/// What an outline encloses, as triangles.
fn triangles(outline: &[[DVec2; 2]]) -> Vec<[DVec2; 3]> {
    let corners = || outline.iter().flatten();
    let min = corners().fold(DVec2::INFINITY, |m, p| m.min(*p));
    let max = corners().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
    let room = (max - min).max_element() * 0.01 + f64::MIN_POSITIVE;
    let (low, high) = (min - room, max + room);
    // The arrangement's units are pixels of a picture of ordinary size.
    let scale = 1000.0 / (high - low).max_element();
    let scaled = |p: DVec2| (p - low) * scale;
    let mut heights: Vec<f64> = corners().map(|p| scaled(*p).y).collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let size = scaled(high);
    let level = heights.iter().map(|&y| [DVec2::new(0.0, y), DVec2::new(size.x, y)]);
    let lines = outline.iter().map(|s| s.map(scaled)).chain(level);
    let mut triangles = Vec::new();
    for region in arrangement::cut(DVec2::ZERO, size, lines) {
        let Some(p) = arrangement::point_inside(&region) else { continue };
        let crossings = outline.iter().map(|s| s.map(scaled)).filter(|[a, b]| {
            (a.y <= p.y) != (b.y <= p.y) && a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)) > p.x
        });
        if crossings.count() % 2 == 1 {
            let ring = &region[0];
            let back = |p: DVec2| p / scale + low;
            triangles.extend((1..ring.len() - 1).map(|k| [ring[0], ring[k], ring[k + 1]].map(back)));
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_is_filled_between_its_outlines() {
        let v = DVec2::new;
        let square = |r: f64| [v(-r, -r), v(r, -r), v(r, r), v(-r, r)];
        let mut outline = Vec::new();
        for r in [1.0, 3.0] {
            let s = square(r);
            outline.extend((0..4).map(|i| [s[i], s[(i + 1) % 4]]));
        }
        let area: f64 =
            triangles(&outline).iter().map(|t| (t[1] - t[0]).perp_dot(t[2] - t[0]).abs() * 0.5).sum();
        assert!((area - 32.0).abs() < 1e-9, "{area}");
    }
}
