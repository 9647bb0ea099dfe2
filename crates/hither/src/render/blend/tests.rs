//! Blended surfaces against rays that meet every triangle of the expanded scene.

use super::*;
use crate::render::shade::fixture::{at, colored, frame, front_view, scene, square};
use crate::render::{Shader, Shading};
use crate::scene::{AlphaMode, Material, Node, Primitive, Transform};
use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;
use std::collections::HashMap;

fn glass(r: f32, g: f32, b: f32, alpha: f32) -> Material {
    colored(Vec4::new(r, g, b, alpha), AlphaMode::Blend)
}

fn centre(image: &Image) -> Vec4 {
    // Off the squares' diagonals.
    Vec4::from_array(image.pixels[(16 * image.width + 22) as usize])
}

fn picture(scene: &Scene, view: &View) -> Image {
    Shader::new(scene, 1).shade(scene, &frame(scene, view), Shading::Flat)
}

/// Light on a white square facing the eye, at the pixel of [`centre`].
fn white() -> Vec4 {
    let material = colored(Vec4::ONE, AlphaMode::Opaque);
    centre(&picture(&scene(vec![material], vec![(square(Some(0)), at(0.0, 0.0, 0.0))]), &front_view()))
}

fn close(a: Vec4, b: Vec4) -> bool {
    (a - b).abs().max_element() < 2e-3
}

#[test]
fn layers_tint_in_the_order_of_their_depth() {
    let materials = || {
        vec![
            glass(1.0, 0.0, 0.0, 0.5),
            glass(0.0, 1.0, 0.0, 0.25),
            colored(Vec4::new(0.0, 0.0, 1.0, 1.0), AlphaMode::Opaque),
        ]
    };
    let red_first = vec![
        (square(Some(2)), at(0.0, 0.0, -1.0)),
        (square(Some(0)), at(0.0, 0.0, 1.0)),
        (square(Some(1)), at(0.0, 0.0, 0.0)),
        (square(Some(1)), at(0.0, 0.0, -2.0)),
    ];
    let lit = white();
    let mut order = red_first.clone();
    for turn in 0..4 {
        let image = picture(&scene(materials(), order.clone()), &front_view());
        let expected = Vec4::new(0.5, 0.5 * 0.25, 0.5 * 0.75, 1.0) * lit;
        assert!(close(centre(&image), expected), "turn {turn}: {} is not {expected}", centre(&image));
        order.rotate_left(1);
    }
}

#[test]
fn panes_where_an_opaque_surface_is_go_by_their_ids_at_every_pixel() {
    let materials =
        || vec![glass(1.0, 0.0, 0.0, 0.5), colored(Vec4::new(0.0, 0.0, 1.0, 1.0), AlphaMode::Opaque)];
    for turn in 0..20 {
        let (eye, target) = (DVec3::new(f64::from(turn) * 0.3 - 2.0, 1.1, 4.0), DVec3::new(0.1, 0.2, 0.0));
        let projection = match turn % 3 {
            0 => Projection::Orthographic { half_height: 2.5, near: 0.5, far: 20.0 },
            _ => Projection::Perspective { fov_y: 0.9, near: 0.1 },
        };
        let view = View::look_at(eye, target, DVec3::Y, projection, (96, 72));
        for [first, second] in [[0, 1], [1, 0]] {
            let nodes = [first, second].map(|k| (square(Some(k)), at(0.0, 0.0, 0.0)));
            let image = picture(&scene(materials(), nodes.to_vec()), &view);
            let (mut tinted, mut plain) = (0, 0);
            for [red, _, blue, _] in image.pixels.iter().filter(|p| p[3] == 1.0) {
                (tinted, plain) =
                    (tinted + u32::from(*red > 0.0), plain + u32::from(*red == 0.0 && *blue > 0.0));
            }
            let (expected, other) = if first == 0 { (tinted, plain) } else { (plain, tinted) };
            assert!(expected > 100 && other == 0, "turn {turn}, {first} first: {tinted} tinted, {plain} not");
        }
    }
}

