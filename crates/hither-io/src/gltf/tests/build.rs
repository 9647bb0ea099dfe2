//! Makes small glTF files: accessors by their values, the rest as JSON.

use crate::gltf::from_bytes;
use crate::{Diagnostic, Loaded};
use hither::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;

pub(super) const BYTE: u32 = 5120;
pub(super) const UBYTE: u32 = 5121;
pub(super) const SHORT: u32 = 5122;
pub(super) const USHORT: u32 = 5123;
pub(super) const UINT: u32 = 5125;
pub(super) const FLOAT: u32 = 5126;

/// A document under construction, with its one buffer.
#[derive(Clone)]
pub(super) struct Build {
    pub(super) json: Value,
    pub(super) bin: Vec<u8>,
}

impl Build {
    pub(super) fn new() -> Build {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "materials": [],
            "cameras": [], "animations": [], "textures": [], "images": [], "samplers": [],
        });
        Build { json, bin: Vec::new() }
    }

    pub(super) fn push(&mut self, list: &str, entry: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(entry);
        list.len() - 1
    }

    pub(super) fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    pub(super) fn accessor(&mut self, view: usize, component: u32, kind: &str, count: usize) -> usize {
        let entry = json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        self.push("accessors", entry)
    }

    pub(super) fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, None);
        self.accessor(view, FLOAT, ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1], values.len())
    }

    pub(super) fn shorts(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, None);
        self.accessor(view, USHORT, "SCALAR", indices.len())
    }

    pub(super) fn mesh(&mut self, name: &str, primitives: Value) -> usize {
        self.push("meshes", json!({ "name": name, "primitives": primitives }))
    }

    /// A node of the scene.
    pub(super) fn root(&mut self, node: Value) -> usize {
        let at = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(at.into());
        at
    }

    /// A root node with a mesh of the primitives.
    pub(super) fn show(&mut self, name: &str, primitives: Value) -> usize {
        let mesh = self.mesh(name, primitives);
        self.root(json!({ "name": name, "mesh": mesh }))
    }

    fn finished(&self) -> Value {
        let mut json = self.json.clone();
        let lists = json.as_object_mut().unwrap();
        lists.retain(|_, list| list.as_array().is_none_or(|l| !l.is_empty()));
        if !self.bin.is_empty() && !lists.contains_key("buffers") {
            lists.insert("buffers".into(), json!([{ "byteLength": self.bin.len() }]));
        }
        json
    }

    pub(super) fn glb(&self) -> Vec<u8> {
        let mut text = self.finished().to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((28 + text.len() as u32 + bin.len() as u32).to_le_bytes());
        out.extend((text.len() as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(text);
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    }

    pub(super) fn read(&self) -> Result<Loaded, String> {
        read(&self.glb())
    }

    /// The scene of a file with nothing odd.
    #[track_caller]
    pub(super) fn scene(&self) -> Scene {
        let Loaded { scene, diagnostics, .. } = self.read().unwrap();
        assert_eq!(diagnostics, []);
        scene
    }

    #[track_caller]
    pub(super) fn refusal(&self) -> String {
        let message = self.read().unwrap_err();
        assert!(!message.contains('\n'), "{message}");
        message
    }

    #[track_caller]
    pub(super) fn odd_scene(&self) -> (Scene, Vec<String>) {
        let Loaded { scene, diagnostics, .. } = self.read().unwrap();
        (scene, diagnostics.iter().map(Diagnostic::to_string).collect())
    }
}

/// Reads a file's bytes; no other files are there.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, String> {
    let nothing = |name: &str| Err(format!("there is no {name}"));
    from_bytes(Path::new("test.glb"), bytes, &nothing).map_err(|e| e.to_string())
}

/// Corners of a unit square in the plane z = 0, counter-clockwise from the origin.
pub(super) const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// A file with one square of two triangles.
pub(super) fn square() -> Build {
    let mut build = Build::new();
    let positions = build.floats(&SQUARE);
    let indices = build.shorts(&[0, 1, 2, 0, 2, 3]);
    build.show("square", json!([{ "attributes": { "POSITION": positions }, "indices": indices }]));
    build
}
