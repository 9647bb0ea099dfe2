//! Depth of field: layers blurred and composited, beside the blurred single picture and the truth.

use super::Taken;
use super::write::Format;
use crate::console::Verbosity;
use crate::failure::Failure;
use crate::numbers::short;
use hither::conventions::View;
use hither::layers::depth_of_field::{
    Lens, accumulate, blur_layer, blur_whole, lens_offsets, rms_difference, view_from,
};
use hither::layers::{Canvas, LayerPainter, PaintOptions, Sprite};
use serde_json::{Value, json};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A lens.
#[derive(clap::Args, Debug)]
pub struct FocusOptions {
    /// Depth of field: distance in focus, metres. Writes the picture beside the layers, as NAME-focus.png
    #[arg(long, value_name = "METRES", allow_hyphen_values = true, help_heading = "Lens")]
    focus: Option<f64>,
    /// The lens's f-number
    #[arg(
        long,
        value_name = "N",
        default_value = "2.8",
        requires = "focus",
        allow_hyphen_values = true,
        help_heading = "Lens"
    )]
    f_number: f64,
    /// The lens's focal length, millimetres
    #[arg(
        long,
        value_name = "MM",
        default_value = "50",
        requires = "focus",
        allow_hyphen_values = true,
        help_heading = "Lens"
    )]
    focal_length: f64,
    /// Also write the blurred single picture and the mean of N pictures from points of the lens, and compare
    #[arg(long, value_name = "N", requires = "focus", help_heading = "Lens",
          value_parser = clap::value_parser!(u32).range(1..=65_536))]
    lens_samples: Option<u32>,
}

/// Names of the pictures: through the lens, and what it is compared with.
const PICTURE: &str = "focus";
const SINGLE: &str = "focus-single";
const TRUTH: &str = "focus-truth";

/// What each number of a lens may be; far beyond, its blur would be none.
const RANGE: RangeInclusive<f64> = 1e-15..=1e15;

impl FocusOptions {
    /// Refuses what is no lens.
    pub fn check(&self) -> Result<(), Failure> {
        let Some(focus) = self.focus else { return Ok(()) };
        let values = [focus, self.f_number, self.focal_length];
        for (name, value) in ["--focus", "--f-number", "--focal-length"].iter().zip(values) {
            if !RANGE.contains(&value) {
                let what = "write a number above 0, from 1e-15 to 1e15";
                return Err(Failure::usage(format!("{name} {value}: {what}")));
            }
        }
        Ok(())
    }

    /// The files that are written for the layers in `output`.
    pub fn pictures(&self, format: Format, output: &Path) -> impl Iterator<Item = PathBuf> {
        let names: &[&str] = match (self.focus, self.lens_samples) {
            (None, _) => &[],
            (Some(_), None) => &[PICTURE],
            (Some(_), Some(_)) => &[PICTURE, SINGLE, TRUTH],
        };
        names.iter().map(move |name| beside(output, format == Format::Folder, name))
    }
}

/// The file of picture `what`: in the folder of the layers, or beside the file that they are in.
fn beside(output: &Path, is_folder: bool, what: &str) -> PathBuf {
    if is_folder {
        return output.join(format!("{what}.png"));
    }
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!("{stem}-{what}.png"))
}

/// Makes the pictures that are asked for; `None` if there is no lens.
pub fn run(
    options: &FocusOptions,
    taken: &Taken,
    view: &View,
    painter: &mut LayerPainter,
    paint: &PaintOptions,
    output: Option<&Path>,
    verbosity: Verbosity,
) -> Result<Option<Value>, Failure> {
    let Some(focus) = options.focus else { return Ok(None) };
    let lens = Lens::of(focus, options.f_number, options.focal_length);
    let size = (view.width, view.height);
    let blurred: Vec<Sprite> = taken.layers.iter().map(|l| blur_layer(&l.painted, view, &lens)).collect();
    let layered = taken.program.run(size, |l| (!taken.layers[l as usize].out).then(|| &blurred[l as usize]));
    write(output, PICTURE, &layered, verbosity)?;
    let Some(samples) = options.lens_samples else { return Ok(Some(json!({ "focus": focus }))) };
    let draw = |painter: &mut LayerPainter, view: &View| {
        painter.paint_all(view, paint).map_err(|e| Failure::work(e.to_string()))
    };
    let whole = draw(painter, view)?;
    let single = blur_whole(&whole, view, &lens);
    let sharp = Canvas { width: size.0, height: size.1, pixels: whole.sprite.expanded(size.0, size.1) };
    let offsets = lens_offsets(view, &lens, samples as usize);
    let mut failed = None;
    let pictures = offsets.iter().map_while(|(offset, shift)| {
        let from = draw(painter, &view_from(view, *offset)).map_err(|e| failed = Some(e)).ok()?;
        let pixels = from.sprite.expanded(size.0, size.1);
        Some((Canvas { width: size.0, height: size.1, pixels }, *shift))
    });
    let truth = accumulate(size, pictures);
    if let Some(failed) = failed {
        return Err(failed);
    }
    write(output, SINGLE, &single, verbosity)?;
    write(output, TRUTH, &truth, verbosity)?;
    let errors = [&layered, &single, &sharp].map(|c| rms_difference(c, &truth));
    verbosity.note(&format!(
        "root mean square error against {} lens samples: layers {}, single picture {}, no blur {}",
        offsets.len(),
        short(errors[0]),
        short(errors[1]),
        short(errors[2])
    ));
    Ok(Some(json!({
        "focus": focus,
        "lens_samples": offsets.len(),
        "rms_error_layers": errors[0],
        "rms_error_single_picture": errors[1],
        "rms_error_without_blur": errors[2],
    })))
}

fn write(output: Option<&Path>, what: &str, picture: &Canvas, verbosity: Verbosity) -> Result<(), Failure> {
    let Some(output) = output else { return Ok(()) };
    let path = beside(output, output.is_dir(), what);
    hither_io::write_png(&path, picture.width, picture.height, &picture.pixels)?;
    verbosity.note(&format!("wrote {}", path.display()));
    Ok(())
}
