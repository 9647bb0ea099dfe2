//! SVG: a group for each view, part, and class of lines, with CSS classes and a stylesheet of its own.
//!
//! A group's strokes are one path, each stroke a subpath in the order in which a pen should draw it.
//! Coordinates are rounded to a fixed number of digits and written as differences of the rounded values, so
//! that no error adds up.

use super::{Sheet, SheetView, Unit, push_fixed};
use crate::{Error, write_whole};
use hither::hidden_line::{Drawing, Face, Stroke};
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// Strokes that one thread formats at a time.
const BLOCK: usize = 256;

/// Digits after the point: a hundredth of a pixel, a thousandth of a millimetre.
fn digits(unit: Unit) -> usize {
    match unit {
        Unit::Pixel => 2,
        Unit::Millimetre => 3,
    }
}

/// Writes a sheet as SVG, whole or not at all.
pub fn write_svg(path: &Path, sheet: &Sheet) -> Result<(), Error> {
    write_whole(path, |file| write(file, sheet))
}

fn write(file: &mut dyn Write, sheet: &Sheet) -> io::Result<()> {
    let unit = match sheet.unit {
        Unit::Pixel => "",
        Unit::Millimetre => "mm",
    };
    let (w, h) = (round(sheet.width), round(sheet.height));
    writeln!(file, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>")?;
    writeln!(
        file,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}{unit}\" height=\"{h}{unit}\" \
         viewBox=\"0 0 {w} {h}\">"
    )?;
    if !sheet.title.is_empty() {
        writeln!(file, "<title>{}</title>", escaped(sheet.title))?;
    }
    let style = sheet.style.lines().map(escaped).collect::<Vec<_>>().join("\n");
    writeln!(file, "<style>\n{}{style}</style>", stylesheet(sheet.unit))?;
    for view in &sheet.views {
        write_view(file, sheet, view)?;
    }
    writeln!(file, "</svg>")
}

fn write_view(file: &mut dyn Write, sheet: &Sheet, view: &SheetView) -> io::Result<()> {
    let name =
        if view.name.is_empty() { String::new() } else { format!(" id=\"{}\"", identifier(&view.name)) };
    writeln!(file, "<g class=\"view\"{name}>")?;
    write_faces(file, sheet, view)?;
    let class = |s: &Stroke| (s.part, s.kind, s.covers);
    let groups: Vec<&[Stroke]> = view.drawing.strokes.chunk_by(|a, b| class(a) == class(b)).collect();
    let blocks: Vec<&[Stroke]> = groups.iter().flat_map(|group| group.chunks(BLOCK)).collect();
    let path = |block: &&[Stroke]| {
        let mut text = Vec::new();
        for stroke in *block {
            push_path(&mut text, sheet, view, view.drawing.points_of(stroke), false);
        }
        text
    };
    let mut texts = blocks.par_iter().map(path).collect::<Vec<_>>().into_iter();
    for of_part in groups.chunk_by(|a, b| a[0].part == b[0].part) {
        let part = of_part[0][0].part;
        writeln!(
            file,
            "<g class=\"part\" data-part=\"{part}\" data-name=\"{}\">",
            escaped(sheet.part_name(part))
        )?;
        for group in of_part {
            let Stroke { kind, covers, .. } = group[0];
            let class = match covers {
                0 => format!("class=\"visible {}\"", kind.name()),
                n => format!("class=\"hidden {}\" data-covers=\"{n}\"", kind.name()),
            };
            write!(file, "<path {class} d=\"")?;
            for text in texts.by_ref().take(group.len().div_ceil(BLOCK)) {
                file.write_all(&text)?;
            }
            writeln!(file, "\"/>")?;
        }
        writeln!(file, "</g>")?;
    }
    writeln!(file, "</g>")
}

