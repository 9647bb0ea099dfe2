//! DXF, release 12, text: a layer for each class of lines, polylines with +y up; filled faces below them.
//!
//! Release 12 is read by every CAD program. It has neither fills with holes nor colours but those of its
//! palette: a face is closed polylines, on a layer of outlines, and triangles (SOLID) in the nearest colour, on
//! another. Hidden lines are on layers with a dashed line type. The part of a line or face is told by the
//! comment (group 999) before its first entity.

use super::{Sheet, SheetView, Unit, palette};
use crate::{Error, write_whole};
use glam::DVec2;
use hither::hidden_line::{Face, Kind, Stroke};
use std::io::{self, Write};
use std::path::Path;

/// Layers of faces: what is seen of bodies, and where they are cut; each filled, and as outlines.
const FACE_LAYERS: [[&str; 2]; 2] = [["FACES", "FACE_OUTLINES"], ["CUT_FACES", "CUT_FACE_OUTLINES"]];

/// Writes a sheet as DXF, whole or not at all.
pub fn write_dxf(path: &Path, sheet: &Sheet) -> Result<(), Error> {
    write_whole(path, |file| write(file, sheet))
}

fn write(file: &mut dyn Write, sheet: &Sheet) -> io::Result<()> {
    let units = match sheet.unit {
        Unit::Pixel => 0,
        Unit::Millimetre => 4,
    };
    write!(file, "999\nHither line drawing\n0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n")?;
    write!(file, "9\n$INSUNITS\n70\n{units}\n")?;
    write!(
        file,
        "9\n$EXTMIN\n10\n0\n20\n0\n9\n$EXTMAX\n10\n{}\n20\n{}\n0\nENDSEC\n",
        sheet.width, sheet.height
    )?;
    write_tables(file)?;
    write!(file, "0\nSECTION\n2\nENTITIES\n")?;
    for view in &sheet.views {
        let mut part = None;
        for face in &view.drawing.faces {
            if part.replace(face.part) != Some(face.part) {
                write_part(file, sheet, view, face.part)?;
            }
            write_face(file, sheet, view, face)?;
        }
        part = None;
        for stroke in &view.drawing.strokes {
            if part.replace(stroke.part) != Some(stroke.part) {
                write_part(file, sheet, view, stroke.part)?;
            }
            write_stroke(file, sheet, view, stroke)?;
        }
    }
    write!(file, "0\nENDSEC\n0\nEOF\n")
}

fn write_part(file: &mut dyn Write, sheet: &Sheet, view: &SheetView, part: u32) -> io::Result<()> {
    let name: String = sheet.part_name(part).chars().filter(|c| !c.is_control()).take(200).collect();
    write!(file, "999\n{} part {part} {name}\n", view.name)
}

fn write_tables(file: &mut dyn Write) -> io::Result<()> {
    write!(file, "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLTYPE\n70\n2\n")?;
    write!(file, "0\nLTYPE\n2\nCONTINUOUS\n70\n0\n3\nSolid line\n72\n65\n73\n0\n40\n0\n")?;
    write!(
        file,
        "0\nLTYPE\n2\nHIDDEN\n70\n0\n3\n_ _ _ _\n72\n65\n73\n2\n40\n3.6\n49\n2.4\n49\n-1.2\n0\nENDTAB\n"
    )?;
    write!(file, "0\nTABLE\n2\nLAYER\n70\n{}\n", Kind::ALL.len() * 2 + 4)?;
    for name in FACE_LAYERS.as_flattened() {
        write!(file, "0\nLAYER\n2\n{name}\n70\n0\n62\n9\n6\nCONTINUOUS\n")?;
    }
    for kind in Kind::ALL {
        for (hidden, line_type, color) in [(false, "CONTINUOUS", 7), (true, "HIDDEN", 8)] {
            write!(file, "0\nLAYER\n2\n{}\n70\n0\n62\n{color}\n6\n{line_type}\n", layer(kind, hidden))?;
        }
    }
    write!(file, "0\nENDTAB\n0\nENDSEC\n")
}

fn write_stroke(file: &mut dyn Write, sheet: &Sheet, view: &SheetView, stroke: &Stroke) -> io::Result<()> {
    let layer = layer(stroke.kind, stroke.covers > 0);
    let points = view.drawing.points_of(stroke);
    let closed = points.len() > 3 && points.first() == points.last();
    let points = if closed { &points[1..] } else { points };
    write_polyline(file, sheet, view, (&layer, ""), points, closed)
}

/// A polyline on a layer, with the group of its colour if that is not the layer's.
fn write_polyline(
    file: &mut dyn Write,
    sheet: &Sheet,
    view: &SheetView,
    (layer, color): (&str, &str),
    points: &[DVec2],
    closed: bool,
) -> io::Result<()> {
    write!(file, "0\nPOLYLINE\n8\n{layer}\n{color}66\n1\n70\n{}\n", u8::from(closed))?;
    write!(file, "10\n0\n20\n0\n30\n0\n")?;
    for &p in points {
        let at = view.place(p);
        write!(file, "0\nVERTEX\n8\n{layer}\n10\n{:.6}\n20\n{:.6}\n30\n0\n", at.x, sheet.height - at.y)?;
    }
    write!(file, "0\nSEQEND\n8\n{layer}\n")
}

/// A face: its triangles, then its outline and its holes.
fn write_face(file: &mut dyn Write, sheet: &Sheet, view: &SheetView, face: &Face) -> io::Result<()> {
    let [fill, outline] = FACE_LAYERS[usize::from(face.cut)];
    let color = format!("62\n{}\n", palette::nearest(face.color_on_white()));
    for [a, b, c] in face.triangles() {
        write!(file, "0\nSOLID\n8\n{fill}\n{color}")?;
        // Four corners; of a triangle the last two are one.
        for (k, p) in [a, b, c, c].into_iter().enumerate() {
            let at = view.place(p);
            write!(file, "1{k}\n{:.6}\n2{k}\n{:.6}\n3{k}\n0\n", at.x, sheet.height - at.y)?;
        }
    }
    for contour in &face.contours {
        write_polyline(file, sheet, view, (outline, &color), contour, true)?;
    }
    Ok(())
}

fn layer(kind: Kind, hidden: bool) -> String {
    let prefix = if hidden { "HIDDEN" } else { "VISIBLE" };
    format!("{prefix}_{}", kind.name().to_uppercase())
}
