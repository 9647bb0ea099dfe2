//! Pictures as OpenEXR files: linear colour, and of the surface seen its distance and its ids, lossless.

use crate::Error;
use crate::atomic::write_whole;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, Layer,
    LayerAttributes, SmallVec, SpecificChannels, Text, Vec2, WritableImage, f16,
};
use hither::conventions::SurfaceId;
use std::io::{self, Cursor};
use std::path::Path;

/// What an EXR file is made of: rows from the top, `width * height` values a list.
#[derive(Clone, Copy, Debug)]
pub struct ExrImage<'a> {
    /// Width, pixels, at least 1.
    pub width: u32,
    /// Height, pixels, at least 1.
    pub height: u32,
    /// Linear premultiplied RGBA: channels `R`, `G`, `B`, `A`.
    pub pixels: &'a [[f32; 4]],
    /// Whether these four channels are written in 16 bits instead of 32; `Z` never is.
    pub half: bool,
    /// Distance along the view axis, metres, of the nearest opaque or masked surface, +∞ where there is
    /// none: channel `Z`. Empty: no such channel.
    pub distances: &'a [f32],
    /// Ids of that surface, [`NO_ID`](hither::conventions::NO_ID) where there is none: 32-bit integer
    /// channels `instance` and `triangle`. Empty: no such channels.
    pub surfaces: &'a [SurfaceId],
}

/// Writes an EXR file, whole or not at all: one part of scan lines, ZIP-compressed.
///
/// # Panics
/// If a list that is not empty has another length than `width * height`.
pub fn write_exr(path: &Path, image: &ExrImage) -> Result<(), Error> {
    // The format keeps its table of offsets ahead of the pixels, so it is made in memory and then written.
    let encoded = encode(image).map_err(|source| Error::Io {
        path: path.to_owned(),
        action: "cannot encode",
        source,
    })?;
    write_whole(path, |out| out.write_all(&encoded))
}

fn encode(image: &ExrImage) -> io::Result<Vec<u8>> {
    let count = image.width as usize * image.height as usize;
    let expect = |len: usize| assert_eq!(len, count, "values of a {}x{} picture", image.width, image.height);
    expect(image.pixels.len());
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (name, at) in [("R", 0), ("G", 1), ("B", 2), ("A", 3)] {
        let values = image.pixels.iter().map(|p| p[at]);
        let samples = if image.half {
            FlatSamples::F16(values.map(f16::from_f32).collect())
        } else {
            FlatSamples::F32(values.collect())
        };
        channels.push(channel(name, samples));
    }
    if !image.distances.is_empty() {
        expect(image.distances.len());
        channels.push(channel("Z", FlatSamples::F32(image.distances.to_vec())));
    }
    if !image.surfaces.is_empty() {
        expect(image.surfaces.len());
        let ids = |of: fn(&SurfaceId) -> u32| FlatSamples::U32(image.surfaces.iter().map(of).collect());
        channels.push(channel("instance", ids(|s| s.instance)));
        channels.push(channel("triangle", ids(|s| s.triangle)));
    }
    let software_name = Some(Text::from(concat!("hither ", env!("CARGO_PKG_VERSION"))));
    let attributes = LayerAttributes { software_name, ..LayerAttributes::default() };
    let size = (image.width as usize, image.height as usize);
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut encoded = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut encoded).map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })?;
    Ok(encoded.into_inner())
}

/// A named picture within a larger one, cut to what it covers.
#[derive(Clone, Copy, Debug)]
pub struct LayerPicture<'a> {
    /// The layer's name; names need not differ.
    pub name: &'a str,
    /// Column and row of its top left pixel.
    pub position: (u32, u32),
    /// Width and height, pixels, perhaps 0.
    pub size: (u32, u32),
    /// Linear premultiplied RGBA, row by row.
    pub pixels: &'a [[f32; 4]],
    /// Whether a program that shows all layers over each other is to show it.
    pub visible: bool,
}

