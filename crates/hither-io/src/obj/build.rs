//! From an OBJ file's statements to meshes: parts gathered, polygons cut, vertices shared.

use super::materials::Materials;
use super::parse::{Corner, NONE, Run, Statements};
use crate::oddities::Oddities;
use crate::polygon::{self, Fit, Triangulator};
use glam::{Vec2, Vec3, Vec4};
use hither::scene::{Content, Material, Mesh, Node, Primitive, Scene};
use std::collections::HashMap;
use std::ops::Range;

/// Makes a mesh and a node of every part that has triangles or lines. A file that has faces, but none that can be
/// drawn, is refused with a line that says why.
pub(super) fn build(
    statements: Statements,
    materials: Materials,
    oddities: &mut Oddities,
) -> Result<Scene, String> {
    let mut scene = Scene::new("");
    let mut runs_of_part: Vec<Vec<usize>> = vec![Vec::new(); statements.parts.len()];
    for (i, run) in statements.runs.iter().enumerate() {
        runs_of_part[run.part as usize].push(i);
    }
    let mut lines_of_part = lines(&statements, oddities);
    let mut welder = Welder { first: vec![NONE; statements.positions.len()], vertices: Vec::new() };
    let mut builder = Builder {
        normals: statements.normals.clone(),
        statements,
        materials,
        default_material: None,
        bare: HashMap::new(),
        triangulator: Triangulator::default(),
        cut: Vec::new(),
        outline: Vec::new(),
        oddities,
    };
    for (part, runs) in runs_of_part.iter().enumerate() {
        let mut mesh = builder.mesh(part, runs, &mut welder);
        mesh.lines = std::mem::take(&mut lines_of_part[part]);
        if !mesh.triangles.is_empty() || !mesh.lines.is_empty() {
            let content = Content::Mesh(scene.meshes.len() as u32);
            scene.groups[0].push(Node { name: mesh.name.clone(), content, ..Node::default() });
            scene.meshes.push(mesh);
        }
    }
    if let Some(refusal) = builder.statements.losses.refusal("line") {
        return Err(refusal);
    }
    scene.materials = builder.materials.list;
    scene.textures = builder.materials.textures;
    Ok(scene)
}

/// The lines of each part, without those that have no length.
fn lines(statements: &Statements, oddities: &mut Oddities) -> Vec<Vec<[Vec3; 2]>> {
    let mut lines = vec![Vec::new(); statements.parts.len()];
    let mut first = 0;
    for polyline in &statements.polylines {
        let corners = &statements.line_corners[first..polyline.end as usize];
        first = polyline.end as usize;
        for ends in corners.windows(2) {
            match [ends[0], ends[1]].map(|i| statements.positions.get(i as usize).copied()) {
                [Some(a), Some(b)] if a.is_finite() && b.is_finite() => {
                    if a != b {
                        lines[polyline.part as usize].push([a, b]);
                    }
                }
                [Some(a), Some(b)] if a.is_nan() || b.is_nan() => oddities.in_line(
                    polyline.line.into(),
                    "a line has a coordinate that is no number and is left out",
                ),
                [Some(_), Some(_)] => oddities.in_line(
                    polyline.line.into(),
                    "a line has a coordinate that is infinite or beyond 32-bit floats and is left out",
                ),
                _ => oddities.in_line(
                    polyline.line.into(),
                    "a line names a vertex that does not exist and is left out",
                ),
            }
        }
    }
    lines
}

struct Builder<'a> {
    statements: Statements,
    /// The file's normals, and then those of faces that have none beside faces that have.
    normals: Vec<Vec3>,
    materials: Materials,
    default_material: Option<u32>,
    /// Copies of materials without their textures.
    bare: HashMap<u32, u32>,
    triangulator: Triangulator,
    cut: Vec<[u32; 3]>,
    outline: Vec<Vec3>,
    oddities: &'a mut Oddities,
}

