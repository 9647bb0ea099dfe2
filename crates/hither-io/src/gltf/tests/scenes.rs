//! Hierarchies, instancing, cameras and animations.

use super::build::*;
use crate::gltf::from_bytes;
use glam::{DAffine3, DQuat, DVec3, Vec4};
use hither::scene::{CameraProjection, Content, Interpolation, Property, Transform};
use serde_json::json;
use std::cell::Cell;
use std::path::Path;

#[test]
fn ten_thousand_nested_nodes_are_read_in_order() {
    let mut build = square();
    const DEPTH: usize = 10_000;
    for i in 0..DEPTH {
        let child = if i == 0 { 0 } else { i };
        build.push("nodes", json!({ "children": [child], "translation": [1.0 / 1024.0, 0.0, 0.0] }));
    }
    build.json["scenes"][0]["nodes"] = json!([DEPTH]);
    let scene = build.scene();
    let nodes = &scene.root_group().nodes;
    assert_eq!(nodes.len(), DEPTH + 1);
    assert!(nodes.iter().enumerate().all(|(i, n)| n.parent == i.checked_sub(1).map(|p| p as u32)));
    assert_eq!(scene.instances()[0].world_from_mesh.translation, DVec3::new(9.765625, 0.0, 0.0));
}

#[test]
fn depth_first_whatever_the_order_in_the_file() {
    let mut build = square();
    // 0 is the square's root. 1 → (4, 2 → 3), 5 outside.
    build.push("nodes", json!({ "name": "1", "children": [4, 2] }));
    build.push("nodes", json!({ "name": "2", "children": [3], "mesh": 0 }));
    build.push("nodes", json!({ "name": "3", "mesh": 0 }));
    build.push("nodes", json!({ "name": "4", "mesh": 0 }));
    build.push("nodes", json!({ "name": "outside", "mesh": 0 }));
    build.json["scenes"][0]["nodes"] = json!([1, 0]);
    let scene = build.scene();
    let names: Vec<&str> = scene.root_group().nodes.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["1", "4", "2", "3", "square"]);
    assert_eq!(scene.instance_count(), 4);
    // Without scenes, every node without parent is shown.
    build.json.as_object_mut().unwrap().remove("scenes");
    build.json.as_object_mut().unwrap().remove("scene");
    let scene = build.scene();
    let names: Vec<&str> = scene.root_group().nodes.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["square", "1", "4", "2", "3", "outside"]);
}

#[test]
fn only_the_default_scene_is_read() {
    let mut build = square();
    // The other scene's mesh is broken, which does not matter.
    let broken = build.mesh("broken", json!([{ "attributes": { "POSITION": 99 } }]));
    build.push("materials", json!({ "name": "unused" }));
    build.push("nodes", json!({ "mesh": broken }));
    build.push("scenes", json!({ "name": "other", "nodes": [1] }));
    let scene = build.scene();
    assert_eq!((scene.meshes.len(), scene.materials.len()), (1, 0));
    build.json["scene"] = json!(1);
    assert!(build.refusal().contains("mesh 1 \"broken\""));
}

#[test]
fn transforms_as_matrix_and_as_parts() {
    let mut build = Build::new();
    let columns = [0.0, 2.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 4.0, 5.0, 6.0, 1.0];
    build.root(json!({ "matrix": columns }));
    build.root(json!({ "rotation": [0.0, 0.0, 3.0, 3.0], "scale": [1, 0, -1], "translation": [1, 2, 3] }));
    build.root(json!({ "rotation": [0, 0, 0, 0] }));
    build.root(json!({ "matrix": columns, "scale": [7, 7, 7] }));
    let (scene, odd) = build.odd_scene();
    let nodes = &scene.root_group().nodes;
    let matrix = nodes[0].local.matrix();
    assert_eq!(matrix.transform_point3(DVec3::ONE), DVec3::new(3.0, 7.0, 9.0));
    let Transform::Trs { rotation, scale, .. } = nodes[1].local else { panic!("it was given in parts") };
    assert!((rotation * DVec3::X - DVec3::Y).length() < 1e-12 && scale == DVec3::new(1.0, 0.0, -1.0));
    assert_eq!(nodes[2].local.matrix(), DAffine3::IDENTITY);
    assert_eq!(nodes[3].local, nodes[0].local);
    let both = "node 3: has a matrix besides its translation, rotation or scale; the matrix counts";
    assert_eq!(odd, ["node 2: its rotation is no unit quaternion; it is ignored", both]);
}

