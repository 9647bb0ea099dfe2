//! One scene, all algorithms, one truth: the hierarchical z-buffer equals the plain one in every id and
//! every depth bit, whatever the window, the threads and the instruction set, and both agree with the
//! brute-force witnesses of `reference`.

use fearless_simd::Level;
use glam::{DQuat, DVec3};
use hither::conventions::View;
use hither::index::TreeKind;
use hither::reference::trouble::Random;
use hither::reference::{Caster, Judgement, trouble, zbuffer};
use hither::render::{BoxTest, Coherence};
use hither::scene::{Content, Transform};
use hither::{Algorithm, Frame, IndexOptions, RenderOptions, Renderer, Scene, SceneIndex, render};
use proptest::prelude::*;

/// Every instruction set this machine has; with the feature `portable`, code without any too.
fn levels() -> Vec<Level> {
    let best = Level::new();
    let others: [Option<Level>; _] = [
        #[cfg(feature = "portable")]
        Some(Level::fallback()),
        #[cfg(target_arch = "x86_64")]
        best.as_avx2().map(Level::Avx2),
        #[cfg(target_arch = "x86_64")]
        best.as_sse4_2().map(Level::Sse4_2),
        #[cfg(target_arch = "x86_64")]
        best.as_sse2().map(Level::Sse2),
    ];
    std::iter::once(best).chain(others.into_iter().flatten()).collect()
}

fn plain(level: Level) -> RenderOptions {
    RenderOptions { algorithm: Algorithm::ZBuffer, level, ..RenderOptions::default() }
}

/// The first pixel at which two frames differ.
fn difference(a: &Frame, b: &Frame) -> Option<String> {
    for y in 0..a.view.height {
        for x in 0..a.view.width {
            let (p, q) = ((a.id(x, y), a.depth(x, y)), (b.id(x, y), b.depth(x, y)));
            if p.0 != q.0 || p.1.to_bits() != q.1.to_bits() {
                return Some(format!("pixel ({x}, {y}): {p:?} and {q:?}"));
            }
        }
    }
    None
}

fn index_of(scene: Scene) -> SceneIndex {
    SceneIndex::build(scene, &IndexOptions::default())
}

const TREES: [TreeKind; 3] = [TreeKind::Bvh, TreeKind::OctreeSmallest, TreeKind::OctreePushed];

fn check_everything(scene: Scene, view: &View) -> Result<(), String> {
    let indices = TREES.map(|tree| SceneIndex::build(scene.clone(), &IndexOptions { tree }));
    let index = &indices[0];
    let truth = render(index, view, &plain(Level::new())).map_err(|e| e.to_string())?;
    // Each variant on a tree, and on another one with the next instruction set.
    for (turn, level) in levels().into_iter().enumerate() {
        let hzb = RenderOptions { level, ..RenderOptions::default() };
        let variants = [
            plain(level),
            hzb,
            RenderOptions { window_width: 16, ..hzb },
            RenderOptions { window_width: 32, threads: 3, ..hzb },
            RenderOptions { complexity: true, ..hzb },
            RenderOptions { box_test: BoxTest::Definitive, ..hzb },
        ];
        for (i, options) in variants.into_iter().enumerate() {
            let index = &indices[(turn + i) % TREES.len()];
            let frame = render(index, view, &options).map_err(|e| e.to_string())?;
            if let Some(at) = difference(&truth, &frame) {
                let tree = index.options().tree;
                return Err(format!("{tree:?}, {options:?} differs from the plain z-buffer: {at}"));
            }
        }
    }
    let caster = Caster::new(index.scene(), view);
    for y in 0..view.height {
        for x in 0..view.width {
            let seen = truth.id(x, y).map(|id| (id, truth.depth(x, y)));
            if let Judgement::Wrong(why) = caster.probe(x, y).judge(seen) {
                return Err(why);
            }
        }
    }
    Ok(())
}

