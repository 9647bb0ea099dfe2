//! `hither order` and `hither layers` as a user meets them.

mod common;

use common::{Folder, done, hither};
use serde_json::Value;
use std::fs;
use std::process::Command;

/// Spheres and cylinders of a frame, and a few toothpicks.
const WORLD: &str = "world:toothpicks?n=30";

fn report(arguments: &[&str]) -> Value {
    serde_json::from_slice(&done(arguments).stdout).unwrap()
}

#[test]
fn an_order_names_every_part_once_and_reports_what_it_did() {
    let json = report(&["order", WORLD, "--frames", "0..3", "--fps", "60", "--arcs", "--json", "-", "-q"]);
    assert_eq!(json["schema"], "hither.order/1");
    assert_eq!(json["parts"].as_array().unwrap().len(), 50);
    let frames = json["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 3);
    for frame in frames {
        let groups = frame["order"].as_array().unwrap();
        let place =
            |part: u64| groups.iter().position(|g| g.as_array().unwrap().contains(&part.into())).unwrap();
        let mut parts: Vec<u64> =
            groups.iter().flat_map(|g| g.as_array().unwrap()).map(|p| p.as_u64().unwrap()).collect();
        parts.sort_unstable();
        assert_eq!(parts, (0..50).collect::<Vec<u64>>());
        for arc in frame["arcs"].as_array().unwrap() {
            assert!(place(arc[0].as_u64().unwrap()) <= place(arc[1].as_u64().unwrap()));
        }
        assert!(frame["time_ms"].as_f64().unwrap() > 0.0 && frame["counters"]["parts"] == 50);
    }
    let names = String::from_utf8(done(&["order", WORLD, "-q"]).stdout).unwrap();
    assert!(names.contains("toothpick 7") && names.contains("sphere 0"));
}

#[test]
fn the_graph_is_drawn_and_parts_are_chosen() {
    let folder = Folder::new("graph");
    let dot = folder.path("graph.dot");
    done(&["order", WORLD, "--dot", &dot, "-q"]);
    let text = fs::read_to_string(dot).unwrap();
    assert!(text.starts_with("digraph") && text.contains(" -> ") && text.trim_end().ends_with('}'));
    let json =
        report(&["order", "world:canyon?grid=5", "--parts", "aircraft 0,aircraft 3", "--json", "-", "-q"]);
    let names: Vec<&str> =
        json["parts"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"aircraft 0") && names.contains(&"body 1") && !names.contains(&"body 0"));
    let refused = hither(&["order", WORLD, "--parts", "nobody"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no node \"nobody\""));
}

#[test]
fn layers_are_written_three_ways_and_restore_the_picture() {
    let folder = Folder::new("ways");
    for (output, file) in [("a.ora", "a.ora"), ("b.exr", "b.exr"), ("c", "c/composite.png")] {
        let output = folder.path(output);
        let json =
            report(&["layers", WORLD, "-o", &output, "--size", "160x90", "--verify", "--json", "-", "-q"]);
        let frame = &json["frames"][0];
        assert_eq!(frame["verification"]["pixels_differing"], 0);
        let layers = frame["layers"].as_array().unwrap();
        let parts: usize = layers.iter().map(|l| l["parts"].as_array().unwrap().len()).sum();
        assert_eq!(parts, 50);
        assert!(frame["expression"].as_str().unwrap().contains(" over "));
        let program = frame["program"].as_array().unwrap();
        assert!(program.len() >= layers.len() && program[0]["register"].is_string());
        assert!(fs::metadata(folder.path(file)).unwrap().len() > 500);
    }
    assert!(fs::read_to_string(folder.path("c/expression.txt")).unwrap().contains("\"sphere 0\""));
    assert!(fs::read_to_string(folder.path("c/program.json")).unwrap().contains("Rover"));
    let direct = folder.path("direct.png");
    let layered = folder.path("layered.png");
    done(&["render", WORLD, "-o", &direct, "--size", "160x90", "-q"]);
    done(&["render", WORLD, "-o", &layered, "--size", "160x90", "--algorithm", "layers", "-q"]);
    assert_eq!(fs::read(&direct).unwrap(), fs::read(&layered).unwrap());
    assert_eq!(fs::read(&direct).unwrap(), fs::read(folder.path("c/composite.png")).unwrap());
}

