//! The triangles and vertices of one view, clipped and projected.
//!
//! Every instance that may be seen becomes a [`Solid`]: a run of vertices and a run of triangles. One that
//! no plane cuts keeps its mesh's numbering; one that is cut gets new vertices, each shared by all that meet
//! at the cut edge, so that neighbours stay neighbours.

use super::bodies::{Body, Paper};
use super::crew::Crew;
use super::lens::{HalfSpace, Lens};
use super::predicates::orientation;
use super::topology::{Edge, Mix, NONE, Topology, trait_of};
use glam::{DAffine3, DVec3, Vec3};
use std::collections::HashMap;

/// What became of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    /// It may be seen.
    Live,
    /// Something nearer covers all of it.
    Hidden,
    /// It is outside the picture.
    Outside,
    /// It is seen edge-on, or has no area: it hides nothing.
    EdgeOn,
    /// It is on the back of a body whose front hides it, and all that it hides.
    Back,
}

/// An instance in view.
#[derive(Debug)]
pub(super) struct Solid<'p> {
    pub topology: &'p Topology,
    /// Number of the instance.
    pub part: u32,
    /// Whether the instance keeps angles.
    pub keeps_angles: bool,
    pub view_from_mesh: DAffine3,
    pub first_vertex: u32,
    pub first_triangle: u32,
    pub triangle_count: u32,
    /// The first of its bodies in [`Shown::sheets`]; [`NONE`] if its bodies do not count.
    pub first_body: u32,
    /// Of a solid that is cut: what the planes did.
    pub cut: Option<Cut>,
}

/// How planes cut an instance.
#[derive(Debug, Default)]
pub(super) struct Cut {
    /// For each of the mesh's triangles, the first of its pieces (relative), or [`NONE`].
    pub place: Vec<u32>,
    /// For each piece, the mesh's triangle.
    pub origin: Vec<u32>,
    /// Whether the mesh's triangle is whole.
    pub whole: Vec<bool>,
    /// The vertex (relative) that replaces the far end of an edge: keyed by its ends, the kept end first.
    ends: HashMap<(u32, u32), u32, Mix>,
    /// Which vertices are kept.
    kept: Vec<bool>,
}

/// Everything that may be seen, in view space and on the paper.
#[derive(Debug)]
pub(super) struct Shown<'p> {
    pub crew: Crew,
    pub lens: Lens,
    pub planes: Vec<HalfSpace>,
    pub solids: Vec<Solid<'p>>,
    pub in_view: Vec<DVec3>,
    pub screen: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The sense of rotation of the projected corners: 1, −1, or 0 for edge-on.
    pub facing: Vec<i8>,
    pub fate: Vec<Fate>,
    /// For each body, whether its front faces cover no point twice.
    pub sheets: Vec<bool>,
    /// Of the triangles after those of all solids, what they close.
    pub caps: Vec<Cap>,
    /// Lines where planes cut, those of the view's range of depth among them.
    pub sections: Vec<SectionLine>,
}

/// What a triangle of a cap belongs to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cap {
    pub plane: u32,
    pub solid: u32,
}

/// A piece of the outline of a cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct SectionLine {
    pub solid: u32,
    pub plane: u32,
    /// The mesh's triangle that is cut here; [`NONE`] where planes cut each other.
    pub triangle: u32,
    pub vertices: [u32; 2],
}

