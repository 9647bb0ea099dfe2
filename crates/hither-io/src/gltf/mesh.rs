//! Meshes: primitives of every triangle mode become one indexed triangle list with its attributes, those of
//! lines the mesh's own lines.
//!
//! Triangles keep the order of the file, strips and fans expanded. An index out of range is refused; a
//! triangle that touches a position which is no number is left out and told of. Primitives that share
//! attributes share vertices. Where a mesh takes less than half of its attributes' elements (some exporters
//! keep a whole file's vertices in one list), only the range that it takes is read.

use super::accessor::Elements;
use super::attributes::{self, Attributes, Vertices};
use super::buffers::Buffers;
use super::fault::{Fault, Oddities, malformed, part, unsupported};
use super::json;
use super::lines;
use super::material::Materials;
use glam::Vec3;
use hither::scene::{Mesh, Primitive};
use std::collections::HashMap;
use std::ops::Range;

/// Reads mesh `index` of the document.
pub(super) fn read(
    buffers: &Buffers,
    materials: &Materials,
    oddities: &mut Oddities,
    index: usize,
) -> Result<Mesh, Fault> {
    let source = &buffers.document().meshes[index];
    let place = part("mesh", index, &source.name);
    let mut runs = Vec::new();
    let mut mesh = Mesh { name: source.name.clone(), ..Mesh::default() };
    for (i, primitive) in source.primitives.iter().enumerate() {
        let here = || format!("{place}, primitive {i}");
        if lines::are_in(primitive) {
            let odd = lines::read(buffers, primitive, &mut mesh.lines).map_err(|f| f.at(here()))?;
            odd.into_iter().for_each(|oddity| oddities.note(here(), oddity));
            continue;
        }
        match Run::read(buffers, materials, primitive).map_err(|f| f.at(here()))? {
            Ok(run) => runs.push((i, run)),
            Err(oddity) => oddities.note(if oddity == THIN { place.clone() } else { here() }, oddity),
        }
    }
    if source.primitives.iter().any(|p| !p.targets.is_empty()) {
        oddities.note(&*place, "has morph targets, which are left out; it is drawn in its rest shape");
    }
    let mut vertices = Vertices::new(buffers, runs.iter().map(|(_, run)| &run.attributes));
    let ranges = ranges(&runs);
    let others_have_uvs = runs.iter().any(|(_, run)| run.attributes.uv.is_some());
    for (i, mut run) in runs {
        let here = || format!("{place}, primitive {i}");
        if materials.is_textured(run.primitive.material) && run.attributes.uv.is_none() {
            oddities.note(here(), "lacks the texture coordinates that its material asks for");
            if others_have_uvs {
                run.material = run.material.map(|m| materials.without_texture(m));
            }
        }
        let range = ranges[&run.attributes].clone();
        run.append(&mut mesh, &mut vertices, range).map_err(|f| f.at(here()))?;
    }
    drop_non_finite(&mut mesh, &place, oddities);
    attributes::tidy(&mut mesh, &place, oddities);
    Ok(mesh)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

impl Mode {
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

/// Why points are not there.
const THIN: &str = "its points are left out";
/// Why a mesh, or a whole file, is refused.
pub(super) const DRACO_IS_NOT_READ: &str = "it is compressed with Draco (KHR_draco_mesh_compression), which is not read; convert the \
                     file to one without, for example by opening it in Blender and exporting it uncompressed";

/// A primitive whose corners are known, before its vertices are read.
struct Run<'a> {
    primitive: &'a json::Primitive,
    material: Option<u32>,
    attributes: Attributes,
    /// Elements that the attributes have.
    count: u32,
    /// Corners as elements of the attributes, all of which exist; at least one triangle.
    triangles: Vec<[u32; 3]>,
}

impl<'a> Run<'a> {
    /// Reads a primitive's corners; or says why it is left out.
    fn read(
        buffers: &Buffers,
        materials: &Materials,
        primitive: &'a json::Primitive,
    ) -> Result<Result<Run<'a>, &'static str>, Fault> {
        let material = materials.scene_index(primitive.material)?;
        let mode = match primitive.mode.map_or(4, |m| m.0) {
            0 => return Ok(Err(THIN)),
            4 => Mode::Triangles,
            5 => Mode::Strip,
            6 => Mode::Fan,
            other => return malformed(format!("its mode {other} is none of glTF's")),
        };
        let uv = format!("TEXCOORD_{}", materials.uv_set(primitive.material));
        let Some(attributes) = Attributes::of(primitive, &uv) else {
            return Ok(Err("has no positions; it is left out"));
        };
        let positions = Elements::resolve(buffers, attributes.position).map_err(|f| f.at("POSITION"))?;
        if primitive.extensions.draco.is_some() && !positions.has_data() {
            return unsupported(DRACO_IS_NOT_READ);
        }
        let Ok(count) = u32::try_from(positions.count()) else {
            return malformed("it has more than 4294967295 vertices");
        };
        let triangles = corners(buffers, primitive, mode, count)?;
        if triangles.is_empty() {
            return Ok(Err("has too few corners for a triangle; it is left out"));
        }
        Ok(Ok(Run { primitive, material, attributes, count, triangles }))
    }

    /// Appends its triangles to the mesh; of its attributes the elements in `range`.
    fn append(mut self, mesh: &mut Mesh, vertices: &mut Vertices, range: Range<u32>) -> Result<(), Fault> {
        let start = range.start;
        let first = vertices.append(mesh, self.attributes, range)?;
        let shift = first.wrapping_sub(start);
        if shift != 0 {
            self.triangles
                .as_flattened_mut()
                .iter_mut()
                .for_each(|corner| *corner = corner.wrapping_add(shift));
        }
        vertices.flatten(mesh, self.attributes, &mut self.triangles)?;
        let start = mesh.triangles.len();
        if mesh.triangles.is_empty() {
            mesh.triangles = self.triangles;
        } else {
            mesh.triangles.append(&mut self.triangles);
        }
        let (Ok(start), Ok(end)) = (u32::try_from(start), u32::try_from(mesh.triangles.len())) else {
            return malformed("the mesh has more than 4294967295 triangles");
        };
        mesh.primitives.push(Primitive { triangles: start..end, material: self.material });
        Ok(())
    }
}

/// Which elements of each set of attributes are read: all, unless less than half are in use.
fn ranges(runs: &[(usize, Run)]) -> HashMap<Attributes, Range<u32>> {
    let mut ranges: HashMap<Attributes, Range<u32>> = HashMap::new();
    for (_, run) in runs {
        let (first, last) =
            run.triangles.as_flattened().iter().fold((u32::MAX, 0), |(a, b), &c| (a.min(c), b.max(c)));
        let range = ranges.entry(run.attributes).or_insert(first..last);
        *range = range.start.min(first)..range.end.max(last + 1);
    }
    for (_, run) in runs {
        if let Some(range) = ranges.get_mut(&run.attributes)
            && range.len() >= run.count as usize / 2
        {
            *range = 0..run.count;
        }
    }
    ranges
}

/// The triangles of a primitive with `count` vertices, every corner checked.
fn corners(
    buffers: &Buffers,
    primitive: &json::Primitive,
    mode: Mode,
    count: u32,
) -> Result<Vec<[u32; 3]>, Fault> {
    let indices = match primitive.indices {
        Some(index) => {
            let indices = Elements::resolve(buffers, index).and_then(|e| e.indices());
            let indices = indices.map_err(|f| f.at("indices"))?;
            // One pass that a compiler can vectorise; the place is looked for only on failure.
            if indices.iter().fold(0, |most, &i| most.max(i)) >= count
                && let Some(bad) = indices.iter().position(|&i| i >= count)
            {
                let index = indices[bad];
                return malformed(format!("index {bad} is {index}, but there are {count} vertices"));
            }
            indices
        }
        None => {
            buffers.spend(4 * u64::from(count))?;
            (0..count).collect()
        }
    };
    if mode != Mode::Triangles {
        buffers.spend(12 * indices.len() as u64)?;
    }
    Ok(mode.expand(&indices))
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