#[test]
fn layers_are_left_out_replaced_blurred_and_reused() {
    let folder = Folder::new("more");
    let whole = folder.path("whole");
    done(&["layers", WORLD, "-o", &whole, "--size", "120x90", "-q"]);
    let without = folder.path("without");
    done(&["layers", WORLD, "-o", &without, "--size", "120x90", "--without", "sphere 7", "-q"]);
    let composite = |folder: &str| fs::read(format!("{folder}/composite.png")).unwrap();
    assert_ne!(composite(&whole), composite(&without));
    let replaced = folder.path("replaced");
    let picture = format!("sphere 7={whole}/composite.png");
    done(&["layers", WORLD, "-o", &replaced, "--size", "120x90", "--replace", &picture, "-q"]);
    assert_ne!(composite(&replaced), composite(&without));
    let blurred = folder.path("blurred");
    let lens = ["--focus", "4.8", "--f-number", "1", "--focal-length", "200", "--lens-samples", "20"];
    let arguments = ["layers", WORLD, "-o", &blurred, "--size", "120x90", "--json", "-", "-q"];
    let json = report(&[&arguments[..], &lens[..]].concat());
    let errors = &json["frames"][0]["depth_of_field"];
    let error = |name: &str| errors[name].as_f64().unwrap();
    assert!(error("rms_error_layers") < error("rms_error_without_blur"), "{errors}");
    assert!(fs::metadata(format!("{blurred}/focus.png")).unwrap().len() > 500);
    let reuse = [
        "layers", WORLD, "--size", "120x90", "--frames", "0..6", "--fps", "60", "--reuse", "1", "--json",
        "-", "-q",
    ];
    let json = report(&reuse);
    let rate = json["reuse"]["update_rate_unit"].as_f64().unwrap();
    assert!((0.0..0.9).contains(&rate), "{rate}");
}

#[test]
fn what_is_no_lens_is_refused_before_anything_is_written_and_a_huge_one_is_none_too_large() {
    let folder = Folder::new("lens");
    let output = folder.path("x.ora");
    let usual = ["layers", WORLD, "-o", &output, "--size", "16x16", "-q"];
    for wrong in [
        &["--focus", "-1"][..],
        &["--focus", "0"],
        &["--focus", "nan"],
        &["--focus", "inf"],
        &["--focus", "1", "--f-number", "0"],
        &["--focus", "1", "--focal-length", "-5"],
        &["--focus", "1", "--focal-length", "nan"],
        &["--focus", "1", "--lens-samples", "0"],
        &["--focus", "1", "--lens-samples", "4000000000"],
    ] {
        let refused = hither(&[&usual[..], wrong].concat());
        assert_eq!(refused.status.code(), Some(2), "{wrong:?}");
        assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 0, "{wrong:?}");
    }
    let huge = ["--focus", "0.1", "--f-number", "1e-15", "--focal-length", "1e15", "--lens-samples", "3"];
    let json = report(&[&usual[..], &huge[..], &["--json", "-"]].concat());
    assert_eq!(json["frames"][0]["depth_of_field"]["lens_samples"], 3);
}

#[test]
fn samples_count_in_the_size_and_in_the_memory_that_a_picture_needs() {
    let folder = Folder::new("samples");
    // The scene does not exist; that the size is named shows which was looked at first.
    let refused =
        hither(&["layers", "no.glb", "-o", &folder.path("x.ora"), "--size", "9000x9", "--samples", "2"]);
    let text = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!((refused.status.code(), text.lines().count()), (Some(1), 1));
    assert!(text.contains("18000x18 samples") && text.contains("16384"), "{text}");
    if !cfg!(target_os = "linux") {
        return;
    }
    let command = format!(
        "ulimit -v 2000000 && exec '{}' layers no.glb --json - --size 4000x4000 --samples 4",
        env!("CARGO_BIN_EXE_hither")
    );
    let refused = Command::new("sh").args(["-c", &command]).output().unwrap();
    let text = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!((refused.status.code(), text.lines().count()), (Some(1), 1));
    assert!(text.contains("4000x4000") && text.contains("GiB") && text.contains("--samples"), "{text}");
}