impl<'p> Shown<'p> {
    pub fn new(crew: Crew, lens: Lens, planes: Vec<HalfSpace>) -> Shown<'p> {
        Shown {
            crew,
            lens,
            planes,
            solids: Vec::new(),
            in_view: Vec::new(),
            screen: Vec::new(),
            triangles: Vec::new(),
            facing: Vec::new(),
            fate: Vec::new(),
            sheets: Vec::new(),
            caps: Vec::new(),
            sections: Vec::new(),
        }
    }

    /// Adds an instance; `cut` says whether some plane may cut it.
    pub fn add(&mut self, topology: &'p Topology, part: u32, view_from_mesh: &DAffine3, cut: bool) {
        let first_vertex = self.in_view.len() as u32;
        let first_triangle = self.triangles.len() as u32;
        let crew = self.crew;
        crew.extend(&mut self.in_view, topology.positions.len(), |v| {
            view_from_mesh.transform_point3(topology.positions[v].as_dvec3())
        });
        let cut = if cut { self.clip(topology, first_vertex) } else { None };
        if cut.is_none() {
            let global = |v: u32| if v == NONE { NONE } else { v + first_vertex };
            let triangle = |t: usize| topology.triangles[t].map(global);
            crew.extend(&mut self.triangles, topology.triangles.len(), triangle);
        }
        let lens = self.lens;
        let fresh = &self.in_view[first_vertex as usize..];
        crew.extend(&mut self.screen, fresh.len(), |v| lens.project(fresh[v]));
        let (fresh, screen) = (&self.triangles[first_triangle as usize..], &self.screen);
        crew.extend(&mut self.facing, fresh.len(), |t| match fresh[t] {
            [NONE, ..] => 0,
            [a, b, c] => orientation(screen[a as usize], screen[b as usize], screen[c as usize]),
        });
        let facing = &self.facing[first_triangle as usize..];
        self.fate.extend(facing.iter().map(|&f| if f == 0 { Fate::EdgeOn } else { Fate::Live }));
        self.solids.push(Solid {
            topology,
            part,
            keeps_angles: keeps_angles(view_from_mesh),
            view_from_mesh: *view_from_mesh,
            first_vertex,
            first_triangle,
            triangle_count: self.triangles.len() as u32 - first_triangle,
            first_body: NONE,
            cut,
        });
    }

    /// Leaves out the backs of the last solid's bodies, and finds those that cannot hide their own fronts.
    /// Not for drawings that count layers, nor for a solid with triangles that hide nothing.
    pub fn leave_out_backs(&mut self, view_from_mesh: &DAffine3) {
        let Some(solid) = self.solids.last_mut() else { return };
        let bodies = &solid.topology.bodies;
        let turn = view_from_mesh.matrix3.determinant();
        if solid.cut.is_some() || bodies.list.is_empty() || turn == 0.0 || turn.is_nan() {
            return;
        }
        solid.first_body = self.sheets.len() as u32;
        // Counter-clockwise as the eye sees it is clockwise on paper whose y points down.
        let front: Vec<i8> =
            bodies.list.iter().map(|b| if b.outward == (turn > 0.0) { -1 } else { 1 }).collect();
        let first = solid.first_triangle as usize;
        for (t, &body) in bodies.of.iter().enumerate() {
            if body != NONE && self.facing[first + t] == -front[body as usize] {
                self.fate[first + t] = Fate::Back;
            }
        }
        let lens = self.lens;
        let center = |b: &Body| lens.project(view_from_mesh.transform_point3(b.center));
        let centers: Vec<DVec3> = bodies.list.iter().map(center).collect();
        let paper = Paper {
            facing: &self.facing[first..],
            screen: &self.screen[solid.first_vertex as usize..],
            front: &front,
            centers: &centers,
        };
        self.sheets.extend(bodies.sheets(self.crew, solid.topology, &paper));
    }

    /// Clips all triangles of the mesh; `None` if nothing is cut.
    fn clip(&mut self, topology: &Topology, first_vertex: u32) -> Option<Cut> {
        let planes = std::mem::take(&mut self.planes);
        let inside = |p: &DVec3| planes.iter().all(|plane| plane.side(*p) >= 0.0);
        let kept: Vec<bool> = self.in_view[first_vertex as usize..].iter().map(inside).collect();
        let in_section = in_section(topology, &planes, &self.in_view[first_vertex as usize..]);
        if kept.iter().all(|&k| k) && in_section.is_empty() {
            self.planes = planes;
            return None;
        }
        let first_triangle = self.triangles.len();
        let mut cut = Cut { kept, ..Cut::default() };
        for (i, t) in topology.triangles.iter().enumerate() {
            let there = t[0] != NONE && !in_section.get(i).is_some_and(|&lies| lies);
            let whole = there && t.iter().all(|&v| cut.kept[v as usize]);
            cut.whole.push(whole);
            cut.place.push(NONE);
            if !there {
                continue;
            }
            let mut polygon: Vec<u32> = t.to_vec();
            if !whole {
                for (k, plane) in planes.iter().enumerate() {
                    let of = [k as u32, i as u32];
                    polygon = self.clip_polygon(&mut cut, first_vertex, &polygon, plane, of);
                }
            }
            if polygon.len() >= 3 {
                cut.place[i] = cut.origin.len() as u32;
                for k in 1..polygon.len() - 1 {
                    let corners = [polygon[0], polygon[k], polygon[k + 1]];
                    self.triangles.push(corners.map(|v| v + first_vertex));
                    cut.origin.push(i as u32);
                }
            }
        }
        for edge in topology.edges.iter().filter(|e| e.traits & trait_of::LOOSE != 0) {
            self.clip_loose(&mut cut, first_vertex, edge.vertices, &planes);
        }
        if !in_section.is_empty() {
            self.drop_unused(topology, &mut cut, first_triangle, first_vertex);
        }
        // Vertices that are cut away stay in the list, unused; project() must not see them behind the eye.
        for (v, &kept) in cut.kept.iter().enumerate() {
            if !kept && v < topology.positions.len() {
                self.in_view[first_vertex as usize + v] = DVec3::NEG_Z;
            }
        }
        self.planes = planes;
        Some(cut)
    }

    /// Vertices of which no triangle and no loose edge is left are not kept.
    fn drop_unused(&self, topology: &Topology, cut: &mut Cut, first_triangle: usize, first_vertex: u32) {
        let mut used = vec![false; cut.kept.len()];
        let corners = self.triangles[first_triangle..].iter().flatten().map(|v| v - first_vertex);
        let loose =
            topology.edges.iter().filter(|e| e.traits & trait_of::LOOSE != 0).flat_map(|e| e.vertices);
        corners.chain(loose).for_each(|v| used[v as usize] = true);
        cut.kept.iter_mut().zip(used).for_each(|(kept, used)| *kept &= used);
    }

    /// What is left of a polygon on the kept side of a plane; on the way, the outline of the cut.
    fn clip_polygon(
        &mut self,
        cut: &mut Cut,
        first: u32,
        polygon: &[u32],
        plane: &HalfSpace,
        [number, triangle]: [u32; 2],
    ) -> Vec<u32> {
        let mut result = Vec::with_capacity(polygon.len() + 1);
        let mut on_plane = Vec::new();
        let mut outside = false;
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let side = |v: u32| plane.side(self.in_view[(v + first) as usize]);
            let (sa, sb) = (side(a), side(b));
            outside |= sa < 0.0;
            if sa < 0.0 {
                cut.kept[a as usize] = false;
            }
            if sa >= 0.0 {
                result.push(a);
                if sa == 0.0 {
                    on_plane.push(a);
                }
            }
            if (sa < 0.0 && sb > 0.0) || (sa > 0.0 && sb < 0.0) {
                let v = self.crossing(cut, first, a, b, plane);
                result.push(v);
                on_plane.push(v);
            }
        }
        // What sections cut, `caps` finds.
        if outside && !plane.section && on_plane.len() == 2 {
            let vertices = [on_plane[0] + first, on_plane[1] + first];
            let solid = self.solids.len() as u32;
            self.sections.push(SectionLine { solid, plane: number, triangle, vertices });
        }
        result
    }

    /// Cuts an edge that no triangle has.
    fn clip_loose(&mut self, cut: &mut Cut, first: u32, mut ends: [u32; 2], planes: &[HalfSpace]) {
        for plane in planes {
            let sides = ends.map(|v| plane.side(self.in_view[(v + first) as usize]));
            let crossing = sides[0] * sides[1] < 0.0;
            let new = crossing.then(|| self.crossing(cut, first, ends[0], ends[1], plane));
            for k in 0..2 {
                if sides[k] < 0.0 {
                    cut.kept[ends[k] as usize] = false;
                    ends[k] = new.unwrap_or(ends[k]);
                }
            }
            if new.is_none() && sides.iter().any(|&s| s < 0.0) {
                return;
            }
        }
    }

    /// The vertex where a plane cuts the edge between two vertices; the same for all that share it.
    fn crossing(&mut self, cut: &mut Cut, first: u32, a: u32, b: u32, plane: &HalfSpace) -> u32 {
        let (low, high) = (a.min(b), a.max(b));
        let (p, q) = (self.in_view[(low + first) as usize], self.in_view[(high + first) as usize]);
        let (sp, sq) = (plane.side(p), plane.side(q));
        let (kept, lost) = if sp >= 0.0 { (low, high) } else { (high, low) };
        if let Some(&known) = cut.ends.get(&(kept, lost)) {
            return known;
        }
        let v = (self.in_view.len() - first as usize) as u32;
        self.in_view.push(p + (q - p) * (sp / (sp - sq)));
        cut.kept.push(true);
        cut.ends.insert((kept, lost), v);
        v
    }

    /// What is left of a mesh's edge, as vertices; `None` if the planes left nothing of it.
    pub fn edge(&self, solid: &Solid, [a, b]: [u32; 2]) -> Option<[u32; 2]> {
        let first = solid.first_vertex;
        let Some(cut) = &solid.cut else { return Some([a + first, b + first]) };
        let (mut ends, kept) = ([a, b], [cut.kept[a as usize], cut.kept[b as usize]]);
        if kept == [true, true] {
            return Some([a + first, b + first]);
        }
        // An end moves to where a plane cut the edge, perhaps several times, as the triangles' corners did.
        loop {
            let mut moved = false;
            for k in 0..2 {
                if let Some(&v) = cut.ends.get(&(ends[1 - k], ends[k])) {
                    ends[k] = v;
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
        let kept = ends.iter().all(|&v| cut.kept[v as usize]);
        (kept && ends[0] != ends[1]).then(|| ends.map(|v| v + first))
    }

    /// The triangle of the view that stands for a mesh's triangle; [`NONE`] if it is cut away.
    pub fn place(&self, solid: &Solid, triangle: u32) -> u32 {
        if triangle == NONE {
            return NONE;
        }
        match &solid.cut {
            None => solid.first_triangle + triangle,
            Some(cut) => match cut.place[triangle as usize] {
                NONE => NONE,
                at => solid.first_triangle + at,
            },
        }
    }

    /// Whether no plane cuts a mesh's triangle.
    pub fn is_whole(&self, solid: &Solid, triangle: u32) -> bool {
        solid.cut.as_ref().is_none_or(|cut| cut.whole[triangle as usize])
    }

    /// The mesh's triangle behind a triangle of the view.
    pub fn origin(&self, solid: &Solid, triangle: u32) -> u32 {
        let at = triangle - solid.first_triangle;
        solid.cut.as_ref().map_or(at, |cut| cut.origin[at as usize])
    }

    /// The cap that a triangle is part of, if it is.
    pub fn cap(&self, triangle: u32) -> Option<&Cap> {
        let first = self.triangles.len() - self.caps.len();
        (triangle as usize).checked_sub(first).map(|at| &self.caps[at])
    }

    /// The plane of the cap that a triangle is part of, if it is.
    pub fn cap_plane(&self, triangle: u32) -> Option<u32> {
        self.cap(triangle).map(|cap| cap.plane)
    }

    /// The solid that a triangle belongs to.
    pub fn solid_of(&self, triangle: u32) -> usize {
        match self.cap(triangle) {
            Some(cap) => cap.solid as usize,
            None => self.solids.partition_point(|s| s.first_triangle <= triangle) - 1,
        }
    }

    /// The instance that a triangle belongs to.
    pub fn part_of(&self, triangle: u32) -> u32 {
        self.solids[self.solid_of(triangle)].part
    }

    /// The mesh's triangle behind a triangle of the view; of a cap [`NONE`].
    pub fn mesh_triangle(&self, triangle: u32) -> u32 {
        if self.cap(triangle).is_some() {
            return NONE;
        }
        self.origin(&self.solids[self.solid_of(triangle)], triangle)
    }

    /// Colour of a triangle, linear; a cap has that of its solid's first triangle.
    pub fn color_of(&self, triangle: u32) -> Vec3 {
        let of_mesh = self.mesh_triangle(triangle);
        let topology = self.solids[self.solid_of(triangle)].topology;
        topology.color(if of_mesh == NONE { 0 } else { of_mesh })
    }

    /// The body that a triangle of a solid is part of, if the body's front faces cover no point twice.
    #[inline]
    pub fn sheet(&self, solid: &Solid, triangle: u32) -> Option<u32> {
        if solid.first_body == NONE {
            return None;
        }
        match solid.topology.bodies.of(triangle - solid.first_triangle) {
            NONE => None,
            body => Some(solid.first_body + body).filter(|&sheet| self.sheets[sheet as usize]),
        }
    }

    /// How opaque a triangle is, 0 to 1; a cap wholly.
    pub fn opacity_of(&self, triangle: u32) -> f32 {
        if self.cap(triangle).is_some() {
            return 1.0;
        }
        let solid = &self.solids[self.solid_of(triangle)];
        let opacity = &solid.topology.opacity;
        if opacity.is_empty() { 1.0 } else { opacity[self.origin(solid, triangle) as usize] }
    }

    /// Whether a triangle's material blends; of a cap not.
    pub fn blends(&self, triangle: u32) -> bool {
        if self.cap(triangle).is_some() {
            return false;
        }
        let solid = &self.solids[self.solid_of(triangle)];
        let blends = &solid.topology.see_through;
        !blends.is_empty() && blends[self.origin(solid, triangle) as usize]
    }

    /// A triangle's corners on the paper.
    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [self.screen[a as usize], self.screen[b as usize], self.screen[c as usize]]
    }

    /// A triangle's corners in view space.
    #[inline(always)]
    pub fn corners_in_view(&self, triangle: u32) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [self.in_view[a as usize], self.in_view[b as usize], self.in_view[c as usize]]
    }
}

