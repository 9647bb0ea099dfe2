//! Colours that tell neighbours apart. They decide nothing that is visible or hidden.

use glam::Vec4;
use hither::scene::Material;

/// A single-sided opaque material. `srgb` is what a screen shows for it.
pub(crate) fn paint(name: &str, srgb: u32) -> Material {
    Material { name: name.to_owned(), base_color: linear(srgb), ..Material::default() }
}

/// A linear colour from sRGB written as 0xRRGGBB.
pub(crate) fn linear(srgb: u32) -> Vec4 {
    let channel = |shift: u32| {
        let s = f64::from((srgb >> shift) & 0xff) / 255.0;
        let l = if s <= 0.04045 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) };
        l as f32
    };
    Vec4::new(channel(16), channel(8), channel(0), 1.0)
}

/// Muted, well-told-apart colours, as linear factors; the same for the same number.
pub(crate) fn tint(number: u32) -> Vec4 {
    const TINTS: [u32; 12] = [
        0xc8553d, 0x588b8b, 0xf28f3b, 0x7a6c5d, 0x93b7be, 0xd5b942, 0x6a7fdb, 0x8f5c78, 0xb5c99a, 0xe0d8c8,
        0x4f6d7a, 0xa44a3f,
    ];
    // A multiplicative hash, so that consecutive numbers do not cycle through the list in order.
    let at = (number.wrapping_mul(2_654_435_761) >> 16) as usize % TINTS.len();
    linear(TINTS[at])
}
