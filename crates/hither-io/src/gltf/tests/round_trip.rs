//! What is written comes back the same.

use super::build::read;
use crate::gltf::write::write_glb;
use crate::{Loaded, gltf};
use glam::{DAffine2, DAffine3, DQuat, DVec2, DVec3, Vec2, Vec3, Vec4};
use hither::scene::*;
use std::fs;
use std::path::PathBuf;

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        Scratch(std::env::temp_dir().join(format!("hither-gltf-{name}-{}.glb", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[track_caller]
fn again(scene: &Scene, name: &str) -> Scene {
    let file = Scratch::new(name);
    write_glb(scene, &file.0).unwrap();
    let Loaded { scene, diagnostics, .. } = gltf::read(&file.0).unwrap();
    assert_eq!(diagnostics, []);
    scene
}

fn texture(alpha: u8) -> Texture {
    let texels = (0..6).map(|i| [i, 2 * i, 255 - i, alpha]).collect();
    Texture { name: format!("texture {alpha}"), width: 3, height: 2, texels }
}

fn material(name: &str, texture: Option<TextureRef>, alpha: AlphaMode) -> Material {
    let base_color = Vec4::new(0.1, 0.2, 0.3, 0.4);
    Material { name: name.into(), base_color, texture, alpha, double_sided: texture.is_some() }
}

fn mesh(name: &str, full: bool) -> Mesh {
    let third = 1.0f32 / 3.0;
    Mesh {
        name: name.into(),
        positions: vec![Vec3::ZERO, Vec3::new(third, 0.1, -1e-20), Vec3::splat(1e18), Vec3::Y],
        normals: if full { vec![Vec3::new(0.6, 0.8, 0.0), Vec3::Z, Vec3::X, Vec3::Y] } else { vec![] },
        uvs: if full { vec![Vec2::splat(third); 4] } else { vec![] },
        colors: if full { vec![Vec4::splat(third); 4] } else { vec![] },
        triangles: vec![[0, 1, 2], [0, 2, 3], [3, 2, 1]],
        primitives: vec![
            Primitive { triangles: 0..1, material: full.then_some(0) },
            Primitive { triangles: 1..3, material: full.then_some(1) },
        ],
        lines: if full { vec![[Vec3::ZERO, Vec3::Y], [Vec3::X, Vec3::splat(third)]] } else { vec![] },
    }
}

fn trs(x: f64) -> Transform {
    let rotation = DQuat::from_rotation_y(x);
    Transform::Trs {
        translation: DVec3::new(x, 1.0 / 3.0, -0.1),
        rotation,
        scale: DVec3::new(1.0, -2.0, 0.0),
    }
}

fn node(name: &str, parent: Option<u32>, local: Transform, content: Content) -> Node {
    Node { name: name.into(), parent, local, content }
}

/// A scene of one group that uses everything.
fn flat_scene() -> Scene {
    let reference = |texture, filter| TextureRef {
        texture,
        transform: DAffine2::IDENTITY,
        wrap: [Wrap::Repeat, Wrap::Clamp],
        filter,
    };
    let moved = TextureRef {
        transform: DAffine2::from_scale_angle_translation(DVec2::new(2.0, -3.0), 0.5, DVec2::new(0.1, 0.2)),
        ..reference(1, Filter::Linear)
    };
    let channel = |node, property, interpolation, values: &[Vec4]| Channel {
        node,
        property,
        interpolation,
        times: vec![0.0, 0.5],
        values: values.to_vec(),
    };
    let v = |x: f32| Vec4::new(x, 0.1, 0.2, 0.0);
    let affine =
        DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), DQuat::from_rotation_x(1.0), DVec3::ONE);
    let lens = CameraProjection::Perspective { fov_y: 1.1, near: 0.01 };
    let flat = CameraProjection::Orthographic { half_width: 2.0, half_height: 1.0, near: 0.5, far: 10.0 };
    let camera = |name: &str, node, projection| Camera {
        name: name.into(),
        node: Some(node),
        local: Transform::default(),
        projection,
    };
    Scene {
        name: "everything".into(),
        meshes: vec![mesh("full", true), mesh("bare", false)],
        materials: vec![
            material("plain", Some(reference(0, Filter::Nearest)), AlphaMode::Mask { cutoff: 0.3 }),
            material("moved", Some(moved), AlphaMode::Blend),
        ],
        textures: vec![texture(255), texture(100)],
        groups: vec![Group {
            name: String::new(),
            nodes: vec![
                node("root", None, trs(0.5), Content::Nothing),
                node("a", Some(0), trs(0.25), Content::Mesh(0)),
                node("b", Some(1), Transform::Affine(affine), Content::Mesh(1)),
                node("c", Some(0), Transform::default(), Content::Mesh(0)),
                node("other root", None, trs(-1.0), Content::Nothing),
            ],
        }],
        root: 0,
        cameras: vec![camera("eye", 4, lens), camera("plan", 2, flat)],
        animations: vec![Animation {
            name: "move".into(),
            channels: vec![
                channel(1, Property::Translation, Interpolation::Linear, &[v(0.0), v(1.0)]),
                channel(1, Property::Rotation, Interpolation::Step, &[Vec4::W, Vec4::X]),
                channel(4, Property::Scale, Interpolation::Cubic, &[v(1.0); 6]),
            ],
        }],
    }
}

#[track_caller]
fn assert_same(a: &Scene, b: &Scene) {
    assert_eq!(format!("{:?}", a.meshes), format!("{:?}", b.meshes));
    assert_eq!(a.textures, b.textures);
    assert_eq!(format!("{:?}", a.groups), format!("{:?}", b.groups));
    assert_eq!(format!("{:?}", a.cameras), format!("{:?}", b.cameras));
    assert_eq!(format!("{:?}", a.animations), format!("{:?}", b.animations));
    assert_eq!((&a.name, a.materials.len()), (&b.name, b.materials.len()));
    for (x, y) in a.materials.iter().zip(&b.materials) {
        assert_eq!(
            (&x.name, x.base_color, x.alpha, x.double_sided),
            (&y.name, y.base_color, y.alpha, y.double_sided)
        );
        let (Some(s), Some(t)) = (x.texture, y.texture) else { panic!("both have textures") };
        assert_eq!((s.texture, s.wrap, s.filter), (t.texture, t.wrap, t.filter));
        assert!(s.transform.abs_diff_eq(t.transform, 1e-12), "{:?} {:?}", s.transform, t.transform);
    }
}

#[test]
fn a_scene_of_one_group_comes_back_the_same() {
    let scene = flat_scene();
    let once = again(&scene, "flat");
    assert_same(&scene, &once);
    assert_same(&once, &again(&once, "flat-twice"));
}

/// Two rows of three rooms; each room has a mesh and a node below it.
fn nested_scene() -> Scene {
    let mut scene = flat_scene();
    scene.animations.clear();
    scene.cameras.clear();
    let room = Group {
        name: "room".into(),
        nodes: vec![
            node("wall", None, Transform::default(), Content::Mesh(0)),
            node("lamp", Some(0), trs(0.1), Content::Mesh(1)),
            node("floor", None, trs(0.2), Content::Mesh(1)),
        ],
    };
    let at = |x: f64| Transform::from_translation(DVec3::X * x);
    let mut row = Group::default();
    for i in 0..3 {
        let n = row.push(node(&format!("room {i}"), None, at(f64::from(i)), Content::Group(0)));
        row.push(node("sign", Some(n), trs(0.3), Content::Mesh(1)));
    }
    let mut house = Group::default();
    house.push(node("front", None, trs(0.4), Content::Group(1)));
    house.push(node("garden", Some(0), trs(0.5), Content::Mesh(0)));
    house.push(node("back", None, at(10.0), Content::Group(1)));
    scene.groups = vec![room, row, house];
    scene.root = 2;
    scene
}

#[test]
fn nested_groups_keep_their_instances_and_numbers() {
    let mut scene = nested_scene();
    let eye = |node, local| Camera {
        name: format!("camera {node:?}"),
        node,
        local,
        projection: CameraProjection::Perspective { fov_y: 1.0, near: 0.1 },
    };
    let turned = |angle: f64| Transform::Trs {
        translation: DVec3::splat(angle),
        rotation: DQuat::from_rotation_x(angle),
        scale: DVec3::ONE,
    };
    scene.groups[2].nodes[0].local = turned(1.0);
    scene.cameras = vec![
        eye(Some(2), Transform::default()),
        eye(Some(2), Transform::default()),
        eye(None, turned(3.0)),
        eye(Some(0), turned(4.0)),
    ];
    scene.cameras[1].projection =
        CameraProjection::Orthographic { half_width: 1.0, half_height: 1.0, near: -5.0, far: 5.0 };
    let back = again(&scene, "nested");
    assert_eq!(back.groups.len(), 1);
    let (before, after) = (scene.instances(), back.instances());
    assert_eq!(before.len(), after.len());
    for (b, a) in before.iter().zip(&after) {
        assert_eq!(b.mesh, a.mesh);
        assert!(b.world_from_mesh.abs_diff_eq(a.world_from_mesh, 1e-12));
        let names = scene.path_name(&b.path);
        assert!(names.ends_with(&back.path_name(&a.path)), "{names}");
    }
    for (i, camera) in scene.cameras.iter().enumerate() {
        let (b, a) = (scene.view(i, (30, 20)).unwrap(), back.view(i, (30, 20)).unwrap());
        if let CameraProjection::Orthographic { near, .. } = camera.projection {
            // The eye steps back so far that the near plane is not behind it.
            let moved = b.view_from_world.translation - a.view_from_world.translation;
            assert!((moved - DVec3::new(0.0, 0.0, -near)).length() < 1e-9, "{moved}");
            continue;
        }
        assert!(b.view_from_world.abs_diff_eq(a.view_from_world, 1e-12));
        assert_eq!(b.projection, a.projection);
    }
}

#[test]
fn the_file_obeys_the_format() {
    let file = Scratch::new("format");
    write_glb(&flat_scene(), &file.0).unwrap();
    let bytes = fs::read(&file.0).unwrap();
    assert_eq!(u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize, bytes.len());
    assert_eq!(bytes.len() % 4, 0);
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    assert_eq!(json_length % 4, 0);
    let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json_length]).unwrap();
    for view in json["bufferViews"].as_array().unwrap() {
        assert_eq!(view["byteOffset"].as_u64().unwrap() % 4, 0);
    }
    let position = json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap();
    let bounds = &json["accessors"][position as usize];
    assert_eq!(bounds["max"][0].as_f64(), Some(f64::from(1e18f32)));
    assert_eq!(bounds["min"][2].as_f64(), Some(f64::from(-1e-20f32)));
    assert!(read(&bytes).is_ok());
}