#[test]
fn gpu_instances_become_nodes_below_theirs() {
    let mut build = square();
    let at = build.floats(&[[1.0f32, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    let view = build.view(&[0x7f, 0, 0, 0].repeat(3), None);
    let turn = build.accessor(view, BYTE, "VEC4", 3);
    build.json["accessors"][turn]["normalized"] = true.into();
    let attributes = json!({ "TRANSLATION": at, "ROTATION": turn, "_ID": at });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    let last = build.push("nodes", json!({ "name": "child", "mesh": 0 }));
    build.json["nodes"][0]["extensions"] = instancing;
    build.json["nodes"][0]["children"] = json!([last]);
    build.json["nodes"][0]["translation"] = json!([0, 10, 0]);
    build.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let scene = build.scene();
    let nodes = &scene.root_group().nodes;
    let names: Vec<&str> = nodes.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["square", "square[0]", "square[1]", "square[2]", "child"]);
    assert_eq!(nodes[0].content, Content::Nothing);
    assert_eq!(scene.instance_count(), 4);
    let second = &scene.instances()[1].world_from_mesh;
    assert_eq!(second.transform_point3(DVec3::new(0.0, 1.0, 0.0)), DVec3::new(2.0, 9.0, 0.0));
}

#[test]
fn cameras_are_named_by_themselves_or_their_nodes() {
    let mut build = Build::new();
    let wide = json!({ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1, "zfar": 9.0 } });
    let flat = json!({ "type": "orthographic", "name": "plan",
        "orthographic": { "xmag": 2, "ymag": 1, "znear": 0, "zfar": 10 } });
    let broken = json!({ "type": "perspective", "perspective": { "yfov": 4.0, "znear": 0.1 } });
    for camera in [wide, flat, broken] {
        build.push("cameras", camera);
    }
    build.root(json!({ "name": "up", "camera": 1, "translation": [0, 5, 0] }));
    build.root(json!({ "name": "door", "camera": 0 }));
    build.root(json!({ "name": "window", "camera": 0 }));
    build.root(json!({ "name": "nowhere", "camera": 2 }));
    let (scene, odd) = build.odd_scene();
    let named: Vec<(&str, Option<u32>)> = scene.cameras.iter().map(|c| (c.name.as_str(), c.node)).collect();
    assert_eq!(named, [("door", Some(1)), ("window", Some(2)), ("plan", Some(0))]);
    assert_eq!(scene.cameras[0].projection, CameraProjection::Perspective { fov_y: 1.0, near: 0.1 });
    assert_eq!(scene.view(2, (10, 10)).unwrap().eye_in_world(), DVec3::new(0.0, 5.0, 0.0));
    assert!(odd.len() == 1 && odd[0].starts_with("camera 2 \"nowhere\""), "{odd:?}");
}

#[test]
fn channels_of_every_kind() {
    let mut build = square();
    let outside = build.push("nodes", json!({}));
    let fixed = build.root(json!({ "matrix": DAffine3::IDENTITY.matrix3.to_cols_array().iter().fold(
        vec![1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], |m, _| m) }));
    let times = build.floats(&[[0.0f32], [1.0]]);
    let backwards = build.floats(&[[1.0f32], [1.0]]);
    let moves = build.floats(&[[0.0f32, 0.0, 0.0], [1.0, 2.0, 3.0]]);
    let spline = build.floats(&[[0.5f32, 0.5, 0.5]; 6]);
    let view = build.view(&[0u8, 0, 0, 127, 0, 127, 0, 0], None);
    let turns = build.accessor(view, BYTE, "VEC4", 2);
    build.json["accessors"][turns]["normalized"] = true.into();
    let sampler = |input, output, interpolation: &str| json!({ "input": input, "output": output, "interpolation": interpolation });
    let channel = |sampler: usize, node: usize, path: &str| json!({ "sampler": sampler, "target": { "node": node, "path": path } });
    let samplers = json!([
        { "input": times, "output": moves },
        sampler(times, turns, "STEP"),
        sampler(times, spline, "CUBICSPLINE"),
        sampler(backwards, moves, "LINEAR"),
        sampler(times, spline, "LINEAR"),
    ]);
    let channels = json!([
        channel(0, 0, "translation"),
        channel(1, 0, "rotation"),
        channel(2, 0, "scale"),
        channel(0, outside, "translation"),
        channel(3, 0, "translation"),
        channel(4, 0, "scale"),
        channel(0, 0, "weights"),
        channel(0, fixed, "translation"),
        channel(9, 0, "translation"),
        channel(0, 99, "translation"),
    ]);
    build.push("animations", json!({ "name": "walk", "channels": channels, "samplers": samplers }));
    build.push(
        "animations",
        json!({ "channels": [channel(0, outside, "scale")],
        "samplers": [{ "input": times, "output": moves }] }),
    );
    let (mut scene, odd) = build.odd_scene();
    assert_eq!(scene.animations.len(), 1);
    let [slide, turn, grow] = &scene.animations[0].channels[..] else {
        panic!("three channels can be played")
    };
    assert_eq!((slide.property, slide.interpolation), (Property::Translation, Interpolation::Linear));
    assert_eq!((turn.property, turn.interpolation), (Property::Rotation, Interpolation::Step));
    assert_eq!(turn.values, [Vec4::W, Vec4::Y]);
    assert_eq!((grow.interpolation, grow.values.len()), (Interpolation::Cubic, 6));
    assert_eq!(odd.len(), 6, "{odd:?}");
    for part in ["do not increase", "disagree in number", "\"weights\"", "matrix", "sampler 9", "node 99"] {
        assert!(
            odd.iter().any(|o| o.starts_with("animation 0 \"walk\", channel ") && o.contains(part)),
            "{part}"
        );
    }
    assert!(scene.pose(0, 1.0));
    let Transform::Trs { translation, rotation, scale } = scene.root_group().nodes[0].local else {
        panic!("it was given in parts")
    };
    assert_eq!((translation, scale), (DVec3::new(1.0, 2.0, 3.0), DVec3::splat(0.5)));
    assert_eq!(rotation, DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0));
}

