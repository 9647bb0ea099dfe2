//! `hither lines`: a scene as a line drawing.

mod arguments;
mod paper;

pub use arguments::Arguments;

use super::report;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{grouped, short};
use crate::outputs::{self, has_extension};
use crate::source;
use crate::timeline::Timeline;
use hither::Scene;
use hither::hidden_line::{Drawing, LineOptions, Preparation, PrepareOptions};
use hither_io::{Sheet, SheetView};
use paper::Paper;
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// Draws what is asked for.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let verbosity = arguments.report.verbosity();
    let format = arguments.output.as_deref().map(Format::of).transpose()?;
    let report = arguments.report.json.as_deref();
    let mut files = Files::of_scene(&arguments.scene);
    files.writes("-o", arguments.output.as_deref(), arguments.view.frames.as_ref())?;
    files.reports(report)?;
    check_paper(arguments)?;
    // All that follows is done in this pool. Nothing before needs one, so that this cannot come too late.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.into()).build_global();

    let start = Instant::now();
    let mut scene = source::open(&arguments.scene, &files, verbosity)?;
    check_size(&scene, &arguments.scene)?;
    let read_time = start.elapsed();
    let timeline = Timeline::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    timeline.pose_first(&mut scene)?;
    let mut paper = Paper::choose(&scene, arguments, verbosity)?;

    let spinner = verbosity.spinner("preparing".into());
    let start = Instant::now();
    let mut preparation = Preparation::new(&scene, &PrepareOptions::default());
    let prepare_time = start.elapsed();
    spinner.finish_and_clear();
    verbosity.detail(&format!("read in {}, prepared in {}", in_ms(read_time), in_ms(prepare_time)));

    let options = arguments.line_options();
    let bar = verbosity.bar(timeline.frames.len() as u64, "drawings");
    let mut frames = Vec::new();
    for number in timeline.frames.clone() {
        if number != timeline.frames.start {
            timeline.pose_scene(&mut scene, number)?;
            preparation.pose(&scene);
            paper.follow(&scene, &arguments.scene)?;
        }
        let job = Job { arguments, format, scene: &scene, preparation: &preparation, options: &options };
        let file = arguments.output.as_deref().map(|output| match timeline.numbered {
            true => outputs::numbered(output, number),
            false => output.to_owned(),
        });
        let made = job.draw(&paper, file.as_deref())?;
        bar.suspend(|| {
            verbosity.detail(&made.line(number));
            if made.is_empty() {
                verbosity.note("note: nothing is visible; the drawing is empty");
            }
            if let (Some(file), false) = (&file, timeline.numbered) {
                let time = in_ms(made.time + made.write_time);
                verbosity.note(&format!("wrote {} in {time}", file.display()));
            }
        });
        bar.inc(1);
        frames.push(made.json(number, timeline.time(number), file.as_deref()));
    }
    bar.finish_and_clear();
    let mut json = report::opening("lines");
    json.insert("scene".into(), arguments.scene.as_str().into());
    json.insert("triangles".into(), scene.instanced_triangle_count().into());
    json.insert("instances".into(), scene.instance_count().into());
    json.insert("threads".into(), rayon::current_num_threads().into());
    json.insert("read_ms".into(), report::milliseconds(read_time));
    json.insert("prepare_ms".into(), report::milliseconds(prepare_time));
    json.insert("frames".into(), frames.into());
    outputs::write_report(arguments.report.json.as_deref(), &json.into())
}

/// Refuses a drawing of no size. Sheets may be larger than a picture can be.
fn check_paper(arguments: &Arguments) -> Result<(), Failure> {
    let (width, height) = arguments.view.size;
    match arguments.views.is_some() || arguments.parallel {
        true if width > 0 && height > 0 => Ok(()),
        true => Err(Failure::work(format!(
            "a sheet of {width}x{height} pixels has no room; choose a larger --size"
        ))),
        false => arguments.view.check_size(),
    }
}

/// Triangles in view are held in memory, some 70 bytes each.
const MOST_TRIANGLES: u64 = 100_000_000;

fn check_size(scene: &Scene, name: &str) -> Result<(), Failure> {
    let triangles = scene.instanced_triangle_count();
    if triangles <= MOST_TRIANGLES {
        return Ok(());
    }
    Err(Failure::work(format!(
        "{name}: it has {} triangles, and lines are drawn of {} at most; draw a part of it",
        grouped(triangles),
        grouped(MOST_TRIANGLES)
    )))
}

/// What kind of file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Svg,
    Dxf,
    Json,
}

impl Format {
    fn of(path: &Path) -> Result<Format, Failure> {
        let known = [("svg", Format::Svg), ("dxf", Format::Dxf), ("json", Format::Json)];
        known.into_iter().find(|(extension, _)| has_extension(path, extension)).map(|k| k.1).ok_or_else(
            || {
                let what = "give the file the extension .svg, .dxf or .json";
                Failure::usage(format!("-o {}: {what}", path.display()))
            },
        )
    }
}

