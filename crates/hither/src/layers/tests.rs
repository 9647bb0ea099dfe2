//! Layers against the picture they are layers of.

use super::*;
use crate::conventions::{Projection, View};
use crate::order::{Granularity, Parts, SortOptions, VisibilitySort};
use crate::reference::trouble;
use crate::render::Shading;
use crate::scene::{AlphaMode, Content, Group, Mesh, Node, Primitive, Scene, Transform};
use glam::{DAffine3, DQuat, DVec3, Vec3};

struct Random(u32);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0) * u64::from(n)) >> 32) as u32
    }
}

fn ring() -> Component {
    Component { layers: vec![vec![0], vec![1], vec![2]], arcs: vec![(0, 1), (1, 2), (2, 0)] }
}

fn letters(layer: u32) -> String {
    char::from(b'A' + layer as u8).to_string()
}

#[test]
fn figure_14_both_ways() {
    let text = Expression::of(&[ring()]).text(&letters);
    assert_eq!(text, "(C atop A) over B over C");
    assert_eq!(sum_of_outs(&ring(), 0).text(&letters), "A out C + B out A + C out B");
}

#[test]
fn a_ring_takes_the_operations_that_the_paper_counts() {
    for n in 3..20u32 {
        let arcs = (0..n).map(|i| (i, (i + 1) % n)).collect();
        let component = Component { layers: (0..n).map(|i| vec![i]).collect(), arcs };
        let program = Program::compile(&[component]);
        let count = |operation| program.instructions.iter().filter(|i| i.operation == operation).count();
        // n − 1 over from memory and one from the sum; one in, one out, two sums of which one is a load.
        assert_eq!(count(Operation::Over), n as usize, "{n}");
        assert_eq!((count(Operation::In), count(Operation::Out), count(Operation::Add)), (1, 1, 2), "{n}");
    }
}

/// A picture of layers whose order differs from pixel to pixel, but never between two: (layers, arcs, truth).
fn puzzle(random: &mut Random) -> (Vec<Sprite>, Vec<(u32, u32)>, Canvas) {
    const SIDE: u32 = 16;
    let n = 2 + random.below(7);
    let mut before = vec![vec![false; n as usize]; n as usize];
    let pairs = (0..n as usize).flat_map(|a| (a + 1..n as usize).map(move |b| (a, b)));
    for (a, b) in pairs {
        let first = random.below(2) == 0;
        (before[a][b], before[b][a]) = (first, !first);
    }
    let mut pictures = vec![Canvas::new(SIDE, SIDE); n as usize];
    let mut truth = Canvas::new(SIDE, SIDE);
    let mut arcs = Vec::new();
    for pixel in 0..(SIDE * SIDE) as usize {
        let mut here: Vec<usize> = (0..n as usize).filter(|_| random.below(3) == 0).collect();
        // Drop what closes a cycle: an order must exist at every pixel.
        let mut kept: Vec<usize> = Vec::new();
        for layer in here.drain(..) {
            let place = kept.iter().position(|&k| before[layer][k]).unwrap_or(kept.len());
            if kept[place..].iter().all(|&k| before[layer][k])
                && kept[..place].iter().all(|&k| before[k][layer])
            {
                kept.insert(place, layer);
            }
        }
        for (i, &a) in kept.iter().enumerate() {
            arcs.extend(kept[i + 1..].iter().map(|&b| (a as u32, b as u32)));
            pictures[a].pixels[pixel] = [random.below(99) as f32 / 7.0, a as f32, 0.3, 1.0];
        }
        if let Some(&front) = kept.first() {
            truth.pixels[pixel] = pictures[front].pixels[pixel];
        }
    }
    arcs.sort_unstable();
    arcs.dedup();
    (pictures.iter().map(|p| Sprite::cut(SIDE, &p.pixels)).collect(), arcs, truth)
}

#[test]
fn programs_and_expressions_restore_any_picture_without_mutual_occluders_bit_for_bit() {
    let mut random = Random(3);
    for _ in 0..400 {
        let (sprites, arcs, truth) = puzzle(&mut random);
        let component = Component { layers: (0..sprites.len() as u32).map(|i| vec![i]).collect(), arcs };
        let size = (truth.width, truth.height);
        let components = [component];
        let program = Program::compile(&components);
        assert_eq!(program.run(size, |l| Some(&sprites[l as usize])), truth, "{components:?}");
        let load = |l: u32| Some(sprites[l as usize].clone());
        assert_eq!(Expression::of(&components).evaluate(size, &load), truth);
        assert_eq!(sum_of_outs(&components[0], 0).evaluate(size, &load), truth);
        assert!(program.instructions.len() <= 1 + 3 * sprites.len() + components[0].arcs.len());
    }
}

