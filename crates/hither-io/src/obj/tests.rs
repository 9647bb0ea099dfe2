//! OBJ files made here, good and bad, and what becomes of them.

use super::from_bytes;
use super::parse::parse_in;
use crate::oddities::Oddities;
use crate::texture::tests::png_of;
use crate::{Error, Loaded};
use glam::{DVec2, Vec2, Vec3, Vec4};
use hither::scene::{AlphaMode, Mesh, Scene, Wrap};
use proptest::prelude::*;
use std::path::Path;

/// No file is beside the model, and none but a library or a picture may be asked for.
fn nothing_there(name: &str) -> Result<Vec<u8>, String> {
    assert!(!name.ends_with(".obj"), "{name} is opened");
    Err("cannot read: no such file".into())
}

fn read(text: &str) -> Loaded {
    from_bytes(Path::new("some/model.obj"), text.as_bytes(), &nothing_there).unwrap()
}

fn messages(loaded: &Loaded) -> Vec<String> {
    loaded.diagnostics.iter().map(ToString::to_string).collect()
}

fn area(mesh: &Mesh) -> f64 {
    let doubled = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        crate::polygon::doubled_area(a, b, c).length()
    };
    mesh.triangles.iter().map(doubled).sum::<f64>() * 0.5
}

/// Node name, triangles and area of each part.
fn parts(scene: &Scene) -> Vec<(String, usize, f64)> {
    let nodes = scene.root_group().nodes.iter().zip(&scene.meshes);
    nodes.map(|(n, m)| (n.name.clone(), m.triangles.len(), (area(m) * 1e6).round() / 1e6)).collect()
}

const ODD: &str = "# odd but readable\r
mtllib not there.mtl\r
o name with spaces\r
v 0 0 0\r\nv 2 0 0\r\nv 2 1 0\r\nv 1 1 0\r\nv 1 2 0\r\nv 0 2 0\r
vn 0 0 1\r\nvt 0 0\r
usemtl not there\r\ns off\r
g an L (concave)\r
f 1//1 2//1 3//1 4//1 5//1 6//1\r
\r
g two quads\r
v 0 3 0\r\nv 1 3 0 1.0\r\nv 1 4 0 0.5 0.5 0.5\r\nv 0 4 0\r
v 1 3 0\r\nv 2 3 0\r\nv 2 4 0\r\nv 1 4 0\r
f 7/1/1 8/1/1 9/1/1 10/1/1\r
f -4 -3   -2\t-1  \r
g no area\r
f 1 1 2\r\nf 1 2 1\r
v 3 0 0\r\nv 4 0 0\r\nv 5 0 0\r\nf -3 -2 -1\r
v 7 7 7\r\nv 7 7 7\r\nv 7 7 7\r\nf -3 -2 -1\r
f 1 2\r
g continued\r
v 0 5 0\r\nv 1 5 0\r\nv 0.5 6 0\r
f -3 \\\r\n  -2 \\\r\n  -1\r
l 1 2 3\r\np 1\r\ncurv 0 1 1 2\r\ncall nothing.obj\r\nvp 0.5\r
g crossing\r
v 3 3 0\r\nv 4 4 0\r\nv 4 3 0\r\nv 3 4 0\r
f -4 -3 -2 -1";

#[test]
fn an_odd_file_is_read_part_by_part() {
    let loaded = read(ODD);
    let parts = parts(&loaded.scene);
    let expected = [
        ("name with spaces/an L (concave)", 4, 3.0),
        ("name with spaces/two quads", 4, 2.0),
        ("name with spaces/continued", 1, 0.5),
    ];
    for (part, (name, triangles, area)) in parts.iter().zip(expected) {
        assert_eq!(*part, (name.to_owned(), triangles, area));
    }
    assert_eq!(parts.len(), 4);
    assert!(parts[3].1 <= 2);
    for mesh in &loaded.scene.meshes[..3] {
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!(crate::polygon::doubled_area(a, b, c).z > 0.0);
        }
    }
    let told = messages(&loaded);
    for part in [
        "material library \"not there.mtl\": cannot read",
        "material \"not there\": it is not defined",
        "without area is left out (4 times)",
        "fewer than three corners",
        "points are left out",
        "curves and curved surfaces are left out; only faces and lines are read (2 times)",
        "other files are not called",
        "crosses itself",
    ] {
        assert_eq!(told.iter().filter(|m| m.contains(part)).count(), 1, "{part} in {told:#?}");
    }
    assert_eq!(told.len(), 8, "{told:#?}");
    assert!(told.iter().any(|m| m.starts_with("line 29: a face without area")), "{told:#?}");
}