#[test]
fn skins_and_morphs_are_told_of_and_drawn_at_rest() {
    let mut build = square();
    build.json["nodes"][0]["skin"] = json!(0);
    build.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    let (scene, odd) = build.odd_scene();
    assert_eq!(scene.meshes[0].triangles.len(), 2);
    assert!(odd.iter().any(|o| o.contains("rest pose")) && odd.iter().any(|o| o.contains("rest shape")));
}

#[test]
fn an_empty_document_is_an_empty_scene() {
    let scene = Build::new().scene();
    assert_eq!((scene.instance_count(), scene.bounds()), (0, None));
}

#[test]
fn a_file_that_many_buffers_name_is_loaded_once() {
    let mut build = square();
    let file = std::mem::take(&mut build.bin);
    let names = ["a%20b.bin", "a b.bin", "%61 b.bin"];
    build.json["buffers"] = names.iter().map(|n| json!({ "uri": n, "byteLength": 60 })).collect();
    for i in 3..300 {
        build.push("buffers", json!({ "uri": names[i % 3], "byteLength": 60 }));
    }
    build.json["bufferViews"][1]["buffer"] = 299.into();
    let loads = Cell::new(0);
    let beside = |name: &str| {
        assert_eq!(name, "a b.bin");
        loads.set(loads.get() + 1);
        Ok(file.clone())
    };
    let loaded = from_bytes(Path::new("test.glb"), &build.glb(), &beside).unwrap();
    assert_eq!(loaded.scene.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(loads.get(), 1);
    // What one of them asks for beyond the file's end is still told of that one.
    build.json["buffers"][7]["byteLength"] = 61.into();
    let refused = from_bytes(Path::new("test.glb"), &build.glb(), &beside).unwrap_err().to_string();
    assert!(refused.contains("buffer 7 \"a b.bin\"") && refused.contains("there are 60"), "{refused}");
}
