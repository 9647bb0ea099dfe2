//! Nothing that shows is called hidden, on every world: what is nearest at some sample of a picture three times as
//! fine each way is found by scene culling, whatever its options, and by an occlusion buffer that was asked about the
//! boxes, the balls around and the meshes of all instances.

mod common;

use common::{assert_every_world_is_in, seen, views};
use hither::cull::{
    Ball, Boxes, CullOptions, Culler, Meaning, Occludee, Occluder, OcclusionBuffer, OcclusionOptions,
    PlacedMesh, Verdict,
};
use hither::geometry::Aabb;
use hither::reference::trouble::Random;
use hither::scene::Instance;
use hither::{IndexOptions, SceneIndex};
use std::collections::HashSet;

/// Every world, small.
const SPECS: &[&str] = &[
    "office?n=3",
    "boxcity",
    "clutter?parts=1",
    "spheres?parts=1",
    "hills?polygons=1000000",
    "lecture",
    "toothpicks?n=400",
    "canyon?grid=7",
    "soda",
    "city",
    "tetra",
];

#[test]
fn every_world_is_looked_at() {
    assert_every_world_is_in(SPECS);
}

#[test]
fn scene_culling_leaves_out_nothing_that_shows() {
    let mut left_out = 0;
    for (number, spec) in SPECS.iter().enumerate() {
        let index = SceneIndex::build(hither_worlds::generate(spec).unwrap(), &IndexOptions::default());
        let random = &mut Random::new(number as u64);
        let mut culler = Culler::new();
        for view in views(index.scene(), random) {
            let (samples, centres) = (seen(&index, &view, 3), seen(&index, &view, 1));
            let usual = CullOptions::default();
            let ways = [
                usual,
                CullOptions { coherence: true, ..usual },
                CullOptions { coherence: true, least_occluder_px: 0, least_piece_px: 0, ..usual },
                CullOptions { coarseness: Some(1 + random.below(5)), least_occluder_px: 0, ..usual },
                CullOptions { meaning: Meaning::Sampled, least_occluder_px: 0, ..usual },
            ];
            for options in ways {
                let found = culler.cull(&index, &view, &options).unwrap();
                let visible: HashSet<u32> = found.visible.iter().copied().collect();
                let shown = if options.meaning == Meaning::Sampled { &centres } else { &samples };
                let missing: Vec<_> = shown.difference(&visible).collect();
                assert!(missing.is_empty(), "{spec}, {view:?}, {options:?}: {missing:?} are missing");
                left_out += index.scene().instance_count() as usize - visible.len();
            }
        }
    }
    assert!(left_out > 5000, "{left_out} left out");
}

#[test]
fn an_occlusion_buffer_hides_nothing_that_shows() {
    let mut hidden = [0; 3];
    for (number, spec) in SPECS.iter().enumerate() {
        let index = SceneIndex::build(hither_worlds::generate(spec).unwrap(), &IndexOptions::default());
        let scene = index.scene();
        let instances = scene.instances();
        let occluders: Vec<Occluder> =
            scene.meshes.iter().map(|mesh| Occluder::of_mesh(mesh, &scene.materials)).collect();
        let occludees: Vec<Occludee> =
            scene.meshes.iter().map(|mesh| Occludee::of_mesh(mesh).unwrap()).collect();
        let random = &mut Random::new(number as u64 + 100);
        for view in views(scene, random) {
            let seen = seen(&index, &view, 3);
            let mut buffer = OcclusionBuffer::new(&view, &OcclusionOptions::default()).unwrap();
            for instance in &instances {
                buffer.draw(&occluders[instance.mesh as usize], &instance.world_from_mesh);
            }
            let around = |i: &Instance| {
                let points = scene.meshes[i.mesh as usize].positions.iter();
                Aabb::around(points.map(|p| i.world_from_mesh.transform_point3(p.as_dvec3())))
            };
            let bounds: Vec<Aabb> = instances.iter().map(around).collect();
            let balls: Vec<Ball> = bounds
                .iter()
                .map(|b| Ball { center: b.center(), radius: b.size().length() * 0.500_001 })
                .collect();
            let placed = |i: &Instance| PlacedMesh {
                mesh: &occludees[i.mesh as usize],
                world_from_object: i.world_from_mesh,
            };
            let meshes: Vec<PlacedMesh> = instances.iter().map(placed).collect();
            let mut verdicts = [const { Vec::new() }; 3];
            buffer.ask(&bounds.iter().copied().collect::<Boxes>(), &mut verdicts[0]);
            buffer.ask_balls(&balls, &mut verdicts[1]);
            buffer.ask_meshes(&meshes, &mut verdicts[2]);
            for (kind, verdicts) in verdicts.iter().enumerate() {
                for &i in &seen {
                    let verdict = verdicts[i as usize];
                    assert_eq!(verdict, Verdict::Visible, "{spec}, {view:?}: {i} shows; asked as {kind}");
                }
                hidden[kind] += verdicts.iter().filter(|v| **v == Verdict::Hidden).count();
            }
        }
    }
    assert!(hidden.iter().all(|&h| h > 1000), "{hidden:?} hidden");
}
