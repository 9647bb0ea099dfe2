//! Files that must be refused, each with one line that names the place.

use super::build::*;
use serde_json::{Value, json};

#[track_caller]
fn refused(change: impl Fn(&mut Build), parts: &[&str]) {
    let mut build = square();
    change(&mut build);
    let message = build.refusal();
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

fn set(build: &mut Build, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let parent = build.json.pointer_mut(parent).unwrap();
    match parent {
        Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
        other => other[key] = value,
    }
}

#[test]
fn references_out_of_range() {
    for (pointer, parts) in [
        ("/scene", &["scene 9", "there are 1"][..]),
        ("/scenes/0/nodes/0", &["node 9", "there are 1"]),
        ("/nodes/0/mesh", &["node 0 \"square\"", "mesh 9"]),
        ("/meshes/0/primitives/0/material", &["mesh 0 \"square\", primitive 0", "material 9"]),
        ("/meshes/0/primitives/0/indices", &["primitive 0", "indices", "accessor 9"]),
        ("/meshes/0/primitives/0/attributes/POSITION", &["POSITION", "accessor 9"]),
        ("/meshes/0/primitives/0/mode", &["primitive 0", "mode 9"]),
        ("/accessors/0/bufferView", &["accessor 0", "buffer view 9"]),
        ("/accessors/0/componentType", &["accessor 0", "component type 9"]),
        ("/accessors/0/count", &["accessor 0", "9 elements of 12 bytes", "48 bytes"]),
        ("/bufferViews/0/buffer", &["buffer view 0", "buffer 9"]),
    ] {
        refused(|b| set(b, pointer, json!(9)), parts);
    }
    refused(|b| set(b, "/nodes/0/children", json!([5])), &["node 0 \"square\"", "child 5"]);
    refused(|b| set(b, "/accessors/0/type", json!("MAT4")), &["accessor 0", "type"]);
    refused(|b| set(b, "/accessors/0/type", json!("VEC2")), &["POSITION", "VEC2", "3 components"]);
    refused(|b| set(b, "/accessors/1/componentType", json!(FLOAT)), &["indices"]);
}

#[test]
fn numbers_that_overflow() {
    let most = json!(u64::MAX);
    let word = json!(u32::MAX);
    for value in [most, word, json!(1e15)] {
        for pointer in [
            "/accessors/0/byteOffset",
            "/accessors/0/count",
            "/accessors/1/count",
            "/bufferViews/0/byteOffset",
            "/bufferViews/0/byteLength",
            "/bufferViews/0/byteStride",
        ] {
            let mut build = square();
            set(&mut build, pointer, value.clone());
            let message = build.refusal();
            assert!(message.contains("accessor") || message.contains("buffer view"), "{pointer}: {message}");
        }
    }
    // Zeros that no data stands for: the file's length bounds them all the same.
    refused(
        |b| {
            let zeros = json!({ "componentType": FLOAT, "type": "VEC3", "count": u32::MAX });
            let zeros = b.push("accessors", zeros);
            set(b, "/meshes/0/primitives/0/attributes/POSITION", json!(zeros));
        },
        &["out of all proportion"],
    );
    refused(|b| set(b, "/bufferViews/0/byteStride", json!(0)), &["overlap"]);
    refused(|b| set(b, "/bufferViews/0/byteStride", json!(8)), &["overlap", "stride is 8"]);
}

#[test]
fn many_meshes_of_one_view_cannot_fill_the_memory() {
    let mut build = Build::new();
    let view = build.view(&[0; 30_000], None);
    let position = build.accessor(view, BYTE, "VEC3", 10_000);
    for _ in 0..4000 {
        build.show("copy", json!([{ "attributes": { "POSITION": position }, "mode": 5 }]));
    }
    assert!(build.refusal().contains("out of all proportion"));
}

#[test]
fn many_instances_of_a_long_name_cannot_fill_the_memory() {
    let mut build = square();
    let places = json!({ "componentType": FLOAT, "type": "VEC3", "count": 20_000 });
    let places = build.push("accessors", places);
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    set(&mut build, "/nodes/0/extensions", instancing);
    let scene = build.scene();
    assert_eq!((scene.instance_count(), scene.root_group().nodes[1].name.as_str()), (20_000, "square[0]"));
    set(&mut build, "/nodes/0/name", json!("N".repeat(40_000)));
    let message = build.refusal();
    assert!(message.contains("node 0 \"NNN") && message.contains("out of all proportion"), "{message}");
    assert!(message.len() < 300);
}

#[test]
fn an_index_out_of_range_is_named() {
    refused(
        |b| {
            let indices = b.shorts(&[0, 1, 2, 0, 4, 60_000]);
            set(b, "/meshes/0/primitives/0/indices", json!(indices));
        },
        &["mesh 0 \"square\"", "index 4 is 4", "4 vertices"],
    );
}

#[test]
fn nodes_that_form_no_tree() {
    let mut build = Build::new();
    for (name, child) in [("a", 1), ("b", 2), ("c", 0)] {
        build.push("nodes", json!({ "name": name, "children": [child] }));
    }
    set(&mut build, "/scenes/0/nodes", json!([0]));
    let cycle = "its nodes form a cycle: node 0 \"a\" → node 1 \"b\" → node 2 \"c\" → node 0 \"a\"";
    assert!(build.refusal().ends_with(cycle), "{}", build.refusal());
    set(&mut build, "/nodes/2/children", json!([2]));
    assert!(build.refusal().contains("both node 1 \"b\" and node 2 \"c\""), "{}", build.refusal());
    set(&mut build, "/nodes/1/children", json!([]));
    assert!(build.refusal().ends_with("node 2 \"c\" → node 2 \"c\""), "{}", build.refusal());
    set(&mut build, "/nodes/2/children", json!([]));
    set(&mut build, "/scenes/0/nodes", json!([0, 1]));
    assert!(build.refusal().contains("node 1 \"b\" is in the scene twice"), "{}", build.refusal());
}

#[test]
fn places_beyond_all_numbers() {
    let mut build = square();
    for _ in 0..4 {
        let below = build.json["nodes"].as_array().unwrap().len() - 1;
        build.push("nodes", json!({ "children": [below], "scale": [1e100, 1e100, 1e100] }));
    }
    set(&mut build, "/scenes/0/nodes", json!([4]));
    assert!(build.refusal().contains("not a finite number"), "{}", build.refusal());
}

#[test]
fn versions_and_extensions() {
    refused(|b| set(b, "/asset/version", json!("1.0")), &["version \"1.0\"", "convert"]);
    refused(|b| set(b, "/asset/minVersion", json!("2.1")), &["\"2.1\""]);
    refused(|b| set(b, "/asset", json!({})), &["asset.version"]);
    let requires = |name: &str| json!([name]);
    refused(
        |b| set(b, "/extensionsRequired", requires("EXT_does_not_exist")),
        &["EXT_does_not_exist", "not supported"],
    );
    refused(
        |b| set(b, "/extensionsRequired", requires("KHR_draco_mesh_compression")),
        &["Draco", "convert the file"],
    );
    // Used without being required, Draco is only in the way where there is nothing else.
    let draco = json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    let mut build = square();
    set(&mut build, "/meshes/0/primitives/0/extensions", draco);
    assert_eq!(build.scene().meshes[0].triangles.len(), 2);
    build.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert!(build.refusal().contains("Draco"));
}

#[test]
fn buffers_that_are_missing_or_short() {
    refused(
        |b| b.json["buffers"] = json!([{ "uri": "does%20not exist.bin", "byteLength": 60 }]),
        &["buffer 0 \"does%20not exist.bin\"", "there is no does not exist.bin"],
    );
    refused(
        |b| b.json["buffers"] = json!([{ "byteLength": 1000 }]),
        &["buffer 0", "1000 bytes", "there are 60"],
    );
    refused(
        |b| b.json["buffers"] = json!([{ "uri": "data:;base64,AAAA", "byteLength": 60 }]),
        &["buffer 0", "60 bytes", "there are 3"],
    );
    refused(|b| set(b, "/bufferViews/0/byteOffset", json!(30)), &["buffer view 0", "48 bytes at byte 30"]);
    // A buffer that nothing fills is a fault once it is needed.
    let mut build = square();
    build.json["buffers"] = json!([{ "byteLength": 60 }, { "byteLength": 60 }]);
    assert_eq!(build.scene().meshes.len(), 1);
    set(&mut build, "/bufferViews/0/buffer", json!(1));
    assert!(build.refusal().contains("buffer 1 has no content"));
}

#[test]
fn text_that_is_no_document() {
    for (text, part) in [
        ("{", "EOF"),
        ("{\"asset\":{\"version\":2}}", "asset.version: invalid type"),
        ("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"translation\":[1,2]}]}", "nodes[0].translation"),
        ("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"scale\":[1e999,1,1]}]}", "out of range"),
        ("[]", "neither with { nor"),
    ] {
        let folder = |_: &str| Err(String::new());
        let path = std::path::Path::new("test.gltf");
        let message = crate::gltf::from_bytes(path, text.as_bytes(), &folder).unwrap_err().to_string();
        assert!(message.contains(part) && !message.contains('\n'), "{message}");
    }
}
