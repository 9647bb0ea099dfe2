//! The zero: nothing that is called hidden can be seen, on scenes made to be nasty.

use super::*;
use crate::geometry::Aabb;
use crate::raster::levels;
use crate::reference::sight::Sight;
use crate::reference::trouble::{self, Random};
use crate::scene::{Content, Material, Mesh, Node, Primitive, Scene, Transform};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

mod asked;
mod far;
mod loose;
mod moving;
mod parts;
mod round;
mod sampled;
mod shared;

use round::round_bodies;

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
    let buffer = if random.one_in(4) {
        drawn_plainly(scene, view)
    } else {
        drawn(scene, view, &OcclusionOptions::default())
    };
    shoot(&buffer, scene, view, random, rays, what)
}

/// As [`attack`], of a buffer.
fn shoot(
    buffer: &OcclusionBuffer,
    scene: &Scene,
    view: &View,
    random: &mut Random,
    rays: u32,
    what: &str,
) -> (u64, u64) {
    let sight = Sight::new(scene, view);
    let (mut covered, mut shot) = (0, 0);
    // Far from the origin the truth is itself no better than f64.
    let slack = 1e-12 + (view.eye_in_world().length() - 90.0).max(0.0) * 1e-13;
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
                    truth >= held * (1.0 - slack),
                    "{what}: pixel ({x}, {y}) holds {held}, but at ({px}, {py}) the truth is {truth}"
                );
            }
        }
    }
    (covered, shot)
}

/// [`attack`]s so many scenes.
fn attack_all(seeds: u64, scene_of: impl Fn(u64) -> (Scene, View), rays: u32, random: u64) -> (u64, u64) {
    let random = &mut Random::new(random);
    (0..seeds).fold((0, 0), |(covered, shot), seed| {
        let (scene, view) = scene_of(seed);
        let (c, s) = attack(&scene, &view, random, rays, &format!("seed {seed}"));
        (covered + c, shot + s)
    })
}

#[test]
fn no_pixel_holds_more_than_is_there_in_trouble() {
    let (covered, shot) = attack_all(3000, |seed| (trouble::scene(seed), trouble::view(seed)), 6, 1);
    assert!(covered > 100_000 && shot > 600_000, "{covered} pixels, {shot} rays");
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
    for seed in 0..1500 {
        let scene = lumps(seed);
        let size = (1 + random.below(70), 1 + random.below(70));
        let reach = [3.0, 6.0, 20.0, 1.0][random.below(4) as usize];
        let view = around(random, reach, size);
        let (c, s) = attack(&scene, &view, random, 4, &format!("seed {seed}"));
        covered += c;
        shot += s;
    }
    assert!(covered > 200_000 && shot > 800_000, "{covered} pixels, {shot} rays");
}

/// A view from near or as far as `far`, at most so many pixels each way, in perspective or not.
fn some_view(random: &mut Random, most: u32, far: f64) -> View {
    let size = (1 + random.below(most), 1 + random.below(most));
    let reach = [3.0, 6.0, far, 1.0][random.below(4) as usize];
    let mut view = around(random, reach, size);
    if random.one_in(3) {
        view.projection =
            Projection::Orthographic { half_height: random.between(1.0, 6.0), near: 0.05, far: 50.0 };
    }
    view
}

