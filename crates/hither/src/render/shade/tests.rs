//! Shading as a whole: the same picture whichever way a scene is told, and what each mode shows.

use super::fixture::{at, colored, frame, front_view, scene, square};
use super::*;
use crate::conventions::{Projection, View};
use crate::render::Complexity;
use crate::scene::{
    AlphaMode, Content, Filter, Group, Material, Mesh, Node, Texture, TextureRef, Transform, Wrap,
};
use glam::{DAffine2, DAffine3, DQuat, DVec3, Vec2, Vec3, Vec4};

fn picture(scene: &Scene, view: &View, shading: Shading) -> Image {
    Shader::new(scene, 1).shade(scene, &frame(scene, view), shading)
}

fn pixel(image: &Image, x: u32, y: u32) -> Vec4 {
    Vec4::from_array(image.pixels[(y * image.width + x) as usize])
}

/// The six faces of a cube of side 2 with outward normals.
fn cube() -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0f32, 1.0] {
            let mut out = [0.0; 3];
            out[axis] = side;
            let out = Vec3::from_array(out);
            let along = Vec3::from_array([out.y.abs() + out.z.abs(), out.x.abs(), 0.0]).normalize();
            let across = out.cross(along);
            let first = mesh.positions.len() as u32;
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                mesh.positions.push(out + along * a + across * b);
                mesh.normals.push(out);
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    mesh.primitives.push(crate::scene::Primitive { triangles: 0..12, material: None });
    mesh
}

fn corner_view() -> View {
    let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
    View::look_at(DVec3::new(3.0, 4.0, 5.0), DVec3::ZERO, DVec3::Y, projection, (48, 36))
}

fn affine(x: DVec3, y: DVec3, z: DVec3) -> Transform {
    Transform::Affine(DAffine3::from_cols(x, y, z, DVec3::ZERO))
}

#[test]
fn every_mode_is_transparent_where_nothing_is_seen_and_opaque_elsewhere() {
    let scene = scene(vec![], vec![(cube(), Transform::default())]);
    let frame = frame(&scene, &corner_view());
    for mode in [Shading::Flat, Shading::Smooth, Shading::Ids, Shading::Depth, Shading::Normals] {
        let image = Shader::new(&scene, 1).shade(&scene, &frame, mode);
        for y in 0..36 {
            for x in 0..48 {
                let expected = if frame.id(x, y).is_some() { 1.0 } else { 0.0 };
                let p = pixel(&image, x, y);
                assert_eq!(p.w, expected);
                assert!(p.is_finite() && p.min_element() >= 0.0 && p.max_element() <= 1.0);
                assert!(p.w == 1.0 || p == Vec4::ZERO);
            }
        }
    }
}

#[test]
fn threads_do_not_change_the_picture() {
    let glass = colored(Vec4::new(0.2, 0.5, 0.9, 0.4), AlphaMode::Blend);
    let scene =
        scene(vec![glass], vec![(cube(), Transform::default()), (square(Some(0)), at(0.5, 0.5, 2.0))]);
    let frame = frame(&scene, &corner_view());
    for mode in [Shading::Flat, Shading::Smooth, Shading::Ids, Shading::Depth, Shading::Normals] {
        let one = Shader::new(&scene, 1).shade(&scene, &frame, mode);
        assert_eq!(one, Shader::new(&scene, 3).shade(&scene, &frame, mode));
        assert_eq!(one, Shader::new(&scene, 0).shade(&scene, &frame, mode));
    }
}

#[test]
fn a_mirrored_cube_looks_like_the_cube() {
    let plain = scene(vec![], vec![(cube(), Transform::default())]);
    for (sx, sy, sz) in [(-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-1.0, -1.0, -1.0), (-1.0, 1.0, -1.0)] {
        let mirrored = scene(vec![], vec![(cube(), affine(DVec3::X * sx, DVec3::Y * sy, DVec3::Z * sz))]);
        for mode in [Shading::Flat, Shading::Smooth, Shading::Normals] {
            let (a, b) = (picture(&plain, &corner_view(), mode), picture(&mirrored, &corner_view(), mode));
            for (p, q) in a.pixels.iter().zip(&b.pixels) {
                assert!((Vec4::from_array(*p) - Vec4::from_array(*q)).abs().max_element() < 1e-6);
            }
        }
    }
}

