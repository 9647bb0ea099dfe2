//! `hither cull`: glass and holes by each method, what the report says of the settings, and what the terminal shows.

mod common;

use common::{Folder, done};
use serde_json::{Value, json};
use std::fs;

#[track_caller]
fn report(arguments: &[&str]) -> Value {
    serde_json::from_slice(&done(&[arguments, &["--json", "-"]].concat()).stdout).unwrap()
}

fn names(frame: &Value) -> Vec<String> {
    let visible = frame["visible"].as_array().unwrap().iter();
    visible.map(|v| v["name"].as_str().unwrap().to_owned()).collect()
}

/// A wall with glass before, behind and beside it, and a square whose right half is a hole. Seen from (0, 0, 9).
/// Returns the arguments that cull it.
fn panes(folder: &Folder) -> Vec<String> {
    let squares = [
        ("wall", "solid", [0.0, 0.0, 0.0], 2.0),
        ("behind", "glass", [0.0, 0.0, -1.0], 0.5),
        ("before", "glass", [0.0, 0.0, 1.0], 0.5),
        ("clear", "clear", [0.0, 0.0, 2.0], 0.5),
        ("mask", "mask", [4.0, 0.0, 1.5], 1.0),
        ("through", "solid", [5.1, 0.0, 0.5], 0.2),
        ("covered", "solid", [3.9, 0.0, 0.5], 0.2),
        ("alone", "glass", [-4.0, 0.0, -2.0], 0.5),
    ];
    let materials = ["solid", "glass", "clear", "mask"];
    let node = |(name, material, translation, scale): &(&str, &str, [f64; 3], f64)| {
        let mesh = materials.iter().position(|m| m == material);
        json!({ "name": name, "mesh": mesh, "translation": translation, "scale": [scale, scale, scale] })
    };
    let mesh = |m: usize| {
        let attributes = match materials[m] {
            "mask" => json!({ "POSITION": 0, "COLOR_0": 1 }),
            _ => json!({ "POSITION": 0 }),
        };
        json!({ "primitives": [{ "attributes": attributes, "indices": 2, "material": m }] })
    };
    let blend = |alpha: f64| json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, alpha] } });
    let gltf = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": (0..squares.len()).collect::<Vec<_>>() }],
        "nodes": squares.iter().map(node).collect::<Vec<_>>(),
        "meshes": (0..materials.len()).map(mesh).collect::<Vec<_>>(),
        "materials": [{}, blend(0.4), blend(0.0), { "alphaMode": "MASK" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC4" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 64 },
            { "buffer": 0, "byteOffset": 112, "byteLength": 12 }
        ],
        "buffers": [{ "byteLength": 124, "uri": "panes.bin" }]
    });
    let corners = [[-1f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    // Opaque on the left, and from the middle on below the cutoff.
    let colors = corners.iter().flat_map(|[x, _]| [1.0, 1.0, 1.0, 0.5 - 0.5 * x]);
    let mut buffer: Vec<u8> = positions.chain(colors).flat_map(f32::to_le_bytes).collect();
    buffer.extend([0u16, 1, 2, 0, 2, 3].into_iter().flat_map(u16::to_le_bytes));
    fs::write(folder.path("panes.bin"), buffer).unwrap();
    let path = folder.path("panes.gltf");
    fs::write(&path, gltf.to_string()).unwrap();
    let view = ["--eye", "0,0,9", "--target", "0,0,0", "--fov", "60", "--size", "320x200"];
    ["cull", &path].iter().chain(&view).map(|a| (*a).to_owned()).collect()
}

#[test]
fn glass_that_tints_is_seen_by_every_method_and_holes_are_seen_through() {
    let folder = Folder::new("glass");
    let arguments = panes(&folder);
    let seen = |method: &str| {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        names(&report(&[&arguments, &["--method", method][..]].concat())["frames"][0])
    };
    let exact = seen("exact");
    assert_eq!(exact, ["mask", "before", "through", "wall", "alone"]);
    for method in ["buffer", "planes"] {
        let found = seen(method);
        assert!(exact.iter().all(|name| found.contains(name)), "{method}: {found:?}");
        assert!(!found.contains(&"behind".to_owned()), "{method}: {found:?}");
    }
}

#[test]
fn a_report_says_all_that_the_answer_and_its_time_depend_on() {
    let cores = std::thread::available_parallelism().unwrap().get();
    let of = |more: &[&str]| {
        let report = report(&[&["cull", "world:tetra", "--size", "64x48"], more].concat());
        let settings = ["margin", "coarse", "coherence", "around", "occluders", "leaf", "paper", "threads"];
        let all: Vec<Value> = settings.iter().map(|name| report.get(*name).expect(name).clone()).collect();
        Value::from(all)
    };
    assert_eq!(of(&["--coherence", "--coarse", "2"]), json!([0.0, 2, true, null, null, null, null, 1]));
    // More than a million pixels are culled by twos.
    let coarse_of = |more: &[&str]| {
        report(&[&["cull", "world:tetra", "--size", "1920x1080"], more].concat())["coarse"].clone()
    };
    assert_eq!([coarse_of(&[]), coarse_of(&["--coarse", "1"]), coarse_of(&["--sampled"])], [2, 1, 1]);
    assert_eq!(of(&["--method", "exact"]), json!([0.0, 1, false, null, null, null, null, 1]));
    let planes = |more: &[&str]| of(&[&["--method", "planes"], more].concat());
    assert_eq!(planes(&[]), json!([0.0, 1, false, false, "auto", "auto", false, 1]));
    let chosen = ["--around", "--occluders", "12", "--leaf", "6", "--threads", "2"];
    assert_eq!(planes(&chosen), json!([0.0, 1, false, true, 12, 6, false, 2]));
    let paper = ["--paper", "--margin", "0.5", "--threads", "0"];
    assert_eq!(planes(&paper), json!([0.5, 1, false, true, 32, 8, true, cores]));
    for command in ["render", "lines"] {
        let threads = |n: &str| {
            let folder = Folder::new(&format!("threads-{command}-{n}"));
            let drawing = folder.path(if command == "lines" { "x.svg" } else { "x.png" });
            let arguments = [command, "world:lecture", "--size", "64x48", "--threads", n, "-o", &drawing];
            report(&arguments)["threads"].clone()
        };
        assert_eq!([threads("0"), threads("3")], [json!(cores), json!(3)], "{command}");
    }
}

#[test]
fn verbose_lists_counters_and_what_could_be_seen_nearest_first() {
    let folder = Folder::new("verbose");
    let arguments = panes(&folder);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    for method in ["buffer", "exact", "planes"] {
        let told = |more: &[&str]| done(&[&arguments, &["--method", method][..], more].concat());
        let report: Value = serde_json::from_slice(&told(&["--json", "-"]).stdout).unwrap();
        let frame = &report["frames"][0];
        let seen = frame["visible"].as_array().unwrap();
        let listed = seen.iter().map(|v| format!("  {} {}", v["instance"], v["name"].as_str().unwrap()));
        let listed: Vec<String> = listed.collect();
        let lines = |bytes: &[u8]| -> Vec<String> {
            String::from_utf8(bytes.to_vec()).unwrap().lines().map(str::to_owned).collect()
        };
        assert_eq!(lines(&told(&[]).stdout).len(), 1, "{method}");
        let verbose = lines(&told(&["-v"]).stdout);
        assert!(verbose[0].contains(&format!("{} of 8 instances could be seen", seen.len())), "{verbose:?}");
        let counters = verbose[1].replace(',', "");
        for (counter, number) in frame["counters"].as_object().unwrap() {
            let words = format!("{number} {}", counter.replace('_', " "));
            assert!(number.is_null() || counters.contains(&words), "{counter}: {verbose:?}");
        }
        assert_eq!(verbose[2..], listed, "{method}");
        // Where the report has standard output, all of it is a detail on standard error.
        let errors = lines(&told(&["-v", "--json", "-"]).stderr);
        assert!(errors.ends_with(&listed), "{errors:?}");
    }
}
