//! Line drawings out: SVG for looking, printing and plotting, DXF for CAD, JSON for programs.
//!
//! A [`Sheet`] places one or more drawings on paper that is measured in pixels or in millimetres.

mod dxf;
mod json;
mod palette;
mod svg;

pub use dxf::write_dxf;
pub use json::write_drawing_json;
pub use svg::write_svg;

use glam::DVec2;
use hither::hidden_line::Drawing;

/// What a sheet is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// CSS pixels, 1/96 inch.
    Pixel,
    /// Millimetres.
    Millimetre,
}

/// Drawings on a sheet of paper.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// What it shows, for a title; possibly empty.
    pub title: &'a str,
    /// Width, in the sheet's unit.
    pub width: f64,
    /// Height, in the sheet's unit.
    pub height: f64,
    /// The unit.
    pub unit: Unit,
    /// The drawings.
    pub views: Vec<SheetView<'a>>,
    /// Names of the parts, by number; parts beyond the end have none.
    pub part_names: &'a [String],
    /// Lines to put into the SVG's stylesheet, after its own.
    pub style: &'a str,
}

/// A drawing and its place on the sheet.
#[derive(Clone, Debug)]
pub struct SheetView<'a> {
    /// What the view is called, for example `front`; possibly empty.
    pub name: String,
    /// The drawing, in its own pixels.
    pub drawing: &'a Drawing,
    /// Where its upper left corner is, in the sheet's unit.
    pub origin: DVec2,
    /// Units of the sheet to a pixel of the drawing.
    pub scale: f64,
}

impl SheetView<'_> {
    /// Where a point of the drawing is on the sheet, +y down.
    pub(crate) fn place(&self, p: DVec2) -> DVec2 {
        self.origin + p * self.scale
    }
}

impl Sheet<'_> {
    /// The name of a part, possibly empty.
    pub(crate) fn part_name(&self, part: u32) -> &str {
        self.part_names.get(part as usize).map_or("", String::as_str)
    }
}

/// Appends a number of thousandths (or other parts) as a decimal number without needless digits.
pub(crate) fn push_fixed(text: &mut Vec<u8>, value: i64, digits: usize) {
    if value == 0 {
        text.push(b'0');
        return;
    }
    if value < 0 {
        text.push(b'-');
    }
    let mut rest = value.unsigned_abs();
    let (mut left, mut started) = (digits, false);
    let mut buffer = [0u8; 24];
    let mut at = buffer.len();
    loop {
        let digit = (rest % 10) as u8;
        rest /= 10;
        let fraction = left > 0;
        if !fraction || digit != 0 || started {
            at -= 1;
            buffer[at] = b'0' + digit;
            started = true;
        }
        if fraction {
            left -= 1;
            if left == 0 {
                if started {
                    at -= 1;
                    buffer[at] = b'.';
                }
                started = true;
                if rest == 0 {
                    break;
                }
            }
        } else if rest == 0 {
            break;
        }
    }
    text.extend_from_slice(&buffer[at..]);
}

#[cfg(test)]
mod tests;
