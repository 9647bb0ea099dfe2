//! Occluder planes on the papers' worlds: nothing visible is ever called hidden, along walks and from
//! awkward places; most of what is hidden is found; threads change nothing.

use glam::DVec3;
use hither::cull::planes::{Amount, Culled, PlaneCuller, PlanesOptions};
use hither::reference::all_around::sightings;
use hither::{IndexOptions, SceneIndex};
use hither_worlds::generate;
use std::collections::BTreeSet;

const WORLDS: [&str; 3] = ["soda", "city", "tetra"];

fn walk(name: &str, walk: u32, step_s: f64, count: u32) -> Vec<DVec3> {
    let mut scene = generate(&format!("{name}?walk={walk}")).unwrap();
    let camera = scene.find_camera("walk").unwrap();
    let at = |i: u32| {
        scene.pose(0, f64::from(i) * step_s);
        scene.world_from_camera(camera).unwrap().translation
    };
    (0..count).map(at).collect()
}

/// Polygons with a part that can be seen, by the reference.
fn truth(culler: &PlaneCuller, scene: &hither::Scene, eye: DVec3) -> BTreeSet<u32> {
    let seen = sightings(scene, eye, 1e-7).into_iter();
    seen.map(|s| culler.model().polygon_of(s.instance, s.triangle)).collect()
}

fn false_hidden(culled: &Culled, truth: &BTreeSet<u32>) -> usize {
    truth.iter().filter(|p| culled.visible.binary_search(p).is_err()).count()
}

#[test]
fn nothing_visible_is_hidden_on_walks_and_most_hidden_polygons_are_found() {
    for (name, papers_share) in [("soda", 0.75), ("city", 0.38), ("tetra", 0.69)] {
        let scene = generate(name).unwrap();
        let of = |occluders| PlanesOptions { occluders, ..PlanesOptions::default() };
        let mut cullers = [
            PlaneCuller::new(&scene, &PlanesOptions::paper()),
            PlaneCuller::new(&scene, &of(Amount::Fixed(32))),
            PlaneCuller::new(&scene, &of(Amount::Automatic)),
        ];
        let (mut hidden, mut culled) = (0, [0; 3]);
        for (i, eye) in walk(name, 1, 0.25, 240).into_iter().enumerate() {
            let looks = cullers.each_mut().map(|c| c.look_around(eye).unwrap());
            // The reference is slow; the cullers must not skip a step.
            if i % 80 != 40 {
                continue;
            }
            let truth = truth(&cullers[0], &scene, eye);
            let all = cullers[0].model().polygons().len();
            hidden += all - truth.len();
            for (look, culled) in looks.iter().zip(&mut culled) {
                assert_eq!(false_hidden(look, &truth), 0, "{name} eye {i}");
                *culled += all - look.visible.len();
            }
        }
        let share = culled.map(|c| f64::from(c as u32) / hidden as f64);
        println!("{name}: {share:.3?}");
        assert!(share[1] >= papers_share && share[2] >= share[1], "{name}: {share:?}");
    }
}

#[test]
fn nothing_visible_is_hidden_from_walls_corners_and_outside() {
    for name in WORLDS {
        let scene = generate(name).unwrap();
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let mesh = &scene.meshes[scene.meshes.len() / 2];
        let [a, b, c] = mesh.triangles[0].map(|v| mesh.positions[v as usize].as_dvec3());
        let bounds = scene.bounds().unwrap();
        for eye in [a, (a + b + c) / 3.0, bounds.max + 50.0, DVec3::new(bounds.center().x, 1.0, bounds.max.z)]
        {
            let culled = culler.look_around(eye).unwrap();
            assert_eq!(false_hidden(&culled, &truth(&culler, &scene, eye)), 0, "{name} from {eye}");
        }
    }
}

#[test]
fn what_is_seen_within_reach_was_foreseen() {
    for name in WORLDS {
        let scene = generate(name).unwrap();
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let eyes = walk(name, 2, 0.05, 15);
        let reach = eyes.iter().map(|e| e.distance(eyes[7])).fold(0.0, f64::max);
        let foreseen = culler.foresee(eyes[7], reach).unwrap();
        assert!(foreseen.visible.len() < culler.model().polygons().len() * 9 / 10, "{name}");
        for eye in [eyes[0], eyes[14]] {
            assert_eq!(false_hidden(&foreseen, &truth(&culler, &scene, eye)), 0, "{name} from {eye}");
        }
    }
}

#[test]
fn threads_change_no_answer() {
    for name in WORLDS {
        let scene = generate(name).unwrap();
        let looks = |threads| {
            let mut culler = PlaneCuller::new(&scene, &PlanesOptions { threads, ..PlanesOptions::default() });
            let eyes = walk(name, 3, 0.2, 60).into_iter();
            eyes.map(|eye| culler.look_around(eye).unwrap()).collect::<Vec<_>>()
        };
        let one = looks(1);
        assert_eq!(one, looks(2), "{name}");
        assert_eq!(one, looks(3), "{name}");
    }
}

#[test]
fn neither_planes_nor_buffer_hide_an_instance_that_a_picture_shows() {
    for name in ["city", "tetra"] {
        let mut index = SceneIndex::build(generate(name).unwrap(), &IndexOptions::default());
        let mut culler = PlaneCuller::new(index.scene(), &PlanesOptions::default());
        let camera = index.scene().find_camera("walk").unwrap();
        let mut agreed = 0;
        for frame in 0..12 {
            index.pose(0, f64::from(frame) * 5.0);
            let view = index.scene().view(camera, (640, 360)).unwrap();
            let by_planes = culler.look(&view).unwrap();
            let of = |&p: &u32| culler.model().polygons()[p as usize].instance;
            let by_planes: BTreeSet<u32> = by_planes.visible.iter().map(of).collect();
            let by_buffer = hither::cull::cull(&index, &view, &hither::cull::CullOptions::default()).unwrap();
            let by_buffer: BTreeSet<u32> = by_buffer.visible.into_iter().collect();
            let picture = hither::render(&index, &view, &hither::RenderOptions::default()).unwrap();
            for (x, y) in (0..360).flat_map(|y| (0..640).map(move |x| (x, y))) {
                let Some(id) = picture.id(x, y) else { continue };
                assert!(by_planes.contains(&id.instance), "{name} frame {frame} planes: {id:?}");
                assert!(by_buffer.contains(&id.instance), "{name} frame {frame} buffer: {id:?}");
            }
            let all = 0..index.scene().instance_count() as u32;
            agreed += all.filter(|i| !by_planes.contains(i) && !by_buffer.contains(i)).count();
        }
        assert!(agreed > 12 * 200, "{name}: {agreed} hidden by both");
    }
}
