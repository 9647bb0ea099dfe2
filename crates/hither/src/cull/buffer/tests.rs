//! The zero: nothing that is called hidden can be seen, on scenes made to be nasty.

use super::*;
use crate::geometry::Aabb;
use crate::reference::sight::Sight;
use crate::reference::trouble::{self, Random};
use crate::scene::{Content, Material, Mesh, Node, Primitive, Scene, Transform};
use glam::{DVec3, Vec3};

/// A buffer with everything of `scene` drawn into it.
fn drawn(scene: &Scene, view: &View, options: &OcclusionOptions) -> OcclusionBuffer {
    let occluders: Vec<Occluder> =
        scene.meshes.iter().map(|m| Occluder::of_mesh(m, &scene.materials)).collect();
    let mut buffer = OcclusionBuffer::new(view, options).unwrap();
    for instance in scene.instances() {
        buffer.draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
    }
    buffer
}

/// A point of the closed square of pixel (x, y), often on its border.
fn point_of_pixel(random: &mut Random, x: u32, y: u32) -> (f64, f64) {
    let mut coordinate = |p: u32| {
        let inside = match random.below(6) {
            0 => 1e-9,
            1 => 1.0 - 1e-9,
            _ => random.unit(),
        };
        f64::from(p) + inside
    };
    (coordinate(x), coordinate(y))
}

/// Asserts that rays through covered pixels meet something no farther than what the pixels hold; returns the
/// numbers of pixels covered and of rays.
fn attack(scene: &Scene, view: &View, random: &mut Random, rays: u32, what: &str) -> (u64, u64) {
    let buffer = drawn(scene, view, &OcclusionOptions::default());
    let sight = Sight::new(scene, view);
    let (mut covered, mut shot) = (0, 0);
    for y in 0..view.height {
        for x in 0..view.width {
            let held = f64::from(buffer.depth(x, y));
            if held == 0.0 {
                continue;
            }
            covered += 1;
            for _ in 0..rays {
                let (px, py) = point_of_pixel(random, x, y);
                let truth = sight.depth(px, py);
                shot += 1;
                assert!(
                    truth >= held * (1.0 - 1e-12),
                    "{what}: pixel ({x}, {y}) holds {held}, but at ({px}, {py}) the truth is {truth}"
                );
            }
        }
    }
    (covered, shot)
}

#[test]
fn no_pixel_holds_more_than_is_there_in_trouble() {
    let random = &mut Random::new(1);
    let (mut covered, mut shot) = (0, 0);
    for seed in 0..600 {
        let (scene, view) = (trouble::scene(seed), trouble::view(seed));
        let (c, s) = attack(&scene, &view, random, 6, &format!("seed {seed}"));
        covered += c;
        shot += s;
    }
    assert!(covered > 20_000 && shot > 100_000, "{covered} pixels, {shot} rays");
}