#[test]
fn over_nothing_a_pane_is_translucent_and_premultiplied() {
    let scene = scene(vec![glass(1.0, 0.0, 1.0, 0.5)], vec![(square(Some(0)), at(0.0, 0.0, 0.0))]);
    let image = picture(&scene, &front_view());
    let expected = Vec4::new(0.5, 0.0, 0.5, 0.5) * white().truncate().extend(1.0);
    assert!(close(centre(&image), expected));
    assert_eq!(image.pixels[0], [0.0; 4]);
}

#[test]
fn ids_and_measurements_ignore_glass() {
    let scene = scene(vec![glass(1.0, 1.0, 1.0, 1.0)], vec![(square(Some(0)), at(0.0, 0.0, 0.0))]);
    let frame = frame(&scene, &front_view());
    for shading in [Shading::Ids, Shading::Depth, Shading::Normals, Shading::Complexity] {
        let image = Shader::new(&scene, 1).shade(&scene, &frame, shading);
        assert!(image.pixels.iter().all(|p| *p == [0.0; 4]));
    }
}

#[test]
fn panes_that_cross_are_ordered_at_each_pixel() {
    let turned = |angle: f64| Transform::Trs {
        translation: DVec3::ZERO,
        rotation: DQuat::from_rotation_y(angle),
        scale: DVec3::ONE,
    };
    let materials = vec![glass(1.0, 0.0, 0.0, 0.9), glass(0.0, 1.0, 0.0, 0.9)];
    let parts = vec![(square(Some(0)), turned(0.5)), (square(Some(1)), turned(-0.5))];
    let image = picture(&scene(materials, parts), &front_view());
    let [left, right] = [17, 23].map(|x| image.pixels[15 * 40 + x]);
    // Turned about +Y by a positive angle, a square's left half comes forward.
    assert!(left[0] > 5.0 * left[1] && right[1] > 5.0 * right[0], "{left:?} {right:?}");
}

#[test]
fn a_tie_in_depth_goes_to_the_smaller_instance_opaque_ones_included() {
    let materials = vec![
        glass(1.0, 0.0, 0.0, 0.5),
        glass(0.0, 1.0, 0.0, 0.5),
        colored(Vec4::new(0.0, 0.0, 1.0, 1.0), AlphaMode::Opaque),
    ];
    let lit = white();
    for (kinds, expected) in [
        ([0, 1, 2], Vec4::new(0.5, 0.25, 0.25, 1.0)),
        ([1, 0, 2], Vec4::new(0.25, 0.5, 0.25, 1.0)),
        ([0, 2, 1], Vec4::new(0.5, 0.0, 0.5, 1.0)),
        ([2, 0, 1], Vec4::new(0.0, 0.0, 1.0, 1.0)),
    ] {
        let parts = kinds.map(|m| (square(Some(m)), at(0.0, 0.0, 0.0))).to_vec();
        let scene = scene(materials.clone(), parts);
        let frame = frame(&scene, &front_view());
        // Every blended square at exactly the depth of the opaque one, larger ids first.
        let pixel = 16 * 40 + 22;
        let fragments = |rows: Range<u32>| {
            let glass = (0..3).rev().filter(|&i| kinds[i as usize] < 2 && rows.contains(&16));
            let id = |instance| SurfaceId { instance, triangle: 0 };
            glass.map(|i| Fragment { pixel, depth: frame.depth(22, 16), id: id(i) }).collect()
        };
        let image = Shader::new(&scene, 1).shade_with(&scene, &frame, Shading::Flat, fragments);
        assert!(close(centre(&image) / lit, expected), "{kinds:?}: {}", centre(&image) / lit);
    }
}

