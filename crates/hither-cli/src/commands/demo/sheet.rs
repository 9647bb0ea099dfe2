//! A contact sheet: pictures of one size, small, in rows.

use crate::failure::Failure;
use hither::render::Image;
use std::path::Path;

/// Pictures in a row.
const COLUMNS: usize = 3;
/// A side of a picture becomes this many times smaller.
const SHRINK: u32 = 3;
/// White pixels around each.
const GAP: u32 = 6;

/// Writes `pictures`, all of one size, as one picture on white.
pub fn write(pictures: &[Image], path: &Path) -> Result<(), Failure> {
    let Some(first) = pictures.first() else { return Ok(()) };
    let (width, height) = (first.width / SHRINK, first.height / SHRINK);
    let rows = pictures.len().div_ceil(COLUMNS) as u32;
    let sheet_width = COLUMNS as u32 * (width + GAP) + GAP;
    let sheet_height = rows * (height + GAP) + GAP;
    let mut sheet = vec![[1.0f32; 4]; (sheet_width * sheet_height) as usize];
    for (i, picture) in pictures.iter().enumerate() {
        let left = GAP + (i % COLUMNS) as u32 * (width + GAP);
        let top = GAP + (i / COLUMNS) as u32 * (height + GAP);
        for y in 0..height {
            for x in 0..width {
                let at = (top + y) * sheet_width + left + x;
                sheet[at as usize] = over_white(average(picture, x * SHRINK, y * SHRINK));
            }
        }
    }
    Ok(hither_io::write_png(path, sheet_width, sheet_height, &sheet)?)
}

/// Mean of the `SHRINK` × `SHRINK` pixels from (x, y) on.
fn average(picture: &Image, x: u32, y: u32) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for row in y..y + SHRINK {
        for column in x..x + SHRINK {
            let pixel = picture.pixels[(row * picture.width + column) as usize];
            for (sum, channel) in sum.iter_mut().zip(pixel) {
                *sum += channel;
            }
        }
    }
    sum.map(|channel| channel / (SHRINK * SHRINK) as f32)
}

fn over_white(pixel: [f32; 4]) -> [f32; 4] {
    pixel.map(|channel| channel + 1.0 - pixel[3])
}