/// Closed, bumpy, connected meshes of many small faces: folds, silhouettes in front of the same surface.
fn lump(random: &mut Random, rings: u32, spokes: u32, bump: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.positions.push(Vec3::Y);
    for i in 1..rings {
        for k in 0..spokes {
            let (theta, phi) = (
                std::f64::consts::PI * f64::from(i) / f64::from(rings),
                std::f64::consts::TAU * f64::from(k) / f64::from(spokes),
            );
            let r = random.between(1.0 - bump, 1.0 + bump);
            let p = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * r;
            mesh.positions.push(p.as_vec3());
        }
    }
    mesh.positions.push(Vec3::NEG_Y);
    let last = mesh.positions.len() as u32 - 1;
    let at = |i: u32, k: u32| 1 + (i - 1) * spokes + k % spokes;
    for k in 0..spokes {
        mesh.triangles.push([0, at(1, k + 1), at(1, k)]);
        for i in 1..rings - 1 {
            mesh.triangles.push([at(i, k), at(i, k + 1), at(i + 1, k + 1)]);
            mesh.triangles.push([at(i, k), at(i + 1, k + 1), at(i + 1, k)]);
        }
        mesh.triangles.push([last, at(rings - 1, k), at(rings - 1, k + 1)]);
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
    mesh
}

fn lumps(seed: u64) -> Scene {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new("lumps");
    scene.materials = vec![Material { double_sided: random.one_in(4), ..Material::default() }];
    for _ in 0..1 + random.below(3) {
        let bump = [0.0, 0.05, 0.5, 0.9][random.below(4) as usize];
        let (rings, spokes) = (3 + random.below(10), 3 + random.below(12));
        let mesh = lump(random, rings, spokes, bump);
        scene.meshes.push(mesh);
        let content = Content::Mesh(scene.meshes.len() as u32 - 1);
        let at = DVec3::new(random.between(-2.0, 2.0), random.between(-2.0, 2.0), random.between(-2.0, 2.0));
        scene.groups[0].push(Node { content, local: Transform::from_translation(at), ..Node::default() });
    }
    scene
}

fn around(random: &mut Random, reach: f64, size: (u32, u32)) -> View {
    let mut point =
        || DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    let (eye, target) = (point() * reach, point());
    let projection = Projection::Perspective { fov_y: random.between(0.2, 2.0), near: 0.05 };
    View::look_at(eye, target, DVec3::Y, projection, size)
}

#[test]
fn no_pixel_holds_more_than_is_there_on_folded_closed_surfaces() {
    let random = &mut Random::new(2);
    let (mut covered, mut shot) = (0, 0);
    for seed in 0..400 {
        let scene = lumps(seed);
        let size = (1 + random.below(70), 1 + random.below(70));
        let reach = [3.0, 6.0, 20.0, 1.0][random.below(4) as usize];
        let view = around(random, reach, size);
        let (c, s) = attack(&scene, &view, random, 4, &format!("seed {seed}"));
        covered += c;
        shot += s;
    }
    assert!(covered > 50_000 && shot > 200_000, "{covered} pixels, {shot} rays");
}

#[test]
fn edges_inside_a_surface_do_not_leak() {
    let random = &mut Random::new(3);
    for _ in 0..20 {
        // A ball that fills the middle of the image, of faces from far larger to far smaller than a pixel.
        let mut scene = Scene::new("ball");
        scene.materials = vec![Material::default()];
        let fine = 3 + random.below(60);
        scene.meshes = vec![lump(random, fine, fine, 0.0)];
        scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
        let eye = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 3.0);
        let lens = Projection::Perspective { fov_y: 0.9, near: 0.1 };
        let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, lens, (96, 96));
        let buffer = drawn(&scene, &view, &OcclusionOptions::default());
        let sight = Sight::new(&scene, &view);
        // Wherever a pixel and its neighbours are covered at all their corners, the pixel is.
        let inside: Vec<bool> =
            (0..97 * 97).map(|i| sight.depth(f64::from(i % 97), f64::from(i / 97)) > 0.0).collect();
        for y in 1..95usize {
            for x in 1..95usize {
                let all = (y - 1..=y + 2).all(|j| (x - 1..=x + 2).all(|i| inside[j * 97 + i]));
                if all {
                    assert!(buffer.depth(x as u32, y as u32) > 0.0, "leak at ({x}, {y}), {fine} rings");
                }
            }
        }
    }
}

