//! `hither order`: whole parts, front to back.

use super::report;
use super::sorting::{PartOptions, Sorting};
use crate::console;
use crate::eye::Eye;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{count, short};
use crate::options::{ReportOptions, ViewOptions};
use crate::outputs;
use crate::source;
use crate::timeline::Timeline;
use hither::order::{Counters, Order, SortOptions};
use hither_io::one_line;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Whole parts front to back, and the groups that no order can serve
#[derive(clap::Args)]
pub struct Arguments {
    /// A .glb, .gltf, .obj, .stl or .ply file, or a generated world, as in `world:toothpicks?n=200`
    scene: String,
    #[command(flatten)]
    parts: PartOptions,
    /// Also report which part occludes which: all arcs of the occlusion graph
    #[arg(long)]
    arcs: bool,
    /// Also report which pairs of parts have hulls that intersect
    #[arg(long)]
    intersections: bool,
    /// Write the occlusion graph for Graphviz
    #[arg(long, value_name = "FILE.dot", conflicts_with = "frames")]
    dot: Option<PathBuf>,
    /// Sort every frame from the order by distance instead of from the last frame's order
    #[arg(long)]
    from_scratch: bool,
    #[command(flatten)]
    view: ViewOptions,
    #[command(flatten)]
    report: ReportOptions,
}

/// Sorts the frames that are asked for.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let verbosity = arguments.report.verbosity();
    let to = arguments.report.json.as_deref();
    let mut files = Files::of_scene(&arguments.scene);
    files.writes("--dot", arguments.dot.as_deref(), None)?;
    files.reports(to)?;
    arguments.view.check_size()?;
    let start = Instant::now();
    let mut scene = source::open_surfaces(&arguments.scene, &files, verbosity)?;
    let prepared = arguments.parts.prepare(&mut scene, &arguments.scene)?;
    let read_time = start.elapsed();
    let timeline = Timeline::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    timeline.pose_scene(&mut scene, timeline.frames.start)?;
    let eye = Eye::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    let start = Instant::now();
    let options = SortOptions { incremental: !arguments.from_scratch, ..SortOptions::default() };
    let mut sorting =
        Sorting::new(&scene, &arguments.scene, &arguments.parts, &prepared, options, verbosity)?;
    let hull_time = start.elapsed();
    verbosity.detail(&format!("read in {}, hulls in {}", in_ms(read_time), in_ms(hull_time)));

    let mut frames = Vec::new();
    for number in timeline.frames.clone() {
        timeline.pose_scene(&mut scene, number)?;
        let view = eye.view(&scene, &arguments.scene, arguments.view.size)?;
        let time = sorting.sort(&scene, &view);
        let order = sorting.sort.order().clone();
        let counters = sorting.sort.counters();
        verbosity.detail(&format!("frame {number}: {}", line(&counters, time)));
        if !timeline.numbered {
            verbosity.note(&line(&counters, time));
        }
        let arcs = (arguments.arcs || arguments.dot.is_some()).then(|| sorting.sort.arcs());
        if let (Some(dot), Some(arcs)) = (&arguments.dot, &arcs) {
            let text = graph(&order, arcs, &|part| sorting.name(part));
            hither_io::write_whole(dot, |file| file.write_all(text.as_bytes()))?;
            verbosity.note(&format!("wrote {}", dot.display()));
        }
        if to.is_some() {
            let intersections = arguments.intersections.then(|| sorting.sort.intersecting_pairs());
            frames.push(json!({
                "frame": number,
                "scene_time_ms": timeline.time(number).map(|t| t * 1e3),
                "eye": report::point(view.eye_in_world()),
                "time_ms": report::milliseconds(time),
                "order": order.groups().collect::<Vec<_>>(),
                "arcs": arguments.arcs.then_some(arcs),
                "intersections": intersections,
                "counters": counters_json(&counters),
            }));
        } else if !timeline.numbered {
            console::print(&listing(&order, &|part| one_line(&sorting.name(part)).into_owned()))?;
        }
    }
    let mut json = report::opening("order");
    json.insert("scene".into(), arguments.scene.as_str().into());
    json.insert("read_ms".into(), report::milliseconds(read_time));
    json.insert("hulls_ms".into(), report::milliseconds(hull_time));
    json.insert("parts".into(), sorting.parts_json());
    json.insert("frames".into(), frames.into());
    outputs::write_report(to, &json.into())
}

fn line(counters: &Counters, time: Duration) -> String {
    let cycles = match counters.groups {
        0 => "no cycle".to_owned(),
        n => format!(
            "{} holding {} (the largest {})",
            count(n, "cycle"),
            count(counters.grouped_parts, "part"),
            counters.largest_group
        ),
    };
    format!("{} in {}: {cycles}", count(counters.parts, "part"), in_ms(time))
}

fn in_ms(time: Duration) -> String {
    format!("{} ms", short(time.as_secs_f64() * 1e3))
}

/// One group a line, front to back; a cycle's members in braces.
fn listing(order: &Order, name: &impl Fn(u32) -> String) -> String {
    let mut text = String::new();
    for group in order.groups() {
        let names: Vec<String> = group.iter().map(|&p| name(p)).collect();
        let _ = match names.as_slice() {
            [one] => writeln!(text, "{one}"),
            many => writeln!(text, "{{ {} }}", many.join(", ")),
        };
    }
    text
}

/// The graph in Graphviz's language: an arrow points to what is occluded, a cycle is a box.
fn graph(order: &Order, arcs: &[(u32, u32)], name: &impl Fn(u32) -> String) -> String {
    let quoted = |part: u32| name(part).replace('\\', "\\\\").replace('"', "\\\"");
    let mut text = String::from("digraph occlusion {\n  node [shape=ellipse, fontname=\"sans-serif\"];\n");
    for (number, group) in order.groups().enumerate() {
        let nodes =
            group.iter().map(|&p| format!("p{p} [label=\"{}\"];", quoted(p))).collect::<Vec<_>>().join(" ");
        let _ = match group.len() {
            1 => writeln!(text, "  {nodes}"),
            _ => writeln!(text, "  subgraph cluster_{number} {{ style=rounded; {nodes} }}"),
        };
    }
    for &(front, behind) in arcs {
        let mutual = arcs.binary_search(&(behind, front)).is_ok();
        let _ = match (mutual, front < behind) {
            (false, _) => writeln!(text, "  p{front} -> p{behind};"),
            (true, true) => writeln!(text, "  p{front} -> p{behind} [dir=both];"),
            (true, false) => Ok(()),
        };
    }
    text.push_str("}\n");
    text
}

fn counters_json(counters: &Counters) -> Value {
    json!({
        "parts": counters.parts,
        "extents": counters.extents,
        "cells": counters.cells,
        "cell_entries": counters.cell_entries,
        "candidates": counters.candidates,
        "exact_tests": counters.exact_tests,
        "arcs_found": counters.arcs_found,
        "groups": counters.groups,
        "grouped_parts": counters.grouped_parts,
        "largest_group": counters.largest_group,
        "moved_up": counters.moved_up,
    })
}