/// Writes a picture and its layers, front to back, as the parts of one EXR file, whole or not at all; `notes` become text
/// attributes of the file. Parts are named `NNN name`, for EXR wants names to differ; names of more than 200 bytes are cut.
///
/// The picture is the first of `layers`: its channels are `R`, `G`, `B`, `A`, for programs that know no layers. Those of
/// a layer are `NNN name.Combined.R` and so on, and every part has a value for every pixel: Blender tells layers by
/// these names alone, and takes all parts to be where the first is.
pub fn write_exr_layers(
    path: &Path,
    (width, height): (u32, u32),
    layers: &[LayerPicture],
    notes: &[(&str, &str)],
) -> Result<(), Error> {
    let encoded = encode_layers((width, height), layers, notes).map_err(|source| Error::Io {
        path: path.to_owned(),
        action: "cannot encode",
        source,
    })?;
    write_whole(path, |out| out.write_all(&encoded))
}

fn encode_layers(
    (width, height): (u32, u32),
    layers: &[LayerPicture],
    notes: &[(&str, &str)],
) -> io::Result<Vec<u8>> {
    let size = (width as usize, height as usize);
    let parts = layers.iter().copied().enumerate().map(|(number, layer)| {
        let name = format!("{number:03} {}", shortened(layer.name));
        let channel = |channel: &str| match number {
            0 => Text::from(channel),
            _ => text(&format!("{name}.Combined.{channel}")),
        };
        let pixel = move |at: Vec2<usize>| {
            let inside = |at: usize, from: u32, size: u32| {
                at.checked_sub(from as usize).filter(|&i| i < size as usize)
            };
            let column = inside(at.x(), layer.position.0, layer.size.0);
            let row = inside(at.y(), layer.position.1, layer.size.1);
            let place = row.zip(column).map(|(row, column)| row * layer.size.0 as usize + column);
            let [r, g, b, a] = place.map_or([0.0; 4], |place| layer.pixels[place]);
            (r, g, b, a)
        };
        let channels = SpecificChannels::build();
        let channels = channels.with_channel(channel("R")).with_channel(channel("G"));
        let channels = channels.with_channel(channel("B")).with_channel(channel("A")).with_pixel_fn(pixel);
        let mut attributes = LayerAttributes::named(text(&name));
        attributes.software_name = Some(Text::from(concat!("hither ", env!("CARGO_PKG_VERSION"))));
        Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels)
    });
    let parts: Vec<_> = parts.collect();
    let mut attributes = ImageAttributes::with_size(size);
    for (name, value) in notes {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    let mut encoded = Cursor::new(Vec::new());
    Image::from_layers(attributes, parts).write().to_buffered(&mut encoded).map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })?;
    Ok(encoded.into_inner())
}

/// Longer names are cut: with what is added to them, names of channels are to have no more than 255 bytes.
const LONGEST_NAME: usize = 200;

/// A layer's name, or as much of it as there is room for.
fn shortened(name: &str) -> String {
    match name.len() {
        ..=LONGEST_NAME => name.to_owned(),
        _ => format!("{}…", &name[..name.floor_char_boundary(LONGEST_NAME)]),
    }
}

/// UTF-8, as OpenEXR has it; where bytes end in 0, a 0 cannot be among them.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.replace('\0', " ").as_bytes())
}

