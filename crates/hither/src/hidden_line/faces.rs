//! Visible faces as polygons with holes.
//!
//! The visible parts of *all* lines (every edge that is not within a plane, and every meeting of surfaces)
//! cut the paper into regions, and within a region nothing changes: one face is seen in all of it. So a look
//! at one point of a region tells what it shows. Regions of the same flat face are put together again. The
//! polygons tile what is covered: they share their borders, and nothing hidden is among them.
//!
//! Where blended surfaces hide nothing, a region shows all of them as far as the first surface that does: as one
//! polygon in the colour that they make together, so that the tiling stays one.

use super::FaceColor;
use super::arrangement::{self, Polygon};
use super::cover::Plane;
use super::draw::Piece;
use super::drawing::Face;
use super::edges::FLAT;
use super::occluders::Occluders;
use super::regions::{self, Regions};
use super::runs::Runs;
use super::shown::Shown;
use super::topology::{Topology, trait_of};
use super::trace::Tracer;
use glam::{DVec2, DVec3, Vec3};
use std::cmp::Ordering;
use std::collections::HashMap;

/// Contours of less area, square pixels, are rounding.
const LEAST_AREA: f64 = 1e-9;

/// The faces that are seen, given the visible parts of all lines that bound faces.
pub(super) fn find(tracer: &Tracer, bounds: &[Piece], color: FaceColor) -> Vec<Face> {
    let crew = tracer.shown.crew;
    let paper = [DVec2::ZERO, tracer.picture];
    let mut regions = regions::cut(crew, paper, bounds.iter().map(|piece| piece.ends), |p| gap(tracer, p));
    let all = std::mem::take(&mut regions.all);
    let shares = crew.shares(all.len(), 16);
    let seen = crew.map(shares, |range| all[range].iter().map(|r| seen_in(tracer, r)).collect::<Vec<_>>());
    let mut flats: HashMap<*const Topology, Vec<u32>> = HashMap::new();
    let mut groups: HashMap<Vec<Group>, Vec<Region>> = HashMap::new();
    for (polygons, seen) in all.into_iter().zip(seen.into_iter().flatten()) {
        if !seen.is_empty() {
            let group = seen.iter().map(|&t| group_of(tracer.shown, t, &mut flats)).collect();
            groups.entry(group).or_default().push(Region { seen, polygons });
        }
    }
    let mut groups: Vec<(Vec<Group>, Vec<Region>)> = groups.into_iter().collect();
    groups.sort_by(|a, b| a.0.cmp(&b.0));
    let faces_of =
        |(group, parts): (Vec<Group>, Vec<Region>)| faces_of(tracer, &regions, &group, parts, color);
    let mut faces: Vec<Face> = crew.map(groups, faces_of).into_iter().flatten().collect();
    faces.sort_by_key(|f| (f.part, f.cut, f.color, f.opacity.to_bits()));
    faces
}

/// The faces of a group: its regions, put together.
fn faces_of(
    tracer: &Tracer,
    regions: &Regions,
    group: &[Group],
    parts: Vec<Region>,
    color: FaceColor,
) -> Vec<Face> {
    let Some((last, through)) = group.split_last() else { return Vec::new() };
    // The same, whichever region was found first.
    let layer = |k: usize| parts.iter().map(|p| p.seen[k]).min().unwrap_or_default();
    let seen: Vec<u32> = (0..group.len()).map(layer).collect();
    let (color, opacity) = shade(tracer, &seen, color);
    let triangle = tracer.shown.mesh_triangle(seen[through.len()]);
    let through: Vec<u32> = through.iter().map(|g| g.part).collect();
    let mut polygons: Vec<Polygon> = parts.into_iter().flat_map(|p| p.polygons).collect();
    if polygons.len() > 1 {
        polygons = arrangement::merged(&polygons);
        polygons.iter_mut().flatten().for_each(|contour| regions.straighten(contour));
    }
    let mut faces = Vec::with_capacity(polygons.len());
    for mut contours in polygons {
        if arrangement::area_within(&contours[0]) < LEAST_AREA {
            continue;
        }
        contours.retain(|c| arrangement::area_within(c) >= LEAST_AREA);
        let (part, cut, through) = (last.part, last.cut, through.clone());
        faces.push(Face { part, through, triangle, cut, color, opacity, contours });
    }
    faces
}

