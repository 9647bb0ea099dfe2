//! A drawing's geometry as JSON, `hither.drawing/1`: for programs that draw, cut or measure.

use super::{Sheet, SheetView, Unit};
use crate::{Error, write_whole};
use glam::DVec2;
use std::io::{self, Write};
use std::path::Path;

/// Writes a sheet as JSON, whole or not at all. Points are in the sheet's unit, +y down, in full precision.
pub fn write_drawing_json(path: &Path, sheet: &Sheet) -> Result<(), Error> {
    write_whole(path, |file| write(file, sheet))
}

fn write(file: &mut dyn Write, sheet: &Sheet) -> io::Result<()> {
    let unit = match sheet.unit {
        Unit::Pixel => "px",
        Unit::Millimetre => "mm",
    };
    write!(file, "{{\"schema\":\"hither.drawing/1\",\"version\":\"{}\",\"title\":", hither::VERSION)?;
    serde_json::to_writer(&mut *file, sheet.title)?;
    write!(file, ",\"unit\":\"{unit}\",\"width\":{},\"height\":{},\"views\":[", sheet.width, sheet.height)?;
    for (i, view) in sheet.views.iter().enumerate() {
        if i > 0 {
            file.write_all(b",")?;
        }
        write_view(file, sheet, view)?;
    }
    file.write_all(b"]}\n")
}

fn write_view(file: &mut dyn Write, sheet: &Sheet, view: &SheetView) -> io::Result<()> {
    file.write_all(b"{\"name\":")?;
    serde_json::to_writer(&mut *file, &view.name)?;
    file.write_all(b",\"strokes\":[")?;
    for (i, stroke) in view.drawing.strokes.iter().enumerate() {
        write!(file, "{}\n{{\"part\":{},\"name\":", if i > 0 { "," } else { "" }, stroke.part)?;
        serde_json::to_writer(&mut *file, sheet.part_name(stroke.part))?;
        write!(file, ",\"class\":\"{}\",\"covers\":{},\"points\":", stroke.kind.name(), stroke.covers)?;
        write_points(file, view, view.drawing.points_of(stroke))?;
        file.write_all(b"}")?;
    }
    file.write_all(b"],\"faces\":[")?;
    for (i, face) in view.drawing.faces.iter().enumerate() {
        write!(file, "{}\n{{\"part\":{},\"name\":", if i > 0 { "," } else { "" }, face.part)?;
        serde_json::to_writer(&mut *file, sheet.part_name(face.part))?;
        write!(file, ",\"triangle\":{},\"cut\":{},\"color\":", face.triangle, face.cut)?;
        serde_json::to_writer(&mut *file, &face.color)?;
        write!(file, ",\"opacity\":{},\"through\":", face.opacity)?;
        serde_json::to_writer(&mut *file, &face.through)?;
        file.write_all(b",\"contours\":[")?;
        for (k, contour) in face.contours.iter().enumerate() {
            if k > 0 {
                file.write_all(b",")?;
            }
            write_points(file, view, contour)?;
        }
        file.write_all(b"]}")?;
    }
    file.write_all(b"]}")
}

fn write_points(file: &mut dyn Write, view: &SheetView, points: &[DVec2]) -> io::Result<()> {
    file.write_all(b"[")?;
    for (i, &p) in points.iter().enumerate() {
        let at = view.place(p);
        write!(file, "{}[{},{}]", if i > 0 { "," } else { "" }, at.x, at.y)?;
    }
    file.write_all(b"]")
}