#[test]
fn lines_belong_to_their_part() {
    let loaded = read(
        "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nl 1 2 3\nf 1 2 3\nl -4/1 -2/1 # end\no wire\nl 2 3 3 1\n\
         l 1 4\nl 1 9 2\nl 1 x\nl 2\no empty\n",
    );
    let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vec3::from);
    let scene = &loaded.scene;
    assert_eq!(parts(scene), [("a".to_owned(), 1, 0.5), ("wire".to_owned(), 0, 0.0)]);
    assert_eq!(scene.meshes[0].lines, [[a, b], [b, c], [a, c]]);
    assert_eq!(scene.meshes[1].lines, [[b, c], [c, a]]);
    let told = messages(&loaded);
    for part in ["coordinate that is no number", "names a vertex that does not exist", "cannot be read"] {
        assert_eq!(told.iter().filter(|m| m.contains(part)).count(), 1, "{part} in {told:#?}");
    }
}

#[test]
fn corners_without_normals_beside_such_with_are_flat() {
    let loaded = read(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 2\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1 3 4\nf 1//2 2//2 4//9\n",
    );
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    let normals = |t: usize| mesh.triangles[t].map(|i| mesh.normals[i as usize]);
    assert_eq!(normals(0), [Vec3::Z; 3]);
    assert_eq!(normals(1), [Vec3::X; 3]);
    assert_eq!(normals(2), [Vec3::NEG_Y; 3]);
    assert!(messages(&loaded)[0].contains("do not exist"));
}

#[test]
fn equal_corners_share_a_vertex_and_v_goes_down() {
    let loaded =
        read("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0.25\nvt 0.5\nf 1/1 2/1 3/1\nf 1/1 3/1 4/2\n");
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.uvs, [[0.0, 0.75], [0.0, 0.75], [0.0, 0.75], [0.5, 1.0]].map(Vec2::from));
    assert!(mesh.normals.is_empty() && mesh.colors.is_empty());
    assert!(loaded.diagnostics.is_empty());
}

#[test]
fn same_names_are_one_part_and_a_new_object_has_no_group() {
    let f = "f 1 2 3\n";
    let text = format!(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\n{f}g a b\n{f}g\n{f}o x\n{f}g a b\n{f}usemtl m\n{f}o y\n{f}o x\ng a b\n{f}{f}"
    );
    let loaded = read(&text);
    let parts = parts(&loaded.scene);
    let names: Vec<(&str, usize)> = parts.iter().map(|(n, t, _)| (n.as_str(), *t)).collect();
    assert_eq!(names, [("", 2), ("a b", 1), ("x", 1), ("x/a b", 4), ("y", 1)]);
    assert_eq!(loaded.scene.name, "model");
    assert!(loaded.scene.materials.iter().all(|m| m.double_sided));
}

#[test]
fn faces_may_come_first_and_wrong_indices_cost_only_their_face() {
    let loaded = read(
        "f 1 2 3\nf -1 -2 -3\nf 0 1 2\nf 1 2 4\nf 1 2 99999999999999999999\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",
    );
    assert_eq!(loaded.scene.meshes[0].triangles.len(), 1);
    assert_eq!(messages(&loaded).len(), 1);
    assert!(messages(&loaded)[0].contains("line 2: a face names a vertex that does not exist"));
}

