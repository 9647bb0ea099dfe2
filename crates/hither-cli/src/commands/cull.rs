//! `hither cull`: which instances could be seen.

mod exact;
mod planes;

use super::report;
use crate::console::{self, Verbosity};
use crate::eye::Eye;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{count, grouped, short};
use crate::options::{self, ReportOptions, ViewOptions};
use crate::outputs;
use crate::source;
use crate::timeline::Timeline;
use clap::ValueEnum;
use hither::conventions::View;
use hither::cull::{CullCounters, CullOptions, Culler, Meaning, Reason};
use hither::scene::InstanceLocator;
use hither::{IndexOptions, Scene, SceneIndex};
use hither_io::one_line;
use serde_json::{Map, Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// Which instances could be seen, front to back
#[derive(clap::Args)]
pub struct Arguments {
    /// A .glb, .gltf, .obj, .stl or .ply file, or a generated world, as in `world:office?n=33`
    scene: String,
    /// How it is found out
    #[arg(long, value_name = "NAME", default_value = "buffer")]
    method: MethodName,
    /// How far the eye may move while the answer stays true, in metres (methods buffer and planes)
    #[arg(long, value_name = "METRES", value_parser = metres, default_value = "0", allow_hyphen_values = true)]
    margin: f64,
    /// How far each object may move while the answer stays true, in metres (method buffer)
    #[arg(long, value_name = "METRES", value_parser = metres, default_value = "0", allow_hyphen_values = true)]
    objects_move: f64,
    /// Leave out what shows at no pixel's centre, too: for drawing at this very size (method buffer)
    #[arg(long)]
    sampled: bool,
    /// Cull with pixels N times as wide and high: as true, faster, and leaves out less; 2 by default where the size is of
    /// more than a million pixels, else 1 (method buffer)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    coarse: Option<u32>,
    /// Start each frame with what hid something in the last (method buffer)
    #[arg(long)]
    coherence: bool,
    /// Also say of each instance why it was judged as it was (method buffer), or of each polygon how (planes)
    #[arg(long)]
    reasons: bool,
    #[command(flatten)]
    planes: planes::Options,
    #[command(flatten)]
    view: ViewOptions,
    #[command(flatten)]
    report: ReportOptions,
}

/// `--method`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    /// Conservative occlusion buffer: what is left out cannot be seen
    Buffer,
    /// Planes through the eye and the sides of large polygons, no image: what is left out cannot be seen
    Planes,
    /// What shows at some pixel centre: what is left out may be seen between centres
    Exact,
}

/// What a method found in one frame.
struct Found {
    visible: Vec<u32>,
    reasons: Option<Value>,
    polygons: Option<planes::Polygons>,
    counters: Value,
    time: Duration,
}

/// Culls the frames that are asked for.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    check(arguments)?;
    let verbosity = arguments.report.verbosity();
    let to = arguments.report.json.as_deref();
    let mut files = Files::of_scene(&arguments.scene);
    planes::check_map(arguments, &mut files)?;
    files.reports(to)?;
    arguments.view.check_size()?;
    let bytes_a_pixel = match arguments.method {
        // A depth, and its share of blocks and tiles.
        MethodName::Buffer => 6,
        MethodName::Planes => 0,
        // The depth buffer with ids, and the frame.
        MethodName::Exact => 22,
    };
    arguments.view.check_memory(bytes_a_pixel, "a smaller --size")?;
    let mut scene = source::open_surfaces(&arguments.scene, &files, verbosity)?;
    if arguments.method == MethodName::Planes {
        planes::check_scene(&scene, &arguments.scene)?;
    }
    let timeline = Timeline::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    timeline.pose_first(&mut scene)?;
    let eye = Eye::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    let spinner = verbosity.spinner("indexing".into());
    let locator = InstanceLocator::new(&scene);
    let mut index = SceneIndex::build(scene, &IndexOptions::default());
    let mut method = Method::new(arguments, &index);
    spinner.finish_and_clear();

    let mut frames = Vec::new();
    let bar = verbosity.bar(timeline.frames.len() as u64, "frames");
    for number in timeline.frames.clone() {
        timeline.pose(&mut index, number)?;
        let view = eye.view(index.scene(), &arguments.scene, arguments.view.size)?;
        let found = method.find(&index, &view)?;
        if let Method::Planes(planes) = &method {
            planes.write_map(number, timeline.numbered)?;
        }
        let names = Names { scene: index.scene(), locator: &locator };
        bar.suspend(|| say(&names, &found, number, to, verbosity))?;
        bar.inc(1);
        if to.is_some() {
            frames.push(frame_json(&names, &found, number, timeline.time(number), &view));
        }
    }
    bar.finish_and_clear();
    let mut json = report::opening("cull");
    json.extend(settings(arguments, &eye, &index));
    json.extend(method.settings());
    json.insert("frames".into(), frames.into());
    outputs::write_report(to, &json.into())
}

