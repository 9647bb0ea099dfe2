//! Pictures as 8-bit sRGB PNG files, with straight alpha where anything is transparent.

use crate::Error;
use crate::atomic::write_whole;
use crate::srgb::Encoder;
use std::io;
use std::path::Path;

/// Writes a picture, whole or not at all.
///
/// `pixels` are linear premultiplied RGBA, row by row from the top, `width * height` of them. Each channel
/// is rounded to the nearest code; what is below 0 or above 1 is clamped, NaN becomes 0. The file is RGB if
/// every pixel is opaque after rounding, RGBA otherwise.
///
/// # Panics
/// If the number of pixels is not `width * height`.
pub fn write_png(path: &Path, width: u32, height: u32, pixels: &[[f32; 4]]) -> Result<(), Error> {
    write_whole(path, |out| encode(out, width, height, pixels))
}

/// Writes a picture's bytes; see [`write_png`].
pub(crate) fn encode(out: impl io::Write, width: u32, height: u32, pixels: &[[f32; 4]]) -> io::Result<()> {
    assert_eq!(
        pixels.len() as u64,
        u64::from(width) * u64::from(height),
        "pixels of a {width}x{height} picture"
    );
    let opaque = pixels.iter().all(|p| alpha_code(p[3]) == 255);
    let samples = if opaque { rgb(pixels) } else { rgba(pixels) };
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(into_io)?;
    writer.write_image_data(&samples).map_err(into_io)?;
    writer.finish().map_err(into_io)
}

fn into_io(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

fn alpha_code(alpha: f32) -> u8 {
    // A cast saturates, and takes NaN to 0.
    (alpha * 255.0).round() as u8
}

fn rgb(pixels: &[[f32; 4]]) -> Vec<u8> {
    let encoder = Encoder::get();
    let mut samples = Vec::with_capacity(pixels.len() * 3);
    for &pixel in pixels {
        let [r, g, b] = straight(pixel).map(|c| encoder.encode(c));
        samples.extend_from_slice(&[r, g, b]);
    }
    samples
}

fn rgba(pixels: &[[f32; 4]]) -> Vec<u8> {
    let encoder = Encoder::get();
    let mut samples = Vec::with_capacity(pixels.len() * 4);
    for &pixel in pixels {
        let [r, g, b] = straight(pixel).map(|c| encoder.encode(c));
        samples.extend_from_slice(&[r, g, b, alpha_code(pixel[3])]);
    }
    samples
}

/// Colour without the alpha that was multiplied in; where nothing is there, black.
fn straight([r, g, b, a]: [f32; 4]) -> [f32; 3] {
    if a == 1.0 {
        [r, g, b]
    } else if a > 0.0 {
        [r / a, g / a, b / a]
    } else {
        [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, width: u32, height: u32, pixels: &[[f32; 4]]) -> (png::ColorType, Vec<u8>) {
        let path = std::env::temp_dir().join(format!("hither-png-{name}-{}.png", std::process::id()));
        write_png(&path, width, height, pixels).unwrap();
        let decoder = png::Decoder::new(io::BufReader::new(std::fs::File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut samples).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!((info.width, info.height), (width, height));
        samples.truncate(info.buffer_size());
        (info.color_type, samples)
    }

    #[test]
    fn opaque_pictures_are_srgb_without_alpha() {
        let pixels = [[0.0, 0.5, 1.0, 1.0], [0.214_041_14, 2.0, f32::NAN, 1.0]];
        let (kind, samples) = written("opaque", 2, 1, &pixels);
        assert_eq!(kind, png::ColorType::Rgb);
        assert_eq!(samples, [0, 188, 255, 128, 255, 0]);
    }

    #[test]
    fn alpha_is_divided_out_before_encoding() {
        let pixels = [[0.25, 0.0, 0.5, 0.5], [0.3, 0.3, 0.3, 0.0], [0.0, 0.0, 0.0, 0.999]];
        let (kind, samples) = written("alpha", 1, 3, &pixels);
        assert_eq!(kind, png::ColorType::Rgba);
        assert_eq!(samples, [188, 0, 255, 128, 0, 0, 0, 0, 0, 0, 0, 255]);
    }
}
