//! `hither layers`: separate images, and the expression that composites them.

mod focus;
mod reuse;
mod verify;
mod write;

use super::report;
use super::sorting::{LayerOptions, PartOptions, Sorting};
use crate::console::Verbosity;
use crate::eye::Eye;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::count;
use crate::options::{ReportOptions, ShadeName, ViewOptions};
use crate::outputs;
use crate::source;
use crate::timeline::Timeline;
use focus::FocusOptions;
use hither::Scene;
use hither::conventions::{MAX_IMAGE_SIDE, View};
use hither::layers::{
    Canvas, Component, Expression, Holdout, LayerPainter, Openness, PaintOptions, Painted, Program, Sprite,
};
use hither::order::SortOptions;
use hither::render::RenderOptions;
use reuse::Reuse;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use write::Format;

/// One image a layer, and the expression that composites them
#[derive(clap::Args)]
pub struct Arguments {
    /// A .glb, .gltf, .obj, .stl or .ply file, or a generated world, as in `world:toothpicks?n=200`
    scene: String,
    /// An OpenRaster file (.ora), an EXR file of several layers (.exr), or a folder of PNGs
    #[arg(short, value_name = "FILE.ora|FILE.exr|DIR", required_unless_present = "json")]
    output: Option<PathBuf>,
    #[command(flatten)]
    parts: PartOptions,
    #[command(flatten)]
    layers: LayerOptions,
    /// How the layers are coloured
    #[arg(long, value_name = "NAME", default_value = "smooth")]
    shade: ShadeName,
    /// Samples along each side of a pixel; with 1 the composite is the direct picture to the last bit, up to rounding
    /// where surfaces blend
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
    /// Leave out layers that show, and so hide, nothing
    #[arg(long)]
    leave_out_empty: bool,
    /// Composite without the layers that hold these parts; the others are not drawn anew
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    without: Vec<String>,
    /// Composite with a picture of your own in place of the layer that holds a part
    #[arg(long, value_name = "NAME=FILE")]
    replace: Vec<String>,
    /// Compare the composite with the picture drawn directly, without --split
    #[arg(long)]
    verify: bool,
    /// With --frames: draw a layer anew only where its last picture, warped by an affine map, would be off by more
    /// than so many pixels, and report how often that is, and how far off the pictures are
    #[arg(long, value_name = "PIXELS", requires = "frames")]
    reuse: Option<f64>,
    #[command(flatten)]
    focus: FocusOptions,
    #[command(flatten)]
    view: ViewOptions,
    /// Worker threads; 0 is one for each core
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,
    #[command(flatten)]
    report: ReportOptions,
}

/// A frame taken apart.
struct Taken {
    components: Vec<Component>,
    /// Through all components.
    layers: Vec<Layer>,
    expression: String,
    program: Program,
    composite: Canvas,
}

/// A layer and its picture.
struct Layer {
    name: String,
    parts: Vec<u32>,
    painted: Painted,
    /// Left out of the composite.
    out: bool,
    /// Its picture is another.
    replaced: bool,
    /// Samples that are cut because another layer is before them.
    held_out: u64,
}

fn check_choices(arguments: &Arguments) -> Result<(), Failure> {
    if matches!(arguments.shade, ShadeName::Depth) {
        return Err(Failure::usage(
            "--shade depth spreads a picture's own distances over its greys, and layers would not fit together: \
             `hither render` draws it",
        ));
    }
    arguments.layers.check()?;
    arguments.focus.check()
}

