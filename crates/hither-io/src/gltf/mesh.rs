//! Meshes: primitives of every triangle mode become one indexed triangle list with its attributes.
//!
//! Triangles keep the order of the file, strips and fans expanded. An index out of range is refused; a
//! triangle that touches a position which is no number is left out and told of. Attributes that only some
//! primitives of a mesh have are filled in: face normals, white, texture coordinates of 0.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part, unsupported};
use super::json::{self, Index};
use super::material::Materials;
use glam::{Vec2, Vec3, Vec4};
use hither::scene::{Mesh, Primitive};
use std::collections::HashMap;

/// Reads mesh `index` of the document.
pub(super) fn read(
    buffers: &Buffers,
    materials: &Materials,
    oddities: &mut Oddities,
    index: usize,
) -> Result<Mesh, Fault> {
    let source = &buffers.document().meshes[index];
    let place = part("mesh", index, &source.name);
    let drawn: Vec<(usize, &json::Primitive, Mode)> = source
        .primitives
        .iter()
        .enumerate()
        .filter_map(|(i, primitive)| Mode::of(primitive).map(|mode| (i, primitive, mode)))
        .collect();
    let mut builder = Builder {
        buffers,
        mesh: Mesh { name: source.name.clone(), ..Mesh::default() },
        with_normals: drawn.iter().any(|(_, p, _)| p.attributes.contains_key("NORMAL")),
        with_colors: drawn.iter().any(|(_, p, _)| p.attributes.contains_key("COLOR_0")),
        with_uvs: drawn.iter().any(|(_, p, _)| uv_of(p, materials).is_some()),
        vertices: HashMap::new(),
    };
    for (i, primitive, mode) in &drawn {
        let here = || format!("{place}, primitive {i}");
        if let Some(oddity) = builder.add(primitive, *mode, materials).map_err(|f| f.at(here()))? {
            oddities.note(here(), oddity);
        }
    }
    tell_what_is_left_out(source, &place, materials, oddities)?;
    let mut mesh = builder.mesh;
    drop_non_finite(&mut mesh, &place, oddities);
    tidy_attributes(&mut mesh, &place, oddities);
    Ok(mesh)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

impl Mode {
    /// `None` for points, for lines, and for numbers that mean nothing.
    fn of(primitive: &json::Primitive) -> Option<Mode> {
        match primitive.mode.map_or(4, |m| m.0) {
            4 => Some(Mode::Triangles),
            5 => Some(Mode::Strip),
            6 => Some(Mode::Fan),
            _ => None,
        }
    }

    /// The corners of every triangle, counter-clockwise as the file means it.
    fn expand(self, corners: &[u32]) -> Vec<[u32; 3]> {
        match self {
            Mode::Triangles => corners.as_chunks().0.to_vec(),
            Mode::Strip => corners
                .windows(3)
                .enumerate()
                .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
                .collect(),
            Mode::Fan => match corners.split_first() {
                Some((&hub, rim)) => rim.windows(2).map(|w| [hub, w[0], w[1]]).collect(),
                None => Vec::new(),
            },
        }
    }
}

/// The accessor of the texture coordinates that a primitive's material asks for.
fn uv_of(primitive: &json::Primitive, materials: &Materials) -> Option<Index> {
    let set = materials.uv_set(primitive.material);
    primitive.attributes.get(&format!("TEXCOORD_{set}")).copied()
}

struct Builder<'a> {
    buffers: &'a Buffers<'a>,
    mesh: Mesh,
    with_normals: bool,
    with_uvs: bool,
    with_colors: bool,
    /// The first vertex of attributes that were read before: primitives often share them.
    vertices: HashMap<[Option<Index>; 4], (u32, u32)>,
}

