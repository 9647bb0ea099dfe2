//! Materials and the images that they use.

use super::build::*;
use crate::Loaded;
use crate::gltf::from_bytes;
use crate::texture::tests::png_of;
use glam::{DVec2, Vec2, Vec4};
use hither::scene::{AlphaMode, Filter, Wrap};
use serde_json::{Value, json};
use std::cell::Cell;
use std::path::Path;

const RED: [u8; 4] = [255, 0, 0, 255];

/// A square with two sets of texture coordinates and one material with a 1x1 texture.
fn textured() -> Build {
    let mut build = square();
    let near = build.floats(&[[0.25f32, 0.25]; 4]);
    let far = build.floats(&[[0.75f32, 0.75]; 4]);
    let image = build.view(&png_of(1, 1, &[RED]), None);
    build.push("images", json!({ "name": "red", "bufferView": image, "mimeType": "image/png" }));
    build.push("samplers", json!({ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }));
    build.push("textures", json!({ "source": 0, "sampler": 0 }));
    build.push(
        "materials",
        json!({ "name": "paint", "pbrMetallicRoughness": {
        "baseColorFactor": [1, 0.5, 0.25, 0.125],
        "baseColorTexture": { "index": 0, "texCoord": 1 } } }),
    );
    let primitive = &mut build.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = near.into();
    primitive["attributes"]["TEXCOORD_1"] = far.into();
    primitive["material"] = 0.into();
    build
}

#[test]
fn the_material_chooses_the_texture_coordinates() {
    let mut build = textured();
    let scene = build.scene();
    let material = &scene.materials[0];
    assert_eq!(material.base_color, Vec4::new(1.0, 0.5, 0.25, 0.125));
    let reference = material.texture.unwrap();
    assert_eq!((reference.wrap, reference.filter), ([Wrap::Clamp, Wrap::Mirror], Filter::Nearest));
    assert_eq!((scene.textures[0].name.as_str(), &scene.textures[0].texels[..]), ("red", &[RED][..]));
    assert_eq!(scene.meshes[0].uvs, [Vec2::splat(0.75); 4]);

    let transform =
        json!({ "KHR_texture_transform": { "offset": [0.5, 0], "scale": [2, 2], "texCoord": 0 } });
    build.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = transform;
    let scene = build.scene();
    assert_eq!(scene.meshes[0].uvs, [Vec2::splat(0.25); 4]);
    let transform = scene.materials[0].texture.unwrap().transform;
    assert_eq!(transform.transform_point2(DVec2::new(1.0, 1.0)), DVec2::new(2.5, 2.0));

    build.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] =
        json!({ "index": 0, "texCoord": 7 });
    let (scene, odd) = build.odd_scene();
    assert!(scene.meshes[0].uvs.is_empty() && odd[0].contains("lacks the texture coordinates"), "{odd:?}");

    // Beside one that has them, it is drawn as alone.
    build.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 0.into();
    let mut bare = build.json["meshes"][0]["primitives"][0].clone();
    bare["attributes"].as_object_mut().unwrap().retain(|name, _| !name.starts_with("TEXCOORD"));
    build.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(bare);
    let (scene, odd) = build.odd_scene();
    let mesh = &scene.meshes[0];
    let is_textured = |t: usize| {
        let material = mesh.material_of(t as u32).unwrap();
        scene.materials[material as usize].texture.is_some()
    };
    assert!(is_textured(0) && !is_textured(mesh.triangles.len() - 1) && odd.len() == 1, "{odd:?}");
}

#[test]
fn alpha_modes_and_sides() {
    let mut build = textured();
    for (change, alpha) in [
        (json!({}), AlphaMode::Opaque),
        (json!({ "alphaMode": "MASK" }), AlphaMode::Mask { cutoff: 0.5 }),
        (json!({ "alphaMode": "MASK", "alphaCutoff": 0.25 }), AlphaMode::Mask { cutoff: 0.25 }),
        (json!({ "alphaMode": "BLEND", "doubleSided": true }), AlphaMode::Blend),
    ] {
        build.json["materials"][0] = change;
        let material = &build.scene().materials[0];
        assert_eq!((material.alpha, material.double_sided), (alpha, alpha == AlphaMode::Blend));
    }
    build.json["materials"][0] = json!({ "alphaMode": "ADD" });
    assert!(build.odd_scene().1[0].contains("\"ADD\" is unknown"));
}

#[test]
fn the_older_model_lends_its_diffuse_colour() {
    let mut build = textured();
    build.json["materials"][0] = json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.5, 0.5, 1], "diffuseTexture": { "index": 0 } } } });
    build.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    let scene = build.scene();
    assert_eq!(scene.materials[0].base_color, Vec4::new(0.5, 0.5, 0.5, 1.0));
    assert!(scene.materials[0].texture.is_some());
}

