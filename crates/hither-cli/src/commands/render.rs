//! `hither render`: pictures of a scene.

mod layered;

use super::report::{self, Seen};
use crate::console::Verbosity;
use crate::eye::Eye;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{grouped, short};
use crate::options::{self, AlgorithmName, ReportOptions, ShadeName, ViewOptions, WorkOptions};
use crate::outputs::{self, PictureFormat};
use crate::source;
use crate::timeline::Timeline;
use hither::conventions::{NO_ID, SurfaceId};
use hither::render::{Frame, Image, Shader, Shading, complexity_image};
use hither::scene::LINEAR_FROM_SRGB;
use hither::{Renderer, Scene, SceneIndex};
use hither_io::ExrImage;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Pictures of a scene
#[derive(clap::Args)]
pub struct Arguments {
    /// A .glb, .gltf, .obj, .stl or .ply file, or a generated world, as in `world:office?n=33`
    scene: String,
    /// The picture: .png, or .exr with depth and ids. With --frames each `#` of a run in the name stands for
    /// a digit of the picture's number; without one, out.png becomes out.0001.png
    #[arg(short, value_name = "FILE", required_unless_present = "json")]
    output: Option<PathBuf>,
    /// How the picture is coloured
    #[arg(long, value_name = "NAME", default_value = "smooth")]
    shade: ShadeName,
    /// Colour behind the scene, 0 to 255 each [default: transparent]
    #[arg(long, value_name = "R,G,B[,A]", value_parser = options::color)]
    background: Option<[u8; 4]>,
    #[command(flatten)]
    view: ViewOptions,
    #[command(flatten)]
    work: WorkOptions,
    #[command(flatten)]
    report: ReportOptions,
}

/// Draws the pictures that are asked for.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let verbosity = arguments.report.verbosity();
    let to = arguments.report.json.as_deref();
    let format = arguments.output.as_deref().map(PictureFormat::of).transpose()?;
    let mut files = Files::of_scene(&arguments.scene);
    files.writes("-o", arguments.output.as_deref(), arguments.view.frames.as_ref())?;
    files.reports(to)?;

    arguments.view.check_size()?;
    // The depth buffer and the frame, and the picture with what its file holds of each pixel.
    let bytes_a_pixel = if format == Some(PictureFormat::Exr) { 66 } else { 26 };
    arguments.view.check_memory(bytes_a_pixel, "a smaller --size")?;
    let start = Instant::now();
    let mut scene = source::open_surfaces(&arguments.scene, &files, verbosity)?;
    let read_time = start.elapsed();
    let timeline = Timeline::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    timeline.pose_first(&mut scene)?;
    let eye = Eye::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;

    let spinner = verbosity.spinner("indexing".into());
    let start = Instant::now();
    let mut index = SceneIndex::build(scene, &arguments.work.index());
    let index_time = start.elapsed();
    spinner.finish_and_clear();
    verbosity.detail(&format!("read in {}, indexed in {}", in_ms(read_time), in_ms(index_time)));

    let job = Job {
        arguments,
        format,
        timeline,
        eye,
        wants_counts: to.is_some() || verbosity == Verbosity::Verbose,
    };
    let frames = job.draw(&mut index)?;
    let mut json = report::opening("render");
    json.extend(job.settings(index.scene()));
    json.insert("read_ms".into(), report::milliseconds(read_time));
    json.insert("index_ms".into(), report::milliseconds(index_time));
    json.insert("frames".into(), frames.into());
    outputs::write_report(to, &json.into())
}

/// Everything that is settled before the first picture.
struct Job<'a> {
    arguments: &'a Arguments,
    format: Option<PictureFormat>,
    timeline: Timeline,
    eye: Eye,
    wants_counts: bool,
}