/// How far apart, pixels, lines near a point may end that should meet. Where surfaces meet almost at an edge, the edge is
/// seen up to where depths are the same but for rounding, and the meeting begins where they are the same.
fn gap(tracer: &Tracer, p: DVec2) -> f64 {
    /// The more the flatter surfaces are to each other and to the line of sight.
    const TOLERANCES: f64 = 8.0;
    let Occluders { grid, list, .. } = tracer.surfaces;
    let nearest = tracer.surfaces.in_cell(grid.index(grid.column(p.x), grid.row(p.y))).first();
    nearest.map_or(0.0, |&i| {
        let lens = &tracer.shown.lens;
        TOLERANCES * lens.tolerance * lens.pixels_per_metre(f64::from(list[i as usize].nearest))
    })
}

/// A region of the paper, and the triangles that are seen in it, nearest first.
struct Region {
    seen: Vec<u32>,
    polygons: Vec<Polygon>,
}

/// What is one face: a flat run of neighbours of one material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Group {
    part: u32,
    cut: bool,
    flat: u32,
}

fn group_of(shown: &Shown, triangle: u32, flats: &mut HashMap<*const Topology, Vec<u32>>) -> Group {
    let part = shown.part_of(triangle);
    if let Some(plane) = shown.cap_plane(triangle) {
        return Group { part, cut: true, flat: plane };
    }
    let topology = shown.solids[shown.solid_of(triangle)].topology;
    let flat = flats.entry(topology).or_insert_with(|| flat_runs(topology));
    Group { part, cut: false, flat: flat[shown.mesh_triangle(triangle) as usize] }
}

/// For each triangle, the first of those that it lies in one plane with, from neighbour to neighbour.
fn flat_runs(topology: &Topology) -> Vec<u32> {
    let mut runs = Runs::new(topology.triangles.len());
    let flat = (2.0 * (FLAT * 0.5).sin().powi(2)) as f32;
    for edge in &topology.edges {
        let apart = edge.traits & (trait_of::NON_MANIFOLD | trait_of::BORDER) != 0;
        if !apart && edge.bend <= flat {
            let [a, b] = edge.triangles;
            runs.join(a, b);
        }
    }
    runs.firsts()
}

/// What is seen in a region, nearest first: surfaces that hide nothing, and the first that does, if there is one. Where
/// two of different parts are at the same depth, a place is looked for where one of them is before the other.
fn seen_in(tracer: &Tracer, region: &[Polygon]) -> Vec<u32> {
    /// Places that are tried.
    const MOST_PLACES: usize = 24;
    let part_of = |t: &u32| tracer.shown.part_of(*t);
    let mut places = arrangement::points_inside(region).into_iter();
    let Some(widest) = places.next() else { return Vec::new() };
    let mut tied = Vec::new();
    let first = seen(tracer, widest, &mut tied);
    if tied.is_empty() {
        return first;
    }
    // Where it is narrow a place may lie beside what is seen in the region: then it shows another part.
    let decided = places.take(MOST_PLACES - 1).find_map(|p| {
        let mut tied_here = Vec::new();
        let seen = seen(tracer, p, &mut tied_here);
        let is_one = seen.last().is_some_and(|t| tied.contains(&part_of(t)));
        (tied_here.is_empty() && is_one).then_some(seen)
    });
    decided.unwrap_or(first)
}

