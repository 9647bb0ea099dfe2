//! STL, text and binary: bare triangles.
//!
//! What becomes of a file:
//! - Each solid that has triangles becomes one mesh and one node with the solid's name; a binary file is one
//!   solid without a name.
//! - Corners at the same position (to the last bit) become one vertex. Normals in the file are not used:
//!   faces are flat, and the order of the corners says which side is the front. Colours in the attribute
//!   bytes, of which there are several dialects, are not used either.
//! - STL solids are often not closed: the material is double-sided.
//! - Triangles without area are dropped, those with a coordinate that is no number left out with a diagnostic;
//!   where that is the lot of all triangles, the file is refused.
//! - A binary file whose header claims more triangles than it holds is refused. That a file begins with
//!   `solid` does not make it text: many binary ones do.

mod text;

use crate::input;
use crate::oddities::{Losses, Oddities};
use crate::polygon::doubled_area;
use crate::weld::Welder;
use crate::{Error, Loaded};
use glam::Vec3;
use hither::scene::{Content, Material, Mesh, Node, Primitive, Scene};
use std::path::Path;

/// Bytes of a binary file before its first triangle: 80 of comment, 4 of count.
const HEADER: usize = 84;

/// Bytes of a triangle in a binary file: normal, three corners, attribute.
const RECORD: usize = 50;

/// Reads the STL file at `path`.
pub fn read(path: &Path) -> Result<Loaded, Error> {
    let bytes = input::read(path)?;
    from_bytes(path, &bytes)
}

/// Reads an STL file from memory. `path` names it in messages and gives the scene its name.
pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Loaded, Error> {
    let mut oddities = Oddities::default();
    let mut scene =
        Scene::new(path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default());
    scene.materials.push(Material { double_sided: true, ..Material::default() });
    let read = if is_text(bytes) {
        text::read(bytes, &mut scene, &mut oddities)
    } else {
        binary(bytes, &mut scene, &mut oddities)
    };
    read.map_err(|message| Error::Malformed { path: path.to_owned(), message })?;
    Loaded::checked(path, scene, oddities.into_diagnostics())
}

/// Whether this is a text file. Text as a binary header would claim more than 500 million triangles, so a
/// file that is exactly as long as a binary header says is binary.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if !start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        return false;
    }
    // Numbers in binary are full of zero bytes, the count itself unless there are 16 million triangles.
    count(bytes).is_none_or(|n| HEADER as u64 + n * RECORD as u64 != bytes.len() as u64)
        && !bytes[..bytes.len().min(1024)].contains(&0)
}

/// The number of triangles that a binary header claims.
fn count(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..HEADER)?.as_array::<4>()?;
    Some(u32::from_le_bytes(*count).into())
}

fn binary(bytes: &[u8], scene: &mut Scene, oddities: &mut Oddities) -> Result<(), String> {
    let Some(claimed) = count(bytes) else {
        return Err(format!("its {} bytes are fewer than the {HEADER} of an STL header", bytes.len()));
    };
    let body = &bytes[HEADER..];
    let (records, _) = body.as_chunks::<RECORD>();
    let held = records.len() as u64;
    if held < claimed || (claimed == 0 && held > 0) {
        return Err(format!(
            "its header claims {claimed} triangles but the file holds {held}; it is damaged, or not STL"
        ));
    }
    let rest = body.len() - claimed as usize * RECORD;
    if rest > 0 {
        oddities.note(
            "rest",
            || "end of file".into(),
            || format!("{rest} bytes after the last triangle are left out"),
        );
    }
    let mut solid = Solid::default();
    let mut odd = Odd { unit: "triangle", oddities, losses: Losses::default() };
    for (i, record) in records[..claimed as usize].iter().enumerate() {
        let floats = record[12..48].as_chunks::<4>().0;
        let corner =
            |at: usize| Vec3::from_array([0, 1, 2].map(|axis| f32::from_le_bytes(floats[3 * at + axis])));
        solid.triangle([corner(0), corner(1), corner(2)], i as u64, &mut odd);
    }
    solid.finish(scene);
    odd.refusal().map_or(Ok(()), Err)
}

/// What is odd about a file, and what of it is lost.
struct Odd<'a> {
    /// What numbers count: triangles, or lines of text.
    unit: &'static str,
    oddities: &'a mut Oddities,
    losses: Losses,
}

impl Odd<'_> {
    #[cold]
    fn note(&mut self, number: u64, what: &'static str) {
        let unit = self.unit;
        self.oddities.note(what, || format!("{unit} {number}"), || what.to_owned());
    }

    /// A triangle or a loop is left out that would be seen if it were understood.
    #[cold]
    fn lose(&mut self, number: u64, why: &'static str) {
        self.losses.lost(number, why);
        self.note(number, why);
    }

    /// The line that refuses the file, if all of it is lost.
    fn refusal(&self) -> Option<String> {
        self.losses.refusal(self.unit)
    }
}