impl Builder<'_> {
    fn mesh(&mut self, part: usize, runs: &[usize], welder: &mut Welder) -> Mesh {
        let mut mesh = Mesh { name: std::mem::take(&mut self.statements.parts[part]), ..Mesh::default() };
        let normals = self.attribute(runs, |[_, _, normal]| normal);
        let uvs = self.attribute(runs, |[_, uv, _]| uv);
        for &at in runs {
            let run = self.statements.runs[at];
            let (mut first_triangle, mut is_bare) = (mesh.triangles.len() as u32, false);
            for face in self.faces_of(at) {
                if uvs == Presence::Mixed && is_bare != self.is_bare(face, run) {
                    self.end_run(run, is_bare, first_triangle, &mut mesh);
                    (first_triangle, is_bare) = (mesh.triangles.len() as u32, !is_bare);
                }
                if normals == Presence::Mixed {
                    self.give_normal(face);
                }
                self.face(face, &mut mesh.triangles, welder);
            }
            self.end_run(run, is_bare, first_triangle, &mut mesh);
        }
        let vertices = welder.take();
        let of = |i: usize| vertices.iter().map(move |v| v.corner[i]);
        mesh.positions = of(0).map(|i| self.statements.positions[i as usize]).collect();
        if normals != Presence::Nowhere {
            mesh.normals = of(2).map(|i| self.normals[i as usize]).collect();
        }
        if uvs != Presence::Nowhere {
            mesh.uvs =
                of(1).map(|i| self.statements.uvs.get(i as usize).copied().unwrap_or(Vec2::ZERO)).collect();
        }
        let colors = &self.statements.colors;
        let color = |i: u32| colors.get(i as usize).copied().unwrap_or(Vec4::ONE);
        if !colors.is_empty() && of(0).any(|i| color(i) != Vec4::ONE) {
            mesh.colors = of(0).map(color).collect();
        }
        mesh
    }

    /// Whether the corners of a part have an attribute.
    fn attribute(&self, runs: &[usize], of: impl Fn(&Corner) -> &u32) -> Presence {
        let (mut some, mut none) = (false, false);
        for &at in runs {
            let faces = self.faces_of(at);
            let corners = self.corners(faces.start).start..self.corners(faces.end - 1).end;
            for corner in &self.statements.corners[corners] {
                if *of(corner) == NONE {
                    none = true;
                } else {
                    some = true;
                }
            }
        }
        match (some, none) {
            (true, true) => Presence::Mixed,
            (true, false) => Presence::Everywhere,
            (false, _) => Presence::Nowhere,
        }
    }

    /// The faces of a run.
    fn faces_of(&self, run: usize) -> Range<usize> {
        let Statements { runs, faces, .. } = &self.statements;
        runs[run].first_face as usize..runs.get(run + 1).map_or(faces.len(), |next| next.first_face as usize)
    }

    fn corners(&self, face: usize) -> Range<usize> {
        let faces = &self.statements.faces;
        let start = if face == 0 { 0 } else { faces[face - 1].end as usize };
        start..faces[face].end as usize
    }

    /// Whether a face lacks the texture coordinates that its material asks for, beside faces that have some.
    fn is_bare(&mut self, face: usize, run: Run) -> bool {
        let material = self.material(run.material) as usize;
        let bare = self.materials.list[material].texture.is_some()
            && self.statements.corners[self.corners(face)].iter().any(|&[_, uv, _]| uv == NONE);
        if bare {
            self.note(
                face,
                "a face has no texture coordinates; it is drawn without the texture of its material",
            );
        }
        bare
    }

    /// Gives the corners of a face that have no normal the face's own, so that it is drawn flat.
    fn give_normal(&mut self, face: usize) {
        let corners = self.corners(face);
        let corners = &mut self.statements.corners[corners];
        if corners.iter().all(|&[_, _, normal]| normal != NONE) {
            return;
        }
        let positions = &self.statements.positions;
        let at = |&[p, _, _]: &Corner| positions.get(p as usize).copied().unwrap_or(Vec3::NAN);
        self.outline.clear();
        self.outline.extend(corners.iter().map(at));
        let normal = polygon::normal(&self.outline).unwrap_or_default().normalize_or_zero().as_vec3();
        let index = self.normals.len() as u32;
        self.normals.push(normal);
        for [_, _, missing] in corners {
            if *missing == NONE {
                *missing = index;
            }
        }
    }

    /// Appends the triangles of a face.
    fn face(&mut self, face: usize, triangles: &mut Vec<[u32; 3]>, welder: &mut Welder) {
        let range = self.corners(face);
        let positions = &self.statements.positions;
        let corners = &self.statements.corners[range];
        self.outline.clear();
        for &[position, _, _] in corners {
            match positions.get(position as usize) {
                Some(p) if p.is_finite() => self.outline.push(*p),
                Some(p) if p.is_nan() => {
                    return self.lose(face, "a face has a coordinate that is no number and is left out");
                }
                Some(_) => {
                    let why =
                        "a face has a coordinate that is infinite or beyond 32-bit floats and is left out";
                    return self.lose(face, why);
                }
                None => return self.lose(face, "a face names a vertex that does not exist and is left out"),
            }
        }
        self.cut.clear();
        let fit = self.triangulator.triangulate(&self.outline, &mut self.cut);
        for triangle in &self.cut {
            triangles.push(triangle.map(|i| welder.vertex(corners[i as usize])));
        }
        if fit == Fit::TooIntricate {
            return self.lose(face, "the outline of a face is too intricate; it is left out");
        }
        self.statements.losses.understood();
        let empty = self.cut.is_empty();
        match fit {
            Fit::CrossesItself => {
                self.note(face, "the outline of a face crosses itself; its triangles are a guess")
            }
            Fit::Exact if empty => self.note(face, "a face without area is left out"),
            Fit::Exact | Fit::TooIntricate => {}
        }
    }

    fn lose(&mut self, face: usize, why: &'static str) {
        let line = self.statements.faces[face].line;
        self.statements.losses.lost(line.into(), why);
        self.note(face, why);
    }

    fn note(&mut self, face: usize, kind: &'static str) {
        self.oddities.in_line(self.statements.faces[face].line.into(), kind);
    }

    /// The triangles from `first_triangle` on have the run's material; if they are bare, without its texture.
    fn end_run(&mut self, run: Run, is_bare: bool, first_triangle: u32, mesh: &mut Mesh) {
        let end = mesh.triangles.len() as u32;
        if end == first_triangle {
            return;
        }
        let material = self.material(run.material);
        let material = Some(if is_bare { self.without_texture(material) } else { material });
        match mesh.primitives.last_mut() {
            Some(last) if last.material == material => last.triangles.end = end,
            _ => mesh.primitives.push(Primitive { triangles: first_triangle..end, material }),
        }
    }

    fn without_texture(&mut self, material: u32) -> u32 {
        let list = &mut self.materials.list;
        *self.bare.entry(material).or_insert_with(|| {
            list.push(Material { texture: None, ..list[material as usize].clone() });
            (list.len() - 1) as u32
        })
    }

    fn material(&mut self, name: u32) -> u32 {
        if let Some(&Some(found)) = self.materials.of_name.get(name as usize) {
            return found;
        }
        let list = &mut self.materials.list;
        *self.default_material.get_or_insert_with(|| {
            list.push(Material { double_sided: true, ..Material::default() });
            (list.len() - 1) as u32
        })
    }
}