fn check(arguments: &Arguments) -> Result<(), Failure> {
    let buffer = arguments.method == MethodName::Buffer;
    if !buffer && arguments.coherence {
        return Err(Failure::usage("--coherence goes with --method buffer"));
    }
    if arguments.method == MethodName::Exact && arguments.reasons {
        return Err(Failure::usage("--reasons goes with --method buffer or planes"));
    }
    if !buffer && arguments.coarse.is_some_and(|n| n > 1) {
        return Err(Failure::usage("--coarse goes with --method buffer"));
    }
    if arguments.sampled && arguments.coarse.is_some_and(|n| n > 1) {
        return Err(Failure::usage("--sampled needs the view's own pixels: it goes without --coarse"));
    }
    if !buffer && (arguments.sampled || arguments.objects_move > 0.0) {
        return Err(Failure::usage("--sampled and --objects-move go with --method buffer"));
    }
    if arguments.sampled && (arguments.margin > 0.0 || arguments.objects_move > 0.0) {
        return Err(Failure::usage(
            "--sampled holds for one eye alone: it goes without --margin and --objects-move",
        ));
    }
    if arguments.method == MethodName::Exact && arguments.margin > 0.0 {
        return Err(Failure::usage("--margin goes with --method buffer or planes"));
    }
    arguments.planes.check(arguments.method)
}

/// A method with what it keeps from frame to frame.
enum Method {
    Buffer(Box<Culler>, CullOptions),
    Exact(Box<exact::Exact>),
    Planes(Box<planes::Planes>),
}

fn cull_options(arguments: &Arguments) -> CullOptions {
    CullOptions {
        eye_moves: arguments.margin,
        objects_move: arguments.objects_move,
        meaning: if arguments.sampled { Meaning::Sampled } else { Meaning::Continuous },
        coarseness: arguments.coarse,
        coherence: arguments.coherence,
        reasons: arguments.reasons,
        ..CullOptions::default()
    }
}

impl Method {
    fn new(arguments: &Arguments, index: &SceneIndex) -> Method {
        match arguments.method {
            MethodName::Exact => Method::Exact(Box::new(exact::Exact::new(index))),
            MethodName::Planes => Method::Planes(Box::new(planes::Planes::new(arguments, index))),
            MethodName::Buffer => {
                let mut culler = Box::new(Culler::new());
                culler.prepare(index);
                Method::Buffer(culler, cull_options(arguments))
            }
        }
    }

    /// What the report says of method planes alone, null for the others, and of threads.
    fn settings(&self) -> Map<String, Value> {
        let settings = match self {
            Method::Planes(planes) => planes.settings(),
            Method::Buffer(..) | Method::Exact(_) => json!({
                "around": null, "occluders": null, "leaf": null, "paper": null, "threads": 1,
            }),
        };
        settings.as_object().cloned().unwrap_or_default()
    }

    fn find(&mut self, index: &SceneIndex, view: &View) -> Result<Found, Failure> {
        let start = Instant::now();
        match self {
            Method::Buffer(culler, options) => {
                let found = culler.cull(index, view, options).map_err(|e| Failure::work(e.to_string()))?;
                let time = start.elapsed();
                let reasons = options.reasons.then(|| {
                    let entry = |j: &hither::cull::Judged| {
                        json!({ "first": j.instances.start, "count": j.instances.len(), "reason": word(j.reason) })
                    };
                    found.judged.iter().map(entry).collect::<Vec<_>>().into()
                });
                let counters = counters(&found.counters);
                Ok(Found { visible: found.visible, reasons, polygons: None, counters, time })
            }
            Method::Planes(planes) => planes.find(index, view),
            Method::Exact(exact) => exact.find(index, view),
        }
    }
}