#[test]
fn images_that_cannot_be_had_are_left_out() {
    let whole = textured();
    for (image, part) in [
        (json!({ "bufferView": 0 }), "image 0: it is not a PNG, JPEG or WebP image; the texture is left out"),
        (json!({ "bufferView": 99 }), "buffer view 99"),
        (json!({}), "neither a URI nor a buffer view"),
        (json!({ "uri": "missing.png" }), "image 0 \"missing.png\": there is no missing.png"),
        (json!({ "uri": "https://example.com/a.png" }), "only files in the model's folder"),
    ] {
        let mut build = whole.clone();
        build.json["images"][0] = image;
        let (scene, odd) = build.odd_scene();
        assert_eq!((scene.textures.len(), scene.materials[0].texture), (0, None));
        assert!(odd.len() == 1 && odd[0].contains(part), "{odd:?}");
    }
    for (texture, part) in [
        (json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } }), "KHR_texture_basisu"),
        (json!({}), "names no image"),
        (json!({ "source": 5 }), "image 5"),
    ] {
        let mut build = whole.clone();
        build.json["textures"][0] = texture;
        let (scene, odd) = build.odd_scene();
        assert_eq!(scene.materials[0].texture, None);
        assert!(odd.len() == 1 && odd[0].starts_with("texture 0: ") && odd[0].contains(part), "{odd:?}");
    }
}

#[test]
fn images_come_from_files_data_and_other_formats() {
    let mut build = textured();
    build.json["images"][0] = json!({ "uri": "a%20b.png" });
    let beside = |name: &str| if name == "a b.png" { Ok(png_of(1, 1, &[RED])) } else { Err(name.to_owned()) };
    let loaded = from_bytes(Path::new("test.glb"), &build.glb(), &beside).unwrap();
    assert_eq!((loaded.scene.textures.len(), loaded.diagnostics.len()), (1, 0));

    // A lossless WebP file of one red pixel, in a data URI.
    let webp = "data:image/webp;base64,UklGRhwAAABXRUJQVlA4TA8AAAAvAAAAAAcQ/Y/+ByKi/wEA";
    build.push("images", json!({ "uri": webp }));
    build.json["textures"][0] = json!({ "extensions": { "EXT_texture_webp": { "source": 1 } } });
    build.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    assert_eq!(build.scene().textures[0].texels, [RED]);
}

#[test]
fn images_of_one_source_are_fetched_and_decoded_once() {
    const COUNT: usize = 300;
    // Of one buffer view; a file by two names; and a view that holds no image.
    let view: fn(usize) -> Value = |_| json!({ "bufferView": 4 });
    let file: fn(usize) -> Value = |i| json!({ "uri": if i < 100 { "a%20b.png" } else { "a b.png" } });
    let wrong: fn(usize) -> Value = |_| json!({ "bufferView": 0 });
    for (source, textures, loads) in [(view, 1, 0), (file, 1, 1), (wrong, 0, 0)] {
        let mut build = textured();
        assert_eq!(build.json["images"][0]["bufferView"], 4);
        let material = build.json["materials"][0].clone();
        let primitive = build.json["meshes"][0]["primitives"][0].clone();
        for list in ["images", "textures", "materials"] {
            build.json[list] = json!([]);
        }
        build.json["meshes"][0]["primitives"] = json!([]);
        for i in 0..COUNT {
            build.push("images", source(i));
            build.push("textures", json!({ "source": i }));
            let mut material = material.clone();
            material["pbrMetallicRoughness"]["baseColorTexture"]["index"] = i.into();
            build.push("materials", material);
            let mut primitive = primitive.clone();
            primitive["material"] = i.into();
            build.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
        }
        let loaded_files = Cell::new(0);
        let beside = |_: &str| {
            loaded_files.set(loaded_files.get() + 1);
            Ok(png_of(1, 1, &[RED]))
        };
        let Loaded { scene, diagnostics, .. } =
            from_bytes(Path::new("test.glb"), &build.glb(), &beside).unwrap();
        assert_eq!((scene.textures.len(), loaded_files.get()), (textures, loads));
        let shown = scene.materials.iter().filter(|m| m.texture.is_some_and(|t| t.texture == 0)).count();
        assert_eq!((scene.materials.len(), shown), (COUNT, COUNT * textures));
        let told: Vec<&str> = diagnostics.iter().map(|d| d.place.as_str()).collect();
        assert_eq!(told, &["image 0 and 299 more"][textures..]);
    }
}