#[test]
fn both_sides_of_a_sheet_are_lit_on_the_side_that_is_seen() {
    let turned = Transform::Trs {
        translation: DVec3::ZERO,
        rotation: DQuat::from_rotation_y(std::f64::consts::PI),
        scale: DVec3::ONE,
    };
    let material = || vec![colored(Vec4::ONE, AlphaMode::Opaque)];
    let mut sheet = square(Some(0));
    sheet.normals = vec![Vec3::Z; 4];
    let front = scene(material(), vec![(sheet.clone(), Transform::default())]);
    let back = scene(material(), vec![(sheet, turned)]);
    for mode in [Shading::Flat, Shading::Smooth, Shading::Normals] {
        let (a, b) = (picture(&front, &front_view(), mode), picture(&back, &front_view(), mode));
        let difference = pixel(&a, 20, 15) - pixel(&b, 20, 15);
        assert!(difference.abs().max_element() < 1e-6, "{mode:?}");
    }
    let normals = picture(&back, &front_view(), Shading::Normals);
    let towards_z = Vec4::new(0.2140411, 0.2140411, 1.0, 1.0);
    assert!((pixel(&normals, 20, 15) - towards_z).abs().max_element() < 1e-4);
}

#[test]
fn uneven_scale_keeps_normals_perpendicular() {
    // A slanted face of a wedge, given normals; squashing it turns them as it turns the face.
    let mut wedge = square(None);
    wedge.positions.iter_mut().for_each(|p| p.z = -p.y);
    wedge.normals = vec![Vec3::new(0.0, 1.0, 1.0).normalize(); 4];
    let squash = affine(DVec3::X, DVec3::Y * 0.3, DVec3::Z);
    let scene = scene(vec![], vec![(wedge, squash)]);
    let frame = frame(&scene, &front_view());
    let smooth = Shader::new(&scene, 1).shade(&scene, &frame, Shading::Smooth);
    let flat = Shader::new(&scene, 1).shade(&scene, &frame, Shading::Flat);
    assert!(frame.id(20, 15).is_some());
    assert!((pixel(&smooth, 20, 15) - pixel(&flat, 20, 15)).abs().max_element() < 1e-6);
}

