//! Vertex attributes: lists that all have a mesh's length, whatever its primitives have and lack.
//!
//! What only some primitives of a mesh have is filled in for the others: face normals, white, texture
//! coordinates of 0. Normals come out unit and everything finite.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed};
use super::json::{self, Index};
use glam::{Vec2, Vec3, Vec4};
use hither::scene::Mesh;
use std::collections::HashMap;
use std::ops::Range;

/// The accessors of a primitive's attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Attributes {
    pub(super) position: Index,
    pub(super) normal: Option<Index>,
    pub(super) uv: Option<Index>,
    pub(super) color: Option<Index>,
}

impl Attributes {
    /// Those of `primitive`, with the texture coordinates called `uv`; `None` if it has no positions.
    pub(super) fn of(primitive: &json::Primitive, uv: &str) -> Option<Attributes> {
        let get = |name| primitive.attributes.get(name).copied();
        let position = get("POSITION")?;
        Some(Attributes { position, normal: get("NORMAL"), uv: get(uv), color: get("COLOR_0") })
    }
}

/// Appends vertices to a mesh.
pub(super) struct Vertices<'a> {
    buffers: &'a Buffers<'a>,
    with_normals: bool,
    with_uvs: bool,
    with_colors: bool,
    /// The first vertex of attributes that were appended before: primitives often share them.
    known: HashMap<Attributes, u32>,
}

impl<'a> Vertices<'a> {
    /// For a mesh whose primitives have the attributes of `all`.
    pub(super) fn new<'b>(
        buffers: &'a Buffers<'a>,
        all: impl Iterator<Item = &'b Attributes> + Clone,
    ) -> Vertices<'a> {
        Vertices {
            buffers,
            with_normals: all.clone().any(|a| a.normal.is_some()),
            with_uvs: all.clone().any(|a| a.uv.is_some()),
            with_colors: all.clone().any(|a| a.color.is_some()),
            known: HashMap::new(),
        }
    }

    /// Appends the elements in `range`, unless they are there; the vertex that the first of them is.
    pub(super) fn append(
        &mut self,
        mesh: &mut Mesh,
        attributes: Attributes,
        range: Range<u32>,
    ) -> Result<u32, Fault> {
        if let Some(&first) = self.known.get(&attributes) {
            return Ok(first);
        }
        let length = mesh.positions.len() + range.len();
        let (Ok(first), Ok(_)) = (u32::try_from(mesh.positions.len()), u32::try_from(length)) else {
            return malformed("the mesh has more than 4294967295 vertices");
        };
        let range = range.start as usize..range.end as usize;
        let positions = Elements::resolve(self.buffers, attributes.position)?;
        let count = positions.count();
        let positions = positions.floats_in(range.clone()).map_err(|f| f.at("POSITION"))?;
        append(&mut mesh.positions, positions, Vec3::from_array);
        let resolve = |name: &'static str, index: Index| -> Result<Elements, Fault> {
            let elements = Elements::resolve(self.buffers, index).map_err(|f| f.at(name))?;
            if elements.count() != count {
                let others = elements.count();
                return malformed(format!("{name} has {others} elements, but there are {count} positions"));
            }
            Ok(elements)
        };
        if let Some(index) = attributes.normal {
            let normals = resolve("NORMAL", index)?.floats_in(range.clone()).map_err(|f| f.at("NORMAL"))?;
            append(&mut mesh.normals, normals, Vec3::from_array);
        } else if self.with_normals {
            mesh.normals.resize(length, Vec3::Z);
        }
        if let Some(index) = attributes.uv {
            let uvs = resolve("TEXCOORD", index)?.floats_in(range.clone()).map_err(|f| f.at("TEXCOORD"))?;
            append(&mut mesh.uvs, uvs, Vec2::from_array);
        } else if self.with_uvs {
            mesh.uvs.resize(length, Vec2::ZERO);
        }
        if let Some(index) = attributes.color {
            let colors = resolve("COLOR_0", index)?;
            if colors.width() == 3 {
                let colors = colors.floats_in(range).map_err(|f| f.at("COLOR_0"))?;
                append(&mut mesh.colors, colors, |[r, g, b]| Vec4::new(r, g, b, 1.0));
            } else {
                let colors = colors.floats_in(range).map_err(|f| f.at("COLOR_0"))?;
                append(&mut mesh.colors, colors, Vec4::from_array);
            }
        } else if self.with_colors {
            mesh.colors.resize(length, Vec4::ONE);
        }
        self.known.insert(attributes, first);
        Ok(first)
    }

    /// Where a primitive lacks the normals that others have, gives each of its triangles corners of its
    /// own, with the face's normal.
    pub(super) fn flatten(
        &self,
        mesh: &mut Mesh,
        attributes: Attributes,
        triangles: &mut [[u32; 3]],
    ) -> Result<(), Fault> {
        if attributes.normal.is_some() || !self.with_normals {
            return Ok(());
        }
        self.buffers.spend(3 * 48 * triangles.len() as u64)?;
        if mesh.positions.len().saturating_add(3 * triangles.len()) > u32::MAX as usize {
            return malformed("the mesh has more than 4294967295 vertices");
        }
        for triangle in triangles {
            let corners = triangle.map(|c| c as usize);
            let first = mesh.positions.len() as u32;
            let normal = face_normal(corners.map(|c| mesh.positions[c]));
            for c in corners {
                mesh.positions.push(mesh.positions[c]);
                mesh.normals.push(normal);
                if self.with_uvs {
                    mesh.uvs.push(mesh.uvs[c]);
                }
                if self.with_colors {
                    mesh.colors.push(mesh.colors[c]);
                }
            }
            *triangle = [first, first + 1, first + 2];
        }
        Ok(())
    }
}

