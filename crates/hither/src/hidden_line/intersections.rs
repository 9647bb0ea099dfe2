//! Lines in which surfaces meet: where they pass through each other, and where an edge of one lies on the
//! other.
//!
//! Pairs of triangles that may be seen are found through the grid: those whose boxes and depths overlap, and which
//! are not known to lie in one plane (`flats`).
//! Of a pair each triangle cuts the other's plane in a segment; both segments lie on the line common to the
//! planes, and their overlap is where the triangles meet. A corner nearer to the other's plane than the
//! tolerance lies in it. The cut of an edge by a plane is computed the same for all triangles at that edge,
//! so that the segments of neighbouring pairs meet in every bit.

use super::Kinds;
use super::draw::{Piece, is_live, push_parts};
use super::drawing::{Counters, Kind};
use super::flats::Flats;
use super::shown::{SectionLine, Shown};
use super::topology::{Mix, NONE, ordered};
use super::trace::{NO_SHEET, Own, Scratch, Tracer};
use glam::DVec3;
use std::collections::HashSet;
use std::ops::Range;

/// Bands of rows that are searched independently.
const BANDS: usize = 16;

/// Meetings that one thread traces at a time.
const CHUNK: usize = 1024;

/// Planes at a smaller angle than this, radians, are one plane.
const PARALLEL: f64 = 1e-7;

/// A line in which two triangles meet.
pub(super) struct Meeting {
    ends: [DVec3; 2],
    kind: Kind,
    triangles: [u32; 2],
    /// Whether it may be found in several bands.
    repeats: bool,
}

/// Finds the lines of these kinds in which the live triangles meet.
/// Cost: the pairs of triangles that overlap on the paper and in depth.
pub(super) fn find(tracer: &Tracer, kinds: &Kinds, counters: &mut Counters) -> Vec<Meeting> {
    if !kinds.intersection && !kinds.contact {
        return Vec::new();
    }
    let (crew, list) = (tracer.shown.crew, &tracer.surfaces.list);
    let mut planes = Vec::new();
    crew.extend(&mut planes, list.len(), |i| Plane::of(tracer.shown, list[i].triangle));
    let (mut meetings, pairs) = meetings(tracer, &planes);
    meetings.retain(|m| is_wanted(m, kinds));
    counters.pairs += pairs;
    meetings
}

fn is_wanted(meeting: &Meeting, kinds: &Kinds) -> bool {
    if meeting.kind == Kind::Intersection { kinds.intersection } else { kinds.contact }
}

/// Follows those meetings that are of these kinds, and adds their parts to `pieces`.
pub(super) fn add(
    tracer: &Tracer,
    meetings: &[Meeting],
    kinds: &Kinds,
    pieces: &mut Vec<Piece>,
    counters: &mut Counters,
) {
    let crew = tracer.shown.crew;
    let of_chunk = |scratch: &mut Scratch, chunk: &[Meeting]| {
        let (mut pieces, mut lines) = (Vec::new(), 0);
        for meeting in chunk.iter().filter(|m| is_wanted(m, kinds)) {
            lines += 1;
            let [p, q] = meeting.ends.map(|e| tracer.shown.lens.project(e));
            if p.truncate() == q.truncate() {
                continue;
            }
            let shown = tracer.shown;
            let sheet = |t: u32| match shown.cap(t) {
                Some(_) => None,
                None => shown.sheet(&shown.solids[shown.solid_of(t)], t),
            };
            let own = Own {
                owns: |t: u32| meeting.triangles.contains(&t),
                anchored: meeting.triangles.iter().any(|&t| tracer.hides(t)),
                sheets: meeting.triangles.map(|t| sheet(t).unwrap_or(NO_SHEET)),
            };
            tracer.trace([p, q], &own, scratch);
            let part = meeting.triangles.map(|t| tracer.shown.part_of(t));
            push_parts(&mut pieces, p, q, part[0].min(part[1]), meeting.kind, scratch);
        }
        (pieces, lines, std::mem::take(&mut scratch.tests))
    };
    let chunks = meetings.chunks(CHUNK).collect();
    let found = crew.map_with(chunks, || Scratch::new(tracer.occluders), of_chunk);
    for (more, lines, tests) in found {
        pieces.extend(more);
        counters.lines += lines;
        counters.tests += tests;
    }
}