#[test]
fn order_instruction_set_bands_and_threads_change_nothing() {
    for seed in 0..40 {
        let (scene, view) = (trouble::scene(seed + 1000), trouble::view(seed + 1000));
        let reference = drawn(&scene, &view, &OcclusionOptions::default()).depths();
        let plain = OcclusionOptions { level: Level::baseline(), ..OcclusionOptions::default() };
        assert!(drawn(&scene, &view, &plain).depths() == reference, "seed {seed}: instruction sets differ");
        let occluders: Vec<Occluder> =
            scene.meshes.iter().map(|m| Occluder::of_mesh(m, &scene.materials)).collect();
        let mut instances = scene.instances();
        instances.reverse();
        let shared = SharedBuffer::new(&view, &OcclusionOptions::default(), 3).unwrap();
        std::thread::scope(|scope| {
            for half in instances.chunks(instances.len().div_ceil(2).max(1)) {
                let (shared, occluders) = (&shared, &occluders);
                scope.spawn(move || {
                    for i in half {
                        shared.draw(&occluders[i.mesh as usize], &i.world_from_mesh);
                    }
                });
            }
        });
        let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        let depths: Vec<f32> = pixels.map(|(x, y)| shared.depth(x, y)).collect();
        assert!(depths == reference, "seed {seed}: threads or order differ");
    }
}

/// A box somewhere in or around a scene; rarely one that is no box.
fn some_box(random: &mut Random) -> Aabb {
    let center = DVec3::new(random.between(-8.0, 8.0), random.between(-8.0, 8.0), random.between(-8.0, 8.0));
    let size = [0.0, 1e-3, 0.1, 1.0, 5.0][random.below(5) as usize];
    let half = DVec3::new(random.unit(), random.unit(), random.unit()) * size;
    Aabb { min: center - half, max: center + half }
}

#[test]
fn no_box_that_is_hidden_can_be_seen() {
    let random = &mut Random::new(4);
    let mut counts = [0u64; 3];
    for seed in 0..400 {
        let (scene, view) = (trouble::scene(seed + 5000), trouble::view(seed + 5000));
        let buffer = drawn(&scene, &view, &OcclusionOptions::default());
        let sight = Sight::new(&scene, &view);
        let bounds: Vec<Aabb> = (0..200).map(|_| some_box(random)).collect();
        let boxes: Boxes = bounds.iter().copied().collect();
        let mut verdicts = Vec::new();
        buffer.ask(&boxes, &mut verdicts);
        for (b, verdict) in bounds.iter().zip(&verdicts) {
            counts[*verdict as usize] += 1;
            if *verdict != Verdict::Visible {
                points_are_out_of_sight(&sight, &view, b, *verdict, random, seed);
            }
        }
    }
    assert!(counts.iter().all(|&c| c > 1000), "{counts:?}");
}

/// Shoots at points of a box: its corners, and others.
fn points_are_out_of_sight(
    sight: &Sight,
    view: &View,
    b: &Aabb,
    verdict: Verdict,
    random: &mut Random,
    seed: u64,
) {
    for k in 0..16u32 {
        let pick = DVec3::from_array([0, 1, 2].map(|axis: u32| match k {
            0..8 => f64::from(k >> axis & 1),
            _ => random.unit(),
        }));
        let p = view.view_from_world.transform_point3(b.min + (b.max - b.min) * pick);
        let distance = -p.z;
        let (origin, direction) = match view.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, p / distance),
            Projection::Orthographic { .. } => (DVec3::new(p.x, p.y, 0.0), DVec3::NEG_Z),
        };
        if distance < view.projection.near() || view.projection.distance(f32::MIN_POSITIVE) < distance {
            continue;
        }
        let scale = view.pixels_per_unit();
        let (sx, sy) = match view.projection {
            Projection::Perspective { .. } => (direction.x * scale, -direction.y * scale),
            Projection::Orthographic { .. } => (p.x * scale, -p.y * scale),
        };
        let (hw, hh) = (f64::from(view.width) * 0.5, f64::from(view.height) * 0.5);
        if sx.abs() > hw - 1e-9 || sy.abs() > hh - 1e-9 {
            continue;
        }
        assert!(verdict == Verdict::Hidden, "seed {seed}: {b:?} is in view at {p}");
        let nearest = sight.distance((origin, direction));
        assert!(
            nearest <= distance * (1.0 + 1e-12),
            "seed {seed}: {b:?} is seen at {p}; nearest is {nearest}"
        );
    }
}