/// Lumps of many faces and rubble of single ones, some seen from both sides, with holes, mirrored or not.
fn rubble(seed: u64) -> (Scene, View) {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new("rubble");
    scene.materials = vec![Material { double_sided: random.one_in(2), ..Material::default() }];
    for _ in 0..1 + random.below(3) {
        let bump = [0.0, 0.05, 0.5, 0.9][random.below(4) as usize];
        let (rings, spokes) = (4 + random.below(12), 4 + random.below(14));
        let mut mesh = lump(random, rings, spokes, bump);
        match random.below(3) {
            0 => {}
            // Holes, at which the surface ends.
            1 => mesh.triangles.retain(|_| !random.one_in(9)),
            _ => {
                // Every triangle by itself, twisted a little.
                mesh.positions =
                    mesh.triangles.as_flattened().iter().map(|&v| mesh.positions[v as usize]).collect();
                mesh.positions.iter_mut().for_each(|p| *p *= random.between(0.9, 1.0) as f32);
                mesh.triangles =
                    (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            }
        }
        mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
        scene.meshes.push(mesh);
        let content = Content::Mesh(scene.meshes.len() as u32 - 1);
        let at = DVec3::new(random.between(-2.0, 2.0), random.between(-2.0, 2.0), random.between(-2.0, 2.0));
        let flip = DVec3::new([1.0, -1.0][random.below(2) as usize], random.between(0.3, 2.0), 1.0);
        let local = Transform::Trs { translation: at, rotation: glam::DQuat::IDENTITY, scale: flip };
        scene.groups[0].push(Node { content, local, ..Node::default() });
    }
    (scene, some_view(random, 90, 20.0))
}

#[test]
fn no_pixel_holds_more_than_is_there_on_fine_and_loose_faces() {
    let (covered, shot) = attack_all(1500, rubble, 4, 12);
    assert!(covered > 200_000 && shot > 800_000, "{covered} pixels, {shot} rays");
}

/// As [`drawn`], face by face.
fn drawn_plainly(scene: &Scene, view: &View) -> OcclusionBuffer {
    drawn_as(scene, view, |standing| standing.plain = true)
}

/// For each pixel of an image so many pixels wide the largest depth within four pixels: a block of 4×4 holds one.
fn nearest_around(depths: &[f32], width: usize) -> Vec<f32> {
    let spread = |from: &[f32], step: usize| -> Vec<f32> {
        let place = |i: usize| if step == 1 { (i % width, width) } else { (i / width, depths.len() / width) };
        let at = |i: usize| {
            let (here, count) = place(i);
            let (before, after) = (here.min(4), (count - 1 - here).min(4));
            (i - before * step..=i + after * step).step_by(step).map(|k| from[k]).fold(0.0, f32::max)
        };
        (0..from.len()).map(at).collect()
    };
    spread(&spread(depths, 1), width)
}

fn drawn_as(scene: &Scene, view: &View, change: impl Fn(&mut Standing)) -> OcclusionBuffer {
    let mut buffer = OcclusionBuffer::new(view, &OcclusionOptions::default()).unwrap();
    let level = buffer.frame.options.level;
    for instance in scene.instances() {
        let occluder = Occluder::of_mesh(&scene.meshes[instance.mesh as usize], &scene.materials);
        let mut standing = buffer.frame.standing(&occluder, &instance.world_from_mesh);
        change(&mut standing);
        let (band, mut drawn) = (&mut buffer.band, Drawn::default());
        dispatch!(level, simd => band.draw(simd, &standing, &mut drawn));
    }
    buffer
}

#[test]
fn no_pixel_holds_more_than_is_there_where_only_boxes_inside_are_drawn() {
    let random = &mut Random::new(31);
    let (mut covered, mut shot) = (0, 0);
    for seed in 0..600 {
        let (scene, mut view) = if seed % 2 == 0 { rubble(seed) } else { (lumps(seed), bodies(seed).1) };
        (view.width, view.height) = (view.width.max(40), view.height.max(40));
        let buffer = drawn_as(&scene, &view, |standing| standing.px_a_face = 1 << 20);
        let (c, s) = shoot(&buffer, &scene, &view, random, 4, &format!("seed {seed}"));
        covered += c;
        shot += s;
    }
    assert!(covered > 20_000 && shot > 80_000, "{covered} pixels, {shot} rays");
}

/// How what is drawn differs from what is drawn face by face: pixels that both cover, that only one does, and of those
/// that both do where it is nearer than anything that plain faces hold around, and where it is farther by a hundredth.
#[derive(Debug, Default)]
struct Compared {
    both: u32,
    one: u32,
    nearer: u32,
    farther: u32,
}

fn compared(seeds: u64, scene_of: impl Fn(u64) -> (Scene, View)) -> Compared {
    let mut sum = Compared::default();
    for seed in 0..seeds {
        let (scene, view) = scene_of(seed);
        let fast = drawn(&scene, &view, &OcclusionOptions::default()).depths();
        let plain = drawn_plainly(&scene, &view).depths();
        let around = nearest_around(&plain, view.width as usize);
        for ((fast, plain), around) in fast.iter().zip(&plain).zip(around) {
            sum.both += u32::from(*fast > 0.0 && *plain > 0.0);
            sum.one += u32::from((*fast > 0.0) != (*plain > 0.0));
            sum.nearer += u32::from(*plain > 0.0 && *fast > around * 1.000_1);
            sum.farther += u32::from(*fast > 0.0 && *fast < plain * 0.99);
        }
    }
    sum
}

#[test]
fn counting_outlines_and_counting_faces_cover_the_same_pixels() {
    // Where a face is seen edge-on, only one of them may have drawn it. At the rim of a patch no block of it is there that
    // lies nearer.
    let sum = compared(1500, rubble);
    let differ = (sum.one * 100).max(sum.nearer * 25);
    assert!(sum.both > 200_000 && differ < sum.both, "{sum:?}");
}

/// Closed convex bodies of few faces, of all shapes and sizes, mirrored or not, some seen from both sides.
fn bodies(seed: u64) -> (Scene, View) {
    let random = &mut Random::new(seed);
    let mut scene = Scene::new("bodies");
    scene.materials = vec![Material { double_sided: random.one_in(4), ..Material::default() }];
    for _ in 0..1 + random.below(8) {
        // A prism, a frustum or a pyramid over a polygon, closed; a corner may be a little off.
        let n = 3 + random.below(4);
        let top = [1.0, 1.0, 0.4, 0.0][random.below(4) as usize];
        let mut mesh = Mesh::default();
        for level in 0..2u32 {
            let r = if level == 0 { 1.0 } else { top };
            for k in 0..n {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
                mesh.positions.push(DVec3::new(cos * r, sin * r, f64::from(level) * 2.0 - 1.0).as_vec3());
            }
        }
        for k in 0..n {
            let next = (k + 1) % n;
            mesh.triangles.extend([[k, next, n + next], [k, n + next, n + k]]);
            if k > 1 {
                mesh.triangles.extend([[0, k, k - 1], [n, n + k - 1, n + k]]);
            }
        }
        if random.one_in(8) {
            mesh.positions[0].x += random.between(-0.5, 0.5) as f32;
        }
        mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: Some(0) }];
        scene.meshes.push(mesh);
        let at = DVec3::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0), random.between(-3.0, 3.0));
        let mut size = || [0.003, 0.05, 0.5, 2.0][random.below(4) as usize];
        let scale = DVec3::new(size(), size(), size()) * [1.0, -1.0][random.below(2) as usize];
        let axis = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.3).normalize();
        let rotation = match random.below(3) {
            0 => glam::DQuat::IDENTITY,
            _ => glam::DQuat::from_axis_angle(axis, random.between(0.0, 6.3)),
        };
        let local = Transform::Trs { translation: at, rotation, scale };
        let content = Content::Mesh(scene.meshes.len() as u32 - 1);
        scene.groups[0].push(Node { content, local, ..Node::default() });
    }
    (scene, some_view(random, 120, 30.0))
}