#[test]
fn parts_that_pass_through_each_other_are_merged_or_held_out() {
    let layers = |options: &[&str]| {
        let usual = ["layers", WORLD, "--size", "640x360", "--verify", "--json", "-", "-q"];
        let json = report(&[&usual[..], options].concat());
        let frame = &json["frames"][0];
        assert_eq!(frame["verification"]["pixels_differing"], 0, "{options:?}");
        let layers = frame["layers"].as_array().unwrap();
        let held_out = layers.iter().filter(|l| l["held_out_samples"].as_u64().unwrap() > 0).count();
        (layers.len(), held_out)
    };
    let (hulls, samples, held_out) = (layers(&["--occlusion", "hulls"]), layers(&[]), layers(&["--holdout"]));
    assert!(hulls.0 <= samples.0 && samples.0 < held_out.0, "{hulls:?} {samples:?} {held_out:?}");
    assert!(held_out.0 == 50 && hulls.1 == 0 && samples.1 == 0 && held_out.1 > 0);
    let refused = hither(&["layers", WORLD, "--json", "-", "--holdout", "--occlusion", "hulls"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn a_node_is_split_into_parts() {
    const VALLEY: &str = "world:canyon?grid=1";
    let parts = |options: &[&str]| {
        let json = report(&[&["order", VALLEY, "--json", "-", "-q"][..], options].concat());
        json["parts"].as_array().unwrap().len()
    };
    assert_eq!(parts(&[]), 38);
    assert_eq!(parts(&["--split", "terrain 0=grid:5x5"]), 37 + 25);
    // Pieces stay apart whatever is one part otherwise.
    assert_eq!(parts(&["--split", "terrain 0=grid:5x5", "--parts", "depth=1"]), 7 + 25);
    assert!(parts(&["--split", "terrain 0=adaptive:9", "--split", "body 0=boxes:2x1x1"]) >= 36 + 9 + 2);
    let json = report(&[
        "layers",
        VALLEY,
        "--split",
        "terrain 0=grid:6x6",
        "--overlap",
        "10",
        "--shade",
        "flat",
        "--size",
        "160x90",
        "--verify",
        "--json",
        "-",
        "-q",
    ]);
    let off = json["frames"][0]["verification"]["largest_difference"].as_f64().unwrap();
    assert!(off < 1.0 / 255.0, "{off}");
    // Part 1 is the terrain.
    assert_eq!(parts(&["--split", "1=grid:5x5", "--backdrop", "0"]), 37 + 25);
    for (split, code) in [
        ("terrain 0=grid:5", 2),
        ("38=grid:2x2", 1),
        ("terrain 0", 2),
        ("terrain 0=grid:0x1", 2),
        ("sea=grid:2x2", 1),
    ] {
        let refused = hither(&["order", VALLEY, "--split", split]);
        assert_eq!(refused.status.code(), Some(code), "{split}");
    }
    assert_eq!(hither(&["order", VALLEY, "--overlap", "5"]).status.code(), Some(2));
}

/// The colours of a layered EXR file's composite.
fn composite(file: &str) -> Vec<[f32; 4]> {
    let room = |size: exr::math::Vec2<usize>, _: &_| (size.0, vec![[0.0; 4]; size.area()]);
    let take = |(width, pixels): &mut (usize, Vec<[f32; 4]>), at: exr::math::Vec2<usize>, (r, g, b, a)| {
        pixels[at.1 * *width + at.0] = [r, g, b, a];
    };
    exr::prelude::read_first_rgba_layer_from_file(file, room, take).unwrap().layer_data.channel_data.pixels.1
}

/// Panes one behind the other, tilted, all but the last transparent; a transparent box among them; and, if they are
/// to cross, two more that pass through each other.
fn panes(folder: &Folder, crossing: bool) -> String {
    let mut text = String::from("mtllib glass.mtl\n");
    let mut vertices = 0;
    let mut quads = |name: &str, material: &str, corners: &[[f64; 3]], faces: &[[usize; 4]]| {
        text.push_str(&format!("o {name}\nusemtl {material}\n"));
        corners.iter().for_each(|[x, y, z]| text.push_str(&format!("v {x} {y} {z}\n")));
        for [a, b, c, d] in faces {
            let [a, b, c, d] = [a, b, c, d].map(|i| vertices + i + 1);
            text.push_str(&format!("f {a} {b} {c} {d}\n"));
        }
        vertices += corners.len();
    };
    for i in 0..5u32 {
        let (z, x) = (-f64::from(i), 0.25 * f64::from(i));
        let material = ["red", "green", "blue", "red", "solid"][i as usize];
        let corners =
            [[x - 1.0, -1.0, z], [x + 1.0, -1.0, z - 0.4], [x + 1.0, 1.0, z - 0.4], [x - 1.0, 1.0, z]];
        quads(&format!("pane{i}"), material, &corners, &[[0, 1, 2, 3]]);
    }
    let corner = |i: u32| {
        let side = |bit: u32, half: f64| if i >> bit & 1 == 0 { -half } else { half };
        [0.6 + side(0, 0.5), 0.4 + side(1, 0.5), -1.7 + side(2, 0.1)]
    };
    let box_ = [[0, 1, 3, 2], [5, 4, 6, 7], [4, 0, 2, 6], [1, 5, 7, 3], [2, 3, 7, 6], [4, 5, 1, 0]];
    quads("box", "green", &(0..8).map(corner).collect::<Vec<_>>(), &box_);
    if crossing {
        for (name, tilt) in [("left", 0.5), ("right", -0.5)] {
            let corners = [[-2.5, -1.0, -2.0 - tilt], [-1.5, -1.0, -2.0 + tilt], [-1.5, 1.0, -2.0 + tilt]];
            let last = [-2.5, 1.0, -2.0 - tilt];
            quads(name, "blue", &[corners[0], corners[1], corners[2], last], &[[0, 1, 2, 3]]);
        }
    }
    let colors = [("red", "0.9 0.1 0.1", 0.4), ("green", "0.1 0.8 0.2", 0.5), ("blue", "0.1 0.2 0.9", 0.6)];
    let mut materials = String::from("newmtl solid\nKd 0.8 0.8 0.7\n");
    for (name, color, alpha) in colors {
        materials.push_str(&format!("newmtl {name}\nKd {color}\nd {alpha}\n"));
    }
    fs::write(folder.path("glass.mtl"), materials).unwrap();
    let path = folder.path("panes.obj");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_transparent_part_that_is_split_tints_what_is_behind_it_once() {
    let folder = Folder::new("split-glass");
    let scene = panes(&folder, false);
    for (split, pieces) in [("pane1=boxes:3x2x1", 6), ("pane1=cylinder:4x2", 4), ("box=boxes:2x2x2", 8)] {
        for samples in ["1", "2"] {
            let drawn = |name: &str, how: &[&str]| {
                let file = folder.path(name);
                let arguments = ["layers", &scene, "--samples", samples, "-o", &file, "--json", "-"];
                let view = ["--eye", "-0.4,0.3,4", "--target", "0,0,-2", "--size", "240x160", "-q"];
                (report(&[&arguments[..], &view, how].concat()), composite(&file))
            };
            let (json, with) = drawn("split.exr", &["--split", split, "--verify"]);
            assert_eq!(json["parts"].as_array().unwrap().len(), 5 + pieces, "{split}");
            // Neither a gap shows, nor anything twice. But new corners are snapped, which may move a sample at the outline
            // from one side to the other.
            let (_, without) = drawn("whole.exr", &[]);
            let off = |(a, b): (&[f32; 4], &[f32; 4])| a.iter().zip(b).any(|(a, b)| (a - b).abs() >= 1e-5);
            let moved = with.iter().zip(&without).filter(|pair| off(*pair)).count();
            assert!(moved <= 1, "{split}, {samples} samples: {moved}");
            // Verified is against the scene that is not split.
            let verified = &json["frames"][0]["verification"];
            let largest = verified["largest_difference"].as_f64().unwrap();
            assert_eq!(largest >= 1e-5, moved > 0, "{split}, {samples} samples: {verified}");
        }
    }
}

#[test]
fn transparent_scenes_are_those_sorted_at_every_pixel_and_cycles_are_named() {
    let folder = Folder::new("transparent");
    for crossing in [false, true] {
        let scene = panes(&folder, crossing);
        let picture = |algorithm: &str| {
            let file = folder.path(&format!("{algorithm}.png"));
            let view = ["--eye", "-0.4,0.3,4", "--target", "0,0,-2", "--size", "240x160", "-v"];
            let arguments = ["render", &scene, "--algorithm", algorithm, "-o", &file];
            let output = hither(&[&arguments[..], &view[..]].concat());
            assert!(output.status.success());
            let (_, _, pixels) = hither_io::read_picture(file.as_ref()).unwrap();
            (fs::read(&file).unwrap(), pixels, String::from_utf8(output.stderr).unwrap())
        };
        let ((truth, pixels, _), (layered, _, said)) = (picture("hzb"), picture("layers"));
        assert!(truth == layered, "crossing: {crossing}");
        let partly = pixels.iter().filter(|p| p[3] > 0.3 && p[3] < 0.95).count();
        assert!(partly > 2_000, "{partly} pixels are transparent");
        let named = said.lines().filter(|l| l.contains("in a binary cycle, drawn together:"));
        let named: Vec<&str> = named.map(|l| l.rsplit(": ").next().unwrap()).collect();
        assert_eq!(named.len(), usize::from(crossing), "{said}");
        assert!(!crossing || (named[0].contains("left") && named[0].contains("right")), "{said}");
        assert_eq!(said.contains("2 parts occlude each other both ways"), crossing, "{said}");
    }
}

#[test]
fn a_picture_in_a_layers_place_does_not_move_with_it_when_layers_are_reused() {
    let folder = Folder::new("replaced");
    let whole = folder.path("whole");
    done(&["layers", WORLD, "-o", &whole, "--size", "120x90", "-q"]);
    let json = report(&["order", WORLD, "--json", "-", "-q"]);
    let names: Vec<&str> =
        json["parts"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    // All parts, so that every frame is made of pictures that rest.
    let pictures: Vec<String> = names.iter().map(|name| format!("{name}={whole}/composite.png")).collect();
    let mut arguments = vec![
        "layers", WORLD, "--size", "120x90", "--frames", "0..6", "--fps", "60", "--reuse", "8", "--json",
        "-", "-q",
    ];
    pictures.iter().for_each(|picture| arguments.extend(["--replace", picture]));
    let json = report(&arguments);
    assert!(json["reuse"]["update_rate_unit"].as_f64().unwrap() < 1.0);
    assert_eq!(json["reuse"]["rms_error"], 0.0);
}
