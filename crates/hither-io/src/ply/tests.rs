//! PLY files made here, good and bad, and what becomes of them.

use super::from_bytes;
use crate::{Error, Loaded};
use glam::{Vec2, Vec3, Vec4};
use hither::scene::{AlphaMode, Mesh};
use proptest::prelude::*;
use std::path::Path;

fn read(bytes: &[u8]) -> Result<Loaded, Error> {
    from_bytes(Path::new("scan.ply"), bytes)
}

fn messages(loaded: &Loaded) -> Vec<String> {
    loaded.diagnostics.iter().map(ToString::to_string).collect()
}

fn refusal(bytes: &[u8]) -> String {
    let text = read(bytes).unwrap_err().to_string();
    assert!(!text.contains('\n'));
    text
}

/// Declares elements by line, then gives a text body.
fn text_file(elements: &str, body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\ncomment made here\n{elements}end_header\n{body}").into_bytes()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACES: &str = "property list uchar int vertex_indices\n";

/// A file with every kind of property, in the three encodings.
fn rich(encoding: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\nelement camera 1\nproperty short id\nproperty list uint double pose\n\
         element vertex 5\n{XYZ}property float nx\nproperty float ny\nproperty float nz\nproperty list uchar short tags\n\
         property double s\nproperty double t\nproperty uchar red\nproperty ushort green\nproperty float blue\n\
         property uchar alpha\nproperty int8 quality\nelement face 2\nproperty uchar flags\n\
         property list ushort uint vertex_index\nproperty float weight\nelement tristrips 1\n\
         property list int int vertex_indices\nelement unknown 2\nproperty float a\nend_header\n"
    )
    .into_bytes();
    let mut put = |kind: &str, value: f64| match encoding {
        "ascii" => bytes.extend(format!("{value}\n").into_bytes()),
        encoding => {
            let mut number = match kind {
                "i8" => (value as i8).to_be_bytes().to_vec(),
                "u8" => (value as u8).to_be_bytes().to_vec(),
                "i16" => (value as i16).to_be_bytes().to_vec(),
                "u16" => (value as u16).to_be_bytes().to_vec(),
                "i32" => (value as i32).to_be_bytes().to_vec(),
                "u32" => (value as u32).to_be_bytes().to_vec(),
                "f32" => (value as f32).to_be_bytes().to_vec(),
                _ => value.to_be_bytes().to_vec(),
            };
            if encoding == "binary_little_endian" {
                number.reverse();
            }
            bytes.extend(number);
        }
    };
    for (kind, value) in [("i16", -3.0), ("u32", 2.0), ("f64", 1.5), ("f64", 2.5)] {
        put(kind, value);
    }
    let positions = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [9.0, 9.0]];
    for (i, [x, y]) in positions.into_iter().enumerate() {
        let normal = if i == 3 { 0.0 } else { 4.0 };
        for (kind, value) in
            [("f32", x), ("f32", y), ("f32", 0.25), ("f32", 0.0), ("f32", 0.0), ("f32", normal)]
        {
            put(kind, value);
        }
        put("u8", i as f64);
        for tag in 0..i {
            put("i16", -(tag as f64));
        }
        for (kind, value) in [("f64", 0.25), ("f64", 0.75), ("u8", 255.0), ("u16", 65535.0), ("f32", 0.5)] {
            put(kind, value);
        }
        put("u8", 51.0);
        put("i8", -7.0);
    }
    for face in [&[0.0, 1.0, 2.0, 3.0][..], &[2.0, 1.0, 0.0]] {
        put("u8", 1.0);
        put("u16", face.len() as f64);
        face.iter().for_each(|&i| put("u32", i));
        put("f32", 0.5);
    }
    put("i32", 8.0);
    [0.0, 1.0, 3.0, 2.0, -1.0, 0.0, 1.0, 2.0].iter().for_each(|&i| put("i32", i));
    put("f32", 1.0);
    put("f32", 2.0);
    bytes
}

fn turns(mesh: &Mesh) -> Vec<bool> {
    let up = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        crate::polygon::doubled_area(a, b, c).z > 0.0
    };
    mesh.triangles.iter().map(up).collect()
}

#[test]
fn the_three_encodings_give_the_same_mesh() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let loaded = read(&rich(encoding)).unwrap();
        let mesh = &loaded.scene.meshes[0];
        assert_eq!(mesh.positions[2], Vec3::new(2.0, 2.0, 0.25), "{encoding}");
        assert_eq!(mesh.positions.len(), 4, "the fifth vertex is not used");
        assert_eq!(mesh.normals, [Vec3::Z; 4], "the fourth is taken from its face");
        assert_eq!(mesh.uvs, [Vec2::splat(0.25); 4]);
        assert!((mesh.colors[0] - Vec4::new(1.0, 1.0, 0.214_041_14, 0.2)).length() < 1e-6);
        assert_eq!(turns(mesh), [true, true, false, true, true, true]);
        assert_eq!(mesh.triangles[3..], [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
        let material = &loaded.scene.materials[0];
        assert!(material.double_sided && material.alpha == AlphaMode::Blend);
        assert!(loaded.diagnostics.is_empty(), "{:?}", loaded.diagnostics);
    }
}