fn say(
    names: &Names,
    found: &Found,
    number: u32,
    to: Option<&Path>,
    verbosity: Verbosity,
) -> Result<(), Failure> {
    let all = names.scene.instance_count();
    let time = short(found.time.as_secs_f64() * 1e3);
    let seen = grouped(found.visible.len() as u64);
    let mut line = format!("frame {number}: {seen} of {} could be seen; {time} ms", count(all, "instance"));
    if let Some(polygons) = &found.polygons {
        line += &format!("; {}", polygons.line());
    }
    let mut lines = vec![line];
    if verbosity == Verbosity::Verbose {
        lines.push(format!("  {}", counters_line(&found.counters)));
        let named = |&i: &u32| format!("  {i} {}", one_line(&names.of(i).unwrap_or_default()));
        lines.extend(found.visible.iter().map(named));
    }
    match to {
        None if verbosity != Verbosity::Quiet => console::print(&format!("{}\n", lines.join("\n"))),
        None => Ok(()),
        Some(_) => {
            lines.iter().for_each(|line| verbosity.detail(line));
            Ok(())
        }
    }
}

/// Counters as the report names them, without those that were not recorded.
fn counters_line(counters: &Value) -> String {
    let all = counters.as_object().into_iter().flatten();
    let one = |(name, value): (&String, &Value)| {
        value.as_u64().map(|number| format!("{} {}", grouped(number), name.replace('_', " ")))
    };
    all.filter_map(one).collect::<Vec<_>>().join(", ")
}

/// Says what instances are called: the names of the nodes that lead to them.
struct Names<'a> {
    scene: &'a Scene,
    locator: &'a InstanceLocator,
}

impl Names<'_> {
    fn of(&self, instance: u32) -> Option<String> {
        self.locator.path(self.scene, instance).map(|path| self.scene.path_name(&path))
    }
}

fn frame_json(names: &Names, found: &Found, number: u32, time: Option<f64>, view: &View) -> Value {
    let named = |&i: &u32| json!({ "instance": i, "name": names.of(i) });
    let mut frame = json!({
        "frame": number,
        "scene_time_ms": time.map(|t| t * 1e3),
        "eye": report::point(view.eye_in_world()),
        "time_ms": report::milliseconds(found.time),
        "visible": found.visible.iter().map(named).collect::<Vec<_>>(),
        "counters": found.counters,
    });
    if let (Some(reasons), Some(frame)) = (&found.reasons, frame.as_object_mut()) {
        frame.insert("reasons".into(), reasons.clone());
    }
    if let (Some(polygons), Some(frame)) = (&found.polygons, frame.as_object_mut()) {
        frame.insert("polygons".into(), polygons.json());
    }
    frame
}

fn settings(arguments: &Arguments, eye: &Eye, index: &SceneIndex) -> Map<String, Value> {
    let scene = index.scene();
    let camera = eye.camera_name(scene).map(|(i, name)| json!({ "index": i, "name": name }));
    let coarse = match arguments.method {
        MethodName::Buffer => cull_options(arguments).coarseness_in(arguments.view.size),
        _ => 1,
    };
    let mut map = Map::new();
    map.insert("scene".into(), arguments.scene.clone().into());
    map.insert("triangles".into(), scene.instanced_triangle_count().into());
    map.insert("instances".into(), scene.instance_count().into());
    map.insert("width".into(), arguments.view.size.0.into());
    map.insert("height".into(), arguments.view.size.1.into());
    map.insert("camera".into(), camera.into());
    map.insert("method".into(), options::word(arguments.method).into());
    map.insert("margin".into(), arguments.margin.into());
    map.insert("objects_move".into(), arguments.objects_move.into());
    map.insert("sampled".into(), arguments.sampled.into());
    map.insert("coarse".into(), coarse.into());
    map.insert("coherence".into(), arguments.coherence.into());
    map
}

fn counters(c: &CullCounters) -> Value {
    json!({
        "boxes_projected": c.boxes_projected,
        "boxes_asked": c.boxes_asked,
        "boxes_hidden": c.boxes_hidden,
        "occluders": c.occluders,
        "occluders_idle": c.occluders_idle,
        "occluder_patches": c.occluder_patches,
        "occluder_faces": c.occluder_faces,
        "second_thoughts": c.second_thoughts,
    })
}

fn word(reason: Reason) -> &'static str {
    match reason {
        Reason::Shows => "shows",
        Reason::ReachesNearPlane => "reaches-near-plane",
        Reason::OutsideView => "outside-view",
        Reason::BoxHidden => "box-hidden",
        Reason::PartsHidden => "parts-hidden",
        Reason::HiddenAfterAll => "hidden-after-all",
    }
}

fn metres(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|m| m.is_finite() && *m >= 0.0);
    number.ok_or_else(|| "write metres, 0 or more".into())
}
