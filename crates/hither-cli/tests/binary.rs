//! The binary as a user meets it: exit codes, one clear line for each mistake, reports, and no partial files.

mod common;

use common::{Folder, done, hither};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A small world with cameras and an animation.
const WORLD: &str = "world:office?n=1";

/// What is in a folder.
fn names(folder: &Folder) -> Vec<String> {
    let entries = fs::read_dir(&folder.0).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Runs `arguments`, which must fail with `code` in one line that contains `words`, and print no result.
#[track_caller]
fn refused(arguments: &[&str], code: i32, words: &[&str]) {
    let output = hither(arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    let errors: Vec<&str> = text.lines().filter(|l| !l.starts_with("note: ")).collect();
    assert_eq!(errors.len(), 1, "{arguments:?}: {text}");
    assert!(errors[0].starts_with("error: "), "{text}");
    for word in words {
        assert!(errors[0].contains(word), "{arguments:?}: no `{word}` in: {text}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", stdout(&output));
}

#[test]
fn a_wrong_command_line_is_code_2() {
    refused(&["rendre"], 2, &["rendre", "render", "--help"]);
    refused(&["render"], 2, &["SCENE"]);
    refused(&["render", WORLD], 2, &["-o <FILE>"]);
    refused(&["render", WORLD, "-o", "x.jpg"], 2, &["x.jpg", ".png or .exr"]);
    refused(&["render", WORLD, "-o", "x.png", "--size", "640"], 2, &["640", "1280x720"]);
    refused(&["render", WORLD, "-o", "x.png", "--eye", "1,2"], 2, &["1,2", "three numbers"]);
    refused(&["render", WORLD, "-o", "x.png", "--target", "1,2,3"], 2, &["--eye"]);
    refused(&["render", WORLD, "-o", "x.png", "--camera", "0", "--eye", "1,2,3"], 2, &["--camera", "--eye"]);
    refused(&["render", WORLD, "-o", "x.png", "--eye", "1,2,3", "--target", "1,2,3"], 2, &["same point"]);
    refused(&["render", WORLD, "-o", "x.png", "--fov", "180"], 2, &["degrees"]);
    refused(&["render", WORLD, "-o", "x.png", "--frames", "4..4"], 2, &["0..250"]);
    refused(&["render", WORLD, "-o", "x.png", "--frames", "0..4", "--time", "1"], 2, &["--time", "--frames"]);
    refused(&["render", WORLD, "-o", "x.png", "--algorithm", "magic"], 2, &["magic", "zbuffer"]);
    refused(&["render", WORLD, "-o", "x.png", "--threads", "100000"], 2, &["100000", "--threads"]);
    refused(&["render", WORLD, "-o", "x.png", "-q", "-v"], 2, &["--quiet", "--verbose"]);
    refused(&["info"], 2, &["SCENE"]);
    refused(&["info", ""], 2, &["empty"]);
    refused(&["world", "office"], 2, &["-o"]);
    refused(&["world", "--json", "-"], 2, &["--json", "-o"]);
    refused(&["layers", WORLD, "--shade", "depth", "-o", "x.ora"], 2, &["--shade depth"]);
    refused(&["world", "office", "-o", "office.obj"], 2, &["office.obj", ".glb"]);
    assert!(!Path::new("x.png").exists());
}

#[test]
fn an_input_that_fails_is_code_1() {
    let folder = Folder::new("input");
    let picture = folder.path("x.png");
    refused(&["info", "no/such/file.glb"], 1, &["no/such/file.glb", "cannot read"]);
    refused(&["info", "office"], 1, &["world:office"]);
    refused(&["info", "world:offices"], 1, &["offices", "office, "]);
    refused(&["info", "world:office?m=1"], 1, &["\"m\"", "n (1 to"]);
    refused(&["info", "world:office?n=0"], 1, &["n=0", "from 1 to"]);
    refused(&["bench", "exakt"], 1, &["\"exakt\"", "exact"]);
    refused(&["world", "offices", "-o", &folder.path("x.glb")], 1, &["offices"]);
    refused(&["render", WORLD, "-o", &picture, "--camera", "attic"], 1, &["\"attic\"", "\"corridor\""]);
    refused(&["render", WORLD, "-o", &picture, "--animation", "run"], 1, &["\"run\"", "\"walk\""]);
    refused(&["render", WORLD, "-o", &picture, "--size", "0x720"], 1, &["0x720"]);
    refused(&["render", WORLD, "-o", &picture, "--size", "20000x1"], 1, &["20000x1", "16384"]);
    fs::write(folder.0.join("noise.glb"), "glTX and more").unwrap();
    refused(&["render", &folder.path("noise.glb"), "-o", &picture], 1, &["noise.glb"]);
    assert_eq!(names(&folder), ["noise.glb"]);
}

/// Under a limit of its own, which Linux keeps.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_that_there_is_no_memory_for_is_refused() {
    let folder = Folder::new("memory");
    let command = format!(
        "ulimit -v 2000000 && exec '{}' render '{WORLD}' -o '{}' --size 16384x16384",
        env!("CARGO_BIN_EXE_hither"),
        folder.path("x.exr")
    );
    let output = Command::new("sh").args(["-c", &command]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(text.lines().count() == 1 && text.contains("16384x16384") && text.contains("GiB"), "{text}");
    assert!(names(&folder).is_empty());
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_work() {
    let folder = Folder::new("output");
    let missing = folder.path("nowhere/x.png");
    // The scene does not exist either; that the output is named shows which was looked at first.
    refused(&["render", "no.glb", "-o", &missing], 1, &["nowhere/x.png", "make it first"]);
    refused(&["render", "no.glb", "-o", &missing, "--frames", "0..2"], 1, &["nowhere/x.0000.png"]);
    refused(&["render", "no.glb", "--json", &missing], 1, &["nowhere/x.png"]);
    refused(&["world", "no", "-o", &folder.path("nowhere/x.glb")], 1, &["nowhere/x.glb"]);
    assert!(names(&folder).is_empty());
}

#[test]
fn no_file_that_is_named_is_written_over_another() {
    let folder = Folder::new("over");
    done(&["world", "office?n=1", "-o", &folder.path("model.glb")]);
    let scene = &folder.path("model.glb");
    // The first bytes say what a model is, whatever its name.
    for other in ["model.png", "model.svg", "model.exr"] {
        fs::copy(scene, folder.0.join(other)).unwrap();
    }
    fs::create_dir(folder.0.join("sheets")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("model.glb", folder.0.join("link.glb")).unwrap();
    let before = (names(&folder), fs::read(scene).unwrap());
    for (command, named) in [
        ("info model.glb --json model.glb", "the scene"),
        ("render model.glb -o x.png --json model.glb", "the scene"),
        ("render model.png -o model.png", "the scene"),
        ("render model.glb -o x.png --json ./x.png", "-o"),
        ("render model.glb -o sheets/../x.png --json x.png", "-o"),
        ("render world:office -o x.png --frames 2..9 --json x.0005.png", "-o"),
        ("lines model.svg -o model.svg", "the scene"),
        ("lines model.glb -o x.json --json x.json", "-o"),
        ("order model.glb --dot model.glb", "the scene"),
        ("order model.glb --dot x.dot --json x.dot", "--dot"),
        ("cull model.svg --method planes --map model.svg", "the scene"),
        ("cull model.glb --method planes --map x.svg --json x.svg", "--map"),
        ("cull model.glb --json model.glb", "the scene"),
        ("world office -o x.glb --json x.glb", "-o"),
        ("layers model.exr -o model.exr", "the scene"),
        ("layers model.glb -o x.ora --json x.ora", "-o"),
        ("layers model.glb -o sheets --json sheets/program.json", "-o"),
        ("layers model.glb -o x.ora --focus 3 --json x-focus.png", "-o"),
        ("layers model.glb -o x.ora --replace a=model.png --json model.png", "--replace"),
        #[cfg(unix)]
        ("render link.glb -o x.png --json model.glb", "the scene"),
        #[cfg(unix)]
        ("info model.glb --json link.glb", "the scene"),
    ] {
        let is_file = |word: &str| word.contains('.') && !word.contains("..9");
        let word = |word: &str| match word.split_once('=') {
            Some((name, file)) => format!("{name}={}", folder.path(file)),
            None if is_file(word) || word == "sheets" => folder.path(word),
            None => word.to_owned(),
        };
        let arguments: Vec<String> = command.split(' ').map(word).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        refused(&arguments, 1, &[&format!(": this is the file of {named}, too, and one would be lost")]);
        assert_eq!((names(&folder), fs::read(scene).unwrap()), before, "{command}");
    }
    // What the model names is known when it is read.
    fs::write(folder.0.join("m.obj"), "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
        .unwrap();
    fs::write(folder.0.join("m.mtl"), "newmtl a\nKd 1 0 0\n").unwrap();
    let (model, materials) = (folder.path("m.obj"), folder.path("m.mtl"));
    for arguments in [
        vec!["info"],
        vec!["render", "-o", &folder.path("y.png")],
        vec!["lines"],
        vec!["order"],
        vec!["cull"],
    ] {
        let arguments = [&arguments, &[model.as_str(), "--json", &materials][..]].concat();
        refused(&arguments, 1, &["--json", "the scene is read from this file, too, and it would be lost"]);
        assert!(!folder.0.join("y.png").exists());
    }
    // What holds nothing can be named as often as one likes.
    if cfg!(unix) {
        done(&["order", scene, "--dot", "/dev/null", "--json", "/dev/null"]);
    }
}

#[test]
fn pictures_have_the_size_and_the_names_that_were_asked_for() {
    let folder = Folder::new("pictures");
    done(&["render", WORLD, "-o", &folder.path("one.png"), "--size", "64x48"]);
    done(&["render", WORLD, "-o", &folder.path("walk.png"), "--size", "16x16", "--frames", "3..5"]);
    done(&["render", WORLD, "-o", &folder.path("##-walk.EXR"), "--size", "16x16", "--frames", "9..10"]);
    assert_eq!(names(&folder), ["09-walk.EXR", "one.png", "walk.0003.png", "walk.0004.png"]);
    let png = fs::read(folder.0.join("one.png")).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!(png[16..24], [0, 0, 0, 64, 0, 0, 0, 48]);
    let exr = fs::read(folder.0.join("09-walk.EXR")).unwrap();
    assert_eq!(exr[..4], [0x76, 0x2f, 0x31, 0x01]);
}

#[test]
fn the_report_says_what_was_done() {
    let folder = Folder::new("report");
    let file = folder.path("report.json");
    done(&[
        "render", WORLD, "--camera", "walk", "--size", "32x24", "--frames", "0..3", "--fps", "2", "--json",
        &file,
    ]);
    let report: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let first_key = report.as_object().unwrap().keys().next().unwrap();
    assert_eq!((first_key.as_str(), &report["schema"]), ("schema", &"hither.render/1".into()));
    assert!(report["version"].is_string());
    assert_eq!(report["camera"]["name"], "walk");
    assert_eq!(report["triangles"], 15_000);
    assert_eq!((&report["width"], &report["height"]), (&32.into(), &24.into()));
    let frames = report["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 3);
    for (i, frame) in frames.iter().enumerate() {
        assert_eq!(frame["frame"], i);
        assert_eq!(frame["scene_time_ms"], 500.0 * i as f64);
        assert!(frame["time_ms"].as_f64().unwrap() >= 0.0);
        for counter in
            ["nodes_visited", "nodes_culled", "triangles_tested", "triangles_drawn", "pixels_written"]
        {
            assert!(frame["counters"][counter].is_u64(), "{counter}");
        }
        assert!(frame["counters"].as_object().unwrap().contains_key("depth_complexity"));
    }
    assert_ne!(frames[0]["eye"], frames[2]["eye"], "the camera walks");
}

#[test]
fn a_report_on_standard_output_is_nothing_but_json() {
    let output = done(&["render", WORLD, "--size", "8x8", "--json", "-"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["frames"].as_array().unwrap().len(), 1);
    let output = done(&["info", WORLD, "--json", "-"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["schema"], "hither.info/1");
    assert_eq!(report["cameras"][0]["name"], "corridor");
    assert!(report["bounds"]["max"][0].as_f64().unwrap() > 0.0);
}

#[test]
fn a_world_written_as_glb_is_the_same_scene_and_the_same_picture() {
    let folder = Folder::new("world");
    let (file, report) = (folder.path("office.glb"), folder.path("report.json"));
    let output = done(&["world", "office?n=2", "-o", &file, "--json", &report]);
    assert!(stderr(&output).contains("120,000 triangles in 8 instances"), "{}", stderr(&output));
    let report: Value = serde_json::from_slice(&fs::read(&report).unwrap()).unwrap();
    assert_eq!(report["schema"], "hither.world/1");
    let text = stdout(&done(&["info", &file]));
    for part in ["120,000 shown", "\"corridor\"", "\"walk\"", "10 s"] {
        assert!(text.contains(part), "no `{part}` in {text}");
    }
    let picture = |scene: &str| {
        let path = folder.path("walk.png");
        let view = ["--camera", "walk", "--time", "4.5", "--shade", "depth", "--size", "64x48"];
        done(&[&["render", scene, "-o", &path], &view[..]].concat());
        fs::read(path).unwrap()
    };
    assert!(picture("world:office?n=2") == picture(&file));
}

/// A red wall with a hole that a camera-less view looks at, and oddities that are worth a warning each.
const OBJ: &str = "\
mtllib nowhere.mtl
v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0
usemtl red
f 1 2 3 4
f 4 3 2 1
";

#[test]
fn what_is_odd_about_a_file_is_a_warning_and_its_picture_is_made() {
    let folder = Folder::new("odd");
    fs::write(folder.0.join("wall.obj"), OBJ).unwrap();
    let (wall, picture) = (folder.path("wall.obj"), folder.path("wall.png"));
    let output = done(&["render", &wall, "-o", &picture, "--size", "32x32", "--json", "-"]);
    let text = stderr(&output);
    assert!(text.lines().any(|l| l.starts_with("warning: ") && l.contains("nowhere.mtl")), "{text}");
    assert!(text.contains("note: the scene has no camera"), "{text}");
    let mut lines: Vec<&str> = text.lines().collect();
    let all = lines.len();
    lines.sort_unstable();
    lines.dedup();
    assert_eq!(lines.len(), all, "said twice: {text}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let frame = &report["frames"][0];
    assert_eq!(frame["file"], picture);
    assert!(frame["pixels_covered"].as_u64().unwrap() > 100, "{frame}");
}

/// A field of view, radians, for which no number says how large what it shows is drawn.
const NARROW: &str = "1e-310";

/// A triangle seen by cameras called `names`, the first of which sees too little to be drawn and is at a node scaled by 0,
/// with an animation.
fn gltf(names: &[&str], mode: u32) -> String {
    let names: Vec<String> = names.iter().map(|name| serde_json::to_string(name).unwrap()).collect();
    let lens = |fov| format!(r#""type":"perspective","perspective":{{"yfov":{fov},"znear":0.1}}"#);
    let camera = |(i, name)| format!(r#"{{"name":{name},{}}}"#, lens(if i == 0 { NARROW } else { "1.0" }));
    let cameras: Vec<String> = names.iter().enumerate().map(camera).collect();
    let nodes: Vec<String> = (0..names.len())
        .map(|i| {
            format!(r#"{{"name":{0},"camera":{i},"translation":[0,0,5],"scale":[{i},{i},{i}]}}"#, names[i])
        })
        .collect();
    let shown: Vec<String> = (0..=names.len()).map(|i| i.to_string()).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{shown}]}}],
        "nodes":[{{"name":{name},"mesh":0}},{nodes}],"cameras":[{cameras}],
        "meshes":[{{"name":{name},"primitives":[{{"attributes":{{"POSITION":0}},"mode":{mode}}},
            {{"attributes":{{"POSITION":0}}}}]}}],
        "animations":[{{"name":{name},"samplers":[{{"input":1,"output":0}}],
            "channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5126,"count":3,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":24,"byteLength":12}}],
        "buffers":[{{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAABA"}}]}}"#,
        shown = shown.join(","),
        name = names[0],
        nodes = nodes.join(","),
        cameras = cameras.join(","),
    )
}

#[test]
fn names_out_of_files_and_of_files_act_on_no_terminal() {
    const NAME: &str = "a\nb\u{1b}[31m";
    let folder = Folder::new("names");
    fs::write(folder.0.join("names.gltf"), gltf(&[NAME, "two"], 4)).unwrap();
    fs::write(folder.0.join("far.gltf"), gltf(&["one"], 4).replace("data:;base64,", "a%0Ab%1B[31m")).unwrap();
    fs::write(folder.0.join("wall.obj"), OBJ.replace("nowhere.mtl", "a\u{1b}[31m.mtl")).unwrap();
    let odd = folder.path(&format!("{NAME}.obj"));
    fs::write(&odd, OBJ).unwrap();
    let (names, far, wall) = (folder.path("names.gltf"), folder.path("far.gltf"), folder.path("wall.obj"));
    let picture = folder.path(&format!("{NAME}.png"));
    let (eye, missing) = (["--eye", "0,0,5"], folder.path(&format!("{NAME}/x.png")));
    for (arguments, lines) in [
        (&["info", &names][..], 2),
        (&["info", &far], 1),
        (&["info", &wall], 2),
        (&["info", &odd], 2),
        (&["info", &folder.path(&format!("no {NAME}"))], 1),
        (&["info", &names, "--no-such", NAME], 1),
        (&["order", &names, eye[0], eye[1]], 2),
        (&["cull", &names, "-v", eye[0], eye[1]], 2),
        (&["render", &names, "-o", &picture, "--camera", NAME], 1),
        (&["render", &names, "-o", &picture, "--camera", "x"], 1),
        (&["render", &names, "-o", &picture, "--animation", NAME, "--camera", "two"], 1),
        (&["render", &names, "-o", &picture, "--animation", "x"], 1),
        (&["render", &names, "-o", &missing], 1),
        (&["layers", &names, "-o", &folder.path("x.ora"), "--without", NAME, eye[0], eye[1]], 2),
        (&["lines", &names, "-o", &folder.path(&format!("{NAME}.txt"))], 1),
    ] {
        let output = hither(arguments);
        let acts = |c: char| c.is_control() && c != '\n';
        let (told, said) = (stderr(&output), stdout(&output));
        assert!(!told.contains(acts) && !said.contains(acts), "{arguments:?}: {told:?} {said:?}");
        assert!(told.lines().count() <= lines, "{arguments:?}: {told}");
        for line in told.lines().chain(said.lines()) {
            assert!(!line.starts_with('b'), "{arguments:?}: a name went on in a line of its own: {line}");
        }
    }
}

#[test]
fn a_camera_that_cannot_be_used_is_named() {
    let folder = Folder::new("camera");
    let file = gltf(&["narrow", "two"], 4);
    fs::write(folder.0.join("flat.gltf"), &file).unwrap();
    let (scene, picture) = (folder.path("flat.gltf"), folder.path("x.png"));
    for command in ["render", "layers"] {
        refused(
            &[command, &scene, "-o", &picture.replace("png", "exr")],
            1,
            &["flat.gltf: camera 0 (\"narrow\") cannot be used", "sees so little", "--camera"],
        );
    }
    done(&["render", &scene, "-o", &picture, "--size", "8x8", "--camera", "two"]);
    // The scale of 0 above it is no reason.
    fs::write(folder.0.join("flat.gltf"), file.replace(NARROW, "1.0")).unwrap();
    done(&["render", &scene, "-o", &picture, "--size", "8x8", "--camera", "narrow"]);
}

/// A triangle below ten nodes, each of which grows to 10³⁸ times its size within a second, and a camera whose planes are
/// a thousand kilometres apart.
fn write_growing(folder: &Folder) -> String {
    let numbers = [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 1., 1., 1., 1., 1e38, 1e38, 1e38];
    fs::write(folder.0.join("grows.bin"), numbers.map(f32::to_le_bytes).as_flattened()).unwrap();
    let mut nodes: Vec<Value> =
        (1..10).map(|child| json!({ "name": "grows", "children": [child] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    nodes.push(json!({ "camera": 0, "translation": [0, 0, 5] }));
    let channel = |node: usize| json!({ "sampler": 0, "target": { "node": node, "path": "scale" } });
    let view = |from: usize, length: usize| json!({ "buffer": 0, "byteOffset": from, "byteLength": length });
    let accessor = |view: usize, count: usize, kind: &str| {
        json!({
            "bufferView": view, "componentType": 5126, "count": count, "type": kind,
        })
    };
    let document = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0, 10] }],
        "nodes": nodes,
        "cameras": [{ "type": "orthographic",
            "orthographic": { "xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 1e6 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "animations": [{ "channels": (0..9).map(channel).collect::<Vec<_>>(),
            "samplers": [{ "input": 1, "output": 2 }] }],
        "accessors": [accessor(0, 3, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3")],
        "bufferViews": [view(0, 36), view(36, 8), view(44, 24)],
        "buffers": [{ "byteLength": 68, "uri": "grows.bin" }],
    });
    fs::write(folder.0.join("grows.gltf"), document.to_string()).unwrap();
    folder.path("grows.gltf")
}

#[test]
fn places_beyond_all_numbers_are_refused_and_planes_too_far_apart_told() {
    let folder = Folder::new("beyond");
    let (scene, picture) = (write_growing(&folder), folder.path("x.png"));
    let words = ["grows.gltf: node 8 \"grows\": at 1 s its place in the world is not a finite number"];
    for arguments in [
        &["render", &scene, "-o", &picture][..],
        &["cull", &scene],
        &["cull", &scene, "--method", "planes"],
        &["order", &scene],
        &["lines", &scene, "-o", &folder.path("x.svg")],
        &["layers", &scene, "-o", &folder.path("x.ora")],
    ] {
        refused(&[arguments, &["--time", "1", "--size", "8x8"]].concat(), 1, &words);
    }
    assert_eq!(names(&folder), ["grows.bin", "grows.gltf"]);
    let told = stderr(&done(&["render", &scene, "-o", &picture, "--size", "8x8"]));
    assert!(
        told.contains("camera 0: its planes are so far apart that depths within 6.0e-2 m are one"),
        "{told}"
    );
}

#[test]
fn lines_that_a_picture_leaves_out_are_told_once() {
    let folder = Folder::new("left-out");
    fs::write(folder.0.join("wire.gltf"), gltf(&["eye", "two"], 3)).unwrap();
    let scene = folder.path("wire.gltf");
    for command in ["render", "cull", "order", "layers"] {
        let output = done(&[command, &scene, "--size", "8x8", "--json", "-", "--camera", "two"]);
        let text = stderr(&output);
        let told: Vec<&str> = text.lines().filter(|l| l.contains("`hither lines`")).collect();
        assert_eq!(told.len(), 1, "{command}: {text}");
        assert!(
            told[0].starts_with("warning: ") && told[0].contains("2 lines of its meshes are left out"),
            "{text}"
        );
    }
    let output = done(&["lines", &scene, "--json", "-", "--camera", "two"]);
    assert!(!stderr(&output).contains("left out"), "{}", stderr(&output));
}

#[test]
fn a_model_all_of_whose_faces_are_lost_is_code_1() {
    let folder = Folder::new("lost");
    fs::write(folder.0.join("lost.obj"), OBJ.replace("f 1 2 3 4", "f 1 2 3 9").replace("f 4 3", "f 9 3"))
        .unwrap();
    let (scene, picture) = (folder.path("lost.obj"), folder.path("x.png"));
    refused(&["render", &scene, "-o", &picture], 1, &["lost.obj", "all of its 2 faces are lost (line 7: "]);
    assert_eq!(names(&folder), ["lost.obj"]);
}

#[test]
fn the_picture_does_not_depend_on_how_the_work_is_done() {
    let folder = Folder::new("same");
    let picture = |name: &str, options: &[&str]| {
        let path = folder.path(name);
        let common = ["render", "world:office?n=3", "--camera", "open", "--size", "96x54", "-o", &path];
        done(&[&common, options].concat());
        fs::read(&path).unwrap()
    };
    for shade in ["smooth", "ids", "depth"] {
        let plain = picture("plain.png", &["--shade", shade, "--algorithm", "zbuffer", "--threads", "1"]);
        assert!(plain == picture("hzb.png", &["--shade", shade]), "{shade}: hzb");
        assert!(plain == picture("two.png", &["--shade", shade, "--threads", "2"]), "{shade}: two threads");
        for tree in ["bvh", "octree", "octree-pushed"] {
            assert!(plain == picture("tree.png", &["--shade", shade, "--tree", tree]), "{shade}: {tree}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_one_line_and_code_1() {
    let folder = Folder::new("full");
    std::os::unix::fs::symlink("/dev/full", folder.0.join("full.png")).unwrap();
    refused(&["render", WORLD, "-o", &folder.path("full.png"), "--size", "64x64"], 1, &["full.png", "space"]);
    refused(&["info", WORLD, "--json", "/dev/full"], 1, &["/dev/full", "space"]);
}

#[test]
fn info_prints_what_is_in_a_world() {
    let text = stdout(&done(&["info", "world:office?n=33"]));
    for part in ["539,055,000 shown, 15,000 stored", "35,937 of 1 mesh", "\"corridor\"", "fov 60", "10 s"] {
        assert!(text.contains(part), "no `{part}` in {text}");
    }
}

#[test]
fn worlds_are_listed_and_help_is_printed() {
    assert!(stdout(&done(&["world"])).contains("office"));
    assert!(stdout(&done(&["--help"])).contains("render"));
    assert!(stdout(&done(&["render", "--help"])).contains("--camera"));
    assert!(stdout(&done(&["bench", "--help"])).contains("exact"));
    assert!(stdout(&done(&["--version"])).starts_with("hither "));
}

#[test]
fn quiet_is_quiet_and_a_choice_is_said() {
    let folder = Folder::new("quiet");
    let picture = folder.path("x.png");
    let quiet = done(&["render", WORLD, "-o", &picture, "--size", "8x8", "-q"]);
    assert!(quiet.stdout.is_empty() && quiet.stderr.is_empty());
    let normal = done(&["render", WORLD, "-o", &picture, "--size", "8x8"]);
    assert!(stderr(&normal).contains("camera 0 (\"corridor\")"));
    let verbose = done(&["render", WORLD, "-o", &picture, "--size", "8x8", "-v"]);
    assert!(stderr(&verbose).contains("nodes visited"));
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_hither"))
        .args(["info", WORLD])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(output.stderr.is_empty());
}

#[test]
fn lines_draws_a_sheet_in_three_formats() {
    let folder = Folder::new("lines");
    let svg = folder.path("a.svg");
    let report = folder.path("report.json");
    done(&[
        "lines",
        "world:lecture",
        "--views",
        "front,top,iso",
        "--scale",
        "1:200",
        "--hidden",
        "--faces",
        "flat",
        "-o",
        &svg,
        "--json",
        &report,
    ]);
    let text = fs::read_to_string(&svg).unwrap();
    for expected in [
        "mm\"",
        "id=\"front\"",
        "id=\"iso\"",
        "data-name=\"rectangle\"",
        "class=\"visible boundary\"",
        "class=\"face\"",
    ] {
        assert!(text.contains(expected), "no {expected}");
    }
    let report: Value = serde_json::from_str(&fs::read_to_string(&report).unwrap()).unwrap();
    assert_eq!(report["schema"], "hither.lines/1");
    assert!(report["frames"][0]["visible_segments"].as_u64().unwrap() > 0);
    let (dxf, json) = (folder.path("a.dxf"), folder.path("a.json"));
    done(&["lines", WORLD, "--camera", "corridor", "-o", &dxf]);
    assert!(fs::read_to_string(&dxf).unwrap().ends_with("EOF\n"));
    done(&["lines", WORLD, "--camera", "corridor", "-o", &json]);
    let drawing: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    assert!(drawing["views"][0]["strokes"].as_array().unwrap().len() > 10);
}

#[test]
fn lines_refuses_what_it_cannot_draw() {
    let folder = Folder::new("lines-refused");
    let svg = folder.path("a.svg");
    refused(&["lines", WORLD, "-o", &folder.path("a.png")], 2, &[".svg, .dxf or .json"]);
    refused(&["lines", WORLD, "-o", &svg, "--scale", "1:50"], 2, &["--scale", "--views"]);
    refused(&["lines", WORLD, "-o", &svg, "--views", "side"], 2, &["side", "front"]);
    refused(&["lines", WORLD, "-o", &svg, "--edges", "wires"], 2, &["wires", "silhouette"]);
    refused(&["lines", WORLD, "-o", &svg, "--cut", "0,0,0,1"], 2, &["normal"]);
    refused(&["lines", WORLD, "-o", &svg, "--cut", "1e-150,0,0,-1e308"], 2, &["--cut", "too large"]);
    for sheet in [&["--views", "front"][..], &["--parallel"]] {
        let usual = ["lines", WORLD, "-o", &svg, "--size"];
        refused(&[&usual[..], &["0x0"], sheet].concat(), 1, &["0x0"]);
        refused(&[&usual[..], &["20000x0"], sheet].concat(), 1, &["20000x0"]);
    }
    refused(&["lines", "world:office?n=33", "-o", &svg], 1, &["539,055,000 triangles"]);
    assert!(names(&folder).is_empty());
}

#[test]
fn an_empty_drawing_is_a_valid_file_and_a_note() {
    let folder = Folder::new("lines-empty");
    let svg = folder.path("a.svg");
    let output = done(&["lines", WORLD, "--eye", "0,900,0", "--target", "0,1000,0", "-o", &svg]);
    assert!(stderr(&output).contains("nothing is visible"));
    assert!(fs::read_to_string(&svg).unwrap().ends_with("</svg>\n"));
}

#[test]
fn cull_names_what_could_be_seen_and_leaves_out_nothing_that_is() {
    let report = |method: &str, more: &[&str]| -> Value {
        let mut arguments =
            vec!["cull", "world:office?n=3", "--size", "320x200", "--method", method, "--json", "-"];
        arguments.extend(more);
        serde_json::from_slice(&done(&arguments).stdout).unwrap()
    };
    let buffer = report("buffer", &["--reasons"]);
    assert_eq!(buffer["schema"], "hither.cull/1");
    assert_eq!(buffer["frames"].as_array().unwrap().len(), 1);
    let frame = &buffer["frames"][0];
    let visible = |frame: &Value| -> Vec<u64> {
        frame["visible"].as_array().unwrap().iter().map(|v| v["instance"].as_u64().unwrap()).collect()
    };
    let (found, exact) = (visible(frame), visible(&report("exact", &[])["frames"][0]));
    assert!(exact.iter().all(|i| found.contains(i)), "{exact:?} {found:?}");
    assert!(found.len() < 27, "{found:?}");
    assert!(frame["visible"][0]["name"].as_str().unwrap().contains("module"));
    assert!(frame["counters"]["occluders"].as_u64().unwrap() > 0 && frame["time_ms"].is_number());
    let judged =
        frame["reasons"].as_array().unwrap().iter().map(|r| r["count"].as_u64().unwrap()).sum::<u64>();
    assert_eq!(judged, 27);
    let coarse = report("buffer", &["--coarse", "4"]);
    let left_in = visible(&coarse["frames"][0]);
    assert!(coarse["coarse"] == 4 && exact.iter().all(|i| left_in.contains(i)));
    let sampled = visible(&report("buffer", &["--sampled"])["frames"][0]);
    assert!(exact.iter().all(|i| sampled.contains(i)) && sampled.iter().all(|i| found.contains(i)));
    let moving = visible(&report("buffer", &["--margin", "0.1", "--objects-move", "0.1"])["frames"][0]);
    assert!(found.iter().all(|i| moving.contains(i)), "{found:?} {moving:?}");
    let walk = report("buffer", &["--frames", "0..3", "--coherence", "--camera", "walk", "--margin", "0.1"]);
    assert_eq!(walk["frames"].as_array().unwrap().len(), 3);
}

#[test]
fn cull_refuses_what_it_cannot_do() {
    refused(&["cull", WORLD, "--method", "guess"], 2, &["guess", "buffer", "exact"]);
    refused(&["cull", WORLD, "--margin", "-1"], 2, &["--margin", "metres"]);
    refused(&["cull", WORLD, "--margin", "nan"], 2, &["--margin", "metres"]);
    refused(&["cull", WORLD, "--method", "exact", "--margin", "1"], 2, &["--margin", "buffer"]);
    refused(&["cull", WORLD, "--sampled", "--margin", "1"], 2, &["--sampled", "--margin"]);
    refused(&["cull", WORLD, "--sampled", "--coarse", "2"], 2, &["--sampled", "--coarse"]);
    refused(&["cull", WORLD, "--method", "exact", "--coarse", "2"], 2, &["--coarse", "buffer"]);
    refused(&["cull", WORLD, "--coarse", "0"], 2, &["--coarse", "1"]);
    refused(&["cull", WORLD, "--method", "exact", "--sampled"], 2, &["--sampled", "buffer"]);
    refused(&["cull", WORLD, "--method", "planes", "--objects-move", "1"], 2, &["--objects-move", "buffer"]);
    refused(&["cull", WORLD, "--method", "exact", "--map", "x.svg"], 2, &["--map", "planes"]);
    refused(&["cull", WORLD, "--method", "planes", "--map", "x.png"], 2, &["x.png", ".svg"]);
    refused(&["cull", WORLD, "--method", "planes", "--occluders", "0"], 2, &["--occluders", "auto"]);
    refused(&["cull", WORLD, "--method", "planes", "--coherence"], 2, &["--coherence", "buffer"]);
    refused(&["cull", WORLD, "--method", "exact", "--reasons"], 2, &["--reasons", "buffer", "planes"]);
    for method in ["buffer", "exact"] {
        let planes_only = ["--around", "--paper", "--occluders=4", "--leaf=4", "--threads=2"];
        for option in planes_only {
            let name = option.split('=').next().unwrap();
            refused(&["cull", WORLD, "--method", method, option], 2, &[name, "--method planes"]);
        }
    }
    for option in ["--occluders=64", "--leaf=4"] {
        let name = option.split('=').next().unwrap();
        refused(&["cull", WORLD, "--method", "planes", "--paper", option], 2, &["--paper", name]);
    }
    refused(&["cull", "world:office?n=33", "--method", "planes"], 1, &["539,055,000", "--method buffer"]);
    refused(&["cull", WORLD, "--size", "0x10"], 1, &["0x10"]);
    // The scene does not exist either; that the size is named shows which was looked at first.
    for command in ["cull", "render", "order", "layers", "lines"] {
        refused(&[command, "no-such.glb", "--json", "-", "--size", "0x10"], 1, &["0x10"]);
    }
    refused(&["cull", WORLD, "--size", "16385x10"], 1, &["16385x10"]);
    refused(&["cull", "no-such.glb"], 1, &["no-such.glb"]);
}

#[test]
fn cull_by_planes_writes_maps_and_hides_nothing_that_is_seen() {
    let folder = Folder::new("map");
    let map = folder.path("map.svg");
    let visible = |method: &str, map: &[&str]| -> Vec<u64> {
        let world = ["cull", "world:tetra", "--camera", "walk", "--size", "320x200", "--json", "-"];
        let frames = ["--frames", "0..3", "--fps", "2", "--method", method];
        let output = done(&[&world, frames.as_slice(), map].concat());
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        let last = json["frames"][2]["visible"].as_array().unwrap().iter();
        last.map(|i| i["instance"].as_u64().unwrap()).collect()
    };
    let planes = visible("planes", &["--map", &map]);
    let exact = visible("exact", &[]);
    assert!(exact.iter().all(|i| planes.contains(i)) && planes.len() < 600, "{planes:?}");
    assert_eq!(names(&folder), ["map.0000.svg", "map.0001.svg", "map.0002.svg"]);
    let text = fs::read_to_string(folder.0.join("map.0002.svg")).unwrap();
    assert!(text.starts_with("<svg") && text.matches("<polygon").count() > 3601, "{}", text.len());
    let margin = visible("planes", &["--margin", "0.5"]);
    assert!(exact.iter().all(|i| margin.contains(i)));
}

#[test]
fn cull_by_planes_says_how_each_polygon_was_judged() {
    let arguments = ["cull", "world:soda", "--method", "planes", "--size", "320x200", "--reasons"];
    let report: Value =
        serde_json::from_slice(&done(&[&arguments, &["--json", "-"][..]].concat()).stdout).unwrap();
    let frame = &report["frames"][0];
    let polygons = frame["polygons"].as_array().unwrap();
    assert!(polygons.len() == 1 && polygons[0]["instance"] == 0);
    let lists = |state: &str| polygons[0][state].as_array().unwrap();
    let (visible, partial) = (lists("visible"), lists("partial"));
    let (hidden, outside) = (&polygons[0]["hidden"], &polygons[0]["outside"]);
    let not_listed = hidden.as_u64().unwrap() + outside.as_u64().unwrap();
    assert!(!visible.is_empty() && !partial.is_empty() && hidden != 0 && outside != 0, "{polygons:?}");
    assert_eq!(frame["counters"]["polygons_hidden"], not_listed);
    assert_eq!(frame["counters"]["polygons"], (visible.len() + partial.len()) as u64 + not_listed);
    let triangles = || visible.iter().chain(partial).flat_map(|p| p.as_array().unwrap());
    let mut different: Vec<u64> = triangles().map(|t| t.as_u64().unwrap()).collect();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), triangles().count());
    assert!(different.last().unwrap() < &report["triangles"].as_u64().unwrap());
    let line = String::from_utf8(done(&arguments).stdout).unwrap();
    assert!(line.contains(&format!("{} visible, {} partial", visible.len(), partial.len())), "{line}");
}