/// Filled faces lie below the lines.
fn write_faces(file: &mut dyn Write, sheet: &Sheet, view: &SheetView) -> io::Result<()> {
    let Drawing { faces, .. } = view.drawing;
    let mut text = Vec::new();
    for of_part in faces.chunk_by(|a, b| a.part == b.part) {
        let part = of_part[0].part;
        let name = escaped(sheet.part_name(part));
        writeln!(file, "<g class=\"part faces\" data-part=\"{part}\" data-name=\"{name}\">")?;
        let look = |f: &Face| (f.color, f.cut, f.opacity.to_bits());
        for group in of_part.chunk_by(|a, b| look(a) == look(b)) {
            text.clear();
            for face in group {
                for contour in &face.contours {
                    push_path(&mut text, sheet, view, contour, true);
                }
            }
            let [r, g, b] = group[0].color;
            let class = if group[0].cut { "face cut" } else { "face" };
            write!(file, "<path class=\"{class}\" style=\"fill:#{r:02x}{g:02x}{b:02x};")?;
            if group[0].opacity < 1.0 {
                write!(file, "fill-opacity:{};stroke:none\" d=\"", round(f64::from(group[0].opacity)))?;
            } else {
                // A hair of the same colour around each face hides the seams that viewers' antialiasing makes.
                write!(file, "stroke:#{r:02x}{g:02x}{b:02x}\" d=\"")?;
            }
            file.write_all(&text)?;
            writeln!(file, "\"/>")?;
        }
        writeln!(file, "</g>")?;
    }
    Ok(())
}

/// Nothing is drawn farther from the sheet's corner than that, in its smallest steps, so that steps can be told.
const FARTHEST: glam::DVec2 = glam::DVec2::splat(1e15);

/// A subpath: where it starts, then steps.
fn push_path(text: &mut Vec<u8>, sheet: &Sheet, view: &SheetView, points: &[glam::DVec2], closes: bool) {
    let digits = digits(sheet.unit);
    let parts = 10f64.powi(digits as i32);
    let fixed = |p: glam::DVec2| {
        let at = (view.place(p) * parts).round().clamp(-FARTHEST, FARTHEST);
        [at.x as i64, at.y as i64]
    };
    let Some(&first) = points.first() else { return };
    let mut last = fixed(first);
    text.push(b'M');
    push_fixed(text, last[0], digits);
    text.push(b' ');
    push_fixed(text, last[1], digits);
    text.push(b'l');
    let mut steps = 0;
    for &p in &points[1..] {
        let at = fixed(p);
        if at == last {
            continue;
        }
        if steps > 0 && at[0] >= last[0] {
            text.push(b' ');
        }
        push_fixed(text, at[0] - last[0], digits);
        if at[1] >= last[1] {
            text.push(b' ');
        }
        push_fixed(text, at[1] - last[1], digits);
        last = at;
        steps += 1;
    }
    if steps == 0 {
        // A point that is seen is a dot, with round ends.
        text.extend_from_slice(b"0 0");
    }
    if closes {
        text.push(b'z');
    }
}

fn stylesheet(unit: Unit) -> String {
    let (fine, medium, broad, dash) = match unit {
        Unit::Pixel => (0.6, 1.0, 1.4, "4 2.5"),
        Unit::Millimetre => (0.18, 0.25, 0.5, "1.6 0.8"),
    };
    // A face's hair is a pixel wide: where neighbours cover a pixel in parts, a hundredth of the paper shows
    // through at most; of 0.6 pixels it would be four.
    format!(
        "path {{ fill: none; stroke: #000; stroke-width: {medium}; stroke-linecap: round; \
         stroke-linejoin: round; }}\n\
         .crease, .border, .marked {{ stroke-width: {fine}; }}\n\
         .section {{ stroke-width: {broad}; }}\n\
         .hidden {{ stroke: #777; stroke-width: {fine}; stroke-dasharray: {dash}; }}\n\
         .hatch {{ stroke-width: {fine}; }}\n\
         .face {{ stroke-width: {medium}; fill-rule: evenodd; }}\n"
    )
}

fn round(x: f64) -> f64 {
    (x * 1e4).round() / 1e4
}

/// Text as XML wants it; characters that XML cannot hold are left out.
fn escaped(text: &str) -> String {
    let mut result = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => result.push_str("&amp;"),
            '<' => result.push_str("&lt;"),
            '>' => result.push_str("&gt;"),
            '"' => result.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => {}
            c if c < ' ' => {}
            c => result.push(c),
        }
    }
    result
}

/// Letters, digits, hyphens.
fn identifier(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}
