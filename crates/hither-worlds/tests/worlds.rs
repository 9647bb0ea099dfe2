//! Every world is valid, of the size it says, and the same on every machine; its mistakes are clear.

use glam::DVec3;
use hither::scene::Scene;
use hither_worlds::{generate, list, occludees};

fn world(spec: &str) -> Scene {
    let scene = generate(spec).unwrap_or_else(|e| panic!("{spec}: {e}"));
    scene.validate().unwrap_or_else(|e| panic!("{spec}: {e}"));
    scene
}

/// FNV-1a over 32-bit words.
fn checksum(words: impl Iterator<Item = u32>) -> u64 {
    words.fold(0xcbf2_9ce4_8422_2325, |h, w| (h ^ u64::from(w)).wrapping_mul(0x100_0000_01b3))
}

fn geometry_checksum(scene: &Scene) -> u64 {
    checksum(scene.meshes.iter().flat_map(|m| {
        let positions = m.positions.iter().flat_map(|p| p.to_array()).map(f32::to_bits);
        positions.chain(m.triangles.as_flattened().iter().copied())
    }))
}

fn camera_names(scene: &Scene) -> Vec<&str> {
    scene.cameras.iter().map(|c| c.name.as_str()).collect()
}

/// Positive when triangles are counter-clockwise seen from outside.
fn volume(scene: &Scene) -> f64 {
    let mesh = &scene.meshes[0];
    let corner = |v: u32| mesh.positions[v as usize].as_dvec3();
    let tetrahedron = |&[a, b, c]: &[u32; 3]| corner(a).dot(corner(b).cross(corner(c))) / 6.0;
    mesh.triangles.iter().map(tetrahedron).sum()
}

#[test]
fn benchmark_geometry_is_pinned_to_the_last_bit() {
    let pinned = [
        ("office?n=1", 15_000, 0x49d8_7ea5_2de1_8aa1),
        ("boxcity", 120_000, 0xf0a3_3485_c736_8429),
        ("clutter", 20_000, 0xa1f8_5070_3c70_6d53),
        ("spheres", 1_024_000, 0x06d9_be27_70d8_f0ec),
    ];
    let found = pinned.map(|(spec, ..)| {
        let scene = world(spec);
        (spec, scene.instanced_triangle_count(), geometry_checksum(&scene))
    });
    assert_eq!(found, pinned, "{found:#x?}");
}

#[test]
fn occludees_are_pinned_to_the_last_bit() {
    let pinned = [
        ("boxcity", 0x56d7_19ea_c15a_42b4),
        ("clutter", 0x7b48_78db_c479_5646),
        ("spheres", 0x9828_b004_b2da_c443),
    ];
    let found = pinned.map(|(name, _)| {
        let boxes = occludees(name).unwrap_or_default();
        assert_eq!(boxes.len(), 100_000, "{name}");
        let corners = boxes.iter().flat_map(|b| [b.min.to_array(), b.max.to_array()]);
        (name, checksum(corners.flatten().map(|x| (x as f32).to_bits())))
    });
    assert_eq!(found, pinned, "{found:#x?}");
    assert!(occludees("office").is_none());
}

#[test]
fn closed_meshes_face_outwards() {
    // The office's boxes touch and overlap, but each is closed, so volumes add up.
    for (spec, cubic_metres) in [("office?n=1", 59.0..59.1), ("spheres", 81_000.0..82_000.0)] {
        let found = volume(&world(spec));
        assert!(cubic_metres.contains(&found), "{spec}: {found}");
    }
}

#[test]
fn the_office_holds_539_million_triangles_in_little_memory() {
    let scene = world("office?n=33");
    assert_eq!(scene.instance_count(), 35_937);
    assert_eq!(scene.instanced_triangle_count(), 539_055_000);
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.groups.iter().map(|g| g.nodes.len()).sum::<usize>(), 3 * 33 + 1);
    let bounds = scene.bounds().unwrap();
    assert_eq!((bounds.min, bounds.max), (DVec3::new(0.0, 0.0, -396.0), DVec3::new(396.0, 132.0, 0.0)));
    assert_eq!(camera_names(&scene), ["corridor", "open", "outside", "walk"]);
}

