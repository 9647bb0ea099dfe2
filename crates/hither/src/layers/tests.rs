//! Layers against the picture they are layers of.

use super::*;
use crate::conventions::{Projection, View};
use crate::order::{Granularity, Parts, SortOptions, VisibilitySort};
use crate::reference::trouble;
use crate::render::Shading;
use crate::scene::{AlphaMode, Content, Group, Mesh, Node, Primitive, Scene, Transform};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use std::collections::HashMap;

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

/// What decides about occlusion, and what becomes of mutual occluders.
#[derive(Clone, Copy, Debug, PartialEq)]
enum By {
    Hulls,
    Samples,
    SamplesHeldOut,
}

const WAYS: [By; 3] = [By::Hulls, By::Samples, By::SamplesHeldOut];

/// A scene's picture by layers and drawn directly, and the layers.
struct BothWays {
    composite: Canvas,
    direct: Canvas,
    components: Vec<Component>,
    sprites: Vec<Sprite>,
}

/// Sorts a scene, paints its layers, composites them, and paints it directly.
fn both_ways(scene: &Scene, view: &View, options: &PaintOptions, by: By) -> BothWays {
    let parts = Parts::of(scene, &Granularity::Instances).unwrap();
    let slack = 1.0 / (256.0 * view.pixels_per_unit()) + 1e-6;
    let mut sort = VisibilitySort::new(SortOptions { slack, ..SortOptions::default() });
    parts.add_to(&mut sort);
    parts.place_in(&mut sort, scene);
    let order = sort.sort(view.eye_in_world()).clone();
    let mut painter = LayerPainter::new(scene);
    let instances = |layer: &[u32]| {
        let of = |&p: &u32| parts.parts[p as usize].instances.iter().copied();
        let mut instances: Vec<u32> = layer.iter().flat_map(of).collect();
        instances.sort_unstable();
        instances
    };
    let (components, held_out) = match by {
        By::Hulls => (decompose(&order, |group| sort.arcs_among(group)), HashMap::new()),
        _ => {
            let mutual = if by == By::Samples { Mutual::Merged } else { Mutual::HeldOut };
            let look = |group: &[u32]| {
                let members: Vec<Vec<u32>> = group.iter().map(|p| instances(&[*p])).collect();
                painter.look(&members, view, options)
            };
            decompose_by_sight(&order, mutual, look).unwrap()
        }
    };
    let mut sprites = Vec::new();
    let mut open = Openness::new(view, options);
    for component in &components {
        let mut draw = |layer: &Vec<u32>| {
            painter.draw(&instances(layer), view, options, held_out.get(&layer[0])).unwrap()
        };
        let drawn = component.layers.iter().map(&mut draw).collect();
        sprites.extend(open.settle(drawn, &component.arcs).into_iter().map(|p| p.sprite));
    }
    let size = (view.width, view.height);
    let composite = Program::compile(&components).run(size, |l| Some(&sprites[l as usize]));
    let direct = painter.paint_all(view, options).unwrap().sprite.expanded(size.0, size.1);
    let direct = Canvas { width: size.0, height: size.1, pixels: direct };
    BothWays { composite, direct, components, sprites }
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

/// As they come: everything through everything else, the eye inside, coincident copies.
fn as_it_comes(scene: &mut Scene, view: &mut View, seed: u64) {
    let (source, other) = (trouble::scene(seed), trouble::view(seed));
    (scene.groups, scene.root) = (source.groups, source.root);
    (view.view_from_world, view.width, view.height) = (other.view_from_world, other.width, other.height);
}

#[test]
fn opaque_scenes_come_back_bit_for_bit() {
    let (mut several, mut merged) = (0, [0; 3]);
    for seed in 0..120 {
        let (mut scene, mut view) = strewn(seed, true);
        if seed % 4 == 0 {
            as_it_comes(&mut scene, &mut view, seed);
        }
        for (by, merged) in WAYS.into_iter().zip(&mut merged) {
            let both = both_ways(&scene, &view, &PaintOptions::default(), by);
            several += usize::from(both.components.len() > 1);
            let layers = both.components.iter().flat_map(|c| &c.layers);
            *merged += layers.filter(|l| l.len() > 1).map(Vec::len).sum::<usize>();
            assert!(both.composite == both.direct, "seed {seed}, {by:?}");
        }
    }
    assert!(several > 90, "{several} of several components");
    assert!(merged[0] > merged[1] + 300 && merged[1] > 0 && merged[2] == 0, "{merged:?}");
}

/// The picture drawn directly is sorted at every pixel, blended surfaces too; a layered one must be it whatever is in
/// a cycle, for what occludes each other both ways is one layer. The sums of cycles round a little.
#[test]
fn blended_scenes_come_back_whatever_is_in_a_cycle() {
    let (mut cycles, mut merged, mut blended) = (0, 0, 0);
    for seed in 0..160 {
        let (mut scene, mut view) = strewn(seed, false);
        if seed % 4 == 0 {
            as_it_comes(&mut scene, &mut view, seed);
        }
        for by in WAYS {
            let BothWays { composite, direct, components, .. } =
                both_ways(&scene, &view, &PaintOptions::default(), by);
            cycles += components.iter().filter(|c| c.layers.len() > 1).count();
            merged += components.iter().flat_map(|c| &c.layers).filter(|l| l.len() > 1).count();
            blended += direct.pixels.iter().filter(|p| p[3] > 0.0 && p[3] < 1.0).count();
            let pairs = composite.pixels.as_flattened().iter().zip(direct.pixels.as_flattened());
            let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 1e-5, "seed {seed}, {by:?}: {off}");
        }
    }
    assert!(merged > 50 && blended > 10_000, "{cycles} cycles, {merged} merged, {blended} blended pixels");
}