#[test]
fn flattened_and_degenerate_instances_are_shaded_without_fault() {
    let flat = affine(DVec3::X, DVec3::Y, DVec3::ZERO);
    let point = affine(DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let scene = scene(vec![], vec![(cube(), flat), (cube(), point)]);
    for mode in [Shading::Flat, Shading::Smooth, Shading::Normals] {
        let image = picture(&scene, &front_view(), mode);
        assert!(image.pixels.iter().flatten().all(|c| c.is_finite()));
        assert_eq!(pixel(&image, 20, 15).w, 1.0);
    }
}

#[test]
fn enormous_and_minute_scenes_look_like_the_plain_one() {
    let plain = scene(vec![], vec![(cube(), Transform::default())]);
    let expected = picture(&plain, &corner_view(), Shading::Smooth);
    for scale in [1e18, 1e-18] {
        let scaled =
            scene(vec![], vec![(cube(), affine(DVec3::X * scale, DVec3::Y * scale, DVec3::Z * scale))]);
        let mut view = corner_view();
        view.view_from_world.translation *= scale;
        view.projection = Projection::Perspective { fov_y: 0.8, near: 0.1 * scale };
        let image = picture(&scaled, &view, Shading::Smooth);
        let same = |(p, q): (&[f32; 4], &[f32; 4])| {
            (Vec4::from_array(*p) - Vec4::from_array(*q)).abs().max_element() < 1e-5
        };
        let differing = image.pixels.iter().zip(&expected.pixels).filter(|pair| !same(*pair)).count();
        assert_eq!(differing, 0, "at scale {scale}");
    }
}

#[test]
fn a_texture_in_perspective_is_where_the_surface_is() {
    // A floor that runs away from the eye, with one white column at a quarter of its width.
    let texels = |i: u32| if i % 64 == 16 { [255; 4] } else { [0, 0, 0, 255] };
    let texture =
        Texture { name: String::new(), width: 64, height: 64, texels: (0..64 * 64).map(texels).collect() };
    let how = TextureRef {
        texture: 0,
        transform: DAffine2::IDENTITY,
        wrap: [Wrap::Clamp; 2],
        filter: Filter::Nearest,
    };
    let mut floor = square(Some(0));
    floor.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x * 4.0, -1.0, p.y * -8.0 - 4.0));
    floor.uvs = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(Vec2::from).to_vec();
    let mut scene = scene(vec![Material::default()], vec![(floor, Transform::default())]);
    scene.textures.push(texture);
    scene.materials[0].texture = Some(how);
    let image = picture(&scene, &front_view(), Shading::Flat);
    let mut bright_rows = 0;
    for y in 16..24 {
        let row = (0..40).map(|x| (f64::from(x) + 0.5, f64::from(pixel(&image, x, y).x)));
        let (weighted, light) = row.fold((0.0, 0.0), |(w, l), (x, i)| (w + x * i, l + i));
        if light > 0.05 {
            bright_rows += 1;
            // The column's centre is at x = −4 + 8 · 16.5 / 64 in the plane y = −1 below the eye.
            let expected = 20.0 + (-4.0 + 8.0 * 16.5 / 64.0) * (f64::from(y) + 0.5 - 15.0);
            assert!((weighted / light - expected).abs() <= 0.6, "row {y}: {}, {expected}", weighted / light);
        }
    }
    assert!(bright_rows > 5, "{bright_rows}");
}

#[test]
fn ids_tell_instances_apart_and_stay_the_same() {
    let colors: Vec<Vec3> = (0..200)
        .map(|instance| Vec4::from_array(id_color(SurfaceId { instance, triangle: 0 })).truncate())
        .collect();
    let alike = |i: usize| colors[..i].iter().filter(|c| (**c - colors[i]).length() < 0.01).count();
    assert!((0..200).map(alike).sum::<usize>() < 20);
    for (a, b) in colors.iter().zip(&colors[1..]) {
        assert!((*a - *b).length() > 0.005, "neighbouring numbers look alike: {a} {b}");
    }
    let near = Vec4::from_array(id_color(SurfaceId { instance: 7, triangle: 1 })).truncate();
    assert!((near - colors[7]).length() < 0.15 && near != colors[7]);
}

#[test]
fn depth_is_white_near_and_dark_far_and_even_in_between() {
    let scene = scene(
        vec![],
        vec![
            (square(None), at(-2.0, 0.0, 3.0)),
            (square(None), at(0.0, 0.0, -3.0)),
            (square(None), at(30.0, 0.0, -45.0)),
        ],
    );
    let view = View { width: 80, ..front_view() };
    let frame = frame(&scene, &view);
    let image = Shader::new(&scene, 1).shade(&scene, &frame, Shading::Depth);
    let mut by_distance: Vec<(f64, f32)> = Vec::new();
    for y in 0..30 {
        for x in 0..80 {
            if frame.id(x, y).is_some() {
                by_distance.push((frame.distance(x, y), pixel(&image, x, y).x));
            }
        }
    }
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(by_distance.windows(2).all(|w| w[0].1 >= w[1].1));
    assert!((by_distance[0].1 - 1.0).abs() < 1e-5);
    let darkest = by_distance[by_distance.len() - 1].1;
    assert!(darkest > 0.005 && darkest < 0.02, "{darkest}");
}

