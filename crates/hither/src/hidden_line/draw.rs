//! From a preparation and a view to a drawing: the order of the work.

use super::caps;
use super::coincident;
use super::cover::{self, Cover};
use super::crew::Crew;
use super::drawing::{Counters, Drawing, Face, Kind};
use super::edges::Choice;
use super::faces;
use super::grid::Grid;
use super::hatch;
use super::intersections::{self, Meeting};
use super::lens::{HalfSpace, Lens};
use super::occluders::Occluders;
use super::shown::{Fate, Shown};
use super::strokes;
use super::topology::NONE;
use super::trace::{NO_SHEET, Own, Scratch, Tracer};
use super::{FaceColor, Kinds, LineOptions, Preparation};
use crate::conventions::{View, ViewError};
use crate::geometry::Aabb;
use glam::{DAffine3, DVec2, DVec3};

/// Edges that one thread traces at a time.
const CHUNK: usize = 4096;

/// The longest side of the grid, cells.
const MOST_CELLS: usize = 768;

/// Strokes that are shorter in all, pixels, are not drawn.
const SPECK_PX: f64 = 1e-3;

/// A line on the paper before it is joined to others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub ends: [DVec2; 2],
    pub part: u32,
    pub kind: Kind,
    pub covers: u32,
}

/// An instance and where its box is on the paper.
struct Placed {
    part: u32,
    mesh: u32,
    view_from_mesh: DAffine3,
    cut: bool,
    min: DVec2,
    max: DVec2,
    nearest: f64,
}

impl Preparation {
    /// Draws what `view` sees. Errors: a view that cannot be drawn ([`View::validate`]).
    pub fn draw(&self, view: &View, options: &LineOptions) -> Result<Drawing, ViewError> {
        view.validate()?;
        let crew = Crew::here();
        Ok(crew.inside(|| self.drawing(view, options, crew)))
    }

    fn drawing(&self, view: &View, options: &LineOptions, crew: Crew) -> Drawing {
        let lens = Lens::new(view, self.tolerance);
        let picture = DVec2::new(f64::from(view.width), f64::from(view.height));
        let planes = planes(view, &lens, options);
        let placed = self.place(view, &lens, &planes, picture);
        let mut counters = Counters {
            instances_culled: (self.instances.len() - placed.len()) as u64,
            ..Counters::default()
        };
        let (shown, mut cover) =
            self.show(Shown::new(crew, lens, planes), &placed, options, picture, &mut counters);
        let grid =
            cover.as_ref().map_or_else(|| grid_over(&placed, picture, shown.triangles.len()), |c| c.grid);
        let see_through = see_through(&shown, options);
        let occluders = Occluders::new(&shown, grid, cover.as_ref(), |t| !see_through(t));
        if let Some(cover) = &mut cover {
            cover.settle_cells(&shown, &occluders, |t| !see_through(t));
        }
        drop(see_through);
        // What is seen through hides nothing, but is seen, and meets others.
        let surfaces =
            sees_through(&shown, options).then(|| Occluders::new(&shown, grid, cover.as_ref(), |_| true));
        counters.triangles = shown.triangles.len() as u64;
        counters.triangles_live = occluders.list.len() as u64;
        let tracer = Tracer {
            shown: &shown,
            occluders: &occluders,
            surfaces: surfaces.as_ref().unwrap_or(&occluders),
            sees_through: surfaces.is_some(),
            cover: cover.as_ref(),
            picture,
            counts: options.hidden,
            piercing: false,
        };
        let drawn = Choice::new(options.kinds, options.crease_angle, options.hidden);
        let mut pieces = trace_edges(&tracer, &drawn, options, &mut counters);
        let wants_faces = options.faces.is_some() || options.hatch.is_some();
        let kinds = if wants_faces { &Kinds::ALL } else { &options.kinds };
        let meetings = intersections::find(&tracer, kinds, &mut counters);
        intersections::add(&tracer, &meetings, &options.kinds, &mut pieces, &mut counters);
        intersections::add_sections(&tracer, false, &mut pieces, &mut counters);
        let mut faces = Vec::new();
        if wants_faces {
            let bounds = bounds_of_faces(tracer, &meetings, options, &mut counters);
            faces = find_faces(&tracer, options, &bounds, &mut pieces);
        }
        pieces.retain(|piece| is_on_paper(piece, picture));
        counters.segments = pieces.len() as u64;
        counters.visible_segments = pieces.iter().filter(|p| p.covers == 0).count() as u64;
        coincident::draw_once(crew, &mut pieces);
        // Giving back so much memory takes a while.
        let ((points, mut strokes), ()) =
            crew.both(|| strokes::join(crew, pieces), || drop((shown, occluders, surfaces, cover)));
        strokes.retain(|s| !is_speck(&points[s.points.start as usize..s.points.end as usize]));
        Drawing { width: picture.x, height: picture.y, points, strokes, faces, counters }
    }