#[test]
fn an_empty_scene_and_meshes_without_triangles_can_be_written() {
    assert_eq!(again(&Scene::new("empty"), "empty").instance_count(), 0);
    let mut scene = Scene::new("");
    scene.meshes.push(Mesh::default());
    scene.groups[0].push(node("nothing", None, Transform::default(), Content::Mesh(0)));
    let back = again(&scene, "no-triangles");
    assert_eq!((back.root_group().nodes.len(), back.instance_count()), (1, 0));
}

#[test]
fn what_cannot_be_written_is_refused_in_one_line() {
    let file = Scratch::new("refused");
    let refusal = |scene: &Scene| {
        let text = write_glb(scene, &file.0).unwrap_err().to_string();
        assert!(!file.0.exists() && !text.contains('\n'));
        text
    };
    let mut scene = nested_scene();
    scene.meshes[0].positions[0].x = f32::NAN;
    assert!(refusal(&scene).contains("the scene cannot be written: mesh 0 (\"full\")"));
    // Sixteen groups, each of two of the one before.
    let mut scene = Scene::new("many");
    scene.groups[0].push(Node::default());
    for g in 0..24 {
        let twice = Node { content: Content::Group(g), ..Node::default() };
        scene.groups.push(Group { nodes: vec![twice.clone(), twice], ..Group::default() });
    }
    scene.root = 24;
    assert!(refusal(&scene).contains("expands to 50331646 nodes; no more than 2000000"));
}