/// For each triangle of a closed mesh whether it lies in a section plane. A body that ends there is closed by its cap
/// instead, and of one that begins there nothing stays. Empty if there is none.
fn in_section(topology: &Topology, planes: &[HalfSpace], in_view: &[DVec3]) -> Vec<bool> {
    let mut all = Vec::new();
    for plane in planes.iter().filter(|plane| plane.section) {
        let in_plane: Vec<bool> = in_view.iter().map(|&p| plane.side(p) == 0.0).collect();
        if !in_plane.contains(&true) {
            continue;
        }
        all.resize(topology.triangles.len(), false);
        for (corners, lies) in topology.triangles.iter().zip(&mut all) {
            *lies |= corners[0] != NONE && corners.iter().all(|&v| in_plane[v as usize]);
        }
    }
    let ends = |e: &Edge| e.triangles.contains(&NONE) && e.traits & trait_of::LOOSE == 0;
    if all.contains(&true) && !topology.edges.iter().any(ends) { all } else { Vec::new() }
}

/// Whether a map is a rotation, a reflection and one scale.
fn keeps_angles(map: &DAffine3) -> bool {
    let m = map.matrix3;
    let squares = [m.x_axis.length_squared(), m.y_axis.length_squared(), m.z_axis.length_squared()];
    let most = squares[0].max(squares[1]).max(squares[2]);
    let slack = most * 1e-6;
    squares.iter().all(|s| most - s <= slack)
        && [m.x_axis.dot(m.y_axis), m.y_axis.dot(m.z_axis), m.z_axis.dot(m.x_axis)]
            .iter()
            .all(|d| d.abs() <= slack)
}
