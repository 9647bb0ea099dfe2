//! Layered pictures as OpenRaster files (freedesktop.org, version 0.0.6), which Krita, GIMP and MyPaint open.
//!
//! An archive of PNGs: one a layer, with its place in `stack.xml`, the merged picture, and a thumbnail. Layers are
//! 8-bit sRGB; a program that opens the file puts the visible ones over each other.

use crate::Error;
use crate::atomic::write_whole;
use crate::exr::LayerPicture;
use crate::png;
use std::fmt::Write as _;
use std::io::{self, Cursor, Write};
use std::path::Path;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

/// A thumbnail's longer side, pixels, at most.
const THUMBNAIL: u32 = 256;

/// Writes layers, front to back, and the picture they make, whole or not at all. `notes` are further files in the
/// archive, by name and content.
///
/// # Panics
/// If a picture's pixels are not as many as its size says.
pub fn write_openraster(
    path: &Path,
    (width, height): (u32, u32),
    layers: &[LayerPicture],
    merged: &[[f32; 4]],
    notes: &[(&str, &str)],
) -> Result<(), Error> {
    let archive = encode((width, height), layers, merged, notes).map_err(|source| Error::Io {
        path: path.to_owned(),
        action: "cannot encode",
        source,
    })?;
    write_whole(path, |out| out.write_all(&archive))
}

fn encode(
    (width, height): (u32, u32),
    layers: &[LayerPicture],
    merged: &[[f32; 4]],
    notes: &[(&str, &str)],
) -> io::Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    // Everything is stored: PNGs are compressed, and the first entry must be found by its bytes.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut file = |name: &str, content: &[u8]| -> io::Result<()> {
        zip.start_file(name, options).map_err(io::Error::other)?;
        zip.write_all(content)
    };
    file("mimetype", b"image/openraster")?;
    file("stack.xml", stack((width, height), layers).as_bytes())?;
    for (number, layer) in layers.iter().enumerate() {
        let (size, pixels) =
            if layer.pixels.is_empty() { ((1, 1), &[[0.0; 4]][..]) } else { (layer.size, layer.pixels) };
        file(&source(number), &picture(size, pixels)?)?;
    }
    file("mergedimage.png", &picture((width, height), merged)?)?;
    let (small, pixels) = thumbnail((width, height), merged);
    file("Thumbnails/thumbnail.png", &picture(small, &pixels)?)?;
    for (name, content) in notes {
        file(name, content.as_bytes())?;
    }
    Ok(zip.finish().map_err(io::Error::other)?.into_inner())
}

fn source(number: usize) -> String {
    format!("data/layer{number:04}.png")
}

fn picture((width, height): (u32, u32), pixels: &[[f32; 4]]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    png::encode(&mut bytes, width, height, pixels)?;
    Ok(bytes)
}

fn stack((width, height): (u32, u32), layers: &[LayerPicture]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(xml, "<image version=\"0.0.6\" w=\"{width}\" h=\"{height}\">\n <stack>");
    for (number, layer) in layers.iter().enumerate() {
        let visibility = if layer.visible { "visible" } else { "hidden" };
        let _ = writeln!(
            xml,
            "  <layer name=\"{}\" src=\"{}\" x=\"{}\" y=\"{}\" opacity=\"1.0\" visibility=\"{visibility}\" \
             composite-op=\"svg:src-over\"/>",
            escaped(layer.name),
            source(number),
            layer.position.0,
            layer.position.1,
        );
    }
    xml.push_str(" </stack>\n</image>\n");
    xml
}

/// Text as an attribute's value; characters that XML has no place for are left out.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => safe.push(c),
        }
    }
    safe
}

/// The picture shrunk to its thumbnail by averaging.
fn thumbnail((width, height): (u32, u32), pixels: &[[f32; 4]]) -> ((u32, u32), Vec<[f32; 4]>) {
    let step = width.max(height).div_ceil(THUMBNAIL).max(1);
    let size = (width.div_ceil(step), height.div_ceil(step));
    let mut small = Vec::with_capacity(size.0 as usize * size.1 as usize);
    for y in 0..size.1 {
        for x in 0..size.0 {
            let rows = y * step..((y + 1) * step).min(height);
            let columns = x * step..((x + 1) * step).min(width);
            let count = (rows.len() * columns.len()) as f32;
            let mut sum = [0.0f32; 4];
            for row in rows {
                for column in columns.clone() {
                    let pixel = pixels[(row * width + column) as usize];
                    sum.iter_mut().zip(pixel).for_each(|(s, c)| *s += c);
                }
            }
            small.push(sum.map(|s| s / count));
        }
    }
    (size, small)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn the_archive_opens_with_its_type_and_holds_every_layer() {
        let pixels = [[0.5, 0.0, 0.0, 1.0]; 6];
        let layer =
            |name, visible| LayerPicture { name, position: (1, 2), size: (3, 2), pixels: &pixels, visible };
        let empty = LayerPicture { pixels: &[], size: (0, 0), ..layer("nothing", true) };
        let layers = [layer("a <\"b\"> & c\u{1}", true), layer("second", false), empty];
        let merged = vec![[0.25; 4]; 400 * 300];
        let bytes = encode((400, 300), &layers, &merged, &[("hither/expression.txt", "a over b")]).unwrap();
        assert_eq!(&bytes[30..54], b"mimetypeimage/openraster");
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut read = |name: &str| {
            let mut content = Vec::new();
            archive.by_name(name).unwrap().read_to_end(&mut content).unwrap();
            content
        };
        let xml = String::from_utf8(read("stack.xml")).unwrap();
        assert!(
            xml.contains(
                "name=\"a &lt;&quot;b&quot;&gt; &amp; c\" src=\"data/layer0000.png\" x=\"1\" y=\"2\""
            )
        );
        assert!(xml.contains("visibility=\"hidden\""));
        assert_eq!(read("hither/expression.txt"), b"a over b");
        for (name, size) in [("data/layer0002.png", (1, 1)), ("Thumbnails/thumbnail.png", (200, 150))] {
            let decoder = ::png::Decoder::new(Cursor::new(read(name)));
            let reader = decoder.read_info().unwrap();
            assert_eq!((reader.info().width, reader.info().height), size);
        }
    }
}