#[test]
fn concave_faces_are_cut_and_odd_ones_left_out() {
    let elements = format!("element vertex 8\n{XYZ}element face 9\n{FACES}");
    let body = "0 0 0\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\nnan 0 0\n0 inf 0\n6 0 1 2 3 4 5\n3 0 1 8\n3 0 1 -1\n\
        3 0 1 6\n3 0 7 1\n2 0 1\n0\n3 0 0 1\n4 0 2 1 3";
    let loaded = read(&text_file(&elements, body)).unwrap();
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(turns(mesh)[..4], [true; 4]);
    assert_eq!(mesh.positions.len(), 6);
    let told = messages(&loaded);
    for part in [
        "face 1: a face names a vertex that does not exist and is left out (2 times)",
        "face 3: a face has a coordinate that is no number and is left out",
        "face 4: a face has a coordinate that is infinite or beyond 32-bit floats and is left out",
        "face 5: a face has fewer than three corners and is left out (2 times)",
        "face 7: a face without area is left out",
        "face 8: the outline of a face crosses itself",
    ] {
        assert!(told.iter().any(|m| m.starts_with(part)), "{part} in {told:#?}");
    }
    assert_eq!(told.len(), 6);
}

#[test]
fn faces_may_come_before_vertices_and_points_alone_are_told() {
    let body = "3 0 1 2\n0 0 0 1 0 0 0 1 0\n";
    let loaded = read(&text_file(&format!("element face 1\n{FACES}element vertex 3\n{XYZ}"), body)).unwrap();
    assert_eq!(loaded.scene.meshes[0].triangles, [[0, 1, 2]]);
    let loaded = read(&text_file(&format!("element vertex 1\n{XYZ}"), "1 2 3\n")).unwrap();
    assert!(loaded.scene.bounds().is_none());
    assert!(messages(&loaded)[0].contains("points but no faces"));
    let elements = format!("element vertex 0\n{XYZ}element face 0\n{FACES}element nothing 99999999999\n");
    assert!(read(&text_file(&elements, "")).unwrap().diagnostics.is_empty());
}

#[test]
fn alpha_blends_unless_it_would_hide_everything() {
    for (alphas, blend) in [([255, 255, 255], false), ([255, 0, 255], true), ([0, 0, 0], false)] {
        let elements = format!(
            "element vertex 3\n{XYZ}property uchar r\nproperty uchar g\nproperty uchar b\nproperty uchar a\n\
             element face 1\n{FACES}"
        );
        let [a, b, c] = alphas;
        let body = format!("0 0 0 9 9 9 {a}\n1 0 0 9 9 9 {b}\n0 1 0 9 9 9 {c}\n3 0 1 2\n");
        let loaded = read(&text_file(&elements, &body)).unwrap();
        assert_eq!(loaded.scene.materials[0].alpha == AlphaMode::Blend, blend, "{alphas:?}");
    }
}

#[test]
fn what_lies_or_is_cut_short_is_refused() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let good = rich(encoding);
        let body = good.len() - 8;
        for end in (0..body).step_by(7) {
            assert!(read(&good[..end]).is_err(), "{encoding}, {end} of {} bytes", good.len());
        }
        let text = String::from_utf8_lossy(&good[..600]).into_owned();
        let header = text.find("end_header").unwrap();
        for (from, to) in [("vertex 5", "vertex 4000000000"), ("face 2", "face 18446744073709551615")] {
            let mut lying = text[..header].replace(from, to).into_bytes();
            lying.extend(&good[header..]);
            let told = refusal(&lying);
            assert!(told.contains("more than the rest of the file can hold"), "{told}");
        }
    }
    let elements = format!("element vertex 3\n{XYZ}element face 1\n{FACES}");
    for (list, part) in
        [("4000000000 0 1 2", "not complete"), ("-3 0 1 2", "not complete"), ("3 0 1", "not complete")]
    {
        let told = refusal(&text_file(&elements, &format!("0 0 0 1 0 0 0 1 0 {list}")));
        assert!(told.contains("row 0 of the 1 rows of \"face\"") && told.contains(part), "{told}");
    }
    let flat = "element vertex 1\nproperty float x\nproperty float y\n";
    assert!(refusal(&text_file(flat, "1 2")).contains("no x, y and z"));
    assert!(refusal(&text_file(&format!("element face 1\n{FACES}"), "0")).contains("no element \"vertex\""));
    assert!(refusal(b"ply").contains("does not begin"));
}

#[test]
fn a_file_all_of_whose_faces_are_lost_is_refused() {
    let with = |n: u32, faces: &str| {
        let elements = format!("element vertex 3\n{XYZ}element face {n}\n{FACES}");
        text_file(&elements, &format!("0 0 0\n1 0 0\n0 1 0\n{faces}"))
    };
    let told = refusal(&with(1, "3 0 1 -7"));
    assert!(told.contains("its only face is lost (face 0: a face names a vertex that does not"), "{told}");
    let told = refusal(&with(3, "2 0 1 3 0 1 3 3 0 1 9"));
    assert!(told.contains("all of its 3 faces are lost (face 0: a face has fewer than three"), "{told}");
    // One without area is no loss.
    assert!(read(&with(2, "3 0 1 1 3 0 1 9")).unwrap().scene.bounds().is_none());
}

#[test]
fn rows_of_nothing_are_no_vertices_and_faces_of_nothing_are_told() {
    for format in ["ascii", "binary_little_endian"] {
        let of = |elements: &str| format!("ply\nformat {format} 1.0\n{elements}end_header\n").into_bytes();
        for count in ["1", "18446744073709551615"] {
            assert!(refusal(&of(&format!("element vertex {count}\n"))).contains("no x, y and z"));
            let faces = format!("element vertex 0\n{XYZ}element face {count}\n");
            assert!(
                messages(&read(&of(&faces)).unwrap())[0].contains("\"face\": it has no list of vertices")
            );
        }
        assert!(read(&of("element vertex 0\nelement face 0\n")).unwrap().diagnostics.is_empty());
    }
}

proptest! {
    #[test]
    fn damaged_files_are_read_or_refused(
        encoding in prop::sample::select(vec!["ascii", "binary_little_endian", "binary_big_endian"]),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 1..12),
    ) {
        let mut bytes = rich(encoding);
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