fn channel(name: &str, samples: FlatSamples) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, samples)
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use hither::conventions::NO_ID;

    #[test]
    fn every_channel_comes_back_bit_for_bit() {
        let (width, height) = (67, 45);
        let count = (width * height) as usize;
        let pixels: Vec<[f32; 4]> =
            (0..count).map(|i| [i as f32 * 0.37, -1.5, f32::MIN_POSITIVE, 1.0]).collect();
        let distances: Vec<f32> =
            (0..count).map(|i| if i % 3 == 0 { f32::INFINITY } else { 1.0 / (i as f32 + 0.1) }).collect();
        let surfaces: Vec<SurfaceId> = (0..count as u32)
            .map(|i| SurfaceId {
                instance: if i % 3 == 0 { NO_ID } else { i },
                triangle: i.wrapping_mul(0x9e37_79b9),
            })
            .collect();
        for half in [false, true] {
            let image =
                ExrImage { width, height, pixels: &pixels, half, distances: &distances, surfaces: &surfaces };
            let encoded = encode(&image).unwrap();
            let back = read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .first_valid_layer()
                .all_attributes()
                .from_buffered(Cursor::new(encoded))
                .unwrap();
            let names: Vec<String> =
                back.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
            assert_eq!(names, ["A", "B", "G", "R", "Z", "instance", "triangle"]);
            let channel = |name: &str| {
                let found = back.layer_data.channel_data.list.iter().find(|c| c.name.eq(name));
                found.map(|c| c.sample_data.clone()).unwrap()
            };
            let red: Vec<f32> = channel("R").values_as_f32().collect();
            let expected = pixels.iter().map(|p| if half { f16::from_f32(p[0]).to_f32() } else { p[0] });
            assert!(red.into_iter().eq(expected));
            assert_eq!(channel("Z"), FlatSamples::F32(distances.clone()));
            assert_eq!(channel("instance"), FlatSamples::U32(surfaces.iter().map(|s| s.instance).collect()));
            assert_eq!(channel("triangle"), FlatSamples::U32(surfaces.iter().map(|s| s.triangle).collect()));
        }
    }

    #[test]
    fn layers_have_names_of_their_own_and_a_value_for_every_pixel() {
        let whole: Vec<[f32; 4]> = (0..30).map(|i| [i as f32, 0.5, 0.25, 1.0]).collect();
        let picture =
            LayerPicture { name: "composite", position: (0, 0), size: (6, 5), pixels: &whole, visible: true };
        let cut =
            LayerPicture { name: "wall.001", position: (2, 1), size: (3, 2), pixels: &whole[..6], ..picture };
        let empty = LayerPicture { name: "b", position: (0, 0), size: (0, 0), pixels: &[], ..picture };
        let encoded = encode_layers((6, 5), &[picture, cut, empty], &[("expression", "a over b")]).unwrap();
        let back = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(encoded))
            .unwrap();
        let values = |layer: usize, name: &str| -> Vec<f32> {
            let layer = &back.layer_data[layer];
            assert_eq!((layer.size, layer.attributes.layer_position), (Vec2(6, 5), Vec2(0, 0)));
            let found = layer.channel_data.list.iter().find(|c| c.name.eq(name));
            found.unwrap().sample_data.values_as_f32().collect()
        };
        assert_eq!(values(0, "R"), (0..30).map(|i| i as f32).collect::<Vec<_>>());
        let red = values(1, "001 wall.001.Combined.R");
        assert_eq!((red[8], red[9], red[16], red.iter().sum::<f32>()), (0.0, 1.0, 5.0, 15.0));
        assert_eq!(values(1, "001 wall.001.Combined.A").iter().sum::<f32>(), 6.0);
        assert_eq!(values(2, "002 b.Combined.A"), [0.0; 30]);
    }

    #[test]
    fn long_names_are_cut_and_all_are_utf_8() {
        let (name, pixels) = ("été 日本 ".repeat(30), [[1.0; 4]]);
        let layer =
            LayerPicture { name: &name, position: (0, 0), size: (1, 1), pixels: &pixels, visible: true };
        let encoded = encode_layers((1, 1), &[layer, layer], &[("expression", "über")]).unwrap();
        assert!(encoded.windows(5).any(|bytes| bytes == "über".as_bytes()));
        let back =
            read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        let back = back.from_buffered(Cursor::new(encoded)).unwrap();
        for channel in &back.layer_data[1].channel_data.list {
            let bytes = channel.name.as_slice();
            let text = std::str::from_utf8(bytes).unwrap();
            assert!(bytes.len() <= 255 && text.starts_with("001 été 日本 "), "{} bytes, {text}", bytes.len());
        }
    }
}