#[test]
fn what_is_no_number_reaches_no_mesh() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 0 inf 0\nv 1e99 0 0\nv 1 x 1\nv 1,5 2 3\n\
        vn nan 0 1\nvt inf 0\nf 1/1/1 2/1/1 3/1/1\nf 1 2 4\nf 1 2 5\nf 1 2 6\nf 1 2 7\nf 1 2 8\nf 1 2 3x\nf 1 2 3/\nf 1 2 x\n";
    let loaded = read(text);
    assert_eq!(loaded.scene.meshes[0].triangles.len(), 2);
    let told = messages(&loaded);
    for part in [
        "line 12: a face has a coordinate that is no number and is left out (3 times)",
        "line 13: a face has a coordinate that is infinite or beyond 32-bit floats and is left out (2 times)",
    ] {
        assert!(told.iter().any(|m| m == part), "{part} in {told:#?}");
    }
    assert!(
        told.iter().any(|m| m.contains("the face \"1 2 3x\" cannot be read and is left out (2 times)")),
        "{told:#?}"
    );
}

#[test]
fn vertex_colours_are_srgb_and_missing_ones_white() {
    let loaded = read("v 0 0 0\nv 1 0 0 1\nv 0 1 0 0.5 1 0\nv 0 0 1 1 1 1 0.5\nf 1 2 3\nf 1 2 4\n");
    let colors = &loaded.scene.meshes[0].colors;
    assert_eq!(colors.len(), 4);
    assert_eq!(colors[..2], [Vec4::ONE; 2]);
    assert!((colors[2] - Vec4::new(0.214_041_14, 1.0, 0.0, 1.0)).length() < 1e-6);
    assert_eq!(colors[3], Vec4::new(1.0, 1.0, 1.0, 0.5));
}

const LIBRARY: &str = "# materials\nnewmtl red\nKd 1 0 0\nd 0.25\nTr 0.1\nnewmtl wood\r
Ka 1 1 1\nillum 2\nmap_Kd -s 2 3 -o 0.5 0.25 0 -clamp on wood grain.png\nnewmtl glass\nTr 0.75\nmap_d hole.png\n\
newmtl lost\nmap_Kd ..\\..\\secret.png\nnewmtl grey\nKd 0.5\nnewmtl odd\nKd spectral x.rfl\n";

#[test]
fn libraries_give_colour_transparency_and_textures() {
    let files = |name: &str| match name {
        "my lib.mtl" => Ok(LIBRARY.as_bytes().to_vec()),
        "wood grain.png" => Ok(png_of(1, 2, &[[1, 2, 3, 255], [4, 5, 6, 255]])),
        other => Err(format!("no {other}")),
    };
    let mut text = String::from("mtllib my lib.mtl\nmtllib my lib.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for name in ["red", "wood", "glass", "lost", "grey", "odd", "unknown"] {
        text.push_str(&format!("usemtl {name}\nf 1 2 3\n"));
    }
    let loaded = from_bytes(Path::new("m.obj"), text.as_bytes(), &files).unwrap();
    let scene = &loaded.scene;
    let mesh = &scene.meshes[0];
    let of = |i: u32| &scene.materials[mesh.material_of(i).unwrap() as usize];
    assert_eq!((of(0).base_color, of(0).alpha), (Vec4::new(1.0, 0.0, 0.0, 0.25), AlphaMode::Blend));
    let texture = of(1).texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
    // A point whose v goes up is (0.1, 0.2): scaled and moved it is (0.7, 0.85).
    let moved = texture.transform.transform_point2(DVec2::new(0.1, 0.8));
    assert!((moved - DVec2::new(0.7, 1.0 - 0.85)).length() < 1e-12);
    assert_eq!(scene.textures.len(), 1);
    assert_eq!((of(2).base_color.w, of(2).alpha), (0.25, AlphaMode::Blend));
    assert!(of(3).texture.is_none());
    assert!((of(4).base_color.x - 0.214_041_14).abs() < 1e-6);
    assert_eq!(of(5).base_color, Vec4::ONE);
    assert_eq!((of(6).base_color, of(6).alpha), (Vec4::ONE, AlphaMode::Opaque));
    assert!(scene.materials.iter().all(|m| m.double_sided));
    let told = messages(&loaded);
    for part in ["secret.png", "map_d", "\"spectral x.rfl\" cannot be read", "\"unknown\": it is not defined"]
    {
        let is_map_d = part == "map_d";
        let wanted = if is_map_d { "texture of transparency" } else { part };
        assert_eq!(told.iter().filter(|m| m.contains(wanted)).count(), 1, "{wanted} in {told:#?}");
    }
    assert_eq!(told.len(), 4, "{told:#?}");
}