#[test]
fn back_faces_of_single_sided_glass_are_not_there() {
    let material = Material { double_sided: false, ..glass(1.0, 1.0, 1.0, 0.5) };
    let scaled = |x: f64, y: f64| Transform::Trs {
        translation: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        scale: DVec3::new(x, y, 1.0),
    };
    let turned = Transform::Trs {
        translation: DVec3::ZERO,
        rotation: DQuat::from_rotation_y(std::f64::consts::PI),
        scale: DVec3::ONE,
    };
    let shows = |local: Transform| {
        centre(&picture(&scene(vec![material.clone()], vec![(square(Some(0)), local)]), &front_view())).w
            > 0.0
    };
    assert!(shows(scaled(1.0, 1.0)) && shows(scaled(-1.0, 1.0)) && shows(scaled(-1.0, -1.0)));
    assert!(!shows(turned));
}

#[test]
fn repeated_fragments_count_once_and_bands_do_not_show() {
    let scene = scene(vec![glass(1.0, 0.5, 0.2, 0.5)], vec![(square(Some(0)), at(0.0, 0.0, 0.0))]);
    let view = View { width: 400, height: 300, ..front_view() };
    let frame = frame(&scene, &view);
    let blended = BlendedTriangles::find(&scene, &view);
    let mut shader = Shader::new(&scene, 1);
    let once = shader.shade_with(&scene, &frame, Shading::Flat, |rows| blended.fragments(rows));
    let twice = shader.shade_with(&scene, &frame, Shading::Flat, |rows| {
        let mut found = blended.fragments(rows);
        found.reverse();
        found.extend_from_within(..);
        found
    });
    assert_eq!(once, twice);
    let whole = blended.fragments(0..300);
    let parts: usize = (0..300).map(|y| blended.fragments(y..y + 1).len()).sum();
    assert_eq!(whole.len(), parts);
    let covered = once.pixels.iter().filter(|p| p[3] > 0.0).count();
    assert_eq!(covered, whole.len());
    assert!(once.pixels.iter().all(|p| p[3] == 0.0 || (p[3] - 0.5).abs() < 1e-6));
}

#[test]
fn blended_instances_are_those_without_which_the_picture_is_another() {
    let turned = |angle: f64, z: f64| Transform::Trs {
        translation: DVec3::new(0.0, 0.0, z),
        rotation: DQuat::from_rotation_y(angle),
        scale: DVec3::splat(0.5),
    };
    let before = [at(0.5, 0.0, 1.0), at(-0.5, 0.0, 2.0), at(0.0, 0.3, 0.001)];
    let hidden = [at(0.0, 0.0, -0.001), at(0.0, 0.0, -0.5)];
    let other = [turned(0.7, 0.0), at(0.9, 0.0, -3.0), at(9.0, 0.0, 0.0)];
    let panes: Vec<Transform> = [&before[..], &hidden, &other].concat();
    let solid = panes.len() as u32;
    let faint = |without: Option<u32>, k: u32| {
        // Pane 2 is before the wall, and wholly transparent.
        let alpha = if without == Some(k) || k == 2 { 0.0 } else { 0.3 };
        glass(1.0, 0.8, 0.1, alpha)
    };
    let made = |without: Option<u32>| {
        let mut materials: Vec<Material> = (0..solid).map(|k| faint(without, k)).collect();
        materials.push(colored(Vec4::new(0.2, 0.3, 0.4, 1.0), AlphaMode::Opaque));
        let mut parts: Vec<_> = (0..solid).map(|k| (square(Some(k)), panes[k as usize])).collect();
        parts.push((square(Some(solid)), at(0.0, 0.0, 0.0)));
        scene(materials, parts)
    };
    let (scene, view) = (made(None), View { width: 400, height: 300, ..front_view() });
    let whole = picture(&scene, &view);
    let expected: Vec<u32> = (0..solid).filter(|&k| picture(&made(Some(k)), &view) != whole).collect();
    assert_eq!(expected, [0, 1, 5, 6]);
    let frame = frame(&scene, &view);
    for threads in [1, 3] {
        let found = Shader::new(&scene, threads).blended_instances(&scene, &frame);
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), expected);
        let distances = found.iter().map(|f| view.projection.distance(f.1));
        // The turned pane, of side 1, comes forward by half the sine of its turn.
        let nearest = [4.0, 3.0, 5.0 - 0.5 * 0.7f64.sin(), 8.0];
        assert!(distances.zip(nearest).all(|(d, e)| (d - e).abs() < 0.02), "{found:?}");
    }
}

