//! Valid files, damaged at random: whatever comes in, a scene or one line comes out.

use super::build::*;
use crate::Loaded;
use crate::gltf::meshopt::{self, Filter, Mode};
use crate::texture::tests::png_of;
use proptest::prelude::*;
use serde_json::{Value, json};

/// A file that uses nearly everything that is read.
fn rich() -> Build {
    let mut build = square();
    let uvs = build.floats(&[[0.5f32, 0.5]; 4]);
    let colors = build.floats(&[[0.5f32, 0.5, 0.5, 1.0]; 4]);
    let normals = build.floats(&[[0.0f32, 0.0, 1.0]; 4]);
    let places = build.view(&[1, 0], None);
    let value = build.view(&[0; 12], None);
    let sparse = json!({ "bufferView": 0, "componentType": FLOAT, "type": "VEC3", "count": 4, "sparse": {
        "count": 1, "indices": { "bufferView": places, "componentType": USHORT }, "values": { "bufferView": value } } });
    let sparse = build.push("accessors", sparse);
    let image = build.view(&png_of(2, 2, &[[9; 4]; 4]), None);
    build.push("images", json!({ "bufferView": image }));
    build.push("textures", json!({ "source": 0 }));
    build.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    let attributes = json!({ "POSITION": sparse, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors });
    build.show(
        "rich",
        json!([{ "attributes": attributes, "mode": 5, "material": 0 },
        { "attributes": { "POSITION": 0 }, "indices": 1, "mode": 6 }]),
    );
    // Attributes of one block, told relative to a tail of zeros: no change at all.
    let mut packed = vec![0xa0];
    packed.extend([0; 12]);
    packed.extend([0; 32]);
    let compressed = build.view(&packed, None);
    let length = build.json["bufferViews"][compressed]["byteLength"].clone();
    let offset = build.json["bufferViews"][compressed]["byteOffset"].clone();
    let view = build.push(
        "bufferViews",
        json!({ "buffer": 1, "byteLength": 48, "extensions": {
        "EXT_meshopt_compression": { "buffer": 0, "byteOffset": offset, "byteLength": length,
            "byteStride": 12, "count": 4, "mode": "ATTRIBUTES" } } }),
    );
    let unpacked = build.accessor(view, FLOAT, "VEC3", 4);
    build.show("packed", json!([{ "attributes": { "POSITION": unpacked }, "mode": 6 }]));
    let times = build.floats(&[[0.0f32], [1.0]]);
    let moves = build.floats(&[[0.0f32, 0.0, 0.0]; 2]);
    build.push(
        "animations",
        json!({ "samplers": [{ "input": times, "output": moves }],
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] }),
    );
    build.push("cameras", json!({ "perspective": { "yfov": 1, "znear": 1 } }));
    build.root(json!({ "camera": 0, "mesh": 0, "extensions": {
        "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves } } } }));
    let length = build.bin.len();
    build.json["buffers"] = json!([{ "byteLength": length }, { "byteLength": 48 }]);
    build
}

#[track_caller]
fn check(bytes: &[u8]) {
    match read(bytes) {
        Ok(Loaded { scene, diagnostics, .. }) => {
            scene.validate().unwrap();
            assert!(diagnostics.iter().all(|d| !d.to_string().contains('\n')));
        }
        Err(message) => assert!(!message.contains('\n'), "{message:?}"),
    }
}

/// Every number and string in the document.
fn leaves<'a>(value: &'a mut Value, found: &mut Vec<&'a mut Value>) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(|v| leaves(v, found)),
        Value::Object(map) => map.iter_mut().for_each(|(_, v)| leaves(v, found)),
        leaf => found.push(leaf),
    }
}

fn odd_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        (0u64..12).prop_map(Value::from),
        (0u32..64).prop_map(|b| Value::from(1u64 << b)),
        any::<u64>().prop_map(Value::from),
        any::<i32>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        prop::sample::select(vec![5120, 5121, 5122, 5123, 5125, 5126]).prop_map(Value::from),
        prop::sample::select(vec!["", "SCALAR", "VEC2", "VEC3", "VEC4", "MAT4", "TRIANGLES", "\n"])
            .prop_map(Value::from),
        Just(Value::Null),
        Just(json!([])),
        Just(json!({})),
    ]
}

#[test]
fn the_rich_file_is_read() {
    let scene = rich().scene();
    assert_eq!((scene.meshes.len(), scene.textures.len(), scene.cameras.len()), (3, 1, 1));
    assert_eq!((scene.animations.len(), scene.instance_count()), (1, 5));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn truncated(end in 0usize..8000) {
        let bytes = rich().glb();
        check(&bytes[..end.min(bytes.len())]);
    }

    #[test]
    fn with_bytes_changed(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)) {
        let mut bytes = rich().glb();
        let length = bytes.len();
        for (at, byte) in changes {
            bytes[at.index(length)] = byte;
        }
        check(&bytes);
    }

    #[test]
    fn with_values_changed(changes in prop::collection::vec((any::<prop::sample::Index>(), odd_value()), 1..4)) {
        let mut build = rich();
        let mut found = Vec::new();
        leaves(&mut build.json, &mut found);
        let count = found.len();
        for (at, value) in changes {
            *found[at.index(count)] = value;
        }
        check(&build.glb());
    }

    #[test]
    fn any_bytes_at_all(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        check(&bytes);
    }

    #[test]
    fn any_compressed_bytes(
        mut bytes in prop::collection::vec(any::<u8>(), 0..600),
        start in prop::sample::select(vec![0xa0u8, 0xa1, 0xe1, 0xd1]),
        count in 0usize..700,
        stride in prop::sample::select(vec![2usize, 4, 8, 12, 16, 256]),
        filter in prop::sample::select(vec![None, Some(Filter::Octahedral), Some(Filter::Quaternion),
            Some(Filter::Exponential), Some(Filter::Color)]),
    ) {
        if let Some(first) = bytes.first_mut() {
            *first = start;
        }
        for mode in [Mode::Attributes, Mode::Triangles, Mode::Indices] {
            if let Ok(decoded) = meshopt::decode(&bytes, mode, filter, count, stride) {
                prop_assert_eq!(decoded.len(), count * stride);
            }
        }
        // The counts that only a lie can make.
        for count in [usize::MAX, usize::MAX / 3 * 3, 1 << 40] {
            prop_assert!(meshopt::decode(&bytes, Mode::Attributes, filter, count, 4).is_err());
            prop_assert!(meshopt::decode(&bytes, Mode::Triangles, None, count, 4).is_err());
            prop_assert!(meshopt::decode(&bytes, Mode::Indices, None, count, 4).is_err());
        }
    }
}
