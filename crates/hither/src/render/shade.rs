//! Shading, deferred: once a pixel, from the ids and depth of a finished frame.

use super::Frame;
use crate::index::SceneIndex;

/// How a picture is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Base colour and a headlight on the face's own plane.
    Flat,
    /// Base colour and a headlight on interpolated normals.
    #[default]
    Smooth,
    /// A colour for each instance.
    Ids,
    /// Distance as grey.
    Depth,
    /// Normals as colours.
    Normals,
    /// Log-scale picture of where the work was done [Greene 1995, fig. 3.8].
    Complexity,
}

/// A picture: rows from the top, linear premultiplied RGBA.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Row by row.
    pub pixels: Vec<[f32; 4]>,
}

/// Shades a finished frame of `index` in its present pose.
pub fn shade(_index: &SceneIndex, frame: &Frame, _shading: Shading) -> Image {
    let (width, height) = (frame.view.width, frame.view.height);
    Image { width, height, pixels: vec![[0.0; 4]; width as usize * height as usize] }
}
