//! Images inside or beside a model, decoded to textures; a few bytes cannot ask for much memory.

use crate::Error;
use crate::input;
use hither::scene::{LINEAR_FROM_SRGB, Texture};
use image::{ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// The largest side of a texture, pixels.
const MAX_SIDE: u32 = 16_384;

/// The most pixels of a texture: 512 MiB decoded.
const MAX_PIXELS: u64 = 1 << 27;

/// What a file may claim however short it is: WebP spends nothing on the pixels of a single colour.
const FREE_PIXELS: u64 = 1 << 22;

/// Beyond that, no more than the tightest packing of the other formats: 1-bit PNG under deflate, 8 × 1032.
const MAX_PIXELS_PER_BYTE: u64 = 8256;

/// The most pixels of all textures of a model together: 2 GiB decoded.
const MAX_ALL_PIXELS: u64 = 1 << 29;

/// What the textures of one model may still take.
pub(crate) struct Budget {
    pixels: u64,
}

impl Default for Budget {
    fn default() -> Self {
        Budget { pixels: MAX_ALL_PIXELS }
    }
}

impl Budget {
    /// Takes off what the image in `bytes` will need, or says that it is too much. An image whose size cannot
    /// be told costs nothing: it cannot be decoded either.
    pub(crate) fn pay(&mut self, bytes: &[u8]) -> Result<(), String> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
        let size = reader.ok().and_then(|r| r.into_dimensions().ok());
        let pixels = size.map_or(0, |(width, height)| u64::from(width) * u64::from(height));
        match self.pixels.checked_sub(pixels) {
            Some(left) => {
                self.pixels = left;
                Ok(())
            }
            None => Err("all images together are larger than 2 GiB; make them smaller".into()),
        }
    }
}

/// Decodes a PNG, JPEG or WebP file; its first bytes decide which. On failure one line that says why.
pub(crate) fn decode(name: &str, bytes: &[u8]) -> Result<Texture, String> {
    let reader = || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string());
    if reader()?.format().is_none() {
        return Err("it is not a PNG, JPEG or WebP image".into());
    }
    let (width, height) = reader()?.into_dimensions().map_err(|e| one_line(&e))?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || width > MAX_SIDE || height > MAX_SIDE || pixels > MAX_PIXELS {
        return Err(format!(
            "its size of {width}x{height} pixels is out of range; sides reach {MAX_SIDE}, areas {MAX_PIXELS}"
        ));
    }
    if pixels > FREE_PIXELS + MAX_PIXELS_PER_BYTE * bytes.len() as u64 {
        return Err(format!(
            "it claims {width}x{height} pixels, more than its {} bytes can hold",
            bytes.len()
        ));
    }
    let mut decoder = reader()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    // 16 bits a channel in the file, and as much again for the decoder's own needs.
    limits.max_alloc = Some(16 * pixels + (64 << 20));
    decoder.limits(limits);
    let decoded = decoder.decode().map_err(|e| one_line(&e))?.into_rgba8();
    let texels = decoded.as_raw().as_chunks::<4>().0.to_vec();
    Ok(Texture { name: name.to_owned(), width, height, texels })
}

/// Reads a PNG, JPEG or WebP picture: width, height, and linear premultiplied RGBA, row by row.
pub fn read_picture(path: &Path) -> Result<(u32, u32, Vec<[f32; 4]>), Error> {
    let bytes = input::read(path)?;
    let texture =
        decode("picture", &bytes).map_err(|message| Error::Malformed { path: path.to_owned(), message })?;
    let linear = |[r, g, b, a]: [u8; 4]| {
        let alpha = f32::from(a) / 255.0;
        let channel = |code: u8| LINEAR_FROM_SRGB[usize::from(code)] * alpha;
        [channel(r), channel(g), channel(b), alpha]
    };
    Ok((texture.width, texture.height, texture.texels.into_iter().map(linear).collect()))
}

fn one_line(error: &image::ImageError) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A PNG file of the given RGBA texels.
    pub(crate) fn png_of(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.write_header().unwrap().write_image_data(texels.as_flattened()).unwrap();
        bytes
    }

    #[test]
    fn texels_come_back() {
        let texels = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12], [0, 0, 0, 0], [255; 4], [1; 4]];
        let texture = decode("t", &png_of(3, 2, &texels)).unwrap();
        assert_eq!((texture.width, texture.height, texture.texels.as_slice()), (3, 2, &texels[..]));
    }

    #[test]
    fn all_textures_together_have_a_limit() {
        let mut budget = Budget { pixels: 7 };
        let image = png_of(3, 2, &[[0; 4]; 6]);
        assert!(budget.pay(&image).is_ok() && budget.pay(b"no image").is_ok());
        assert!(budget.pay(&image).is_err() && budget.pay(&png_of(1, 1, &[[0; 4]])).is_ok());
    }

    #[test]
    fn what_is_no_image_or_too_large_is_refused_in_one_line() {
        let good = png_of(1, 1, &[[0; 4]]);
        let mut huge = good.clone();
        huge[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x20, 0]);
        for bytes in [&b""[..], b"BM not read", &good[..good.len() / 2], &huge] {
            let text = decode("t", bytes).unwrap_err();
            assert!(!text.is_empty() && !text.contains('\n'), "{text}");
        }
    }
}
