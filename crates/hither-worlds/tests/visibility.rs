//! One scene, all algorithms, one truth, on every world: the hierarchical z-buffer equals the plain one in every id
//! and every depth bit, and the ray caster of `reference` finds at random pixels what both find. Seen from all of a
//! world's cameras at several moments, and from eyes that lean towards trouble: on a vertex, along an edge, a hair
//! in front of a face.

mod common;

use common::{assert_every_world_is_in, views_of_cameras};
use fearless_simd::Level;
use glam::{DQuat, DVec3};
use hither::conventions::{Projection, View};
use hither::index::TreeKind;
use hither::reference::{Caster, Judgement, trouble::Random};
use hither::render::{BoxTest, Coherence};
use hither::scene::Scene;
use hither::{Algorithm, Frame, IndexOptions, RenderOptions, Renderer, SceneIndex, render};

/// Every world, small: those of few meshes as many, so that a ray is not asked about all of their triangles.
const SPECS: &[&str] = &[
    "office?n=3",
    "boxcity",
    "clutter?parts=1",
    "spheres?parts=1",
    "hills?polygons=1000000",
    "lecture",
    "toothpicks?n=60",
    "canyon?grid=7",
    "soda",
    "city",
    "tetra",
];

const TREES: [TreeKind; 3] = [TreeKind::Bvh, TreeKind::OctreeSmallest, TreeKind::OctreePushed];

const PLAIN: Algorithm = Algorithm::ZBuffer;

fn world(spec: &str) -> Scene {
    hither_worlds::generate(spec).unwrap_or_else(|e| panic!("{spec}: {e}"))
}

#[test]
fn every_world_is_looked_at() {
    assert_every_world_is_in(SPECS);
}

/// The views of all cameras, as the scene is posed now, and some from eyes at a random triangle of it.
fn views(scene: &Scene, random: &mut Random) -> Vec<View> {
    let size = |random: &mut Random| (160 + random.below(161), 120 + random.below(81));
    let mut views = views_of_cameras(scene, || size(random));
    let projection = views[0].projection;
    let instances = scene.instances();
    for kind in 0..3 {
        let instance = &instances[random.below(instances.len() as u32) as usize];
        let mesh = &scene.meshes[instance.mesh as usize];
        let triangle = mesh.triangles[random.below(mesh.triangles.len() as u32) as usize];
        let [a, b, c] = triangle
            .map(|v| instance.world_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3()));
        let inside = (a + b + c) / 3.0;
        let outwards = (b - a).cross(c - a).normalize_or(DVec3::Y);
        let (eye, target) = match kind {
            0 => (a, b + (b - a)),
            1 => (inside, inside + (c - a) + outwards * 0.3 * (c - a).length()),
            _ => (inside + outwards * 2e-3, b),
        };
        let projection = if random.one_in(4) {
            Projection::Orthographic { half_height: random.between(0.5, 20.0), near: -1.0, far: 200.0 }
        } else {
            projection
        };
        views.push(View::look_at(eye, target, DVec3::Y, projection, size(random)));
    }
    views
}

/// The first pixel at which two frames differ.
fn difference(a: &Frame, b: &Frame) -> Option<String> {
    (0..a.view.height).flat_map(|y| (0..a.view.width).map(move |x| (x, y))).find_map(|(x, y)| {
        let (p, q) = ((a.id(x, y), a.depth(x, y)), (b.id(x, y), b.depth(x, y)));
        let same = p.0 == q.0 && p.1.to_bits() == q.1.to_bits();
        (!same).then(|| format!("pixel ({x}, {y}): {p:?} and {q:?}"))
    })
}

/// The ways to draw that are compared with the plain one, on one tree, with a renderer of its own each.
fn variants() -> Vec<(Renderer, RenderOptions)> {
    let usual = RenderOptions::default();
    let ways = [
        RenderOptions { coherence: Coherence::Always, threads: 2, ..usual },
        RenderOptions { coherence: Coherence::WherePays, window_width: 48, ..usual },
        RenderOptions { box_test: BoxTest::Definitive, threads: 3, window_width: 16, ..usual },
        RenderOptions { algorithm: PLAIN, threads: 2, window_width: 80, ..usual },
        RenderOptions { level: Level::baseline(), ..usual },
        usual,
    ];
    ways.map(|options| (Renderer::new(), options)).into()
}

#[test]
fn every_variant_agrees_on_every_world() {
    for (number, spec) in SPECS.iter().enumerate() {
        let scene = world(spec);
        let animated = !scene.animations.is_empty();
        let mut random = Random::new(number as u64);
        let mut indices =
            TREES.map(|tree| (SceneIndex::build(scene.clone(), &IndexOptions { tree }), variants()));
        for moment in 0..if animated { 3 } else { 1 } {
            if animated {
                // Near each other, so that a frame finds much of what the frame before it showed.
                let time = 0.5 * f64::from(moment) + random.between(0.0, 0.2);
                indices.iter_mut().for_each(|(index, _)| _ = index.pose(0, time));
            }
            for (turn, view) in views(indices[0].0.scene(), &mut random).into_iter().enumerate() {
                agree_on(spec, &mut indices, view, turn);
            }
        }
    }
}

/// A tree, and what draws it.
type Drawn = (SceneIndex, Vec<(Renderer, RenderOptions)>);

/// Draws the view, and once more from a step aside, on every tree; in half of the ways, in the other half next turn.
fn agree_on(spec: &str, indices: &mut [Drawn], view: View, turn: usize) {
    let mut aside = view;
    aside.view_from_world.translation += DVec3::new(0.11, -0.04, 0.07);
    aside.view_from_world = glam::DAffine3::from_quat(DQuat::from_rotation_y(0.02)) * aside.view_from_world;
    for view in [view, aside] {
        let plain = RenderOptions { algorithm: PLAIN, ..RenderOptions::default() };
        let truth = render(&indices[0].0, &view, &plain).unwrap();
        for (tree, (index, variants)) in indices.iter_mut().enumerate() {
            for (renderer, options) in variants.iter_mut().skip((tree + turn) % 2).step_by(2) {
                let frame = renderer.render(index, &view, options).unwrap();
                if let Some(at) = difference(&truth, &frame) {
                    panic!("{spec}, {view:?}, {:?}, {options:?}: {at}", index.options());
                }
                renderer.recycle(frame);
            }
        }
    }
}

/// Pixels of each view that a ray is cast through.
const RAYS: u32 = 60;

#[test]
fn rays_meet_what_is_drawn_of_every_world() {
    let (mut agreed, mut excused) = (0, 0);
    for (number, spec) in SPECS.iter().enumerate() {
        let mut random = Random::new(1000 + number as u64);
        let mut scene = world(spec);
        scene.pose(0, 0.8);
        let views = views(&scene, &mut random);
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let plain = RenderOptions { algorithm: PLAIN, ..RenderOptions::default() };
        for view in views {
            let frames =
                [RenderOptions::default(), plain].map(|options| render(&index, &view, &options).unwrap());
            let caster = Caster::new(index.scene(), &view);
            for _ in 0..RAYS {
                let (x, y) = (random.below(view.width), random.below(view.height));
                let probe = caster.probe(x, y);
                for frame in &frames {
                    match probe.judge(frame.id(x, y).map(|id| (id, frame.depth(x, y)))) {
                        Judgement::Agrees => agreed += 1,
                        Judgement::Excused => excused += 1,
                        Judgement::Wrong(why) => panic!("{spec}, {view:?}: {why}"),
                    }
                }
            }
        }
    }
    assert!(excused * 50 < agreed, "{excused} pixels excused, {agreed} agreed");
}
