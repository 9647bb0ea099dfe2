//! Meshes of convex polygons, each with vertices of its own, as models of walls and roofs are made.

use glam::{DVec3, Vec4};
use hither::scene::{Content, Mesh, Node, Primitive, Scene};

/// A mesh under construction.
#[derive(Default)]
pub(crate) struct Sheets {
    mesh: Mesh,
    polygons: usize,
}

impl Sheets {
    pub(crate) fn new(name: &str) -> Sheets {
        Sheets { mesh: Mesh { name: name.to_owned(), ..Mesh::default() }, polygons: 0 }
    }

    /// Polygons so far.
    pub(crate) fn polygons(&self) -> usize {
        self.polygons
    }

    /// Adds a convex polygon as a fan around its first corner, which lies on no line with two others.
    pub(crate) fn push(&mut self, corners: &[DVec3], color: Vec4) {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(corners.iter().map(|c| c.as_vec3()));
        self.mesh.colors.extend(corners.iter().map(|_| color));
        let last = corners.len() as u32 - 1;
        self.mesh.triangles.extend((1..last).map(|i| [first, first + i, first + i + 1]));
        self.polygons += 1;
    }

    /// Adds an upright wall between two points on the ground.
    pub(crate) fn wall(&mut self, a: DVec3, b: DVec3, bottom: f64, top: f64, color: Vec4) {
        let at = |p: DVec3, y: f64| DVec3::new(p.x, y, p.z);
        self.push(&[at(a, bottom), at(b, bottom), at(b, top), at(a, top)], color);
    }

    /// Shows the mesh with material 0 as a node of the root group.
    pub(crate) fn show(self, scene: &mut Scene) {
        let mut mesh = self.mesh;
        mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
        let content = Content::Mesh(scene.meshes.len() as u32);
        scene.groups[0].push(Node { name: mesh.name.clone(), content, ..Node::default() });
        scene.meshes.push(mesh);
    }
}