/// All meetings, each once, and how many pairs were tried for them.
fn meetings(tracer: &Tracer, planes: &[Plane]) -> (Vec<Meeting>, u64) {
    let flats = Flats::find(tracer.shown, tracer.surfaces, planes);
    let of_band = |band: usize| {
        let rows = tracer.surfaces.grid.rows;
        let rows = rows * band / BANDS..rows * (band + 1) / BANDS;
        let mut found = Vec::new();
        let pairs = meetings_in_rows(tracer, planes, &flats, rows, &mut found);
        (found, pairs)
    };
    let found = tracer.shown.crew.map((0..BANDS).collect(), of_band);
    let mut known: HashSet<[u32; 2], Mix> = HashSet::default();
    let pairs = found.iter().map(|band| band.1).sum();
    let mut all: Vec<Meeting> = found.into_iter().flat_map(|band| band.0).collect();
    all.retain(|m| !m.repeats || known.insert(m.triangles));
    (all, pairs)
}

/// The outlines of cuts; also those by the view's range of depth, if they are wanted.
pub(super) fn add_sections(tracer: &Tracer, all: bool, pieces: &mut Vec<Piece>, counters: &mut Counters) {
    let shown = tracer.shown;
    let mut scratch = Scratch::new(tracer.occluders);
    for line in &shown.sections {
        let [p, q] = line.vertices.map(|v| shown.screen[v as usize]);
        if !all && !shown.planes[line.plane as usize].section {
            continue;
        }
        if p.truncate() == q.truncate() {
            continue;
        }
        let own = Own { owns: |t: u32| is_cut_at(shown, line, t), anchored: false, sheets: [NO_SHEET; 2] };
        tracer.trace([p, q], &own, &mut scratch);
        push_parts(pieces, p, q, shown.solids[line.solid as usize].part, Kind::Section, &scratch);
        counters.lines += 1;
    }
    counters.tests += scratch.tests;
}

/// Whether a line of a cut is part of a triangle: of what is left of the triangle that is cut, or of a cap in
/// the same plane.
fn is_cut_at(shown: &Shown, line: &SectionLine, triangle: u32) -> bool {
    if let Some(cap) = shown.cap(triangle) {
        return cap.plane == line.plane || (line.triangle == NONE && cap.solid == line.solid);
    }
    let solid = &shown.solids[line.solid as usize];
    let (first, end) = (solid.first_triangle, solid.first_triangle + solid.triangle_count);
    (first..end).contains(&triangle) && shown.origin(solid, triangle) == line.triangle
}

/// The plane of a triangle in view space.
pub(super) struct Plane {
    pub normal: DVec3,
    offset: f64,
}