#[test]
fn a_layer_left_out_is_as_if_it_were_not_there() {
    let mut random = Random(11);
    for _ in 0..100 {
        let (sprites, arcs, _) = puzzle(&mut random);
        let n = sprites.len() as u32;
        let gone = random.below(n);
        let whole = Component { layers: (0..n).map(|i| vec![i]).collect(), arcs: arcs.clone() };
        let rest = Component {
            layers: whole.layers.clone(),
            arcs: arcs.iter().copied().filter(|a| a.0 != gone && a.1 != gone).collect(),
        };
        let load = |l: u32| (l != gone).then(|| &sprites[l as usize]);
        assert_eq!(
            Program::compile(&[whole]).run((16, 16), load),
            Program::compile(&[rest]).run((16, 16), load)
        );
    }
}

/// Sorts a scene, paints its layers, composites them, and paints it directly.
fn both_ways(
    scene: &Scene,
    view: &View,
    options: &PaintOptions,
) -> (Canvas, Canvas, Vec<Component>, Vec<Sprite>) {
    let parts = Parts::of(scene, &Granularity::Instances).unwrap();
    let slack = 1.0 / (256.0 * view.pixels_per_unit()) + 1e-6;
    let mut sort = VisibilitySort::new(SortOptions { slack, ..SortOptions::default() });
    parts.add_to(&mut sort);
    parts.place_in(&mut sort, scene);
    let order = sort.sort(view.eye_in_world()).clone();
    let components = decompose(&order, |group| sort.arcs_among(group));
    let mut painter = LayerPainter::new(scene);
    let mut sprites = Vec::new();
    for layer in components.iter().flat_map(|c| &c.layers) {
        let mut instances: Vec<u32> =
            layer.iter().flat_map(|&p| parts.parts[p as usize].instances.iter().copied()).collect();
        instances.sort_unstable();
        sprites.push(painter.paint(&instances, view, options).unwrap().sprite);
    }
    let size = (view.width, view.height);
    let composite = Program::compile(&components).run(size, |l| Some(&sprites[l as usize]));
    let direct = painter.paint_all(view, options).unwrap().sprite.expanded(size.0, size.1);
    (composite, Canvas { width: size.0, height: size.1, pixels: direct }, components, sprites)
}

/// Shapes of a troublesome scene, small and strewn over the view, so that some stand alone; perhaps opaque.
fn strewn(seed: u64, opaque: bool) -> (Scene, View) {
    let (mut scene, mut view) = (trouble::scene(seed), trouble::view(seed));
    view.projection = Projection::Perspective { fov_y: 1.0, near: 0.01 };
    if opaque {
        scene
            .materials
            .iter_mut()
            .filter(|m| m.alpha == AlphaMode::Blend)
            .for_each(|m| m.alpha = AlphaMode::Opaque);
    }
    let mut random = Random(seed as u32 * 77 + 5);
    let mut unit = || f64::from(random.below(10_000)) / 5_000.0 - 1.0;
    let world_from_view = view.view_from_world.inverse();
    let nodes = (0..12).map(|i| {
        let axis = DVec3::new(unit(), unit(), unit()).normalize_or(DVec3::X);
        let away = 5.0 + 3.0 * unit();
        let at =
            world_from_view.transform_point3(DVec3::new(unit() * away * 0.5, unit() * away * 0.5, -away));
        let turn = DQuat::from_axis_angle(axis, 3.0 * unit());
        let local = Transform::Trs { translation: at, rotation: turn, scale: DVec3::splat(0.3) };
        Node { local, content: Content::Mesh(i % scene.meshes.len() as u32), ..Node::default() }
    });
    let nodes = nodes.collect();
    scene.groups = vec![Group { name: String::new(), nodes }];
    scene.root = 0;
    scene.cameras.clear();
    scene.animations.clear();
    (scene, view)
}