/// Where a part has an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
    Nowhere,
    Everywhere,
    Mixed,
}

/// Gives equal corners one vertex, without hashing: each position keeps a chain of its vertices.
struct Welder {
    /// For each position the last vertex made of it, or [`NONE`].
    first: Vec<u32>,
    vertices: Vec<Vertex>,
}

#[derive(Clone, Copy)]
struct Vertex {
    corner: Corner,
    /// The next vertex of the same position, or [`NONE`].
    next: u32,
}

/// Beyond this many vertices of one position equal ones are no longer looked for, to bound the time.
const LONGEST_CHAIN: usize = 64;

impl Welder {
    #[inline]
    fn vertex(&mut self, corner: Corner) -> u32 {
        let first = &mut self.first[corner[0] as usize];
        let mut at = *first;
        for _ in 0..LONGEST_CHAIN {
            let Some(vertex) = self.vertices.get(at as usize) else { break };
            if vertex.corner == corner {
                return at;
            }
            at = vertex.next;
        }
        let new = self.vertices.len() as u32;
        self.vertices.push(Vertex { corner, next: *first });
        *first = new;
        new
    }

    /// Hands over the vertices and is ready for the next mesh.
    fn take(&mut self) -> Vec<Vertex> {
        for vertex in &self.vertices {
            self.first[vertex.corner[0] as usize] = NONE;
        }
        std::mem::take(&mut self.vertices)
    }
}