#[test]
fn an_edge_between_glass_and_what_is_opaque_is_drawn_once() {
    // A quad larger than the picture, cut in two along a slanted line.
    let corners = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0), (0.3, -9.0), (-0.4, 9.0)];
    let triangles = vec![[0, 4, 5], [0, 5, 3], [4, 1, 2], [4, 2, 5]];
    let kinds = [(0..2, Some(0)), (2..4, Some(1))];
    let mesh = Mesh {
        positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
        triangles,
        primitives: kinds.map(|(triangles, material)| Primitive { triangles, material }).to_vec(),
        ..Mesh::default()
    };
    let materials = vec![colored(Vec4::ONE, AlphaMode::Opaque), glass(1.0, 0.0, 0.0, 0.5)];
    let scene = scene(materials, vec![(mesh, at(0.0, 0.0, 0.0))]);
    for turn in 0..100 {
        let angle = f64::from(turn) * 0.063;
        let (up, eye) = (DVec3::new(angle.sin(), angle.cos(), 0.0), DVec3::new(0.1 * angle, 0.3, 4.0));
        let projection = match turn % 3 {
            0 => Projection::Orthographic { half_height: 2.5, near: 0.5, far: 20.0 },
            _ => Projection::Perspective { fov_y: 0.9, near: 0.1 },
        };
        let view = View::look_at(eye, DVec3::ZERO, up, projection, (320, 240));
        let frame = frame(&scene, &view);
        let mut surfaces = vec![0; 320 * 240];
        for (pixel, surfaces) in (0..).zip(&mut surfaces) {
            *surfaces = u32::from(frame.id(pixel % 320, pixel / 320).is_some());
        }
        for fragment in BlendedTriangles::find(&scene, &view).fragments(0..240) {
            surfaces[fragment.pixel as usize] += 1;
        }
        let wrong = surfaces.iter().position(|&n| n != 1);
        assert_eq!(wrong, None, "turn {turn}");
    }
}

/// The distance along the view axis at which a ray meets a triangle [Möller & Trumbore 1997].
fn meet(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    let from_a = origin - a;
    let u = from_a.dot(p) / determinant;
    let q = from_a.cross(ab);
    let v = direction.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| -(origin + direction * (ac.dot(q) / determinant)).z)
}

/// The distance at which the ray through a point of the picture (pixels) meets a triangle in view space.
fn meet_at(view: &View, at: DVec2, corners: [DVec3; 3]) -> Option<f64> {
    let unit = 1.0 / view.pixels_per_unit();
    let x = (at.x - f64::from(view.width) * 0.5) * unit;
    let y = -(at.y - f64::from(view.height) * 0.5) * unit;
    let (origin, direction, clip) = match view.projection {
        Projection::Perspective { near, .. } => (DVec3::ZERO, DVec3::new(x, y, -1.0), near..=f64::INFINITY),
        Projection::Orthographic { near, far, .. } => (DVec3::new(x, y, 0.0), DVec3::NEG_Z, near..=far),
    };
    meet(origin, direction, corners).filter(|d| clip.contains(d))
}

