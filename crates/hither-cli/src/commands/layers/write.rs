//! Layers as files: OpenRaster, EXR of several parts, or a folder of PNGs. Each holds the expression as text, the
//! program as JSON, and the composited picture.

use super::Taken;
use crate::failure::Failure;
use crate::outputs;
use hither::layers::{Operation, Program, Register, Source, Sprite};
use hither_io::LayerPicture;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A .ora file.
    OpenRaster,
    /// A .exr file.
    Exr,
    /// A folder.
    Folder,
}

impl Format {
    /// By the extension; a name without one is a folder's.
    pub fn of(path: &Path) -> Result<Format, Failure> {
        if outputs::has_extension(path, "ora") {
            Ok(Format::OpenRaster)
        } else if outputs::has_extension(path, "exr") {
            Ok(Format::Exr)
        } else if path.extension().is_none() || path.is_dir() {
            Ok(Format::Folder)
        } else {
            let what = "give the file the extension .ora or .exr, or name a folder";
            Err(Failure::usage(format!("-o {}: {what}", path.display())))
        }
    }
}

/// What a folder holds besides its layers.
const COMPOSITE: &str = "composite.png";
const EXPRESSION: &str = "expression.txt";
const PROGRAM: &str = "program.json";

/// The files in `output`, if it is a folder, that it has whatever the layers are.
pub fn inside(format: Format, output: &Path) -> impl Iterator<Item = PathBuf> {
    let names = if format == Format::Folder { &[COMPOSITE, EXPRESSION, PROGRAM][..] } else { &[] };
    names.iter().map(move |name| output.join(name))
}

/// A program as a list of `{ op, register, layer }`; `layer` is null where the source is the register to the left.
pub fn program_json(program: &Program) -> Value {
    let instruction = |i: &hither::layers::Instruction| {
        let op = match i.operation {
            Operation::Load => "load",
            Operation::In => "in",
            Operation::Out => "out",
            Operation::Add => "add",
            Operation::Over => "over",
        };
        let register = match i.register {
            Register::Product => "R*",
            Register::Sum => "R+",
            Register::Over => "Rover",
        };
        let layer = match i.source {
            Source::Layer(layer) => Some(layer),
            Source::Register => None,
        };
        json!({ "op": op, "register": register, "layer": layer })
    };
    program.instructions.iter().map(instruction).collect()
}

/// Writes a frame; returns what each layer is called in the file or the folder.
pub fn write(format: Format, path: &Path, taken: &Taken, size: (u32, u32)) -> Result<Vec<String>, Failure> {
    let expression = format!("{}\n", taken.expression);
    let program = format!("{:#}\n", program_json(&taken.program));
    match format {
        Format::Folder => return folder(path, taken, size, &expression, &program),
        Format::OpenRaster => {
            let shown = shown(taken);
            let pictures: Vec<LayerPicture> = shown.iter().map(|(n, s, v)| picture(n, s, *v)).collect();
            let notes =
                [("hither/expression.txt", expression.as_str()), ("hither/program.json", program.as_str())];
            hither_io::write_openraster(path, size, &pictures, &taken.composite.pixels, &notes)?;
        }
        Format::Exr => {
            let composite = Sprite::cut(size.0, &taken.composite.pixels);
            let mut pictures = vec![picture("composite", &composite, true)];
            pictures.extend(taken.layers.iter().map(|l| picture(&l.name, &l.painted.sprite, true)));
            let notes = [("expression", expression.as_str()), ("program", program.as_str())];
            hither_io::write_exr_layers(path, size, &pictures, &notes)?;
        }
    }
    Ok(taken.layers.iter().map(|l| l.name.clone()).collect())
}

fn picture<'a>(name: &'a str, sprite: &'a Sprite, visible: bool) -> LayerPicture<'a> {
    LayerPicture {
        name,
        position: (sprite.x, sprite.y),
        size: (sprite.width, sprite.height),
        pixels: &sprite.pixels,
        visible,
    }
}

/// The layers for a program that knows only `over`: in a cycle, each is cut by its occluders there, and follows
/// uncut and hidden. What is left out is hidden.
fn shown(taken: &Taken) -> Vec<(String, Sprite, bool)> {
    let mut all = Vec::new();
    let mut first = 0;
    for component in &taken.components {
        let n = component.layers.len();
        let layers = &taken.layers[first..first + n];
        if n == 1 {
            all.push((layers[0].name.clone(), layers[0].painted.sprite.clone(), !layers[0].out));
        } else {
            for (at, layer) in layers.iter().enumerate() {
                let mut cut = layer.painted.sprite.clone();
                for front in component.arcs.iter().filter(|a| a.1 as usize == at).map(|a| a.0 as usize) {
                    if !layers[front].out {
                        cut.cut_out(&layers[front].painted.sprite);
                    }
                }
                all.push((format!("{} (cut by what is before it)", layer.name), cut, !layer.out));
            }
            all.extend(
                layers.iter().map(|l| (format!("{} (whole)", l.name), l.painted.sprite.clone(), false)),
            );
        }
        first += n;
    }
    all
}

fn folder(
    path: &Path,
    taken: &Taken,
    (width, height): (u32, u32),
    expression: &str,
    program: &str,
) -> Result<Vec<String>, Failure> {
    std::fs::create_dir_all(path)
        .map_err(|e| Failure::work(format!("{}: cannot make the folder: {e}", path.display())))?;
    let mut files = Vec::new();
    for (number, layer) in taken.layers.iter().enumerate() {
        let safe = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' };
        let name: String = layer.name.chars().map(safe).take(60).collect();
        let file = format!("{number:04}-{name}.png");
        hither_io::write_png(
            &path.join(&file),
            width,
            height,
            &layer.painted.sprite.expanded(width, height),
        )?;
        files.push(file);
    }
    hither_io::write_png(&path.join(COMPOSITE), width, height, &taken.composite.pixels)?;
    for (name, content) in [(EXPRESSION, expression), (PROGRAM, program)] {
        hither_io::write_whole(&path.join(name), |file| file.write_all(content.as_bytes()))?;
    }
    Ok(files)
}
