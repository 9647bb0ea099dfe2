//! Indexed triangle meshes with optional normals, texture coordinates and colours.

use super::{Scene, SceneError, fault};
use crate::geometry::Aabb;
use glam::{Vec2, Vec3, Vec4};
use std::ops::Range;

/// A triangle mesh. Attribute lists are either empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// The mesh's name in its file, possibly empty.
    pub name: String,
    /// Vertex positions, all finite.
    pub positions: Vec<Vec3>,
    /// Vertex normals for smooth shading, or empty (then faces are flat). They are interpolated as they are: unit, but
    /// where a triangle was cut, and zero where there is none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, v down as in glTF, or empty.
    pub uvs: Vec<Vec2>,
    /// Linear RGBA factors on the base colour, or empty.
    pub colors: Vec<Vec4>,
    /// Corner indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Consecutive, non-overlapping runs of `triangles`, together all of them, in order.
    pub primitives: Vec<Primitive>,
    /// Lines that the model has besides its faces, as segments, all finite. They are marked for line drawings;
    /// in pictures they do not show.
    pub lines: Vec<[Vec3; 2]>,
}

/// A run of triangles with one material.
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    /// Which of the mesh's triangles.
    pub triangles: Range<u32>,
    /// Index into [`Scene::materials`]; `None` is the default material (opaque white, single-sided).
    pub material: Option<u32>,
}

impl Mesh {
    /// The smallest box around the vertices that triangles use; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        let mut b = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &corner in self.triangles.as_flattened() {
            let p = self.positions[corner as usize];
            b = (b.0.min(p), b.1.max(p));
        }
        Aabb { min: b.0.as_dvec3(), max: b.1.as_dvec3() }
    }

    /// The smallest box around the ends of its lines; empty if there are none.
    pub fn bounds_of_lines(&self) -> Aabb {
        let ends = || self.lines.as_flattened().iter();
        let min = ends().fold(Vec3::INFINITY, |m, p| m.min(*p));
        let max = ends().fold(Vec3::NEG_INFINITY, |m, p| m.max(*p));
        Aabb { min: min.as_dvec3(), max: max.as_dvec3() }
    }

    /// The material of triangle `index`. Cost: logarithmic in the number of primitives.
    pub fn material_of(&self, index: u32) -> Option<u32> {
        let at = self.primitives.partition_point(|p| p.triangles.end <= index);
        self.primitives.get(at).and_then(|p| p.material)
    }
}

pub(super) fn validate(scene: &Scene) -> Result<(), SceneError> {
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let wrong = |what: &str| Err(fault(format!("mesh {i} (\"{}\")", mesh.name), what));
        let n = mesh.positions.len();
        if [mesh.normals.len(), mesh.uvs.len(), mesh.colors.len()].iter().any(|&l| l != 0 && l != n) {
            return wrong("an attribute has another length than the positions");
        }
        if mesh.positions.iter().any(|p| !p.is_finite()) {
            return wrong("a position is not a finite number");
        }
        if mesh.triangles.as_flattened().iter().any(|&v| v as usize >= n) {
            return wrong("a triangle names a vertex that does not exist");
        }
        if mesh.lines.as_flattened().iter().any(|p| !p.is_finite()) {
            return wrong("an end of a line is not a finite number");
        }
        let mut next = 0;
        for p in &mesh.primitives {
            if p.triangles.start != next || p.triangles.end < next {
                return wrong("its primitives are not consecutive runs of its triangles");
            }
            if p.material.is_some_and(|m| m as usize >= scene.materials.len()) {
                return wrong("a primitive names a material that does not exist");
            }
            next = p.triangles.end;
        }
        if next as usize != mesh.triangles.len() {
            return wrong("its primitives do not cover its triangles");
        }
    }
    Ok(())
}
