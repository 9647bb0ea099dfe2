//! Every way in which glTF can lay out a triangle.

use super::build::*;
use glam::{Vec2, Vec3, Vec4};
use hither::scene::{Mesh, Scene};
use serde_json::json;

fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|c| mesh.positions[c as usize])).collect()
}

#[track_caller]
fn assert_square(scene: &Scene) {
    let [a, b, c, d] = SQUARE.map(Vec3::from_array);
    for mesh in &scene.meshes {
        assert_eq!(corners(mesh), [[a, b, c], [a, c, d]], "{}", mesh.name);
    }
}

#[test]
fn indices_of_every_type_and_none() {
    let mut build = square();
    let bytes: Vec<u8> = vec![0, 1, 2, 0, 2, 3];
    let view = build.view(&bytes, None);
    let u8s = build.accessor(view, UBYTE, "SCALAR", 6);
    let wide: Vec<u8> = bytes.iter().flat_map(|&b| u32::from(b).to_le_bytes()).collect();
    let view = build.view(&wide, None);
    let u32s = build.accessor(view, UINT, "SCALAR", 6);
    let strided: Vec<u8> = bytes.iter().flat_map(|&b| [b, 0, 9, 9]).collect();
    let view = build.view(&strided[..22], Some(4));
    let u16s = build.accessor(view, USHORT, "SCALAR", 6);
    for indices in [u8s, u32s, u16s] {
        build.show("indexed", json!([{ "attributes": { "POSITION": 0 }, "indices": indices }]));
    }
    let [a, b, c, d] = SQUARE;
    let positions = build.floats(&[a, b, c, a, c, d]);
    build.show("plain", json!([{ "attributes": { "POSITION": positions } }]));
    let scene = build.scene();
    assert_eq!(scene.meshes.len(), 5);
    assert_square(&scene);
}

#[test]
fn strips_and_fans_and_what_is_left_out() {
    let mut build = Build::new();
    let [a, b, c, d] = SQUARE;
    let strip = build.floats(&[a, b, d, c]);
    let fan = build.floats(&SQUARE);
    build.show("strip", json!([{ "attributes": { "POSITION": strip }, "mode": 5 }]));
    build.show("fan", json!([{ "attributes": { "POSITION": fan }, "mode": 6 }]));
    for mode in 0..4 {
        build.show("thin", json!([{ "attributes": { "POSITION": fan }, "mode": mode }]));
    }
    let (scene, odd) = build.odd_scene();
    let [a, b, c, d] = SQUARE.map(Vec3::from_array);
    assert_eq!(corners(&scene.meshes[0]), [[a, b, d], [b, c, d]]);
    assert_eq!(corners(&scene.meshes[1]), [[a, b, c], [a, c, d]]);
    // A mesh of lines still is an instance, so that the others keep their numbers.
    assert_eq!(scene.instance_count(), 6);
    assert_eq!(odd, ["mesh 2 \"thin\": its points are left out"]);
    let lines = |i: usize| scene.meshes[i].lines.clone();
    assert!(lines(2).is_empty());
    assert_eq!(lines(3), [[a, b], [c, d]]);
    assert_eq!(lines(4), [[a, b], [b, c], [c, d], [d, a]]);
    assert_eq!(lines(5), [[a, b], [b, c], [c, d]]);
}

#[test]
fn lines_take_their_corners_from_indices() {
    let mut build = Build::new();
    let [a, b, c, d] = SQUARE;
    let corners = build.floats(&[a, [f32::NAN; 3], b, c, d]);
    let indices = build.shorts(&[2, 4, 4, 4, 2, 3, 1, 2]);
    let faces = build.shorts(&[0, 2, 3]);
    build.show(
        "lined",
        json!([{ "attributes": { "POSITION": corners }, "indices": faces },
               { "attributes": { "POSITION": corners }, "indices": indices, "mode": 1 }]),
    );
    let (scene, odd) = build.odd_scene();
    let [_, b, c, d] = SQUARE.map(Vec3::from_array);
    assert_eq!(scene.meshes[0].lines, [[b, d], [b, c]]);
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    assert!(odd.iter().any(|o| o.contains("has lines that touch a position")), "{odd:?}");
    let outside = build.shorts(&[0, 9]);
    build.show("outside", json!([{ "attributes": { "POSITION": corners }, "indices": outside, "mode": 1 }]));
    assert!(build.refusal().contains("index 1 is 9, but there are 5 vertices"));
}