/// Takes the frames apart that are asked for.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let verbosity = arguments.report.verbosity();
    let to = arguments.report.json.as_deref();
    let format = arguments.output.as_deref().map(Format::of).transpose()?;
    check_choices(arguments)?;
    let files = check_outputs(arguments, format)?;
    check_size(arguments)?;
    let mut scene = source::open_surfaces(&arguments.scene, &files, verbosity)?;
    let mut direct = verify::Direct::of(&scene, arguments.verify && arguments.parts.splits());
    let prepared = arguments.parts.prepare(&mut scene, &arguments.scene)?;
    let timeline = Timeline::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    timeline.pose_scene(&mut scene, timeline.frames.start)?;
    let eye = Eye::choose(&scene, &arguments.scene, &arguments.view, verbosity)?;
    let view = eye.view(&scene, &arguments.scene, arguments.view.size)?;
    // Corners are rounded to 1/256 pixel, and depth to single precision.
    let slack = 1.0 / (256.0 * view.pixels_per_unit()) + 1e-6;
    let options = SortOptions { slack, ..SortOptions::default() };
    let mut sorting =
        Sorting::new(&scene, &arguments.scene, &arguments.parts, &prepared, options, verbosity)?;
    let replacements = replacements(arguments, &sorting)?;
    let mut painter = LayerPainter::new(&scene);
    let paint = PaintOptions {
        shading: arguments.shade.shading(),
        samples: arguments.samples,
        render: RenderOptions { threads: usize::from(arguments.threads), ..RenderOptions::default() },
    };
    let mut reuse = arguments.reuse.map(Reuse::new).transpose()?;
    let mut frames = Vec::new();
    for number in timeline.frames.clone() {
        timeline.pose_scene(&mut scene, number)?;
        painter.pose(&scene);
        let view = eye.view(&scene, &arguments.scene, arguments.view.size)?;
        let taken = take_apart(arguments, &scene, &view, &mut sorting, &mut painter, &paint, &replacements)?;
        if let Some(reuse) = &mut reuse {
            reuse.frame(&scene, &sorting, &view, &taken);
        }
        let output = arguments.output.as_ref().map(|path| match timeline.numbered {
            true => outputs::numbered(path, number),
            false => path.clone(),
        });
        let mut files = Vec::new();
        if let (Some(output), Some(format)) = (&output, format) {
            files = write::write(format, output, &taken, (view.width, view.height))?;
        }
        say(verbosity, &taken, output.as_deref(), timeline.numbered);
        let whole = direct.painter(&timeline, number)?.unwrap_or(&mut painter);
        let check = match arguments.verify {
            true => Some(verify::verify(&taken, &view, whole, &paint, verbosity)?),
            false => None,
        };
        let focus =
            focus::run(&arguments.focus, &taken, &view, &mut painter, &paint, output.as_deref(), verbosity)?;
        if to.is_some() {
            frames.push(frame_json(number, &taken, &files, check, focus));
        }
    }
    let mut json = report::opening("layers");
    json.insert("scene".into(), arguments.scene.as_str().into());
    json.insert("width".into(), arguments.view.size.0.into());
    json.insert("height".into(), arguments.view.size.1.into());
    json.insert("parts".into(), sorting.parts_json());
    if let Some(reuse) = &reuse {
        verbosity.note(&reuse.line());
        json.insert("reuse".into(), reuse.json());
    }
    json.insert("frames".into(), frames.into());
    outputs::write_report(to, &json.into())
}

/// Refuses a picture, or one of all its samples, that is too large, or that there is no memory for.
fn check_size(arguments: &Arguments) -> Result<(), Failure> {
    let (view, samples) = (&arguments.view, arguments.samples);
    view.check_size()?;
    let (width, height) = (view.size.0 * samples, view.size.1 * samples);
    if width.max(height) > MAX_IMAGE_SIDE {
        let sides = format!("{width}x{height} samples, and up to {MAX_IMAGE_SIDE} a side can be drawn");
        let what = "choose a smaller --size or fewer --samples";
        return Err(Failure::work(format!("--samples {samples}: the picture has {sides}; {what}")));
    }
    // A picture; and of each sample a depth, two ids, a colour and, where a pixel has several, what is open. Layers
    // need more, by how much of the picture they cover.
    match u64::from(samples) {
        1 => view.check_memory(16 + 28, "a smaller --size"),
        samples => view.check_memory(16 + 32 * samples * samples, "a smaller --size or fewer --samples"),
    }
}