    /// Instances that are in the view, nearest first.
    fn place(&self, view: &View, lens: &Lens, planes: &[HalfSpace], picture: DVec2) -> Vec<Placed> {
        let mut placed: Vec<Placed> = Vec::new();
        for (part, (mesh, world_from_mesh)) in self.instances.iter().enumerate() {
            let view_from_mesh = view.view_from_world * *world_from_mesh;
            let Some((cut, min, max, nearest)) =
                on_paper(&self.bounds[*mesh as usize], &view_from_mesh, lens, planes, picture)
            else {
                continue;
            };
            placed.push(Placed { part: part as u32, mesh: *mesh, view_from_mesh, cut, min, max, nearest });
        }
        placed.sort_by(|a, b| b.nearest.total_cmp(&a.nearest).then(a.part.cmp(&b.part)));
        placed
    }

    /// Projects what may be seen, and learns on the way what cannot.
    fn show<'p>(
        &'p self,
        mut shown: Shown<'p>,
        placed: &[Placed],
        options: &LineOptions,
        picture: DVec2,
        counters: &mut Counters,
    ) -> (Shown<'p>, Option<Cover>) {
        let triangles: usize = placed.iter().map(|p| self.meshes[p.mesh as usize].triangles.len()).sum();
        let mut cover = (!options.hidden).then(|| Cover::new(grid_over(placed, picture, triangles)));
        for p in placed {
            if let Some(cover) = &cover
                && !p.cut
                && cover.hides(cover.grid.cells(p.min, p.max), p.nearest)
            {
                counters.instances_culled += 1;
                continue;
            }
            shown.add(&self.meshes[p.mesh as usize], p.part, &p.view_from_mesh, p.cut);
            let topology = &self.meshes[p.mesh as usize];
            if !options.hidden && (options.transparent_hides || topology.see_through.is_empty()) {
                shown.leave_out_backs(&p.view_from_mesh);
            }
            if let Some(cover) = &mut cover {
                let see_through = see_through(&shown, options);
                cover.add(&shown, |t| !see_through(t));
            }
        }
        caps::add(&mut shown);
        cover::settle(&mut shown, cover.as_ref(), picture);
        (shown, cover)
    }
}

/// Whether blended surfaces hide nothing, and there are any.
fn sees_through(shown: &Shown, options: &LineOptions) -> bool {
    !options.transparent_hides && shown.solids.iter().any(|s| !s.topology.see_through.is_empty())
}

/// Which triangles hide nothing.
fn see_through<'a>(shown: &'a Shown, options: &LineOptions) -> impl Fn(u32) -> bool + use<'a> {
    let asked = sees_through(shown, options);
    move |t: u32| asked && shown.blends(t)
}

fn planes(view: &View, lens: &Lens, options: &LineOptions) -> Vec<HalfSpace> {
    let mut planes = Lens::range(&view.projection);
    for section in &options.sections {
        let normal = -(view.view_from_world.matrix3 * section.normal.normalize_or_zero());
        let point = view.view_from_world.transform_point3(section.point);
        planes.push(HalfSpace { normal, offset: -normal.dot(point), section: true, lens: Some(*lens) });
    }
    planes
}

/// Whether a plane may cut a box, its rectangle on the paper and its nearest w; `None` if it is not seen.
fn on_paper(
    bounds: &Aabb,
    view_from_mesh: &DAffine3,
    lens: &Lens,
    planes: &[HalfSpace],
    picture: DVec2,
) -> Option<(bool, DVec2, DVec2, f64)> {
    if bounds.is_empty() {
        return None;
    }
    let corners: [DVec3; 8] = std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        view_from_mesh.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    });
    let mut cut = false;
    for plane in planes {
        let sides = corners.map(|c| plane.side(c));
        let slack = 1e-9 * corners.iter().fold(plane.offset.abs(), |m, c| m.max(c.abs().max_element()));
        if sides.iter().all(|&s| s < -slack) {
            return None;
        }
        cut |= sides.iter().any(|&s| s <= slack);
    }
    if cut {
        return Some((true, DVec2::ZERO, picture, f64::INFINITY));
    }
    let projected = corners.map(|c| lens.project(c));
    let (min, max) = super::grid::rectangle(projected);
    if max.x < 0.0 || max.y < 0.0 || min.x > picture.x || min.y > picture.y {
        return None;
    }
    let nearest = projected.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p.z));
    Some((false, min, max, nearest + nearest.abs() * 1e-12))
}

/// A grid over what is on the paper, with about as many cells as there are triangles to see.
fn grid_over(placed: &[Placed], picture: DVec2, triangles: usize) -> Grid {
    let (mut min, mut max) = (picture, DVec2::ZERO);
    for p in placed {
        min = min.min(p.min);
        max = max.max(p.max);
    }
    let (min, max) = (min.max(DVec2::ZERO), max.min(picture));
    let side = ((triangles as f64).sqrt() * 0.75) as usize;
    Grid::over(min, max.max(min), side.clamp(8, MOST_CELLS))
}