#[test]
fn interleaved_and_quantized_attributes() {
    let mut build = Build::new();
    // Position as shorts, normal as normalized bytes, uv as normalized unsigned shorts: 16 bytes a vertex.
    let mut bytes = Vec::new();
    for [x, y, z] in SQUARE {
        for v in [x, y, z] {
            bytes.extend(((v * 300.0) as i16).to_le_bytes());
        }
        bytes.extend([0, 0]);
        bytes.extend([0, 0, 127, 0]);
        bytes.extend(((x * 65_535.0) as u16).to_le_bytes());
        bytes.extend(((y * 65_535.0) as u16).to_le_bytes());
    }
    let view = build.view(&bytes, Some(16));
    let position = build.accessor(view, SHORT, "VEC3", 4);
    let normal = build.accessor(view, BYTE, "VEC3", 4);
    let uv = build.accessor(view, USHORT, "VEC2", 4);
    for (accessor, offset) in [(normal, 8), (uv, 12)] {
        build.json["accessors"][accessor]["byteOffset"] = offset.into();
        build.json["accessors"][accessor]["normalized"] = true.into();
    }
    let attributes = json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv });
    build.show("quantized", json!([{ "attributes": attributes, "mode": 6 }]));
    build.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let mesh = &build.scene().meshes[0];
    assert_eq!(mesh.positions[2], Vec3::new(300.0, 300.0, 0.0));
    assert_eq!(mesh.normals, [Vec3::Z; 4]);
    assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
}

#[test]
fn every_component_type_as_a_colour() {
    for (component, bytes, expected) in [
        (UBYTE, vec![51u8, 102, 255, 0], [0.2, 0.4, 1.0, 0.0]),
        (BYTE, vec![127, 0x80, 0, 64], [1.0, -1.0, 0.0, 64.0 / 127.0]),
        (
            USHORT,
            [0u16, 65_535, 13_107, 1].iter().flat_map(|v| v.to_le_bytes()).collect(),
            [0.0, 1.0, 0.2, 1.0 / 65_535.0],
        ),
        (
            SHORT,
            [32_767i16, -32_768, 0, 1].iter().flat_map(|v| v.to_le_bytes()).collect(),
            [1.0, -1.0, 0.0, 1.0 / 32_767.0],
        ),
        (
            UINT,
            [u32::MAX, 0, 0, u32::MAX].iter().flat_map(|v| v.to_le_bytes()).collect(),
            [1.0, 0.0, 0.0, 1.0],
        ),
    ] {
        let mut build = Build::new();
        let position = build.floats(&[SQUARE[0], SQUARE[1], SQUARE[2]]);
        let view = build.view(&bytes.repeat(3), None);
        let color = build.accessor(view, component, "VEC4", 3);
        build.json["accessors"][color]["normalized"] = true.into();
        build.show("coloured", json!([{ "attributes": { "POSITION": position, "COLOR_0": color } }]));
        assert_eq!(build.scene().meshes[0].colors, [Vec4::from_array(expected); 3], "{component}");
    }
}

#[test]
fn sparse_values_replace_and_stand_alone() {
    let mut build = square();
    let places = build.view(&[2, 0, 3, 0], None);
    let moved: Vec<u8> =
        [[5.0f32, 6.0, 7.0], [8.0, 9.0, 10.0]].as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let values = build.view(&moved, None);
    let sparse = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": USHORT },
        "values": { "bufferView": values },
    });
    let over =
        json!({ "bufferView": 0, "componentType": FLOAT, "type": "VEC3", "count": 4, "sparse": sparse });
    let over = build.push("accessors", over);
    let alone = json!({ "componentType": FLOAT, "type": "VEC3", "count": 5, "sparse": sparse });
    let alone = build.push("accessors", alone);
    build.show("over", json!([{ "attributes": { "POSITION": over }, "mode": 6 }]));
    build.show("alone", json!([{ "attributes": { "POSITION": alone }, "mode": 6 }]));
    let scene = build.scene();
    let (p, q) = (Vec3::new(5.0, 6.0, 7.0), Vec3::new(8.0, 9.0, 10.0));
    assert_eq!(scene.meshes[1].positions, [Vec3::ZERO, Vec3::X, p, q]);
    assert_eq!(scene.meshes[2].positions, [Vec3::ZERO, Vec3::ZERO, p, q, Vec3::ZERO]);

    build.json["accessors"][over]["sparse"]["indices"]["componentType"] = BYTE.into();
    assert!(build.refusal().contains("unsigned integers"));
    build.json["accessors"][over]["sparse"]["indices"]["componentType"] = USHORT.into();
    build.json["accessors"][over]["count"] = 3.into();
    assert!(build.refusal().contains("sparse index 1 is 3, but there are 3 elements"));
}