/// A solid as it grows.
#[derive(Default)]
struct Solid {
    name: String,
    triangles: Vec<[u32; 3]>,
    welder: Welder,
}

impl Solid {
    /// Adds a triangle that has an area and no infinite or undefined coordinate.
    #[inline]
    fn triangle(&mut self, corners: [Vec3; 3], number: u64, odd: &mut Odd) {
        let [a, b, c] = corners;
        if !corners.iter().all(|p| p.is_finite()) {
            let what = match corners.iter().any(|p| p.is_nan()) {
                true => "a triangle has a coordinate that is no number and is left out",
                false => {
                    "a triangle has a coordinate that is infinite or beyond 32-bit floats and is left out"
                }
            };
            return odd.lose(number, what);
        }
        odd.losses.understood();
        if doubled_area(a, b, c) == glam::DVec3::ZERO {
            odd.note(number, "a triangle without area is left out");
        } else {
            self.triangles.push(corners.map(|p| self.welder.vertex(p)));
        }
    }

    /// Becomes a mesh and a node, if there is anything to see.
    fn finish(self, scene: &mut Scene) {
        if self.triangles.is_empty() {
            return;
        }
        let content = Content::Mesh(scene.meshes.len() as u32);
        scene.groups[0].push(Node { name: self.name.clone(), content, ..Node::default() });
        scene.meshes.push(Mesh {
            name: self.name,
            positions: self.welder.into_positions(),
            primitives: vec![Primitive { triangles: 0..self.triangles.len() as u32, material: Some(0) }],
            triangles: self.triangles,
            ..Mesh::default()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const TETRAHEDRON: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn binary_file(header: &str, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = vec![b' '; 80];
        bytes[..header.len()].copy_from_slice(header.as_bytes());
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for t in triangles {
            bytes.extend([0; 12]);
            bytes.extend(t.as_flattened().iter().flat_map(|f| f.to_le_bytes()));
            bytes.extend([0xff, 0x7f]);
        }
        bytes
    }

    fn tetrahedron() -> Vec<u8> {
        binary_file("solid in name only", &TETRAHEDRON.map(|t| t.map(|i| CORNERS[i])))
    }

    fn text_file() -> String {
        let mut text = String::new();
        for name in ["first part", "", "C:\\x\\"] {
            text.push_str(&format!("solid {name}\r\n"));
            for t in TETRAHEDRON {
                text.push_str("  facet normal 0 0 0\n    outer loop\n");
                for [x, y, z] in t.map(|i| CORNERS[i]) {
                    text.push_str(&format!("      vertex {x} {y:e} {z:.3}\n"));
                }
                text.push_str("    endloop\n  endfacet\n");
            }
            text.push_str(&format!("endsolid {name}\n"));
        }
        text
    }

    fn read(bytes: &[u8]) -> Result<Loaded, Error> {
        from_bytes(Path::new("part.stl"), bytes)
    }

    fn messages(loaded: &Loaded) -> Vec<String> {
        loaded.diagnostics.iter().map(ToString::to_string).collect()
    }

    fn refusal(bytes: &[u8]) -> String {
        let text = read(bytes).unwrap_err().to_string();
        assert!(!text.contains('\n'));
        text
    }

    #[test]
    fn binary_files_may_begin_with_solid() {
        let loaded = read(&tetrahedron()).unwrap();
        let mesh = &loaded.scene.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 4));
        assert!(mesh.normals.is_empty() && loaded.diagnostics.is_empty());
        assert!(loaded.scene.materials[0].double_sided);
    }

    #[test]
    fn every_solid_of_a_text_file_is_a_part() {
        for text in [text_file(), text_file().to_uppercase(), text_file().replace('\n', "\r")] {
            let loaded = read(text.as_bytes()).unwrap();
            let names: Vec<String> =
                loaded.scene.root_group().nodes.iter().map(|n| n.name.to_lowercase()).collect();
            assert_eq!(names, ["first part", "", "c:\\x\\"]);
            assert!(loaded.scene.meshes.iter().all(|m| m.positions.len() == 4 && m.triangles.len() == 4));
            assert!(loaded.diagnostics.is_empty(), "{:?}", loaded.diagnostics);
        }
    }

    #[test]
    fn counts_that_lie_are_refused() {
        let good = tetrahedron();
        assert!(refusal(&good[..good.len() - 1]).contains("claims 4 triangles but the file holds 3"));
        let mut huge = good.clone();
        huge[80..84].copy_from_slice(&[0xff; 4]);
        assert!(refusal(&huge).contains("claims 4294967295"));
        let mut none = good.clone();
        none[80..84].copy_from_slice(&[0; 4]);
        assert!(refusal(&none).contains("claims 0"));
        assert!(refusal(&good[..83]).contains("fewer"));
        assert!(refusal(b"\0\x01binary").contains("fewer"));
        let mut longer = good;
        longer.extend([1; 60]);
        assert!(messages(&read(&longer).unwrap())[0].contains("60 bytes after the last"));
    }

    #[test]
    fn odd_triangles_are_left_out() {
        let [a, b, c, _] = CORNERS;
        let bad = [f32::NAN, 0.0, 0.0];
        let infinite = [0.0, f32::INFINITY, 0.0];
        let bytes =
            binary_file("", &[[a, b, c], [a, a, b], [a, b, bad], [infinite, b, c], [a, c, [0.0, 2.0, 0.0]]]);
        let loaded = read(&bytes).unwrap();
        assert_eq!(loaded.scene.meshes[0].triangles.len(), 1);
        let told = messages(&loaded);
        assert_eq!(told.len(), 3);
        assert!(told[0].contains("triangle 1") && told[0].contains("without area is left out (2 times)"));
        assert_eq!(told[1], "triangle 2: a triangle has a coordinate that is no number and is left out");
        assert!(told[2].contains("triangle 3") && told[2].contains("infinite or beyond 32-bit floats"));
    }

    #[test]
    fn a_file_all_of_whose_triangles_are_lost_is_refused() {
        let [a, b, c, _] = CORNERS;
        let bad = [f32::NAN, 0.0, 0.0];
        let told = refusal(&binary_file("", &[[a, b, bad]]));
        assert!(
            told.contains(
                "its only face is lost (triangle 0: a triangle has a coordinate that is no number)"
            )
        );
        let told = refusal(&binary_file("", &[[[f32::INFINITY; 3], b, c], [a, b, bad]]));
        assert!(told.contains("all of its 2 faces are lost (triangle 0: ") && told.contains("beyond 32-bit"));
        let facet = |corners: &[&str]| {
            let vertices: String = corners.iter().map(|c| format!("vertex {c}\n")).collect();
            format!("facet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\n")
        };
        let corners = ["0 0 0", "1 0 0", "0 1", "0 1 0"];
        for (text, part) in [
            (
                facet(&corners[..3]),
                "its only face is lost (line 7: a triangle has a coordinate that is no number)",
            ),
            (facet(&corners), "(line 8: a loop has a coordinate that is no number)"),
            (
                facet(&corners[..2]) + &facet(&corners[..1]),
                "2 faces are lost (line 6: a loop has fewer than three",
            ),
            ("facet\nouter loop\nvertex 0 0 0\nvertex 1".into(), "(line 5: the file ends within a facet)"),
        ] {
            let told = refusal(format!("solid part\n{text}").as_bytes());
            assert!(told.starts_with("part.stl: ") && told.contains(part), "{told}");
        }
        // What only has no area is not lost, and neither is a file that never had a triangle.
        for bytes in [binary_file("", &[[a, b, bad], [a, a, b]]), binary_file("", &[])] {
            assert!(read(&bytes).unwrap().scene.bounds().is_none());
        }
    }

    #[test]
    fn text_is_read_as_far_as_it_goes() {
        let loaded = read(b"solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n\
            endfacet\nfacet\nouter loop\nvertex 0 0 0\nvertex x 0 0\nvertex 1 1 1\nendloop\nendfacet\nwhat 1\nfacet\n\
            outer loop\nvertex 0 0 0\nendloop\nfacet normal 0 0 1\nendfacet\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1")
        .unwrap();
        assert_eq!(loaded.scene.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
        let told = messages(&loaded);
        for part in ["no number", "\"what\"", "fewer than three corners", "no corners", "ends within a solid"]
        {
            assert!(told.iter().any(|m| m.contains(part)), "{part} in {told:#?}");
        }
        assert!(read(b"solid\nendsolid\n").unwrap().scene.bounds().is_none());
        assert!(refusal(b"solid\nfacet\nouter loop\nendloop\nendfacet\nendsolid\n").contains("no corners"));
        assert!(refusal(b"solid as a rock\nis not a model\n").contains("no facet"));
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_or_refused(
            text in any::<bool>(),
            edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 1..12),
        ) {
            let mut bytes = if text { text_file().into_bytes() } else { tetrahedron() };
            for (at, byte, how) in edits {
                let at = at.index(bytes.len());
                match how {
                    0 => bytes.insert(at, byte),
                    1 => { bytes.remove(at); }
                    _ => bytes[at] = byte,
                }
            }
            if let Ok(loaded) = read(&bytes) {
                prop_assert!(loaded.scene.validate().is_ok());
            }
        }
    }
}