/// What is settled before a drawing.
struct Job<'a> {
    arguments: &'a Arguments,
    format: Option<Format>,
    scene: &'a Scene,
    preparation: &'a Preparation,
    options: &'a LineOptions,
}

/// A sheet that was drawn.
struct Made {
    drawings: Vec<(String, Drawing)>,
    time: Duration,
    write_time: Duration,
}

impl Job<'_> {
    /// Draws every view of the sheet and writes it.
    fn draw(&self, paper: &Paper, file: Option<&Path>) -> Result<Made, Failure> {
        let start = Instant::now();
        let mut drawings = Vec::new();
        for placed in paper.views() {
            let drawing = self.preparation.draw(&placed.view, self.options);
            let drawing = drawing.map_err(|e| Failure::work(e.to_string()))?;
            drawings.push((placed.name.clone(), drawing));
        }
        let time = start.elapsed();
        let start = Instant::now();
        if let (Some(file), Some(format)) = (file, self.format) {
            let names = part_names(self.scene, &drawings);
            let views = drawings.iter().zip(paper.views());
            let views = views.map(|((name, drawing), placed)| SheetView {
                name: name.clone(),
                drawing,
                origin: placed.origin,
                scale: placed.scale,
            });
            let sheet = Sheet {
                title: &self.scene.name,
                width: paper.size().x,
                height: paper.size().y,
                unit: paper.unit(),
                views: views.collect(),
                part_names: &names,
                style: self.arguments.style.as_deref().unwrap_or(""),
            };
            match format {
                Format::Svg => hither_io::write_svg(file, &sheet)?,
                Format::Dxf => hither_io::write_dxf(file, &sheet)?,
                Format::Json => hither_io::write_drawing_json(file, &sheet)?,
            }
        }
        Ok(Made { drawings, time, write_time: start.elapsed() })
    }
}

impl Made {
    fn is_empty(&self) -> bool {
        self.drawings.iter().all(|(_, d)| d.strokes.is_empty() && d.faces.is_empty())
    }

    fn total(&self, of: impl Fn(&Drawing) -> u64) -> u64 {
        self.drawings.iter().map(|(_, d)| of(d)).sum()
    }

    fn line(&self, number: u32) -> String {
        format!(
            "drawing {number}: {}, written in {}; {} triangles, {} live; {} lines, {} exact tests; {} strokes of {} segments",
            in_ms(self.time),
            in_ms(self.write_time),
            grouped(self.total(|d| d.counters.triangles)),
            grouped(self.total(|d| d.counters.triangles_live)),
            grouped(self.total(|d| d.counters.lines)),
            grouped(self.total(|d| d.counters.tests)),
            grouped(self.total(|d| d.strokes.len() as u64)),
            grouped(self.total(|d| d.counters.segments)),
        )
    }

    fn json(&self, number: u32, time: Option<f64>, file: Option<&Path>) -> Value {
        let length: f64 = self.drawings.iter().map(|(_, d)| d.visible_length()).sum();
        json!({
            "frame": number,
            "scene_time_ms": time.map(|t| t * 1e3),
            "file": file.map(|f| f.display().to_string()),
            "time_ms": report::milliseconds(self.time),
            "write_ms": report::milliseconds(self.write_time),
            "segments": self.total(|d| d.counters.segments),
            "visible_segments": self.total(|d| d.counters.visible_segments),
            "strokes": self.total(|d| d.strokes.len() as u64),
            "faces": self.total(|d| d.faces.len() as u64),
            "length_px": length,
            "counters": {
                "instances_culled": self.total(|d| d.counters.instances_culled),
                "triangles": self.total(|d| d.counters.triangles),
                "triangles_live": self.total(|d| d.counters.triangles_live),
                "lines": self.total(|d| d.counters.lines),
                "tests": self.total(|d| d.counters.tests),
                "pairs": self.total(|d| d.counters.pairs),
            },
        })
    }
}

/// The names of the parts that are drawn, each in its place; the others stay empty.
fn part_names(scene: &Scene, drawings: &[(String, Drawing)]) -> Vec<String> {
    let parts = drawings
        .iter()
        .flat_map(|(_, d)| d.strokes.iter().map(|s| s.part).chain(d.faces.iter().map(|f| f.part)));
    let mut wanted: Vec<u32> = parts.collect();
    wanted.sort_unstable();
    wanted.dedup();
    let Some(&last) = wanted.last() else { return Vec::new() };
    let mut names = vec![String::new(); last as usize + 1];
    let instances = scene.instances();
    for part in wanted {
        if let Some(instance) = instances.get(part as usize) {
            names[part as usize] = scene.path_name(&instance.path);
        }
    }
    names
}

fn in_ms(time: Duration) -> String {
    format!("{} ms", short(time.as_secs_f64() * 1e3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_go_by_extension() {
        assert_eq!(Format::of(Path::new("a.SVG")).unwrap(), Format::Svg);
        assert_eq!(Format::of(Path::new("a.dxf")).unwrap(), Format::Dxf);
        assert!(Format::of(Path::new("a.png")).is_err());
    }
}
