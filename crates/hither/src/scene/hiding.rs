//! Which masks cut holes: one whose alpha is nowhere below its cutoff hides as if it were opaque.

use super::{AlphaMode, Material, Mesh, Scene};

/// The materials of a scene, those as opaque ones whose mask cannot have a hole. Exporters write masks everywhere, and
/// a mask is asked about at every pixel, and hides nothing for certain.
pub(crate) struct HidingMaterials<'a> {
    all: &'a [Material],
    without_holes: Vec<Material>,
}

impl<'a> HidingMaterials<'a> {
    /// Looks at every texel of the textures of masked materials.
    pub fn new(scene: &'a Scene) -> HidingMaterials<'a> {
        let mut without_holes = scene.materials.clone();
        for material in &mut without_holes {
            if let AlphaMode::Mask { cutoff } = material.alpha
                && is_whole(scene, material, cutoff)
            {
                material.alpha = AlphaMode::Opaque;
            }
        }
        HidingMaterials { all: &scene.materials, without_holes }
    }

    /// Those of a mesh: alpha of its vertices may cut holes, too.
    pub fn of(&self, mesh: &Mesh) -> &[Material] {
        if mesh.colors.iter().all(|c| c.w >= 1.0) { &self.without_holes } else { self.all }
    }
}

/// Whether alpha reaches the cutoff everywhere where that of vertices is 1 or more. A filtered texel is a mean of texels,
/// up to roundings, for which there is room.
fn is_whole(scene: &Scene, material: &Material, cutoff: f32) -> bool {
    let least = material.texture.map_or(255, |how| {
        let texels = scene.textures[how.texture as usize].texels.iter();
        texels.map(|texel| texel[3]).min().unwrap_or(0)
    });
    f64::from(material.base_color.w) * f64::from(least) / 255.0 > f64::from(cutoff) * (1.0 + 1e-6) + 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, Texture, TextureRef, Wrap};
    use glam::{DAffine2, Vec4};

    fn scene(alpha: [u8; 2], factor: f32, cutoff: f32) -> Scene {
        let how = TextureRef {
            texture: 0,
            transform: DAffine2::IDENTITY,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
        };
        let masked = Material {
            base_color: Vec4::new(1.0, 1.0, 1.0, factor),
            texture: Some(how),
            alpha: AlphaMode::Mask { cutoff },
            ..Material::default()
        };
        let texels = alpha.map(|a| [0, 0, 0, a]).to_vec();
        let texture = Texture { name: String::new(), width: 2, height: 1, texels };
        let bare = Material { texture: None, ..masked.clone() };
        Scene { materials: vec![masked, bare], textures: vec![texture], ..Scene::default() }
    }

    #[test]
    fn a_mask_that_cuts_nothing_is_opaque() {
        let opaque = |alpha, factor, cutoff, mesh: &Mesh| {
            let scene = scene(alpha, factor, cutoff);
            let hiding = HidingMaterials::new(&scene);
            [0, 1].map(|m| hiding.of(mesh)[m].alpha == AlphaMode::Opaque)
        };
        let plain = Mesh::default();
        assert_eq!(opaque([255, 255], 1.0, 0.5, &plain), [true, true]);
        assert_eq!(opaque([255, 129], 1.0, 0.5, &plain), [true, true]);
        assert_eq!(opaque([255, 127], 1.0, 0.5, &plain), [false, true]);
        assert_eq!(opaque([255, 255], 0.4, 0.5, &plain), [false, false]);
        // Just enough may be too little after rounding; and what is no number is a hole.
        assert_eq!(opaque([255, 255], 1.0, 1.0, &plain), [false, false]);
        assert_eq!(opaque([255, 255], f32::NAN, 0.5, &plain), [false, false]);
        assert_eq!(opaque([255, 255], 1.0, -1.0, &plain), [true, true]);
        let faded = Mesh { colors: vec![Vec4::ONE, Vec4::new(1.0, 1.0, 1.0, 0.9)], ..Mesh::default() };
        assert_eq!(opaque([255, 255], 1.0, 0.5, &faded), [false, false]);
    }
}
