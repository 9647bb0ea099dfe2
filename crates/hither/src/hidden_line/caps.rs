//! Where a plane cuts a closed body, the cut is closed by a cap: a flat face that hides what is behind it.
//!
//! Each section plane cuts the whole mesh, as if there were no other plane; the outline is thus closed wherever
//! the body is. Its segments run with the body on one side, as the faces wind, so that a point's winding number
//! tells whether it is inside, also where closed shells of a mesh overlap or one is hollow. Where faces wind
//! inconsistently, what the outline encloses an odd number of times is inside. What other planes take away is
//! then taken from the cap. A body that is open where it is cut has no cap there, only an outline.

mod outline;

use super::arrangement::{self, Polygon};
use super::lens::HalfSpace;
use super::predicates::orientation;
use super::shown::{Cap, Fate, SectionLine, Shown};
use super::topology::NONE;
use glam::{DVec2, DVec3};
use outline::Outline;

/// The side of the square that an outline is scaled to: the arrangement's units are pixels of a picture.
const SIDE: f64 = 1000.0;

/// Adds the caps and the outlines of all cuts to what is shown.
pub(super) fn add(shown: &mut Shown) {
    let planes = shown.planes.clone();
    for solid in 0..shown.solids.len() {
        if shown.solids[solid].cut.is_none() {
            continue;
        }
        for (k, plane) in planes.iter().enumerate().filter(|(_, p)| p.section) {
            let of_solid = &shown.solids[solid];
            let outline = Outline::of(of_solid.topology, &of_solid.view_from_mesh, plane, &shown.lens);
            if !outline.segments.is_empty() {
                add_cut(shown, &planes, k, solid as u32, &outline);
            }
        }
    }
}

/// Adds the cap and the outline that plane `k` makes of a solid.
fn add_cut(shown: &mut Shown, planes: &[HalfSpace], k: usize, solid: u32, outline: &Outline) {
    let others = || planes.iter().enumerate().filter(move |(other, _)| *other != k);
    let cap = Cap { plane: k as u32, solid };
    for (segment, &triangle) in outline.segments.iter().zip(&outline.triangles) {
        let mut line = segment.map(|at| outline.points[at as usize]).to_vec();
        for (_, plane) in others() {
            line = kept(&line, plane, false).0;
        }
        if let [a, b] = line[..] {
            add_line(shown, cap, triangle, [a, b]);
        }
    }
    for triangle in triangles(outline, &planes[k]) {
        let mut polygon = triangle.to_vec();
        let mut ends = Vec::new();
        for (other, plane) in others() {
            let (rest, cut) = kept(&polygon, plane, true);
            polygon = rest;
            // Two sections meet in a line, which is drawn once.
            if let Some(cut) = cut
                && (!plane.section || k < other)
            {
                ends.push((other, cut));
            }
        }
        for i in 2..polygon.len() {
            add_triangle(shown, [polygon[0], polygon[i - 1], polygon[i]], cap);
        }
        for (other, cut) in ends {
            let mut line = cut.to_vec();
            for (_, plane) in others().filter(|o| o.0 > other) {
                line = kept(&line, plane, false).0;
            }
            let plane = if planes[other].section { cap.plane } else { other as u32 };
            if let [a, b] = line[..] {
                add_line(shown, Cap { plane, ..cap }, NONE, [a, b]);
            }
        }
    }
}

/// What a plane keeps of a polygon, or of a line of two points; and where it cuts a polygon.
fn kept(points: &[DVec3], plane: &HalfSpace, closed: bool) -> (Vec<DVec3>, Option<[DVec3; 2]>) {
    let mut rest = Vec::with_capacity(points.len() + 1);
    let (mut cut, mut outside) = (Vec::new(), false);
    for (i, &a) in points.iter().enumerate() {
        let sa = plane.side(a);
        outside |= sa < 0.0;
        if sa >= 0.0 {
            rest.push(a);
        }
        if sa == 0.0 {
            cut.push(a);
        }
        if i + 1 == points.len() && !closed {
            break;
        }
        let b = points[(i + 1) % points.len()];
        let sb = plane.side(b);
        if sa * sb < 0.0 {
            let crossing = a + (b - a) * (sa / (sa - sb));
            rest.push(crossing);
            cut.push(crossing);
        }
    }
    let cut = if let [a, b] = cut[..] { (outside && a != b).then_some([a, b]) } else { None };
    (rest, cut)
}

fn add_point(shown: &mut Shown, p: DVec3) -> u32 {
    shown.in_view.push(p);
    shown.screen.push(shown.lens.project(p));
    shown.in_view.len() as u32 - 1
}

fn add_line(shown: &mut Shown, of: Cap, triangle: u32, ends: [DVec3; 2]) {
    let vertices = ends.map(|p| add_point(shown, p));
    shown.sections.push(SectionLine { solid: of.solid, plane: of.plane, triangle, vertices });
}

fn add_triangle(shown: &mut Shown, corners: [DVec3; 3], cap: Cap) {
    let vertices = corners.map(|p| add_point(shown, p));
    let [a, b, c] = vertices.map(|v| shown.screen[v as usize]);
    let facing = orientation(a, b, c);
    shown.triangles.push(vertices);
    shown.facing.push(facing);
    shown.fate.push(if facing == 0 { Fate::EdgeOn } else { Fate::Live });
    shown.caps.push(cap);
}

/// What an outline encloses in its plane, as triangles.
fn triangles(outline: &Outline, plane: &HalfSpace) -> Vec<[DVec3; 3]> {
    let (loops, winding) = outline.loops();
    if loops.is_empty() {
        return Vec::new();
    }
    let normal = plane.normal.normalize_or(DVec3::Z);
    let across = normal.any_orthonormal_vector();
    let up = normal.cross(across);
    let origin = outline.points[loops[0][0] as usize];
    let flat = |v: u32| {
        let p = outline.points[v as usize] - origin;
        DVec2::new(p.dot(across), p.dot(up))
    };
    let contours: Polygon = loops.iter().map(|l| l.iter().map(|&v| flat(v)).collect()).collect();
    let reach = contours.iter().flatten().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
    if reach <= 0.0 {
        return Vec::new();
    }
    let scale = SIDE / reach;
    let scaled: Polygon = contours.into_iter().map(|c| c.into_iter().map(|p| p * scale).collect()).collect();
    let inside = arrangement::enclosed(&scaled, winding);
    let back = |p: DVec2| origin + (across * p.x + up * p.y) / scale;
    inside.iter().flat_map(arrangement::triangles).map(|t| t.map(back)).collect()
}