#[test]
fn office_instances_are_numbered_along_x_then_z_then_y() {
    let scene = world("office?nx=2&ny=3&nz=4");
    let all = scene.instances();
    assert_eq!(all.len(), 24);
    for (i, instance) in all.iter().enumerate() {
        let (x, z, y) = (i % 2, i / 2 % 4, i / 8);
        let at = DVec3::new(12.0 * x as f64, 4.0 * y as f64, -12.0 * z as f64);
        assert_eq!(instance.world_from_mesh.translation, at, "instance {i}");
        let direct = scene.instance(i as u64).map(|i| i.world_from_mesh.translation);
        assert_eq!(direct, Some(at), "instance {i}");
    }
    let path = scene.path_name(&all[13].path);
    assert_eq!(path, "floor 1/row 2/module 1");
}

#[test]
fn one_and_three_modules_are_bare() {
    for (spec, modules) in [("office?n=1", 1), ("office?nx=3&ny=1&nz=1", 3)] {
        let scene = world(spec);
        assert_eq!(scene.groups.len(), 1, "{spec}");
        assert_eq!(scene.instance_count(), modules, "{spec}");
    }
}

#[test]
fn cameras_sit_where_the_benchmarks_have_them() {
    let eye_and_direction = |spec: &str, camera: &str| {
        let scene = world(spec);
        let pose = scene.find_camera(camera).and_then(|i| scene.world_from_camera(i)).unwrap();
        (pose.translation, pose.transform_vector3(DVec3::NEG_Z))
    };
    let cases = [
        ("office", "corridor", [198.0, 65.95, -0.5], [0.03, 0.02, -1.0]),
        ("office?n=2", "corridor", [18.0, 5.95, -0.5], [0.03, 0.02, -1.0]),
        ("office", "open", [0.6, 66.7, -0.6], [1.0, -0.01, -0.9]),
        ("office", "outside", [-150.0, 180.0, 220.0], [0.62, -0.25, -0.85]),
        ("boxcity", "street", [0.5, 1.7, 5.0], [0.02, 0.03, -1.0]),
        ("clutter", "front", [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
        ("spheres", "front", [0.0, 0.0, 120.0], [0.0, 0.0, -1.0]),
    ];
    for (spec, camera, eye, direction) in cases {
        let (found_eye, found_direction) = eye_and_direction(spec, camera);
        assert!(found_eye.distance(DVec3::from(eye)) < 1e-9, "{spec} {camera}: {found_eye}");
        let direction = DVec3::from(direction).normalize();
        assert!(found_direction.distance(direction) < 1e-12, "{spec} {camera}: {found_direction}");
    }
}

#[test]
fn parts_are_the_same_triangles_one_node_an_object() {
    for (name, objects) in [("boxcity", 10_000), ("clutter", 20_000), ("spheres", 2_000)] {
        let (whole, parts) = (world(name), world(&format!("{name}?parts=1")));
        assert_eq!(parts.instance_count(), objects, "{name}");
        let corners = |scene: &Scene| {
            checksum(scene.meshes.iter().flat_map(|m| {
                m.triangles
                    .as_flattened()
                    .iter()
                    .flat_map(|&v| m.positions[v as usize].to_array().map(f32::to_bits))
            }))
        };
        assert_eq!(corners(&whole), corners(&parts), "{name}");
    }
}

#[test]
fn hills_have_the_polygons_asked_for_and_copy_none() {
    for polygons in [1_000_000u64, 5_000_000, 53_000_000, 300_000_000] {
        let scene = world(&format!("hills?polygons={polygons}"));
        let found = scene.instanced_triangle_count() as f64;
        assert!((found / polygons as f64 - 1.0).abs() < 0.05, "{polygons}: {found}");
        let stored: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
        assert!(stored < 20_000 + polygons as usize / 50, "{polygons}: {stored} stored");
    }
}

#[test]
fn hills_follow_from_their_seed() {
    let of = |spec: &str| {
        let scene = world(spec);
        let places = scene
            .instances()
            .into_iter()
            .flat_map(|i| [f64::from(i.mesh)].into_iter().chain(i.world_from_mesh.to_cols_array()));
        let places = checksum(places.map(|x| (x as f32).to_bits()));
        (geometry_checksum(&scene), places)
    };
    let found = of("hills?polygons=1000000&seed=7");
    assert_eq!(found, (0x0f54_f721_af7b_21a9, 0x8b02_f88a_5cbe_f965), "{found:#x?}");
    assert_ne!(found, of("hills?polygons=1000000&seed=8"));
}

#[test]
fn the_lecture_shows_its_three_examples() {
    let scene = world("lecture");
    assert_eq!(camera_names(&scene), ["penetrating", "cycle", "tetrahedra"]);
    assert_eq!(scene.instance_count(), 8);
    let seen = |camera: &str| {
        let view = scene.find_camera(camera).and_then(|c| scene.view(c, (32, 32))).unwrap();
        hither::reference::zbuffer::draw(&scene, &view)
    };
    // The rectangle is at z = 10; the triangle's corner (15, 15, 15) stands out of it, its others are behind.
    let picture = seen("penetrating");
    let instance = |x: u32, y: u32| picture.seen(x, 31 - y).map(|(id, _)| id.instance);
    assert_eq!(
        [instance(15, 15), instance(23, 22), instance(12, 10), instance(28, 12)],
        [Some(1), Some(0), Some(0), Some(1)]
    );
    assert_eq!(instance(2, 2), None);
    // Every bar and every tetrahedron is seen, each through or beside the others.
    for (camera, instances) in [("cycle", 2..5), ("tetrahedra", 5..8)] {
        let picture = seen(camera);
        for i in instances {
            assert!(picture.ids.iter().any(|id| id.instance == i), "{camera} {i}");
        }
    }
}

#[test]
fn every_world_is_valid_with_its_defaults_and_unknown_ones_are_named() {
    for info in list() {
        let scene = world(info.name);
        assert!(!scene.cameras.is_empty() && scene.bounds().is_some(), "{}", info.name);
    }
    let fault = generate("ofice").map(drop).unwrap_err().to_string();
    assert!(fault.starts_with("there is no world \"ofice\"; there are office, boxcity"), "{fault}");
}

#[test]
fn toothpicks_have_the_papers_parts_and_move_within_their_cube() {
    let mut scene = world("toothpicks?n=200");
    assert_eq!(scene.instance_count(), 220);
    // 328 polygons: 16 triangles and 312 quadrilaterals.
    assert_eq!(scene.meshes[2].triangles.len(), 16 + 2 * 312);
    assert!((scene.animations[0].duration() - 250.0 / 60.0).abs() < 1e-6);
    assert_eq!(hither_worlds::known_relations(&scene).len(), 24);
    let (mut travelled, mut last) = (0.0, None);
    for frame in 0..250 {
        scene.pose(0, f64::from(frame) / 60.0);
        let tips: Vec<DVec3> = scene.instances()[20..]
            .iter()
            .map(|i| i.world_from_mesh.transform_point3(DVec3::Y * 0.15))
            .collect();
        assert!(tips.iter().all(|t| t.abs().max_element() < 1.0), "frame {frame}");
        if let Some(last) = last.replace(tips.clone()) {
            travelled += tips.iter().zip(&last).map(|(a, b): (&DVec3, &DVec3)| a.distance(*b)).sum::<f64>();
        }
    }
    // The paper: 0.269 % of the cube's side, 2 m, a frame.
    let percent = travelled / (249.0 * 200.0) / 2.0 * 100.0;
    assert!((0.24..0.30).contains(&percent), "{percent}");
    let ud = world("toothpicks?n=1600").groups[0].nodes[30].local.matrix().matrix3.x_axis.length();
    let us = world("toothpicks?n=1600&density=us").groups[0].nodes[30].local.matrix().matrix3.x_axis.length();
    assert!((ud - 0.5).abs() < 1e-6 && (us - 1.0).abs() < 1e-6, "{ud} {us}");
    assert!(generate("toothpicks?density=uu").is_err());
}

#[test]
fn the_canyon_has_the_papers_polygons() {
    for (grid, pieces) in [(20, 390.0), (14, 191.0), (10, 100.0), (7, 49.0), (5, 25.0)] {
        let scene = world(&format!("canyon?grid={grid}"));
        let names: Vec<&str> = scene.groups[0].nodes.iter().map(|n| n.name.as_str()).collect();
        let found = names.iter().filter(|n| n.starts_with("terrain")).count() as f64;
        assert!((found / pieces - 1.0).abs() < 0.05, "grid {grid}: {found} pieces");
        assert_eq!(hither_worlds::backdrops(&scene), [0]);
        assert!(!hither_worlds::known_relations(&scene).is_empty());
    }
    let scene = world("canyon?grid=1");
    let counts =
        [("sky", 480.0), ("terrain", 2473.0), ("body", 1558.0), ("engine", 1255.0), ("wing", 1421.0)];
    let more = [("tail", 22.0), ("rudder", 48.0), ("hinge", 64.0)];
    for (name, expected) in counts.into_iter().chain(more) {
        let mesh = scene.meshes.iter().find(|m| m.name.starts_with(name)).unwrap();
        let found = mesh.triangles.len() as f64;
        assert!((found / expected - 1.0).abs() < 0.05, "{name}: {found}");
    }
    assert_eq!(scene.instance_count(), 2 + 36);
}

#[test]
fn soda_city_and_tetra_have_the_papers_polygons_and_walk_where_it_is_free() {
    for (name, polygons) in [("soda", 1685), ("city", 2857), ("tetra", 3601)] {
        let mut scene = world(name);
        // Polygons are fans with vertices of their own: the triangles are the corners less two a polygon.
        let corners: usize = scene.meshes.iter().map(|m| m.positions.len()).sum();
        let triangles: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
        assert_eq!((corners - triangles) / 2, polygons, "{name}");
        assert!(scene.materials.iter().all(|m| m.double_sided), "{name}");
        let camera = scene.find_camera("walk").unwrap();
        for step in 0..=300 {
            scene.pose(0, f64::from(step) * 0.2);
            let eye = scene.world_from_camera(camera).unwrap().translation;
            let clear = clearance(&scene, eye);
            assert!(clear > 0.4, "{name} step {step}: {clear} m at {eye}");
        }
        assert_ne!(
            format!("{:?}", world(&format!("{name}?walk=1")).animations),
            format!("{:?}", world(&format!("{name}?walk=2")).animations)
        );
    }
}

/// Distance from `p` to the nearest triangle, by its nearest corner, edge or inner point.
fn clearance(scene: &Scene, p: DVec3) -> f64 {
    let of_triangle = |mesh: &hither::scene::Mesh, t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let foot = p - normal * normal.dot(p - a);
        let inside =
            [(a, b), (b, c), (c, a)].iter().all(|(q, r)| (*r - *q).cross(foot - *q).dot(normal) >= 0.0);
        if inside {
            return p.distance(foot);
        }
        let to_edge = |q: DVec3, r: DVec3| {
            let t = ((p - q).dot(r - q) / (r - q).length_squared()).clamp(0.0, 1.0);
            p.distance(q.lerp(r, t))
        };
        to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
    };
    let meshes = scene.meshes.iter();
    meshes.flat_map(|m| m.triangles.iter().map(move |t| of_triangle(m, t))).fold(f64::INFINITY, f64::min)
}

#[test]
fn speeds_may_be_fractions_and_are_numbers_in_range() {
    for (name, keys) in [("toothpicks", ""), ("canyon", "grid=1&")] {
        let mut usual = world(&format!("{name}?{keys}speed=1"));
        let mut slow = world(&format!("{name}?{keys}speed=0.125"));
        let duration = usual.animations[0].duration();
        assert_eq!(slow.animations[0].duration(), duration);
        // Times at which either has keys.
        for k in 0..5 {
            let time = duration * f64::from(k) / 42.0;
            usual.pose(0, time);
            slow.pose(0, time * 8.0);
            let eyes = [&usual, &slow].map(|s| s.view(0, (64, 48)).unwrap().eye_in_world());
            assert!(eyes[0].distance(eyes[1]) < 1e-3 * eyes[0].length(), "{name} {k}: {eyes:?}");
            for (a, b) in usual.instances().iter().zip(slow.instances()) {
                let (a, b) = (a.world_from_mesh, b.world_from_mesh);
                assert!(a.translation.distance(b.translation) < 1e-3, "{name} {k}");
                assert!((a.matrix3.x_axis - b.matrix3.x_axis).length() < 1e-3, "{name} {k}");
            }
        }
        for wrong in ["-1", "NaN", "inf", "-inf", "1e9", "fast", ""] {
            let fault = generate(&format!("{name}?speed={wrong}")).map(drop).unwrap_err().to_string();
            assert!(
                fault.contains(&format!("speed={wrong} is "))
                    && fault.contains("speed is a number from 0 to")
            );
        }
    }
}