/// Follows every edge that is to be drawn.
fn trace_edges(
    tracer: &Tracer,
    choice: &Choice,
    options: &LineOptions,
    counters: &mut Counters,
) -> Vec<Piece> {
    let shown = tracer.shown;
    let mut work = Vec::new();
    for (s, solid) in shown.solids.iter().enumerate() {
        let edges = solid.topology.edges.len();
        work.extend((0..edges).step_by(CHUNK).map(|at| (s, at..(at + CHUNK).min(edges))));
    }
    let see_through = see_through(shown, options);
    let hides = |t: u32| !see_through(t);
    let trace = |scratch: &mut Scratch, (s, range): (usize, std::ops::Range<usize>)| {
        let solid = &shown.solids[s];
        let mut pieces = Vec::new();
        let mut lines = 0;
        for edge in &solid.topology.edges[range] {
            let Some(kind) = choice.kind(shown, solid, edge) else { continue };
            let Some(ends) = shown.edge(solid, edge.vertices) else { continue };
            let (p, q) = (shown.screen[ends[0] as usize], shown.screen[ends[1] as usize]);
            if (q - p).truncate() == DVec2::ZERO {
                continue;
            }
            lines += 1;
            let places = edge.triangles.map(|t| shown.place(solid, t));
            let live = places.map(|t| t != NONE && is_live(shown, t) && hides(t));
            let sheet = |k: usize| if live[k] { shown.sheet(solid, places[k]) } else { None };
            let own = Own {
                owns: |t: u32| has_edge(&shown.triangles[t as usize], ends),
                anchored: live.contains(&true),
                sheets: [0, 1].map(|k| sheet(k).unwrap_or(NO_SHEET)),
            };
            tracer.trace([p, q], &own, scratch);
            push_parts(&mut pieces, p, q, solid.part, kind, scratch);
        }
        (pieces, lines, std::mem::take(&mut scratch.tests))
    };
    let found = shown.crew.map_with(work, || Scratch::new(tracer.occluders), trace);
    let mut all = Vec::with_capacity(found.iter().map(|f| f.0.len()).sum());
    for (pieces, lines, tests) in found {
        all.extend(pieces);
        counters.lines += lines;
        counters.tests += tests;
    }
    all
}

/// The visible parts of all lines that bound faces, whichever of them are drawn. Only tests are counted.
fn bounds_of_faces(
    tracer: Tracer,
    meetings: &[Meeting],
    options: &LineOptions,
    counters: &mut Counters,
) -> Vec<Piece> {
    let tracer = Tracer { counts: false, piercing: true, ..tracer };
    let choice = Choice::new(Kinds { marked: false, ..Kinds::ALL }, 0.0, options.hidden);
    let mut counts = Counters::default();
    let mut bounds = trace_edges(&tracer, &choice, options, &mut counts);
    intersections::add(&tracer, meetings, &Kinds::ALL, &mut bounds, &mut counts);
    intersections::add_sections(&tracer, true, &mut bounds, &mut counts);
    counters.tests += counts.tests;
    bounds.retain(|piece| is_on_paper(piece, tracer.picture));
    bounds
}

/// The visible faces, if they are asked for, and hatching of them among the pieces.
fn find_faces(
    tracer: &Tracer,
    options: &LineOptions,
    bounds: &[Piece],
    pieces: &mut Vec<Piece>,
) -> Vec<Face> {
    if let Some(spacing) = options.hatch {
        pieces.extend(hatch::lines(&faces::find(tracer, bounds, FaceColor::Flat), spacing));
    }
    options.faces.map_or_else(Vec::new, |color| faces::find(tracer, bounds, color))
}

/// Whether a piece lies on the paper. All should; but of a line whose ends are so far away that f64 cannot tell where it
/// crosses the paper, parts may come to lie anywhere.
fn is_on_paper(piece: &Piece, picture: DVec2) -> bool {
    piece.ends.iter().all(|end| end.cmpge(DVec2::NEG_ONE).all() && end.cmple(picture + 1.0).all())
}

/// Whether a stroke is so short that it is rounding: what is left of a line in a corner where surfaces meet. A
/// round pen would make a dot of it.
fn is_speck(points: &[DVec2]) -> bool {
    let length: f64 = points.windows(2).map(|p| p[0].distance(p[1])).sum();
    length < SPECK_PX
}

/// Turns the parts that tracing found into pieces.
pub(super) fn push_parts(
    pieces: &mut Vec<Piece>,
    p: DVec3,
    q: DVec3,
    part: u32,
    kind: Kind,
    scratch: &Scratch,
) {
    let (a, b) = (p.truncate(), q.truncate());
    // The ends themselves stay as they are, so that lines that meet there meet in every bit.
    let at = |t: f64| {
        if t == 0.0 {
            a
        } else if t == 1.0 {
            b
        } else {
            a + (b - a) * t
        }
    };
    for found in &scratch.parts {
        pieces.push(Piece { ends: [at(found.from), at(found.to)], part, kind, covers: found.covers });
    }
}

/// Whether anything of a triangle may be seen.
pub(super) fn is_live(shown: &Shown, triangle: u32) -> bool {
    shown.fate[triangle as usize] == Fate::Live
}

/// Whether two vertices are both corners of a triangle.
pub(super) fn has_edge(triangle: &[u32; 3], ends: [u32; 2]) -> bool {
    triangle.contains(&ends[0]) && triangle.contains(&ends[1])
}