#[test]
fn primitives_share_vertices_and_fill_in_what_they_lack() {
    let mut build = Build::new();
    let positions = build.floats(&SQUARE);
    let normals = build.floats(&[[0.0, 0.0, 2.0]; 4]);
    let colors = build.floats(&[[0.5f32, 0.25, 1.0]; 4]);
    let (first, second) = (build.shorts(&[0, 1, 2]), build.shorts(&[0, 2, 3]));
    let full = json!({ "POSITION": positions, "NORMAL": normals, "COLOR_0": colors });
    let (m, n) =
        (build.push("materials", json!({})), build.push("materials", json!({ "doubleSided": true })));
    build.show(
        "shared",
        json!([
            { "attributes": full, "indices": first, "material": n },
            { "attributes": full, "indices": second, "material": m },
            { "attributes": { "POSITION": positions }, "indices": second },
        ]),
    );
    let scene = build.scene();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles[..2], [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.primitives.iter().map(|p| p.material).collect::<Vec<_>>(), [Some(1), Some(0), None]);
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(corners(mesh)[1], corners(mesh)[2]);
    let last = mesh.triangles[2].map(|c| c as usize);
    assert!(last.iter().all(|&c| mesh.normals[c] == Vec3::Z && mesh.colors[c] == Vec4::ONE));
    assert_eq!(mesh.colors[0], Vec4::new(0.5, 0.25, 1.0, 1.0));
    assert_eq!(mesh.normals[0], Vec3::Z);
}

#[test]
fn what_is_no_number_is_dropped_and_told_once() {
    let mut build = Build::new();
    let [a, b, c, d] = SQUARE;
    let bad = [f32::NAN, 0.0, 0.0];
    let far = [0.0, f32::INFINITY, 0.0];
    let positions = build.floats(&[a, b, c, bad, far, d]);
    let normals = build.floats(&[[0.0f32, 0.0, 0.0], [f32::NAN; 3], [3.0, 0.0, 0.0], a, a, a]);
    let first = build.shorts(&[0, 3, 1, 0, 1, 2]);
    let second = build.shorts(&[4, 1, 2]);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    build.show(
        "half",
        json!([
            { "attributes": attributes, "indices": first },
            { "attributes": attributes, "indices": second },
        ]),
    );
    let (scene, odd) = build.odd_scene();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.primitives.len(), 1);
    assert_eq!(mesh.normals[..3], [Vec3::Z, Vec3::Z, Vec3::X]);
    assert_eq!(odd.len(), 2, "{odd:?}");
    assert!(odd[0].starts_with("mesh 0 \"half\": 2 of its 3 triangles touch a position"), "{odd:?}");
    assert!(odd[1].contains("normals without direction"), "{odd:?}");
}

#[test]
fn huge_and_tiny_faces_have_normals() {
    for scale in [1e-18f32, 1e18] {
        let mut build = Build::new();
        let positions = build.floats(&SQUARE.map(|p| p.map(|v| v * scale)));
        let normals = build.floats(&[[0.0f32; 3]; 4]);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals });
        build.show("extreme", json!([{ "attributes": attributes, "mode": 6 }]));
        assert_eq!(build.odd_scene().0.meshes[0].normals, [Vec3::Z; 4]);
    }
}

#[test]
fn a_small_part_of_a_large_list_is_read_alone() {
    let mut build = Build::new();
    let many: Vec<[f32; 3]> = (0..100u8).map(|i| [f32::from(i), 0.0, f32::from(i % 7)]).collect();
    let normals: Vec<[f32; 3]> =
        (0..100).map(|i| if i == 52 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }).collect();
    let (positions, normals) = (build.floats(&many), build.floats(&normals));
    let (first, second) = (build.shorts(&[50, 51, 52]), build.shorts(&[52, 51, 54]));
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    build.show(
        "part",
        json!([{ "attributes": attributes, "indices": first }, { "attributes": attributes, "indices": second }]),
    );
    let mesh = &build.scene().meshes[0];
    assert_eq!(mesh.positions, many[50..55].iter().map(|&p| Vec3::from_array(p)).collect::<Vec<_>>());
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 4]]);
    assert_eq!((mesh.normals[1], mesh.normals[2]), (Vec3::Y, Vec3::X));
}