#[test]
fn no_pixel_holds_more_than_is_there_on_convex_bodies() {
    let (covered, shot) = attack_all(3000, bodies, 4, 21);
    assert!(covered > 200_000 && shot > 800_000, "{covered} pixels, {shot} rays");
}

#[test]
fn convex_bodies_cover_what_their_faces_cover() {
    // A plane, lowered by what it falls within half a pixel, is below its neighbour's for about a pixel beyond their
    // edge. At the rim of a body no block of it is there that lies nearer.
    let sum = compared(1500, bodies);
    let differ = (sum.one * 100).max(sum.nearer * 25).max(sum.farther * 50);
    assert!(sum.both > 200_000 && differ < sum.both, "{sum:?}");
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
    for seed in 0..80 {
        let (scene, view) = match seed % 2 {
            0 => (trouble::scene(seed + 1000), trouble::view(seed + 1000)),
            _ => round_bodies(seed),
        };
        let reference = drawn(&scene, &view, &OcclusionOptions::default()).depths();
        for level in levels() {
            let plain = OcclusionOptions { level, ..OcclusionOptions::default() };
            assert!(drawn(&scene, &view, &plain).depths() == reference, "seed {seed}: {level:?} differs");
        }
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

#[test]
fn walls_among_patches_give_the_same_in_any_order() {
    let mut covered = 0;
    for seed in 0..400 {
        let random = &mut Random::new(seed + 77);
        let mut scene = lumps(seed);
        for _ in 0..1 + random.below(3) {
            let corner = |random: &mut Random| random.point(6.0).as_vec3();
            let (a, b, c) = (corner(random), corner(random), corner(random));
            let positions = vec![a, b, c, a + c - b];
            let primitives = vec![Primitive { triangles: 0..2, material: Some(0) }];
            scene.meshes.push(Mesh {
                positions,
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                primitives,
                ..Mesh::default()
            });
            let content = Content::Mesh(scene.meshes.len() as u32 - 1);
            scene.groups[0].push(Node { content, ..Node::default() });
        }
        scene.materials[0].double_sided = true;
        let view = some_view(random, 120, 12.0);
        let mut backwards = Scene::new("backwards");
        (backwards.meshes, backwards.materials) = (scene.meshes.clone(), scene.materials.clone());
        for instance in scene.instances().iter().rev() {
            let local = Transform::from_translation(instance.world_from_mesh.translation);
            backwards.groups[0].push(Node {
                content: Content::Mesh(instance.mesh),
                local,
                ..Node::default()
            });
        }
        for way in 0..3 {
            // Eroded, too, by a few pixels.
            let change = |standing: &mut Standing| match way {
                2 => standing.margin = Some(Margin { metres: 0.02, pixels: 100.0, depth: 0.002 }),
                _ => standing.plain = way == 1,
            };
            let depths = drawn_as(&scene, &view, change).depths();
            let reversed = drawn_as(&backwards, &view, change).depths();
            assert!(depths == reversed, "seed {seed}, way {way}");
            covered += depths.iter().filter(|depth| **depth > 0.0).count();
        }
    }
    assert!(covered > 200_000, "{covered} pixels");
}

/// A box somewhere in or around a scene; rarely one that is no box.
fn some_box(random: &mut Random) -> Aabb {
    let center = DVec3::new(random.between(-8.0, 8.0), random.between(-8.0, 8.0), random.between(-8.0, 8.0));
    let size = [0.0, 1e-3, 0.1, 1.0, 5.0][random.below(5) as usize];
    let half = DVec3::new(random.unit(), random.unit(), random.unit()) * size;
    Aabb { min: center - half, max: center + half }
}

#[test]
fn of_two_million_boxes_none_that_is_hidden_can_be_seen() {
    let counts = (0..2600u64).into_par_iter().map(|seed| {
        let random = &mut Random::new(seed + 4);
        let (scene, view) = match seed % 4 {
            0 => rubble(seed),
            _ => (trouble::scene(seed + 5000), trouble::view(seed + 5000)),
        };
        let buffer = drawn(&scene, &view, &OcclusionOptions::default());
        let sight = Sight::new(&scene, &view);
        let bounds: Vec<Aabb> = (0..800).map(|_| some_box(random)).collect();
        let boxes: Boxes = bounds.iter().copied().collect();
        let mut verdicts = Vec::new();
        buffer.ask(&boxes, &mut verdicts);
        let mut counts = [0u64; 3];
        for (b, verdict) in bounds.iter().zip(&verdicts) {
            counts[*verdict as usize] += 1;
            if *verdict != Verdict::Visible {
                points_are_out_of_sight(&sight, &view, b, *verdict, random, seed);
            }
        }
        counts
    });
    let counts = counts.reduce(|| [0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
    assert!(counts.iter().sum::<u64>() > 2_000_000 && counts.iter().all(|&c| c > 50_000), "{counts:?}");
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
    for k in 0..12u32 {
        let pick = DVec3::from_array([0, 1, 2].map(|axis: u32| match k {
            0..8 => f64::from(k >> axis & 1),
            _ => random.unit(),
        }));
        let p = b.min + (b.max - b.min) * pick;
        point_is_out_of_sight(sight, view, p, verdict, &|| format!("seed {seed}: {b:?}"));
    }
}

/// Asserts that a point of the world, of something with this verdict, is out of view or behind something.
fn point_is_out_of_sight(
    sight: &Sight,
    view: &View,
    point: DVec3,
    verdict: Verdict,
    what: &dyn Fn() -> String,
) {
    let p = view.view_from_world.transform_point3(point);
    let distance = -p.z;
    let (origin, direction) = match view.projection {
        Projection::Perspective { .. } => (DVec3::ZERO, p / distance),
        Projection::Orthographic { .. } => (DVec3::new(p.x, p.y, 0.0), DVec3::NEG_Z),
    };
    if distance < view.projection.near() || view.projection.distance(f32::MIN_POSITIVE) < distance {
        return;
    }
    let scale = view.pixels_per_unit();
    let (sx, sy) = match view.projection {
        Projection::Perspective { .. } => (direction.x * scale, -direction.y * scale),
        Projection::Orthographic { .. } => (p.x * scale, -p.y * scale),
    };
    let (hw, hh) = (f64::from(view.width) * 0.5, f64::from(view.height) * 0.5);
    if sx.abs() > hw - 1e-9 || sy.abs() > hh - 1e-9 {
        return;
    }
    assert!(verdict == Verdict::Hidden, "{} is in view at {p}", what());
    let nearest = sight.distance((origin, direction));
    assert!(nearest <= distance * (1.0 + 1e-12), "{} is seen at {p}; nearest is {nearest}", what());
}

/// One box seen from the front: it fills the image's middle.
fn wall() -> (Occluder, View) {
    let (positions, triangles) = cube();
    let lens = Projection::Perspective { fov_y: 1.0, near: 0.1 };
    let view = View::look_at(DVec3::Z * 5.0, DVec3::ZERO, DVec3::Y, lens, (160, 120));
    (Occluder::new(&positions, &triangles, Sides::Front).unwrap(), view)
}

fn cube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner =
        |k: u32| Vec3::new((k & 1) as f32 - 0.5, (k >> 1 & 1) as f32 - 0.5, (k >> 2 & 1) as f32 - 0.5);
    let quads = [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles: Vec<[u32; 3]> =
        quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

fn cube_at(center: DVec3, half: f64) -> Aabb {
    Aabb { min: center - half, max: center + half }
}

#[test]
fn boxes_that_are_none_are_never_hidden() {
    let (wall, view) = wall();
    let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
    buffer.draw(&wall, &DAffine3::from_scale(DVec3::new(50.0, 50.0, 1.0)));
    let sampled = SampledBuffer::new(&view).unwrap();
    sampled.draw(&wall, &DAffine3::from_scale(DVec3::new(50.0, 50.0, 1.0)));
    let behind = cube_at(DVec3::NEG_Z * 10.0, 1.0);
    assert_eq!(buffer.ask_box(&behind), Verdict::Hidden);
    assert_eq!(sampled.ask_box(&behind), Verdict::Hidden);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        for axis in 0..3 {
            for end in 0..2 {
                let mut b = behind;
                let side = if end == 0 { &mut b.min } else { &mut b.max };
                side[axis] = bad;
                assert_eq!(buffer.ask_box(&b), Verdict::Visible, "{b:?}");
                assert_eq!(sampled.ask_box(&b), Verdict::Visible, "{b:?}");
            }
        }
        if !bad.is_finite() {
            assert_eq!(buffer.ask_sphere(DVec3::new(0.0, 0.0, bad), 1.0), Verdict::Visible);
        }
        assert_eq!(buffer.ask_sphere(DVec3::NEG_Z * 9.0, bad.abs()), Verdict::Visible);
        let rect = ScreenRect { left: 1.0, top: 1.0, right: 2.0, bottom: 2.0, depth: bad as f32 };
        assert!(bad == f64::NEG_INFINITY || buffer.ask_rect(&rect) == Verdict::Visible);
    }
    assert_eq!(buffer.ask_box(&Aabb::EMPTY), Verdict::Visible);
    // Around the eye, behind it, beside the view.
    assert_eq!(buffer.ask_box(&cube_at(DVec3::Z * 5.0, 1.0)), Verdict::Visible);
    assert_eq!(buffer.ask_box(&cube_at(DVec3::Z * 9.0, 1.0)), Verdict::Outside);
    assert_eq!(buffer.ask_box(&cube_at(DVec3::X * 90.0, 1.0)), Verdict::Outside);
    let mut verdicts = vec![Verdict::Visible];
    buffer.ask(&Boxes::default(), &mut verdicts);
    assert!(verdicts.is_empty());
}

#[test]
fn balls_rectangles_and_meshes_agree_with_boxes() {
    let (wall, view) = wall();
    let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
    buffer.draw(&wall, &DAffine3::from_scale(DVec3::new(2.0, 2.0, 0.1)));
    let (positions, triangles) = cube();
    let cube = Occludee::new(&positions, &triangles).unwrap();
    let random = &mut Random::new(9);
    let mut counts = [0; 3];
    for _ in 0..3000 {
        let center =
            DVec3::new(random.between(-4.0, 4.0), random.between(-4.0, 4.0), random.between(-9.0, 6.0));
        let half = random.between(0.01, 1.0);
        let around = buffer.ask_box(&cube_at(center, half));
        counts[around as usize] += 1;
        // A ball that reaches the near plane is not looked at more closely.
        if around != Verdict::Visible && center.z + half < 4.8 {
            assert_ne!(buffer.ask_sphere(center, half * 0.999), Verdict::Visible, "{center} {half}");
            let at = DAffine3::from_scale_rotation_translation(
                DVec3::splat(half * 1.998),
                glam::DQuat::IDENTITY,
                center,
            );
            assert_ne!(buffer.ask_mesh(&cube, &at), Verdict::Visible, "{center} {half}");
        }
        if buffer.ask_sphere(center, half * 1.75) == Verdict::Hidden {
            assert_eq!(around, Verdict::Hidden, "{center} {half}");
        }
    }
    assert!(counts.iter().all(|&c| c > 100), "{counts:?}");
    many_are_judged_as_each(&buffer, &cube, random);
    let middle = |depth| ScreenRect { left: 70.0, top: 50.0, right: 90.0, bottom: 70.0, depth };
    assert_eq!(buffer.ask_rect(&middle(0.01)), Verdict::Hidden);
    assert_eq!(buffer.ask_rect(&middle(0.5)), Verdict::Visible);
    assert_eq!(buffer.ask_rect(&ScreenRect { left: 161.0, right: 170.0, ..middle(0.5) }), Verdict::Outside);
}

fn many_are_judged_as_each(buffer: &OcclusionBuffer, mesh: &Occludee, random: &mut Random) {
    let balls: Vec<Ball> = (0..300)
        .map(|_| Ball { center: random.point(5.0) - DVec3::Z * 4.0, radius: random.between(0.01, 1.0) })
        .collect();
    let rect = |random: &mut Random| {
        let (left, top) = (random.between(-20.0, 170.0), random.between(-20.0, 130.0));
        let (right, bottom) = (left + random.between(0.0, 30.0), top + random.between(0.0, 30.0));
        ScreenRect { left, top, right, bottom, depth: random.between(0.0, 0.1) as f32 }
    };
    let rects: Vec<ScreenRect> = (0..300).map(|_| rect(random)).collect();
    let placed = |ball: &Ball| {
        let scale = DVec3::splat(ball.radius);
        let world_from_object =
            DAffine3::from_scale_rotation_translation(scale, glam::DQuat::IDENTITY, ball.center);
        PlacedMesh { mesh, world_from_object }
    };
    let meshes: Vec<PlacedMesh> = balls.iter().map(placed).collect();
    let mut many = [vec![Verdict::Visible], Vec::new(), Vec::new()];
    buffer.ask_balls(&balls, &mut many[0]);
    buffer.ask_rects(&rects, &mut many[1]);
    buffer.ask_meshes(&meshes, &mut many[2]);
    let each = [
        balls.iter().map(|b| buffer.ask_sphere(b.center, b.radius)).collect::<Vec<_>>(),
        rects.iter().map(|r| buffer.ask_rect(r)).collect(),
        meshes.iter().map(|m| buffer.ask_mesh(m.mesh, &m.world_from_object)).collect(),
    ];
    assert_eq!(many, each);
    for verdicts in &many {
        assert!(verdicts.contains(&Verdict::Visible) && verdicts.contains(&Verdict::Hidden), "{verdicts:?}");
    }
}

#[test]
fn merging_is_drawing_both_and_more_occluders_never_reveal() {
    for seed in 0..60 {
        let (scene, view) = (trouble::scene(seed + 300), trouble::view(seed + 300));
        let occluders: Vec<Occluder> =
            scene.meshes.iter().map(|m| Occluder::of_mesh(m, &scene.materials)).collect();
        let empty = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
        let (mut both, mut halves) = (empty.clone(), [empty.clone(), empty]);
        for (i, instance) in scene.instances().iter().enumerate() {
            let before = both.depths();
            both.draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
            assert!(both.depths().iter().zip(&before).all(|(now, then)| now >= then), "seed {seed}");
            halves[i % 2].draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
        }
        let [mut one, other] = halves;
        one.merge(&other).unwrap();
        assert!(one.depths() == both.depths(), "seed {seed}");
    }
    let (_, view) = wall();
    let mut small = OcclusionBuffer::new(&View { width: 10, ..view }, &OcclusionOptions::default()).unwrap();
    assert!(small.merge(&OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap()).is_err());
}

#[test]
fn sizes_from_one_pixel_to_the_largest() {
    let (wall, view) = wall();
    for (width, height) in [(1, 1), (1, 16384), (16384, 1), (16384, 16), (17, 33)] {
        let view = View { width, height, ..view };
        let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
        buffer.draw(&wall, &DAffine3::from_scale(DVec3::new(1e5, 1e5, 1.0)));
        assert!(buffer.depths().iter().all(|&d| d > 0.0), "{width}x{height}");
        assert_eq!(buffer.ask_box(&cube_at(DVec3::NEG_Z * 10.0, 1.0)), Verdict::Hidden);
        buffer.clear();
        assert!(buffer.depths().iter().all(|&d| d == 0.0));
    }
    for (width, height) in [(0, 1), (1, 0), (16385, 1)] {
        let wrong = View { width, height, ..view };
        assert!(OcclusionBuffer::new(&wrong, &OcclusionOptions::default()).is_err());
        assert!(SharedBuffer::new(&wrong, &OcclusionOptions::default(), 2).is_err());
        assert!(SampledBuffer::new(&wrong).is_err());
    }
    let wrong = OcclusionOptions { eye_moves: f64::NAN, ..OcclusionOptions::default() };
    assert!(OcclusionBuffer::new(&view, &wrong).is_err());
}

#[test]
fn eyes_in_on_and_at_a_corner_of_an_occluder_are_told_the_truth() {
    let (wall, view) = wall();
    let random = &mut Random::new(21);
    let mut scene = Scene::new("wall");
    scene.materials = vec![Material::default()];
    let mut mesh = Mesh::default();
    for (corners, _) in wall.triangles() {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(Vec3::from));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh.primitives = vec![Primitive { triangles: 0..12, material: Some(0) }];
    scene.meshes = vec![mesh];
    scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
    for eye in
        [DVec3::ZERO, DVec3::splat(0.5), DVec3::new(0.5, 0.1, 0.2), DVec3::new(0.5, 3.0, 0.5), DVec3::X]
    {
        for target in [DVec3::NEG_Z, DVec3::new(0.3, 0.2, -0.9), DVec3::Y * 0.4] {
            let lens = Projection::Perspective { fov_y: 1.5, near: 0.01 };
            let view = View::look_at(eye, eye + target, DVec3::X, lens, (view.width / 4, view.height / 4));
            attack(&scene, &view, random, 4, &format!("{eye} {target}"));
        }
    }
}