/// Refuses what could not be written, or would be written over something else that is named.
fn check_outputs(arguments: &Arguments, format: Option<Format>) -> Result<Files, Failure> {
    let mut files = Files::of_scene(&arguments.scene);
    for (_, file) in arguments.replace.iter().filter_map(|replacement| replacement.split_once('=')) {
        files.reads("--replace", Path::new(file));
    }
    if let (Some(output), Some(format)) = (&arguments.output, format) {
        for output in outputs::of_frames(output, arguments.view.frames.as_ref()) {
            files.takes("-o", &output)?;
            for beside in write::inside(format, &output).chain(arguments.focus.pictures(format, &output)) {
                files.takes("-o", &beside)?;
            }
            if format != Format::Folder {
                hither_io::check_writable(&output)?;
            }
        }
    }
    files.reports(arguments.report.json.as_deref())?;
    Ok(files)
}

/// Parts by name, with the picture that takes the place of their layer.
fn replacements(arguments: &Arguments, sorting: &Sorting) -> Result<Vec<(String, Option<Sprite>)>, Failure> {
    let known = |name: &str| {
        let found = (0..sorting.parts.parts.len() as u32).any(|p| sorting.name(p) == name);
        let what = "`hither order` lists the names there are";
        if found { Ok(name.to_owned()) } else { Err(Failure::work(format!("no part \"{name}\"; {what}"))) }
    };
    let mut all = Vec::new();
    for name in &arguments.without {
        all.push((known(name)?, None));
    }
    for replacement in &arguments.replace {
        let Some((name, file)) = replacement.split_once('=') else {
            return Err(Failure::usage(format!("--replace {replacement}: write NAME=FILE")));
        };
        let (width, height, pixels) = hither_io::read_picture(Path::new(file))?;
        if (width, height) != arguments.view.size {
            let (w, h) = arguments.view.size;
            let what = format!("its size is {width}x{height}, the picture's {w}x{h}; make them the same");
            return Err(Failure::work(format!("{file}: {what}")));
        }
        all.push((known(name)?, Some(Sprite::cut(width, &pixels))));
    }
    Ok(all)
}

fn take_apart(
    arguments: &Arguments,
    scene: &Scene,
    view: &View,
    sorting: &mut Sorting,
    painter: &mut LayerPainter,
    paint: &PaintOptions,
    replacements: &[(String, Option<Sprite>)],
) -> Result<Taken, Failure> {
    sorting.sort(scene, view);
    let (mut components, held_out) = sorting.components(&arguments.layers, painter, view, paint)?;
    let replacement =
        |parts: &[u32]| replacements.iter().find(|(name, _)| parts.iter().any(|&p| sorting.name(p) == *name));
    let bar =
        arguments.report.verbosity().bar(components.iter().map(|c| c.layers.len() as u64).sum(), "layers");
    let mut layers = Vec::new();
    let mut open = Openness::new(view, paint);
    for component in &mut components {
        let mut drawn = Vec::new();
        for parts in &component.layers {
            let holdout = parts.iter().find_map(|part| held_out.get(part));
            let instances = sorting.instances_of(parts);
            let layer = painter.draw(&instances, view, paint, holdout);
            let mut layer = layer.map_err(|e| Failure::work(e.to_string()))?;
            layer.counts = replacement(parts).is_none();
            drawn.push(layer);
            bar.inc(1);
        }
        let painted = open.settle(drawn, &component.arcs);
        let mut kept = Vec::new();
        for ((at, parts), mut painted) in (0u32..).zip(&component.layers).zip(painted) {
            let name = parts.iter().map(|&p| sorting.name(p)).collect::<Vec<_>>().join(" + ");
            let (mut out, mut replaced) = (false, false);
            match replacement(parts) {
                Some((_, Some(sprite))) => {
                    replaced = true;
                    painted.distances = vec![f32::INFINITY; sprite.pixels.len()];
                    painted.sprite = sprite.clone();
                }
                Some((_, None)) => out = true,
                None => {}
            }
            if arguments.leave_out_empty && painted.sprite.is_empty() {
                continue;
            }
            kept.push(at);
            let held_out = parts.iter().find_map(|part| held_out.get(part)).map_or(0, Holdout::samples);
            layers.push(Layer { name, parts: parts.clone(), painted, out, replaced, held_out });
        }
        keep(component, &kept);
    }
    bar.finish_and_clear();
    components.retain(|c| !c.layers.is_empty());
    let program = Program::compile(&components);
    let expression = Expression::of(&components).text(&|l| quoted(&layers[l as usize].name));
    let composite = program.run((view.width, view.height), |l| {
        let layer = &layers[l as usize];
        (!layer.out).then_some(&layer.painted.sprite)
    });
    Ok(Taken { components, layers, expression, program, composite })
}