impl Job<'_> {
    /// Draws every frame and returns their reports.
    fn draw(&self, index: &mut SceneIndex) -> Result<Vec<Value>, Failure> {
        let verbosity = self.arguments.report.verbosity();
        let complexity = self.arguments.shade.shading() == Shading::Complexity;
        let options = self.arguments.work.render(complexity);
        let mut renderer = Renderer::new();
        let mut shader = Shader::new(index.scene(), options.threads);
        let mut reports = Vec::new();
        let bar = verbosity.bar(self.timeline.frames.len() as u64, "pictures");
        for number in self.timeline.frames.clone() {
            self.timeline.pose(index, number)?;
            let view = self.eye.view(index.scene(), &self.arguments.scene, self.arguments.view.size)?;
            let start = Instant::now();
            let frame = renderer.render(index, &view, &options).map_err(|e| Failure::work(e.to_string()))?;
            let mut render_time = start.elapsed();
            let written = self.write(&mut shader, index.scene(), &frame, number)?;
            let file = written.map(|(file, composing)| {
                render_time += composing;
                file
            });
            let seen = if self.wants_counts { Seen::count(&frame) } else { Seen::default() };
            bar.suspend(|| {
                verbosity.detail(&frame_line(&frame, &seen, number, render_time));
                if let (Some(file), false) = (&file, self.timeline.numbered) {
                    verbosity.note(&format!("wrote {} in {}", file.display(), in_ms(render_time)));
                }
            });
            bar.inc(1);
            if self.arguments.report.json.is_some() {
                let time = self.timeline.time(number);
                reports.push(frame_json(&frame, &seen, number, time, render_time, file.as_deref()));
            }
            renderer.recycle(frame);
        }
        bar.finish_and_clear();
        if let (Some(output), true) = (&self.arguments.output, self.timeline.numbered) {
            let (first, last) = (self.timeline.frames.start, self.timeline.frames.end - 1);
            let name = |frame| outputs::numbered(output, frame).display().to_string();
            verbosity.note(&format!("wrote {} to {}", name(first), name(last)));
        }
        Ok(reports)
    }

    /// Shades and writes a frame, if a picture is asked for; returns its file, and the time that its layers took.
    fn write(
        &self,
        shader: &mut Shader,
        scene: &Scene,
        frame: &Frame,
        number: u32,
    ) -> Result<Option<(PathBuf, Duration)>, Failure> {
        let (Some(output), Some(format)) = (&self.arguments.output, self.format) else { return Ok(None) };
        let path = if self.timeline.numbered { outputs::numbered(output, number) } else { output.clone() };
        let panel = self.arguments.shade.panel().and_then(|panel| complexity_image(frame, panel));
        let shading = self.arguments.shade.shading();
        let in_layers = self.arguments.work.algorithm == AlgorithmName::Layers && shading.shows_blended();
        let mut composing = Duration::ZERO;
        let mut image = match panel {
            Some(panel) => panel,
            None if in_layers => {
                let (start, verbosity) = (Instant::now(), self.arguments.report.verbosity());
                let image = layered::picture(scene, &self.arguments.scene, frame, shading, verbosity)?;
                composing = start.elapsed();
                image
            }
            None => shader.shade(scene, frame, shading),
        };
        if let Some(background) = self.arguments.background {
            put_behind(&mut image, background);
        }
        match format {
            PictureFormat::Png => hither_io::write_png(&path, image.width, image.height, &image.pixels)?,
            PictureFormat::Exr => write_exr(&path, &image, frame)?,
        }
        Ok(Some((path, composing)))
    }

    fn settings(&self, scene: &Scene) -> serde_json::Map<String, Value> {
        let arguments = self.arguments;
        let camera = self.eye.camera_name(scene).map(|(i, name)| json!({ "index": i, "name": name }));
        let settings = json!({
            "scene": arguments.scene,
            "triangles": scene.instanced_triangle_count(),
            "instances": scene.instance_count(),
            "width": arguments.view.size.0,
            "height": arguments.view.size.1,
            "camera": camera,
            "algorithm": options::word(arguments.work.algorithm),
            "box_test": options::word(arguments.work.box_test),
            "tree": options::word(arguments.work.tree),
            "shade": options::word(arguments.shade),
            "threads": options::threads(arguments.work.threads),
            "coherence": arguments.work.coherence,
        });
        match settings {
            Value::Object(map) => map,
            _ => serde_json::Map::new(),
        }
    }
}

fn frame_json(
    frame: &Frame,
    seen: &Seen,
    number: u32,
    time: Option<f64>,
    render_time: Duration,
    file: Option<&Path>,
) -> Value {
    json!({
        "frame": number,
        "scene_time_ms": time.map(|t| t * 1e3),
        "file": file.map(|f| f.display().to_string()),
        "eye": report::point(frame.view.eye_in_world()),
        "time_ms": report::milliseconds(render_time),
        "instances_seen": seen.instances,
        "triangles_seen": seen.triangles,
        "pixels_covered": seen.pixels,
        "counters": report::counters(&frame.counters),
    })
}

fn frame_line(frame: &Frame, seen: &Seen, number: u32, render_time: Duration) -> String {
    let counters = &frame.counters;
    format!(
        "picture {number}: {}; {} nodes visited, {} culled; {} triangles tested, {} drawn, {} seen of {} instances",
        in_ms(render_time),
        grouped(counters.nodes_visited),
        grouped(counters.nodes_culled),
        grouped(counters.triangles_tested),
        grouped(counters.triangles_drawn),
        grouped(seen.triangles),
        grouped(seen.instances),
    )
}

fn in_ms(time: Duration) -> String {
    format!("{} ms", short(time.as_secs_f64() * 1e3))
}

/// Composites the picture over a colour of sRGB codes with straight alpha.
fn put_behind(image: &mut Image, [r, g, b, a]: [u8; 4]) {
    let alpha = f32::from(a) / 255.0;
    let linear = |code: u8| LINEAR_FROM_SRGB[usize::from(code)] * alpha;
    let behind = [linear(r), linear(g), linear(b), alpha];
    for pixel in &mut image.pixels {
        let through = 1.0 - pixel[3];
        for (channel, behind) in pixel.iter_mut().zip(behind) {
            *channel += through * behind;
        }
    }
}

/// Writes the picture with distance and ids of the surface at each pixel.
fn write_exr(path: &Path, image: &Image, frame: &Frame) -> Result<(), hither_io::Error> {
    let pixels = || (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    let nothing = SurfaceId { instance: NO_ID, triangle: NO_ID };
    let distances: Vec<f32> = pixels().map(|(x, y)| frame.distance(x, y) as f32).collect();
    let surfaces: Vec<SurfaceId> = pixels().map(|(x, y)| frame.id(x, y).unwrap_or(nothing)).collect();
    let exr = ExrImage {
        width: image.width,
        height: image.height,
        pixels: &image.pixels,
        half: false,
        distances: &distances,
        surfaces: &surfaces,
    };
    hither_io::write_exr(path, &exr)
}