/// Every blended triangle in view space.
fn blended_triangles(scene: &Scene, view: &View) -> Vec<(SurfaceId, [DVec3; 3])> {
    let mut found = Vec::new();
    for (i, instance) in scene.instances().iter().enumerate() {
        let placed =
            Placed { mesh: instance.mesh, view_from_mesh: view.view_from_world * instance.world_from_mesh };
        let mesh = &scene.meshes[instance.mesh as usize];
        let blended = (0..mesh.triangles.len() as u32).filter(|&t| scene.is_blended(mesh.material_of(t)));
        let with_id = |t| (SurfaceId { instance: i as u32, triangle: t }, placed.corners(scene, t));
        found.extend(blended.map(with_id));
    }
    found
}

/// Whether a point is so near the border of what a triangle covers that snapping may move the border past it.
fn is_at_border(view: &View, at: DVec2, corners: [DVec3; 3]) -> bool {
    let here = meet_at(view, at, corners).is_some();
    let offsets =
        (-1..=1).flat_map(|x| (-1..=1).map(move |y| DVec2::new(f64::from(x), f64::from(y)) / 256.0));
    offsets.into_iter().any(|offset| meet_at(view, at + offset, corners).is_some() != here)
}

fn point() -> impl Strategy<Value = Vec3> {
    (-4.0..4.0f32, -4.0..4.0f32, -9.0..4.0f32).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// In front, beside, behind and across the eye; nested, mirrored, partly without blended surfaces.
    #[test]
    fn what_the_walk_finds_is_what_rays_find(
        points in prop::collection::vec(point(), 6..24),
        flat in any::<bool>(),
        mirror in any::<bool>(),
    ) {
        let corners = points.len() as u32 / 3 * 3;
        let mesh = Mesh {
            positions: points,
            triangles: (0..corners).step_by(3).map(|i| [i, i + 1, i + 2]).collect(),
            primitives: vec![Primitive { triangles: 0..corners / 3, material: Some(0) }],
            ..Mesh::default()
        };
        let solid = square(Some(1));
        let materials = vec![glass(1.0, 0.0, 0.0, 0.5), colored(Vec4::ONE, AlphaMode::Opaque)];
        let mut scene = scene(materials, vec![
            (solid, at(0.0, 0.0, -3.0)),
            (mesh, at(0.5, 0.0, 0.0)),
        ]);
        let mut outer = Group::default();
        for i in 0..3 {
            let scale = if mirror { DVec3::new(-1.0, 0.5, 1.0) } else { DVec3::splat(1.5) };
            let rotation = DQuat::from_rotation_y(f64::from(i) * 1.3);
            let translation = DVec3::new(f64::from(i) - 1.0, 0.3, -f64::from(i));
            let local = Transform::Trs { translation, rotation, scale };
            outer.push(Node { local, content: Content::Group(0), ..Node::default() });
        }
        scene.groups.push(outer);
        scene.root = 1;
        let projection = if flat {
            Projection::Orthographic { half_height: 3.0, near: -1.0, far: 6.0 }
        } else {
            Projection::Perspective { fov_y: 1.3, near: 0.2 }
        };
        let view = View::look_at(DVec3::Z, DVec3::NEG_Z, DVec3::Y, projection, (24, 18));
        let found = BlendedTriangles::find(&scene, &view).fragments(0..18);
        let found: HashMap<(u32, SurfaceId), f32> = found.iter().map(|f| ((f.pixel, f.id), f.depth)).collect();
        for (id, corners) in blended_triangles(&scene, &view) {
            for pixel in 0..24 * 18 {
                let at = pixel_centre(pixel % 24, pixel / 24);
                let expected = meet_at(&view, at, corners);
                let distance = found.get(&(pixel, id)).map(|&depth| view.projection.distance(depth));
                match (distance, expected) {
                    (Some(d), Some(e)) => {
                        prop_assert!((d - e).abs() < 1e-5 * (1.0 + e.abs()), "{} is not {}", d, e);
                    }
                    (None, None) => {}
                    _ => prop_assert!(is_at_border(&view, at, corners), "{:?} at {}", id, at),
                }
            }
        }
    }
}