#[test]
fn faces_without_texture_coordinates_are_drawn_without_the_texture() {
    let files = |name: &str| match name {
        "m.mtl" => Ok(b"NEWMTL wood\nkd 0.5 0.5 0.5\nMap_Kd \"wood grain.png\"\nnewmtl plain\n".to_vec()),
        "wood grain.png" => Ok(png_of(1, 1, &[[1, 2, 3, 255]])),
        other => Err(format!("no {other}")),
    };
    let read = |faces: &str| {
        let text = format!("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl wood\n{faces}");
        from_bytes(Path::new("m.obj"), text.as_bytes(), &files).unwrap()
    };
    let textured = |loaded: &Loaded| -> Vec<bool> {
        let mesh = &loaded.scene.meshes[0];
        let material = |t| &loaded.scene.materials[mesh.material_of(t).unwrap() as usize];
        let textured = |t| material(t).texture.is_some() && !mesh.uvs.is_empty();
        (0..mesh.triangles.len() as u32).map(textured).collect()
    };
    let alone = read("f 1 2 3\n");
    assert_eq!((textured(&alone), messages(&alone).len()), (vec![false], 0));
    let mixed =
        read("f 1 2 3\nf 1/1 2/1 3/1\nf 3/1 2/1 1/1\nf 1/1 2 3/1\nusemtl plain\nf 1 2 3\nf 1/1 2/1 3/1\n");
    assert_eq!(textured(&mixed), [false, true, true, false, false, false]);
    assert_eq!(mixed.scene.materials.len(), 3);
    assert!(mixed.scene.materials.iter().all(|m| m.double_sided));
    let told = messages(&mixed);
    assert!(told.len() == 1 && told[0].starts_with("line 7: ") && told[0].ends_with("(2 times)"), "{told:?}");
}

#[test]
fn several_libraries_on_a_line_are_found() {
    let files = |name: &str| match name {
        "a.mtl" => Ok(b"newmtl a\nKd 0 1 0".to_vec()),
        "b.mtl" => Ok(b"newmtl b\nKd 0 0 1".to_vec()),
        other => Err(format!("no {other}")),
    };
    let text = "mtllib a.mtl b.mtl c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3";
    let loaded = from_bytes(Path::new("m.obj"), text.as_bytes(), &files).unwrap();
    let colors: Vec<Vec4> = loaded.scene.materials.iter().map(|m| m.base_color).collect();
    assert_eq!(colors, [Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)]);
    assert_eq!(messages(&loaded).len(), 1);
}