impl Plane {
    fn of(shown: &Shown, triangle: u32) -> Plane {
        let [a, b, c] = shown.corners_in_view(triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Plane { normal, offset: -normal.dot(a) }
    }

    /// Distance of a point, signed.
    #[inline(always)]
    pub fn side(&self, p: DVec3) -> f64 {
        self.normal.dot(p) + self.offset
    }

    /// Whether all corners are farther from the plane than `tolerance`, on one side.
    fn misses(&self, corners: &[DVec3; 3], tolerance: f64) -> bool {
        // Not by `map`, which is not always inlined.
        let [a, b, c] = [self.side(corners[0]), self.side(corners[1]), self.side(corners[2])];
        (a > tolerance && b > tolerance && c > tolerance)
            || (a < -tolerance && b < -tolerance && c < -tolerance)
    }
}

/// The meetings of pairs of triangles that share a cell of these rows, each once; returns how many pairs were tried,
/// as often as they share a cell.
fn meetings_in_rows(
    tracer: &Tracer,
    planes: &[Plane],
    flats: &Flats,
    rows: Range<usize>,
    found: &mut Vec<Meeting>,
) -> u64 {
    let (shown, occluders) = (tracer.shown, tracer.surfaces);
    let grid = &occluders.grid;
    // A plane's offset is rounded: what it rejects must be clearly beyond the tolerance.
    let clear = shown.lens.tolerance * 2.0;
    let mut known: HashSet<(u32, u32), Mix> = HashSet::default();
    let mut skips = Vec::new();
    let mut pairs = 0;
    for cell in rows.start * grid.columns..rows.end * grid.columns {
        let (column, row) = (cell % grid.columns, cell / grid.columns);
        let list = occluders.in_cell(cell);
        flats.skips(list, &mut skips);
        for (i, &a) in list.iter().enumerate() {
            let first = &occluders.list[a as usize];
            let reach = first.bounds().reach();
            let (farthest, nearest) = (f64::from(first.farthest), f64::from(first.nearest));
            let least = farthest - shown.lens.coarse(nearest);
            let corners = shown.corners_in_view(first.triangle);
            let mut next = i + 1;
            while let Some(&b) = list.get(next) {
                pairs += 1;
                if flats.share(a, b) {
                    next = skips[next];
                    continue;
                }
                next += 1;
                let second = &occluders.list[b as usize];
                if f64::from(second.nearest) < least {
                    break;
                }
                let of = [&planes[a as usize], &planes[b as usize]];
                if !second.bounds().meets(reach)
                    || of[1].misses(&corners, clear)
                    || of[0].misses(&shown.corners_in_view(second.triangle), clear)
                {
                    continue;
                }
                let triangles = [first.triangle, second.triangle];
                // Pairs share several cells. Small ones count in the cell where their boxes' overlap begins;
                // large ones are not in every cell, and count in each band once. Only meetings are remembered:
                // they are far fewer than pairs that do not meet after all.
                if occluders.large[a as usize] || occluders.large[b as usize] {
                    if !known.contains(&(a, b))
                        && let Some(meeting) = meeting(shown, triangles, of)
                    {
                        known.insert((a, b));
                        found.push(Meeting { repeats: true, ..meeting });
                    }
                    continue;
                }
                let begin = first.bounds().min().max(second.bounds().min());
                if grid.column(begin.x) == column && grid.row(begin.y) == row {
                    found.extend(meeting(shown, triangles, of));
                }
            }
        }
    }
    pairs
}

/// Where two triangles meet, of which these are the planes, unless they share an edge, lie in one plane, or meet in
/// less than a line. What ends most pairs for least comes first.
fn meeting(shown: &Shown, [a, b]: [u32; 2], planes: [&Plane; 2]) -> Option<Meeting> {
    if shown.cap(a).is_some() || shown.cap(b).is_some() {
        return None;
    }
    let vertices = [a, b].map(|t| shown.triangles[t as usize]);
    if vertices[0].iter().filter(|v| vertices[1].contains(v)).count() > 1 {
        return None;
    }
    debug_assert!(is_live(shown, a) && is_live(shown, b));
    let corners = [shown.corners_in_view(a), shown.corners_in_view(b)];
    let n = [planes[0].normal, planes[1].normal];
    let sides_b = sides(shown, &corners[1], &corners[0], n[0])?;
    let sides_a = sides(shown, &corners[0], &corners[1], n[1])?;
    if is_point(&sides_a) || is_point(&sides_b) || abut(shown, a, b) {
        return None;
    }
    let direction = n[0].cross(n[1]);
    if direction.length_squared() < PARALLEL * PARALLEL {
        return None;
    }
    let direction = direction.normalize();
    let mut of_a = cut(&vertices[0], &corners[0], &sides_a, direction)?;
    let of_b = cut(&vertices[1], &corners[1], &sides_b, direction)?;
    let along = |p: DVec3| (p - corners[0][0]).dot(direction);
    if along(of_b[0]) > along(of_a[0]) {
        of_a[0] = of_b[0];
    }
    if along(of_b[1]) < along(of_a[1]) {
        of_a[1] = of_b[1];
    }
    if along(of_a[1]) - along(of_a[0]) <= shown.lens.rounding_of_point(of_a[0]) {
        return None;
    }
    let passes = passes_through(shown, a, &sides_a, corners[1][0], n[1])
        && passes_through(shown, b, &sides_b, corners[0][0], n[0]);
    let kind = if passes { Kind::Intersection } else { Kind::Contact };
    Some(Meeting { ends: of_a, kind, triangles: [a, b], repeats: false })
}

/// Whether two triangles are one surface that goes on over a part of an edge.
fn abut(shown: &Shown, a: u32, b: u32) -> bool {
    let solid = &shown.solids[shown.solid_of(a)];
    let abutting = &solid.topology.abutting;
    let (first, end) = (solid.first_triangle, solid.first_triangle + solid.triangle_count);
    !abutting.is_empty()
        && (first..end).contains(&b)
        && abutting.contains(&ordered(shown.origin(solid, a), shown.origin(solid, b)))
}

/// On which side of another triangle's plane each corner is: a distance, or 0 within the tolerance. `None` if
/// the triangle does not reach the plane, or lies in it.
fn sides(shown: &Shown, corners: &[DVec3; 3], plane: &[DVec3; 3], normal: DVec3) -> Option<[f64; 3]> {
    let lens = &shown.lens;
    // Neither of the roundings is more than the tolerance, which is known already.
    let lies = |c: DVec3, side: f64| {
        side.abs() <= lens.tolerance
            && (side.abs() <= lens.rounding_of_point(c)
                || side.abs() <= lens.rounding_of_plane(normal, plane))
    };
    let side = |c: DVec3| {
        let side = normal.dot(c - plane[0]);
        if lies(c, side) { 0.0 } else { side }
    };
    let sides = [side(corners[0]), side(corners[1]), side(corners[2])];
    let reaches = sides.iter().any(|&s| s >= 0.0) && sides.iter().any(|&s| s <= 0.0);
    let lies_in = sides.iter().all(|&s| s == 0.0);
    (reaches && !lies_in).then_some(sides)
}

/// Whether a triangle has no more than a corner in a plane: the others are on one side of it.
fn is_point(sides: &[f64; 3]) -> bool {
    let on = |sign: f64| sides.iter().filter(|&&s| s * sign > 0.0).count();
    sides.contains(&0.0) && on(1.0).max(on(-1.0)) == 2
}

/// The segment in which a triangle cuts a plane, ordered along `direction`; `None` if it is a point.
fn cut(vertices: &[u32; 3], corners: &[DVec3; 3], sides: &[f64; 3], direction: DVec3) -> Option<[DVec3; 2]> {
    let mut ends = [DVec3::ZERO; 3];
    let mut count = 0;
    for k in 0..3 {
        let m = (k + 1) % 3;
        if sides[k] == 0.0 {
            ends[count] = corners[k];
            count += 1;
        } else if sides[k] * sides[m] < 0.0 {
            // The same arithmetic from both triangles at this edge.
            let (i, j) = if vertices[k] < vertices[m] { (k, m) } else { (m, k) };
            ends[count] = corners[i] + (corners[j] - corners[i]) * (sides[i] / (sides[i] - sides[j]));
            count += 1;
        }
    }
    if count < 2 {
        return None;
    }
    let forward = (ends[1] - ends[0]).dot(direction) >= 0.0;
    Some(if forward { [ends[0], ends[1]] } else { [ends[1], ends[0]] })
}

/// Whether the surface of triangle `t` is on both sides of a plane near where they meet: the triangle itself
/// is, or it has an edge in the plane and its neighbour there is on the other side.
fn passes_through(shown: &Shown, t: u32, sides: &[f64; 3], point: DVec3, normal: DVec3) -> bool {
    if sides.iter().any(|&s| s > 0.0) && sides.iter().any(|&s| s < 0.0) {
        return true;
    }
    let Some(k) = (0..3).find(|&k| sides[k] == 0.0 && sides[(k + 1) % 3] == 0.0) else { return false };
    let solid = &shown.solids[shown.solid_of(t)];
    if solid.cut.is_some() {
        return false;
    }
    let neighbour = shown.place(solid, solid.topology.neighbours[shown.origin(solid, t) as usize][k]);
    if neighbour == NONE {
        return false;
    }
    let edge = [0, 1].map(|i| shown.triangles[t as usize][(k + i) % 3]);
    let other = shown.triangles[neighbour as usize].iter().find(|v| !edge.contains(v));
    let Some(other) = other.map(|&v| shown.in_view[v as usize]) else { return false };
    let (theirs, ours) = (normal.dot(other - point), sides[(k + 2) % 3]);
    theirs * ours < 0.0 && theirs.abs() > shown.lens.rounding_of_point(other)
}