/// What is seen at a point, nearest first. Of several at the same depth that counts of the smallest part, then the
/// first; such of different parts are added to `tied`.
fn seen(tracer: &Tracer, p: DVec2, tied: &mut Vec<u32>) -> Vec<u32> {
    let (shown, surfaces) = (tracer.shown, tracer.surfaces);
    let grid = &surfaces.grid;
    let mut best: Option<(f64, u32)> = None;
    let mut through: Vec<(f64, u32)> = Vec::new();
    for &i in surfaces.in_cell(grid.index(grid.column(p.x), grid.row(p.y))) {
        let occluder = &surfaces.list[i as usize];
        if best.is_some_and(|(w, _)| f64::from(occluder.nearest) < w - shown.lens.coarse(w)) {
            break;
        }
        let triangle = occluder.triangle;
        let [a, b, c] = shown.corners(triangle);
        let at = p.extend(0.0);
        let sides = [(a, b), (b, c), (c, a)].map(|(a, b)| super::predicates::cross(a, b, at));
        if sides.iter().any(|&s| s < 0.0) && sides.iter().any(|&s| s > 0.0) {
            continue;
        }
        let (farthest, nearest) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        let w = Plane::through(a, b, c).at(p).clamp(farthest, nearest);
        if !tracer.hides(triangle) {
            through.push((w, triangle));
            continue;
        }
        let Some((before, other)) = best else {
            best = Some((w, triangle));
            continue;
        };
        match depth_order(shown, p, (w, triangle), before) {
            Ordering::Less => {}
            Ordering::Greater => {
                tied.clear();
                best = Some((w, triangle));
            }
            Ordering::Equal => {
                if is_before_at_same_depth(shown, [triangle, other], tied) {
                    best = Some((w.max(before), triangle));
                }
            }
        }
    }
    through.retain(|&(w, triangle)| {
        best.is_none_or(|(before, other)| match depth_order(shown, p, (w, triangle), before) {
            Ordering::Equal => is_before_at_same_depth(shown, [triangle, other], tied),
            order => order == Ordering::Greater,
        })
    });
    through.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    through.into_iter().chain(best).map(|s| s.1).collect()
}

/// Whether a surface at depth w is nearer (greater) than what is at depth `before`, at the same depth, or farther.
fn depth_order(shown: &Shown, p: DVec2, (w, triangle): (f64, u32), before: f64) -> Ordering {
    let same = shown.lens.same_depth(shown.corners_in_view(triangle), p.extend(w));
    if (w - before).abs() <= same { Ordering::Equal } else { w.total_cmp(&before) }
}

/// Whether the first of two triangles at the same depth counts. If they are of different parts, these are added to
/// `tied`.
fn is_before_at_same_depth(shown: &Shown, triangles: [u32; 2], tied: &mut Vec<u32>) -> bool {
    let [ours, theirs] = triangles.map(|t| (shown.part_of(t), t));
    if ours.0 != theirs.0 {
        tied.extend([ours.0, theirs.0]);
    }
    ours < theirs
}

/// The colour of a face, sRGB, and its opacity: surfaces over one another, nearest first.
fn shade(tracer: &Tracer, seen: &[u32], color: FaceColor) -> ([u8; 3], f32) {
    let shown = tracer.shown;
    let (mut sum, mut opacity) = (Vec3::ZERO, 0.0);
    for &triangle in seen {
        let linear = match color {
            FaceColor::White => Vec3::ONE,
            FaceColor::Material => shown.color_of(triangle),
            FaceColor::Flat => shown.color_of(triangle) * brightness(shown, triangle) as f32,
        };
        let alpha = if tracer.hides(triangle) { 1.0 } else { shown.opacity_of(triangle) };
        sum += linear * (alpha * (1.0 - opacity));
        opacity += alpha * (1.0 - opacity);
    }
    let linear = if opacity > 0.0 { sum / opacity } else { sum };
    (linear.to_array().map(|c| (srgb(c.clamp(0.0, 1.0)) * 255.0).round() as u8), opacity)
}

/// How bright a face is in a light from above the eye, 0 to 1; the same from both sides.
pub(super) fn brightness(shown: &Shown, triangle: u32) -> f64 {
    const LIGHT: DVec3 = DVec3::new(0.28, 0.56, 0.78);
    let [a, b, c] = shown.corners_in_view(triangle);
    let n = (b - a).cross(c - a).normalize_or(DVec3::Z);
    let n = if n.z < 0.0 { -n } else { n };
    0.25 + 0.75 * n.dot(LIGHT).max(0.0)
}

fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