impl Builder<'_> {
    /// Appends a primitive. Returns what is odd about it.
    fn add(
        &mut self,
        primitive: &json::Primitive,
        mode: Mode,
        materials: &Materials,
    ) -> Result<Option<&'static str>, Fault> {
        let material = materials.scene_index(primitive.material)?;
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return Ok(Some("has no positions; it is left out"));
        };
        let positions = Elements::resolve(self.buffers, position).map_err(|f| f.at("POSITION"))?;
        if primitive.extensions.draco.is_some() && !positions.has_data() {
            return unsupported(DRACO);
        }
        let normal = primitive.attributes.get("NORMAL").copied();
        let key = [
            Some(position),
            normal,
            uv_of(primitive, materials),
            primitive.attributes.get("COLOR_0").copied(),
        ];
        let flat = self.with_normals && normal.is_none();
        let (base, count) = match self.vertices.get(&key) {
            Some(&known) => known,
            None => self.append_vertices(&positions, key)?,
        };
        let mut triangles = self.corners(primitive, mode, count)?;
        if base > 0 {
            triangles.as_flattened_mut().iter_mut().for_each(|corner| *corner += base);
        }
        if flat {
            self.flatten(&mut triangles)?;
        } else {
            self.vertices.insert(key, (base, count));
        }
        let start = self.mesh.triangles.len();
        if self.mesh.triangles.is_empty() {
            self.mesh.triangles = triangles;
        } else {
            self.mesh.triangles.append(&mut triangles);
        }
        let end = self.mesh.triangles.len();
        let (Ok(first), Ok(last)) = (u32::try_from(start), u32::try_from(end)) else {
            return malformed("the mesh has more than 4294967295 triangles");
        };
        if start == end {
            return Ok(Some("has too few corners for a triangle; it is left out"));
        }
        self.mesh.primitives.push(Primitive { triangles: first..last, material });
        if materials.is_textured(primitive.material) && key[2].is_none() {
            return Ok(Some("lacks the texture coordinates that its material asks for"));
        }
        Ok(None)
    }

    /// The triangles of a primitive with `count` vertices, every corner checked.
    fn corners(&self, primitive: &json::Primitive, mode: Mode, count: u32) -> Result<Vec<[u32; 3]>, Fault> {
        let indices = match primitive.indices {
            Some(index) => {
                let indices = Elements::resolve(self.buffers, index).and_then(|e| e.indices());
                let indices = indices.map_err(|f| f.at("indices"))?;
                // One pass that a compiler can vectorise; the place is looked for only on failure.
                if indices.iter().fold(0, |most, &i| most.max(i)) >= count
                    && let Some(bad) = indices.iter().position(|&i| i >= count)
                {
                    return malformed(format!(
                        "index {bad} is {}, but there are {count} vertices",
                        indices[bad]
                    ));
                }
                indices
            }
            None => {
                self.buffers.spend(4 * u64::from(count))?;
                (0..count).collect()
            }
        };
        if mode != Mode::Triangles {
            self.buffers.spend(12 * indices.len() as u64)?;
        }
        Ok(mode.expand(&indices))
    }

    /// Reads the attributes `[position, normal, texture coordinates, colour]`; the first vertex and how many.
    fn append_vertices(
        &mut self,
        positions: &Elements,
        [_, normal, uv, color]: [Option<Index>; 4],
    ) -> Result<(u32, u32), Fault> {
        let base = self.mesh.positions.len();
        let count = positions.count();
        let (Ok(first), Ok(_)) = (u32::try_from(base), u32::try_from(base.saturating_add(count))) else {
            return malformed("the mesh has more than 4294967295 vertices");
        };
        append(&mut self.mesh.positions, positions.floats().map_err(|f| f.at("POSITION"))?, Vec3::from_array);
        let resolve = |name: &'static str, index: Index| -> Result<Elements, Fault> {
            let elements = Elements::resolve(self.buffers, index).map_err(|f| f.at(name))?;
            if elements.count() != count {
                let others = elements.count();
                return malformed(format!("{name} has {others} elements, but there are {count} positions"));
            }
            Ok(elements)
        };
        if let Some(index) = normal {
            let normals = resolve("NORMAL", index)?.floats().map_err(|f| f.at("NORMAL"))?;
            append(&mut self.mesh.normals, normals, Vec3::from_array);
        } else if self.with_normals {
            self.mesh.normals.resize(base + count, Vec3::Z);
        }
        if let Some(index) = uv {
            let uvs = resolve("TEXCOORD", index)?.floats().map_err(|f| f.at("TEXCOORD"))?;
            append(&mut self.mesh.uvs, uvs, Vec2::from_array);
        } else if self.with_uvs {
            self.mesh.uvs.resize(base + count, Vec2::ZERO);
        }
        if let Some(index) = color {
            let colors = resolve("COLOR_0", index)?;
            if colors.width() == 3 {
                let colors = colors.floats().map_err(|f| f.at("COLOR_0"))?;
                append(&mut self.mesh.colors, colors, |[r, g, b]| Vec4::new(r, g, b, 1.0));
            } else {
                let colors = colors.floats().map_err(|f| f.at("COLOR_0"))?;
                append(&mut self.mesh.colors, colors, Vec4::from_array);
            }
        } else if self.with_colors {
            self.mesh.colors.resize(base + count, Vec4::ONE);
        }
        Ok((first, count as u32))
    }

    /// Gives every triangle corners of its own, with the face's normal.
    fn flatten(&mut self, triangles: &mut [[u32; 3]]) -> Result<(), Fault> {
        self.buffers.spend(3 * 48 * triangles.len() as u64)?;
        let mesh = &mut self.mesh;
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

const DRACO: &str = "it is compressed with Draco (KHR_draco_mesh_compression), which is not read; convert the \
     file without it, for example with `gltf-transform copy in.glb out.glb`";

/// What the file says about its need for Draco.
pub(super) fn draco_is_needed() -> &'static str {
    DRACO
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

fn tell_what_is_left_out(
    source: &json::Mesh,
    place: &str,
    materials: &Materials,
    oddities: &mut Oddities,
) -> Result<(), Fault> {
    let mut other = false;
    for (i, primitive) in source.primitives.iter().enumerate() {
        match primitive.mode.map_or(4, |m| m.0) {
            0..=3 => other = true,
            4..=6 => {}
            mode => return malformed(format!("{place}, primitive {i}: its mode {mode} is none of glTF's")),
        }
        if Mode::of(primitive).is_none() {
            materials.scene_index(primitive.material)?;
        }
    }
    if other {
        oddities.note(place, "its points and lines are left out");
    }
    if source.primitives.iter().any(|p| !p.targets.is_empty()) {
        oddities.note(place, "has morph targets, which are left out; it is drawn in its rest shape");
    }
    Ok(())
}

/// Leaves out triangles that touch a position with a coordinate that is NaN or infinite.
fn drop_non_finite(mesh: &mut Mesh, place: &str, oddities: &mut Oddities) {
    // 0 times a number is 0 exactly if the number is finite.
    if mesh.positions.iter().fold(Vec3::ZERO, |sum, p| sum + *p * 0.0) == Vec3::ZERO {
        return;
    }
    let before = mesh.triangles.len();
    let mut kept = Vec::with_capacity(before);
    for primitive in &mut mesh.primitives {
        let start = kept.len() as u32;
        let run = primitive.triangles.start as usize..primitive.triangles.end as usize;
        let sound = |t: &&[u32; 3]| t.iter().all(|&c| mesh.positions[c as usize].is_finite());
        kept.extend(mesh.triangles[run].iter().filter(sound));
        primitive.triangles = start..kept.len() as u32;
    }
    mesh.triangles = kept;
    mesh.primitives.retain(|p| !p.triangles.is_empty());
    for position in &mut mesh.positions {
        if !position.is_finite() {
            *position = Vec3::ZERO;
        }
    }
    let dropped = before - mesh.triangles.len();
    if dropped > 0 {
        oddities.note(
            place,
            format!("{dropped} of its {before} triangles touch a position that is not a finite number; they are left out"),
        );
    }
}

/// Makes normals unit and the other attributes finite.
fn tidy_attributes(mesh: &mut Mesh, place: &str, oddities: &mut Oddities) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(Mode::Triangles.expand(&[0, 1, 2, 3, 4, 5, 6]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(Mode::Strip.expand(&[0, 1, 2, 3, 4]), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(Mode::Fan.expand(&[9, 1, 2, 3]), [[9, 1, 2], [9, 2, 3]]);
        for mode in [Mode::Triangles, Mode::Strip, Mode::Fan] {
            for n in 0..3 {
                assert!(mode.expand(&[0, 1][..n.min(2)]).is_empty());
            }
        }
    }
}