#[test]
fn complexity_is_logarithmic_and_its_panels_add_up() {
    let scene = Scene::new("");
    let mut frame = frame(&scene, &View { width: 4, height: 2, ..front_view() });
    assert!(complexity_image(&frame, ComplexityPanel::Sum).is_none());
    assert!(complexity_panels(&frame, 1).is_none());
    let empty = Shader::new(&scene, 1).shade(&scene, &frame, Shading::Complexity);
    assert!(empty.pixels.iter().all(|p| *p == [0.0; 4]));
    let cubes = vec![0.0, 0.25, 1.0, 3.0, 10.0, 100.0, 200.0, 9000.0];
    frame.complexity = Some(Complexity { cubes, polygons: vec![0.0, 0.0, 0.0, 0.0, 5.0, 50.0, 56.0, 0.0] });
    let sum = Shader::new(&scene, 1).shade(&scene, &frame, Shading::Complexity);
    assert_eq!(sum, complexity_image(&frame, ComplexityPanel::Sum).unwrap());
    let greys: Vec<f32> = sum.pixels.iter().map(|p| p[0]).collect();
    assert!(greys.windows(2).all(|w| w[0] < w[1] || w[1] == 1.0));
    assert_eq!((greys[0], greys[6], greys[7]), (0.0, 1.0, 1.0));
    let panels = complexity_panels(&frame, 1).unwrap();
    assert_eq!((panels.width, panels.height, panels.pixels.len()), (14, 2, 28));
    assert_eq!(pixel(&panels, 4, 0), Vec4::ZERO);
    assert_eq!(pixel(&panels, 10 + 1, 1), pixel(&sum, 1, 1));
    assert_eq!(pixel(&panels, 2, 0), pixel(&sum, 2, 0));
    assert_eq!(pixel(&panels, 5 + 2, 0), Vec4::new(0.0, 0.0, 0.0, 1.0));
}

#[test]
fn a_shader_follows_the_scene_as_it_is_posed() {
    let mut scene = scene(vec![], vec![(square(None), at(0.0, 0.0, 0.0))]);
    let mut shader = Shader::new(&scene, 1);
    let before = shader.shade(&scene, &frame(&scene, &front_view()), Shading::Smooth);
    scene.groups[0].nodes[0].local = Transform::Trs {
        translation: DVec3::new(1.0, 0.0, 0.0),
        rotation: DQuat::from_rotation_x(0.7),
        scale: DVec3::ONE,
    };
    let posed = frame(&scene, &front_view());
    let after = shader.shade(&scene, &posed, Shading::Smooth);
    assert_ne!(before, after);
    assert_eq!(after, Shader::new(&scene, 1).shade(&scene, &posed, Shading::Smooth));
}

#[test]
fn nested_instances_are_shaded_like_expanded_ones() {
    let mut nested = scene(vec![], vec![(cube(), at(-1.0, 0.0, 0.0)), (cube(), at(1.5, 0.5, -1.0))]);
    let mut outer = Group::default();
    for (angle, x) in [(0.3, -1.0), (1.1, 1.5)] {
        outer.push(Node {
            local: Transform::Trs {
                translation: DVec3::new(x, 0.0, 0.0),
                rotation: DQuat::from_rotation_y(angle),
                scale: DVec3::new(0.5, -0.5, 0.7),
            },
            content: Content::Group(0),
            ..Node::default()
        });
    }
    nested.groups.push(outer);
    nested.root = 1;
    let parts = nested.instances();
    let expanded =
        parts.iter().map(|i| (nested.meshes[i.mesh as usize].clone(), Transform::Affine(i.world_from_mesh)));
    let expanded = scene(vec![], expanded.collect());
    for mode in [Shading::Smooth, Shading::Ids, Shading::Normals] {
        let (a, b) = (picture(&nested, &corner_view(), mode), picture(&expanded, &corner_view(), mode));
        assert_eq!(a, b);
    }
}
