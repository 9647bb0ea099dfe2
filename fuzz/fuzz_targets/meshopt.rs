//! Compressed buffers of `EXT_meshopt_compression`: the first bytes choose how they are declared.
#![no_main]

use hither_fuzz::{check, nothing};
use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let [mode, filter, stride, count, rest @ ..] = bytes else { return };
    // Accessors that fit each mode, so that what is decoded is also used.
    let (mode, stride) = match mode % 3 {
        0 => ("ATTRIBUTES", 4 + 4 * u32::from(stride % 16)),
        1 => ("TRIANGLES", 2 + 2 * u32::from(stride % 2)),
        _ => ("INDICES", 2 + 2 * u32::from(stride % 2)),
    };
    let filter = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"][usize::from(filter % 5)];
    let count = u32::from(*count);
    let length = rest.len();
    let accessor = match (mode, stride) {
        ("ATTRIBUTES", 4) => r#""componentType":5120,"type":"VEC3","normalized":true"#,
        ("ATTRIBUTES", 8) => r#""componentType":5122,"type":"VEC3","normalized":true"#,
        ("ATTRIBUTES", _) => r#""componentType":5126,"type":"VEC3""#,
        (_, 2) => r#""componentType":5123,"type":"SCALAR""#,
        _ => r#""componentType":5125,"type":"SCALAR""#,
    };
    let attributes = mode == "ATTRIBUTES";
    let byte_stride = if attributes { format!(r#""byteStride":{stride},"#) } else { String::new() };
    let primitive = if attributes {
        r#"{"attributes":{"POSITION":1}}"#
    } else {
        r#"{"attributes":{"POSITION":0},"indices":1}"#
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},
        "extensionsUsed":["EXT_meshopt_compression","KHR_mesh_quantization"],
        "extensionsRequired":["EXT_meshopt_compression","KHR_mesh_quantization"],
        "buffers":[{{"byteLength":{length}}},{{"byteLength":65536,
            "extensions":{{"EXT_meshopt_compression":{{"fallback":true}}}}}}],
        "bufferViews":[{{"buffer":1,{byte_stride}"byteLength":{size},"extensions":{{"EXT_meshopt_compression":{{
            "buffer":0,"byteLength":{length},"byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}],
        "accessors":[{{"componentType":5126,"type":"VEC3","count":64}},
            {{"bufferView":0,{accessor},"count":{count}}}],
        "meshes":[{{"primitives":[{primitive}]}}],"nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}],"scene":0}}"#,
        size = stride * count,
    );
    check(hither_io::gltf::from_bytes(Path::new("model.glb"), &glb(json, rest), &nothing));
});

/// A GLB file of these two chunks.
fn glb(mut json: String, buffer: &[u8]) -> Vec<u8> {
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let mut buffer = buffer.to_vec();
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    file.extend((json.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(json.into_bytes());
    file.extend((buffer.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(buffer);
    file
}