#[test]
fn every_variant_agrees_on_troublesome_scenes() {
    for seed in 0..120 {
        check_everything(trouble::scene(seed), &trouble::view(seed))
            .unwrap_or_else(|why| panic!("seed {seed}: {why}"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn every_variant_agrees(scene_seed: u64, view_seed: u64) {
        let checked = check_everything(trouble::scene(scene_seed), &trouble::view(view_seed));
        prop_assert!(checked.is_ok(), "{}", checked.unwrap_err());
    }
}

/// The textbook z-buffer snaps the same way and must cover the same pixels, except where its own clipping
/// or an equal depth decides; the ray caster judges those.
#[test]
fn the_textbook_z_buffer_sees_the_same() {
    let (mut same, mut other) = (0, 0);
    for seed in 0..200 {
        let (scene, view) = (trouble::scene(seed), trouble::view(seed));
        let drawing = zbuffer::draw(&scene, &view);
        let index = index_of(scene);
        let frame = render(&index, &view, &RenderOptions::default()).unwrap();
        for y in 0..view.height {
            for x in 0..view.width {
                let equal = drawing.seen(x, y).map(|s| s.0) == frame.id(x, y);
                (same, other) = if equal { (same + 1, other) } else { (same, other + 1) };
            }
        }
    }
    assert!(other * 500 < same, "{other} pixels differ, {same} are the same");
}

#[test]
fn moving_instances_and_reused_buffers_change_nothing() {
    for seed in 0..40 {
        let (scene, view) = (trouble::scene(seed), trouble::view(seed));
        let nodes = scene.root_group().nodes.len() as u32;
        let mut index = index_of(scene);
        let mut renderers =
            [Coherence::Never, Coherence::WherePays, Coherence::Always].map(|c| (Renderer::new(), c));
        for step in 0..6 {
            let t = f64::from(step);
            let moved = step % nodes;
            index.set_transform(
                moved,
                Transform::Trs {
                    translation: DVec3::new(t.sin() * 3.0, t * 0.3 - 1.0, t.cos() * 3.0 - 4.0),
                    rotation: DQuat::from_rotation_y(t),
                    scale: DVec3::new(1.0, if step == 3 { -1.0 } else { 1.0 }, 1.0),
                },
            );
            index.validate();
            let fresh = index_of(index.scene().clone());
            let truth = render(&fresh, &view, &plain(Level::new())).unwrap();
            for (renderer, coherence) in &mut renderers {
                let options = RenderOptions { coherence: *coherence, ..RenderOptions::default() };
                let frame = renderer.render(&index, &view, &options).unwrap();
                if let Some(at) = difference(&truth, &frame) {
                    panic!("seed {seed}, step {step}, {coherence:?}: {at}");
                }
                renderer.recycle(frame);
            }
        }
    }
}

#[test]
fn coherence_changes_nothing_while_the_eye_moves() {
    for seed in 0..40 {
        let scene = trouble::scene(seed);
        let index = index_of(scene);
        let mut coherent = Renderer::new();
        for step in 0..5 {
            let mut view = trouble::view(seed);
            view.view_from_world.translation += DVec3::new(0.2, -0.1, 0.3) * step as f64;
            let truth = render(&index, &view, &plain(Level::new())).unwrap();
            let options = RenderOptions {
                coherence: Coherence::Always,
                threads: 1 + step % 3,
                window_width: 16 * (step as u32 % 2),
                ..RenderOptions::default()
            };
            let frame = coherent.render(&index, &view, &options).unwrap();
            if let Some(at) = difference(&truth, &frame) {
                panic!("seed {seed}, step {step}: {at}");
            }
            coherent.recycle(frame);
        }
    }
}

/// Up to so far that f64 tells no more than an eighth of a metre there.
#[test]
fn far_from_the_origin_all_draw_the_same() {
    let mut covered = [0; 6];
    for seed in 0..240 {
        let random = &mut Random::new(77_000 + seed);
        let (mut scene, mut view) = (trouble::scene(seed), trouble::view(seed));
        let at = seed as usize % 6;
        let offset = random.point(1.0).normalize_or(DVec3::X) * [1e3, 1e5, 5.4e6, 1e9, 1e12, 1e15][at];
        let offset = glam::DAffine3::from_translation(offset);
        view.view_from_world *= offset.inverse();
        let root = scene.root as usize;
        for node in scene.groups[root].nodes.iter_mut().filter(|n| n.parent.is_none()) {
            node.local = Transform::Affine(offset * node.local.matrix());
        }
        let tree = TREES[random.below(3) as usize];
        let index = SceneIndex::build(scene, &IndexOptions { tree });
        let truth = render(&index, &view, &plain(Level::new())).unwrap();
        for box_test in [BoxTest::Rectangle, BoxTest::Definitive] {
            let options = RenderOptions { box_test, ..RenderOptions::default() };
            let frame = render(&index, &view, &options).unwrap();
            assert_eq!(difference(&truth, &frame), None, "seed {seed}, {offset}, {tree:?}, {box_test:?}");
        }
        // Nearer, the textbook's z-buffer sees the same but for what rounding moves.
        let by_the_book = zbuffer::draw(index.scene(), &view);
        let pixels = || (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        let seen = pixels().filter(|&(x, y)| truth.id(x, y).is_some()).count();
        let by_the_book = pixels().filter(|&(x, y)| by_the_book.seen(x, y).is_some()).count();
        assert!(at > 2 || seen.abs_diff(by_the_book) <= 2 + seen / 100, "seed {seed}: {seen}, {by_the_book}");
        covered[at] += seen;
    }
    assert!(covered.iter().all(|&pixels| pixels > 2_000), "{covered:?}");
}

/// Options drawn at random; all of them must give the same picture.
fn any_options(random: &mut Random) -> RenderOptions {
    let levels = levels();
    RenderOptions {
        algorithm: if random.one_in(6) { Algorithm::ZBuffer } else { Algorithm::Hzb },
        box_test: if random.one_in(3) { BoxTest::Definitive } else { BoxTest::Rectangle },
        threads: 1 + random.below(4) as usize,
        coherence: [Coherence::Never, Coherence::WherePays, Coherence::Always][random.below(3) as usize],
        complexity: random.one_in(6),
        window_width: [0, 16, 32, 48, 112, 256][random.below(6) as usize],
        level: levels[random.below(levels.len() as u32) as usize],
    }
}

/// A step for an instance or an eye: mostly a small one, sometimes a leap; turned, and at times mirrored.
fn any_motion(random: &mut Random) -> Transform {
    let reach = if random.one_in(4) { 5.0 } else { 0.3 };
    let mirror = if random.one_in(5) { -1.0 } else { 1.0 };
    Transform::Trs {
        translation: random.point(reach),
        rotation: DQuat::from_axis_angle(random.point(1.0).normalize_or(DVec3::Y), random.between(-0.2, 0.2)),
        scale: DVec3::new(mirror, random.between(0.7, 1.4), 1.0),
    }
}

/// Tree, instruction set, threads, windows and coherence at random, while instances and the eye move; half of the
/// pictures are wide enough for several windows and levels of the pyramid.
#[test]
fn nothing_shows_how_it_was_drawn_while_instances_and_the_eye_move() {
    for seed in 0..60 {
        let random = &mut Random::new(900_000 + seed);
        let (scene, mut view) = (trouble::scene(seed), trouble::view(seed));
        if seed % 2 == 0 {
            (view.width, view.height) = (200 + random.below(201), 20 + random.below(180));
        }
        let nodes = scene.root_group().nodes.len() as u32;
        let tree = TREES[random.below(3) as usize];
        let mut index = SceneIndex::build(scene, &IndexOptions { tree });
        let mut renderers: Vec<(Renderer, RenderOptions)> =
            (0..4).map(|_| (Renderer::new(), any_options(random))).collect();
        for step in 0..6 {
            let moves: Vec<(u32, Transform)> = (0..random.below(3))
                .map(|_| {
                    let node = random.below(nodes);
                    let before = index.scene().root_group().nodes[node as usize].local.matrix();
                    (node, Transform::Affine(any_motion(random).matrix() * before))
                })
                .collect();
            index.set_transforms(moves);
            if !random.one_in(3) {
                let (_, rotation, translation) = any_motion(random).matrix().to_scale_rotation_translation();
                view.view_from_world =
                    glam::DAffine3::from_rotation_translation(rotation, translation) * view.view_from_world;
            }
            let fresh = index_of(index.scene().clone());
            let truth = render(&fresh, &view, &plain(Level::new())).unwrap();
            for (renderer, options) in &mut renderers {
                if random.one_in(5) {
                    *options = any_options(random);
                }
                let frame = renderer.render(&index, &view, options).unwrap();
                if let Some(at) = difference(&truth, &frame) {
                    panic!("seed {seed}, step {step}, {tree:?}, {options:?}: {at}");
                }
                renderer.recycle(frame);
            }
        }
    }
}

/// A finely tessellated flat sheet that fills the view, seen head-on: no crack on a shared edge, no double hit.
/// (`closed.rs` has closed surfaces.)
#[test]
fn shared_edges_are_drawn_exactly_once() {
    use hither::scene::{Mesh, Node, Primitive};
    let mut mesh = Mesh::default();
    let n = 37u32;
    for j in 0..=n {
        for i in 0..=n {
            let wobble = |a: u32| (a.wrapping_mul(2_654_435_761) >> 20) as f32 / 4096.0 - 0.5;
            let inner = i > 0 && i < n && j > 0 && j < n;
            let (dx, dy) = if inner { (wobble(i * 97 + j), wobble(j * 89 + i)) } else { (0.0, 0.0) };
            let at = |v: u32, d: f32| (v as f32 + d * 0.45) / n as f32 * 2.0 - 1.0;
            mesh.positions.push(glam::Vec3::new(at(i, dx), at(j, dy), -2.0));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let v = |di, dj| (j + dj) * (n + 1) + i + di;
            mesh.triangles.push([v(0, 0), v(1, 0), v(1, 1)]);
            mesh.triangles.push([v(0, 0), v(1, 1), v(0, 1)]);
        }
    }
    mesh.primitives = vec![Primitive { triangles: 0..mesh.triangles.len() as u32, material: None }];
    let mut scene = Scene::new("sheet");
    scene.meshes.push(mesh);
    scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
    let index = index_of(scene);
    for size in [(64, 64), (97, 61), (256, 200)] {
        // The sheet fills the view exactly at distance 2, and more than fills it when nearer.
        for fov in [0.7, 0.9, 2.0 * 0.5f64.atan() * 0.999] {
            let projection = hither::conventions::Projection::Perspective { fov_y: fov, near: 0.1 };
            let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (size.1, size.1));
            let frame = render(&index, &view, &plain(Level::new())).unwrap();
            let pixels = u64::from(size.1) * u64::from(size.1);
            assert_eq!(frame.counters.pixels_written, pixels, "size {size:?}, fov {fov}");
            let holes = (0..size.1).flat_map(|y| (0..size.1).map(move |x| (x, y)));
            assert_eq!(holes.filter(|&(x, y)| frame.id(x, y).is_none()).count(), 0);
        }
    }
}

/// Edge functions of a large triangle do not fit into 32 bits, however few pixels of it are in the picture.
#[test]
fn a_large_triangle_is_right_in_a_picture_of_a_pixel_or_two() {
    use hither::scene::{Mesh, Node, Primitive};
    let mut random = Random::new(77);
    for case in 0..3000 {
        let mut mesh = Mesh::default();
        for _ in 0..3 {
            let mut far = || random.between(-8000.0, 8000.0) as f32;
            mesh.positions.push(glam::Vec3::new(far(), far(), -1.0));
        }
        mesh.triangles = vec![[0, 1, 2], [0, 2, 1]];
        mesh.primitives = vec![Primitive { triangles: 0..2, material: None }];
        let mut scene = Scene::new("large");
        scene.meshes.push(mesh);
        scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
        let size = [(1, 1), (2, 1), (1, 2), (2, 2)][case % 4];
        let half_height = f64::from(size.1) * 0.5;
        let projection = hither::conventions::Projection::Orthographic { half_height, near: 0.0, far: 2.0 };
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, size);
        check_everything(scene, &view).unwrap_or_else(|why| panic!("case {case}: {why}"));
    }
}