/// Leaves only some of a component's layers.
fn keep(component: &mut Component, kept: &[u32]) {
    if kept.len() == component.layers.len() {
        return;
    }
    let place = |old: u32| kept.iter().position(|&k| k == old).map(|at| at as u32);
    component.arcs = component.arcs.iter().filter_map(|&(a, b)| Some((place(a)?, place(b)?))).collect();
    component.layers = kept.iter().map(|&k| component.layers[k as usize].clone()).collect();
}

/// A name as the expression writes it: in quotes where it could be misread.
fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
    let is_word = matches!(name, "over" | "atop" | "out" | "in");
    if !name.is_empty() && name.chars().all(plain) && !is_word {
        return name.to_owned();
    }
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

fn say(verbosity: Verbosity, taken: &Taken, output: Option<&Path>, numbered: bool) {
    let several = taken.layers.iter().filter(|l| l.parts.len() > 1).count();
    let cycles = taken.components.iter().filter(|c| c.layers.len() > 1).count();
    let held_out = taken.layers.iter().filter(|l| l.held_out > 0).count();
    let mut line = format!(
        "{}, {} of several parts, {} composited without merging, {}",
        count(taken.layers.len() as u64, "layer"),
        several,
        count(cycles as u64, "cycle"),
        count(taken.program.instructions.len() as u64, "instruction"),
    );
    if held_out > 0 {
        line.push_str(&format!("; {held_out} cut where others are before them"));
    }
    let wrote = output.map(|o| format!("wrote {}: ", o.display())).unwrap_or_default();
    match numbered {
        true => verbosity.detail(&format!("{wrote}{line}")),
        false => verbosity.note(&format!("{wrote}{line}")),
    }
    let parts: usize = taken.layers.iter().map(|l| l.parts.len()).sum();
    let largest = taken.layers.iter().map(|l| l.parts.len()).max().unwrap_or(0);
    if !numbered && largest > 1 && largest * 2 > parts {
        verbosity.note(&format!(
            "one layer holds {largest} of {parts} parts, which occlude each other both ways; --holdout keeps them apart"
        ));
    }
}

fn frame_json(
    number: u32,
    taken: &Taken,
    files: &[String],
    check: Option<Value>,
    focus: Option<Value>,
) -> Value {
    let layer = |(index, layer): (usize, &Layer)| {
        let sprite = &layer.painted.sprite;
        json!({
            "index": index,
            "name": layer.name,
            "parts": layer.parts,
            "file": files.get(index),
            "left_out": layer.out,
            "held_out_samples": layer.held_out,
            "rectangle": [sprite.x, sprite.y, sprite.width, sprite.height],
        })
    };
    json!({
        "frame": number,
        "layers": taken.layers.iter().enumerate().map(layer).collect::<Vec<_>>(),
        "expression": taken.expression,
        "program": write::program_json(&taken.program),
        "verification": check,
        "depth_of_field": focus,
    })
}