#[test]
fn what_is_not_obj_is_refused_and_what_is_empty_read() {
    let garbage: Vec<u8> = (0..4000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for bytes in [&garbage[..], b"<html>\n<body>", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", &[0; 1000]] {
        let refused = from_bytes(Path::new("m.obj"), bytes, &nothing_there).unwrap_err();
        assert!(matches!(refused, Error::Malformed { .. }));
        assert!(!refused.to_string().contains('\n'));
    }
    for text in ["", "\n \n", "# only a comment", "v 1 2 3", "o x\ng y\n"] {
        let loaded = read(text);
        assert!(loaded.scene.bounds().is_none() && loaded.scene.instance_count() == 0);
    }
    let told = messages(&read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n\0\0\0"));
    assert_eq!(told, ["line 5: a line holds zero bytes instead of text and is left out"]);
}

#[test]
fn a_file_all_of_whose_faces_are_lost_is_refused() {
    const V: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (rest, part) in [
        ("f 1 2 4", "its only face is lost (line 4: a face names a vertex that does not exist); nothing"),
        ("f 1 2 4\nl 1 2\nf 1 2 -9", "all of its 2 faces are lost (line 4: a face names"),
        ("f 1 2 4\n\nf 1", "all of its 2 faces are lost (line 4: a face names"),
        ("f 1 2", "(line 4: a face has fewer than three corners"),
        ("f 1 2 3x", "(line 4: a face cannot be read"),
        ("v 1e300 0 0\nf 1 2 4", "(line 5: a face has a coordinate that is infinite or beyond 32-bit floats"),
        ("v 1 2", "ends within a vertex and has no face"),
        ("v", "ends within a vertex and has no face"),
        ("vn 0", "ends within a vertex and has no face"),
    ] {
        let refused = from_bytes(Path::new("m.obj"), format!("{V}{rest}").as_bytes(), &nothing_there);
        let text = refused.unwrap_err().to_string();
        assert!(text.starts_with("m.obj: ") && text.contains(part) && !text.contains('\n'), "{text}");
    }
    // A face that is left, or that only has no area; and files that never had a face.
    for rest in ["f 1 2 3\nf 1 2 4", "f 1 2 2\nf 1 2 4", "v 1 2\n", "v 1 2 3", "l 1 2\nv 1", "vt 0", "# v"] {
        read(&format!("{V}{rest}"));
    }
}

/// What a file says, read in so many pieces, and what was odd about it.
fn in_pieces(pieces: usize, text: &[u8]) -> (String, Vec<String>) {
    let mut oddities = Oddities::default();
    let statements = parse_in(pieces, text, &mut oddities).unwrap();
    let told = oddities.into_diagnostics();
    (format!("{statements:?}"), told.iter().map(ToString::to_string).collect())
}

/// Statements that mean what they mean by what stands before them.
const LINES: [&str; 22] = [
    "v 0 0 0",
    "v 1 0 0",
    "v 0 1 0 1 0.5 0",
    "v 1",
    "vt 0 1",
    "vn 0 0 1",
    "f 1 2 3",
    "f -1 -2 -3",
    "f -1/-1 -2/-1 -9/-1",
    "f -3//-1 1//1 -1//-1",
    "f 1 -2 x",
    "l -1 -2 1",
    "l 1 -1/-1 -x",
    "o a",
    "g b",
    "g",
    "o",
    "usemtl m",
    "usemtl n",
    "mtllib a.mtl",
    "nonsense \\",
    "",
];

proptest! {
    #[test]
    fn pieces_of_a_file_say_what_the_whole_says(
        lines in prop::collection::vec((prop::sample::select(&LINES[..]), 0u8..8), 0..60),
        pieces in 2usize..9,
    ) {
        let mut text = String::new();
        for (line, end) in lines {
            text.push_str(line);
            text.push_str(["\n", "\n", "\n", "\r\n", " \\\n", "\\\r\n", "\r", " # \\\n"][end as usize]);
        }
        prop_assert_eq!(in_pieces(1, text.as_bytes()), in_pieces(pieces, text.as_bytes()));
    }

    #[test]
    fn pieces_of_a_damaged_file_say_what_the_whole_says(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        pieces in 2usize..40,
    ) {
        let mut bytes = ODD.as_bytes().to_vec();
        for (at, byte) in edits {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        prop_assert_eq!(in_pieces(1, &bytes), in_pieces(pieces, &bytes));
    }

    #[test]
    fn damaged_files_are_read_or_refused(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..4), 1..12),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = ODD.replace("not there.mtl", "m.mtl").into_bytes();
        let mut library = LIBRARY.as_bytes().to_vec();
        for (at, byte, how) in edits {
            let file = if how == 3 { &mut library } else { &mut bytes };
            let at = at.index(file.len());
            match how {
                0 => file.insert(at, byte),
                1 => { file.remove(at); }
                _ => file[at] = byte,
            }
        }
        bytes.truncate(bytes.len() - cut.index(bytes.len()) / 4);
        let files = |name: &str| if name == "m.mtl" { Ok(library.clone()) } else { Err("none".to_owned()) };
        if let Ok(loaded) = from_bytes(Path::new("m.obj"), &bytes, &files) {
            prop_assert!(loaded.scene.validate().is_ok());
            prop_assert!(loaded.diagnostics.iter().all(|d| !d.to_string().contains('\n')));
        }
    }
}