/// Pixels by the layers that cover them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pixel {
    /// At most one does so in part.
    Simple,
    /// Several do.
    Several,
    /// Three of one cycle cover it, at least one of them in part: what [Snyder & Lengyel 1997, §8] except.
    ThreeOfACycle,
}

fn kind(samples: &[Sprite], components: &[Component], (x, y): (u32, u32), n: u32) -> Pixel {
    let covered =
        |sprite: &Sprite| (0..n * n).filter(|i| sprite.at(x * n + i % n, y * n + i / n)[3] > 0.0).count();
    let counts: Vec<usize> = samples.iter().map(covered).collect();
    let partial = |layers: &[usize]| layers.iter().filter(|&&c| c > 0 && c < (n * n) as usize).count();
    let mut first = 0;
    for component in components {
        let layers = &counts[first..first + component.layers.len()];
        first += layers.len();
        if layers.iter().filter(|&&c| c > 0).count() > 2 && partial(layers) > 0 {
            return Pixel::ThreeOfACycle;
        }
    }
    if partial(&counts) < 2 { Pixel::Simple } else { Pixel::Several }
}

#[test]
fn with_coverage_only_pixels_that_three_layers_of_a_cycle_share_are_approximate() {
    const SAMPLES: u32 = 3;
    let options = PaintOptions { samples: SAMPLES, shading: Shading::Flat, ..PaintOptions::default() };
    // Covered pixels of each kind.
    let mut counts = [0u32; 3];
    let mut largest = 0.0f32;
    for (seed, by) in (0..60).zip(WAYS.into_iter().cycle()) {
        let (scene, view) = strewn(seed, seed % 2 == 0);
        let BothWays { composite, direct, components, .. } = both_ways(&scene, &view, &options, by);
        let fine = View { width: view.width * SAMPLES, height: view.height * SAMPLES, ..view };
        let alone = PaintOptions { samples: 1, ..options };
        let samples = both_ways(&scene, &fine, &alone, by).sprites;
        for (at, (a, b)) in (0u32..).zip(composite.pixels.iter().zip(&direct.pixels)) {
            let place = (at % view.width, at / view.width);
            let kind = kind(&samples, &components, place, SAMPLES);
            let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            counts[kind as usize] += u32::from(b[3] > 0.0);
            if kind != Pixel::ThreeOfACycle {
                largest = largest.max(off);
                assert!(off < 1e-5, "seed {seed} {by:?} {place:?} {kind:?}: {a:?} {b:?}");
            }
        }
    }
    assert!(counts[0] > 5_000 && counts[1] > 500, "{counts:?}, off by {largest}");
}

/// Two panes that cross, and a third beside them that does not.
#[test]
fn parts_that_pass_through_each_other_are_kept_apart_by_holding_out() {
    let (mut scene, mut view) = strewn(0, true);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let pane = Mesh {
        positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]],
        primitives: vec![Primitive { triangles: 0..4, material: None }],
        ..Mesh::default()
    };
    scene.meshes = vec![pane];
    let node = |angle: f64, x: f64| {
        let local = DAffine3::from_translation(DVec3::X * x) * DAffine3::from_rotation_y(angle);
        Node { local: Transform::Affine(local), content: Content::Mesh(0), ..Node::default() }
    };
    scene.groups[0].nodes = vec![node(0.6, 0.0), node(-0.6, 0.0), node(0.0, 2.5)];
    view = View::look_at(DVec3::Z * 8.0, DVec3::ZERO, DVec3::Y, view.projection, (120, 80));
    let layers = |by| {
        let both = both_ways(&scene, &view, &PaintOptions::default(), by);
        assert!(both.composite == both.direct, "{by:?}");
        let covered: usize =
            both.sprites.iter().map(|s| s.pixels.iter().filter(|p| p[3] > 0.0).count()).sum();
        (both.components.iter().map(|c| c.layers.len()).sum::<usize>(), covered)
    };
    let (merged, held_out) = (layers(By::Samples), layers(By::SamplesHeldOut));
    assert_eq!((merged.0, held_out.0), (2, 3));
    // The second pane shows behind the first where it is not cut.
    assert!(held_out.1 > merged.1);
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
    for by in WAYS {
        let BothWays { composite, direct, components, .. } =
            both_ways(&scene, &view, &PaintOptions::default(), by);
        assert_eq!(components.len(), 1);
        assert_eq!(components[0].layers.len(), 3);
        assert!(composite == direct);
        assert!(direct.pixels.iter().filter(|p| p[3] > 0.0).count() > 2000);
        // Nowhere do all three meet in a pixel.
        let smooth = PaintOptions { samples: 4, ..PaintOptions::default() };
        let BothWays { composite, direct, .. } = both_ways(&scene, &view, &smooth, by);
        let pairs = composite.pixels.as_flattened().iter().zip(direct.pixels.as_flattened());
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
    }
}
