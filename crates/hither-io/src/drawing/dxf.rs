//! DXF, release 12, text: a layer for each class of lines, polylines with +y up.
//!
//! Release 12 is read by every CAD program. Hidden lines are on layers with a dashed line type. A line's part
//! is told by the comment (group 999) before its first polyline.

use super::{Sheet, SheetView, Unit};
use crate::{Error, write_whole};
use hither::hidden_line::{Kind, Stroke};
use std::io::{self, Write};
use std::path::Path;

/// Writes a sheet as DXF, whole or not at all. Faces are not written.
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
        for stroke in &view.drawing.strokes {
            if part != Some(stroke.part) {
                part = Some(stroke.part);
                let name: String =
                    sheet.part_name(stroke.part).chars().filter(|c| !c.is_control()).take(200).collect();
                write!(file, "999\n{} part {} {name}\n", view.name, stroke.part)?;
            }
            write_stroke(file, sheet, view, stroke)?;
        }
    }
    write!(file, "0\nENDSEC\n0\nEOF\n")
}

fn write_tables(file: &mut dyn Write) -> io::Result<()> {
    write!(file, "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLTYPE\n70\n2\n")?;
    write!(file, "0\nLTYPE\n2\nCONTINUOUS\n70\n0\n3\nSolid line\n72\n65\n73\n0\n40\n0\n")?;
    write!(
        file,
        "0\nLTYPE\n2\nHIDDEN\n70\n0\n3\n_ _ _ _\n72\n65\n73\n2\n40\n3.6\n49\n2.4\n49\n-1.2\n0\nENDTAB\n"
    )?;
    write!(file, "0\nTABLE\n2\nLAYER\n70\n{}\n", Kind::ALL.len() * 2)?;
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
    write!(file, "0\nPOLYLINE\n8\n{layer}\n66\n1\n70\n{}\n10\n0\n20\n0\n30\n0\n", u8::from(closed))?;
    for &p in points {
        let at = view.place(p);
        write!(file, "0\nVERTEX\n8\n{layer}\n10\n{:.6}\n20\n{:.6}\n30\n0\n", at.x, sheet.height - at.y)?;
    }
    write!(file, "0\nSEQEND\n8\n{layer}\n")
}

fn layer(kind: Kind, hidden: bool) -> String {
    let prefix = if hidden { "HIDDEN" } else { "VISIBLE" };
    format!("{prefix}_{}", kind.name().to_uppercase())
}