fn append<T, const N: usize>(to: &mut Vec<T>, from: Vec<[f32; N]>, convert: impl Fn([f32; N]) -> T) {
    let converted = from.into_iter().map(convert);
    if to.is_empty() {
        *to = converted.collect();
    } else {
        to.extend(converted);
    }
}

/// The unit normal of a triangle; +Z where it has none. Computed in f64: no f32 coordinates overflow it.
fn face_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |n| n.as_vec3())
}

/// Makes normals unit and the other attributes finite.
pub(super) fn tidy(mesh: &mut Mesh, place: &str, oddities: &mut Oddities) {
    let mut bad_normals = false;
    for normal in &mut mesh.normals {
        // What is unit to within rounding keeps its bits. (NaN is in no range.)
        if !(0.999_999..=1.000_001).contains(&normal.length_squared()) {
            *normal = normal.as_dvec3().try_normalize().map_or(Vec3::ZERO, |n| n.as_vec3());
            bad_normals |= *normal == Vec3::ZERO;
        }
    }
    if bad_normals {
        for &triangle in &mesh.triangles {
            let corners = triangle.map(|c| c as usize);
            if corners.iter().any(|&c| mesh.normals[c] == Vec3::ZERO) {
                let normal = face_normal(corners.map(|c| mesh.positions[c]));
                for c in corners {
                    if mesh.normals[c] == Vec3::ZERO {
                        mesh.normals[c] = normal;
                    }
                }
            }
        }
        mesh.normals.iter_mut().filter(|n| **n == Vec3::ZERO).for_each(|n| *n = Vec3::Z);
        oddities.note(place, "has normals without direction; those of its faces are used instead");
    }
    let mut replaced = false;
    for uv in &mut mesh.uvs {
        if !uv.is_finite() {
            (*uv, replaced) = (Vec2::ZERO, true);
        }
    }
    for color in &mut mesh.colors {
        if !color.is_finite() {
            (*color, replaced) = (Vec4::ONE, true);
        }
    }
    if replaced {
        oddities.note(place, "has texture coordinates or colours that are not finite; 0 and white are used");
    }
}