#[test]
fn opaque_scenes_come_back_bit_for_bit() {
    let mut several = 0;
    for seed in 0..120 {
        let (mut scene, mut view) = strewn(seed, true);
        if seed % 4 == 0 {
            // As they come: everything through everything else, the eye inside, coincident copies.
            (scene.groups, scene.root) = (trouble::scene(seed).groups, trouble::scene(seed).root);
            let other = trouble::view(seed);
            (view.view_from_world, view.width, view.height) =
                (other.view_from_world, other.width, other.height);
        }
        let (composite, direct, components, _) = both_ways(&scene, &view, &PaintOptions::default());
        several += usize::from(components.len() > 1);
        assert!(composite == direct, "seed {seed}");
    }
    assert!(several > 30, "{several} of several components");
}

#[test]
fn blended_scenes_come_back_where_no_cycle_is_composited() {
    for seed in 0..80 {
        let (scene, view) = strewn(seed, false);
        let (composite, direct, components, _) = both_ways(&scene, &view, &PaintOptions::default());
        let cyclic = components.iter().any(|c| c.layers.len() > 1);
        let mut pairs = composite.pixels.as_flattened().iter().zip(direct.pixels.as_flattened());
        assert!(cyclic || pairs.all(|(a, b)| (a - b).abs() < 1e-5), "seed {seed}");
    }
}

/// Each part of nearly one colour: where a layer's colour varies within a pixel, which part of it is covered matters,
/// too, and triangles of an instance differ a little.
#[test]
fn with_coverage_only_pixels_of_several_partial_layers_differ() {
    let (mut compared, mut beyond) = (0, 0);
    let options = PaintOptions { samples: 3, shading: Shading::Ids, ..PaintOptions::default() };
    for seed in 0..40 {
        let (scene, view) = strewn(seed, true);
        let (composite, direct, components, sprites) = both_ways(&scene, &view, &options);
        let single: Vec<bool> = components.iter().flat_map(|c| &c.layers).map(|l| l.len() == 1).collect();
        for y in 0..view.height {
            for x in 0..view.width {
                let cover: Vec<f32> = sprites.iter().map(|s| s.at(x, y)[3]).collect();
                let partial = cover.iter().filter(|&&a| a > 0.0001 && a < 0.9999).count();
                if partial > 1 || cover.iter().zip(&single).any(|(&a, &single)| a > 0.0 && !single) {
                    continue;
                }
                let at = (y * view.width + x) as usize;
                let (a, b) = (composite.pixels[at], direct.pixels[at]);
                let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(off < 0.05, "seed {seed} ({x}, {y}): {a:?} {b:?}");
                assert!((a[3] - b[3]).abs() < 1e-6, "seed {seed} ({x}, {y}): {a:?} {b:?}");
                compared += usize::from(b[3] > 0.0);
                beyond += usize::from(off > 1.0 / 255.0);
            }
        }
    }
    assert!(compared > 500 && beyond * 50 < compared, "{beyond} of {compared}");
}

#[test]
fn a_ring_of_bars_is_three_layers_and_their_expression_is_the_picture() {
    let (mut scene, mut view) = strewn(0, true);
    let mut bar = Mesh::default();
    for i in 0..8u32 {
        let side = |bit: u32, half: f32| if i >> bit & 1 == 0 { -half } else { half };
        bar.positions.push(Vec3::new(side(0, 1.6), side(1, 0.1), side(2, 0.3)));
    }
    for [a, b, c, d] in [[0, 1, 3, 2], [5, 4, 6, 7], [4, 0, 2, 6], [1, 5, 7, 3], [2, 3, 7, 6], [4, 5, 1, 0]] {
        bar.triangles.extend([[a, c, b], [a, d, c]]);
    }
    bar.primitives = vec![Primitive { triangles: 0..12, material: None }];
    scene.meshes = vec![bar];
    let node = |i: u32| {
        let turn = DAffine3::from_rotation_y(f64::from(i) * 120f64.to_radians());
        let tilt = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.8)) * DAffine3::from_rotation_z(0.3);
        Node { local: Transform::Affine(turn * tilt), content: Content::Mesh(0), ..Node::default() }
    };
    scene.groups[0].nodes = (0..3).map(node).collect();
    view = View::look_at(DVec3::Y * 5.0, DVec3::ZERO, DVec3::Z, view.projection, (160, 160));
    let (composite, direct, components, _) = both_ways(&scene, &view, &PaintOptions::default());
    assert_eq!(components.len(), 1);
    assert_eq!(components[0].layers.len(), 3);
    assert!(composite == direct);
    assert!(direct.pixels.iter().filter(|p| p[3] > 0.0).count() > 2000);
}
