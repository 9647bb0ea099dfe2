//! Whole scenes: nothing that shows is left out, whatever the options say.

use super::*;
use crate::conventions::Projection;
use crate::cull::planes::{PlaneCuller, PlanesOptions};
use crate::geometry::Aabb;
use crate::index::IndexOptions;
use crate::reference::trouble;
use crate::reference::zbuffer;
use crate::scene::{Content, Mesh, Node, Primitive, Scene, Transform};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use std::collections::HashSet;

/// Instances that show at a pixel centre, by the textbook z-buffer at several times the resolution. A masked
/// or opaque surface counts.
fn shown(index: &SceneIndex, view: &View) -> HashSet<u32> {
    let fine = View { width: view.width * 3, height: view.height * 3, ..*view };
    let picture = zbuffer::draw(index.scene(), &fine);
    (0..fine.height)
        .flat_map(|y| (0..fine.width).map(move |x| (x, y)))
        .filter_map(|(x, y)| picture.seen(x, y))
        .map(|(id, _)| id.instance)
        .collect()
}

#[test]
fn what_shows_is_never_left_out() {
    let mut culler = Culler::new();
    let (mut left_out, mut total) = (0, 0);
    for seed in 0..300 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let view = trouble::view(seed);
        let shown = shown(&index, &view);
        for (coherence, least) in [(false, 0), (true, 0), (true, 400)] {
            let options = CullOptions {
                coherence,
                least_occluder_px: least,
                least_piece_px: least / 100,
                reasons: true,
                ..CullOptions::default()
            };
            let found = culler.cull(&index, &view, &options).unwrap();
            let visible: HashSet<u32> = found.visible.iter().copied().collect();
            assert_eq!(visible.len(), found.visible.len(), "seed {seed}: an instance twice");
            assert!(shown.is_subset(&visible), "seed {seed}: {shown:?} show, {visible:?} were found");
            left_out += index.scene().instance_count() as usize - visible.len();
            total += index.scene().instance_count() as usize;
            every_instance_is_judged_once(&index, &found);
        }
    }
    assert!(left_out > 100, "{left_out} of {total} left out");
}

/// A cube of edge 1 around the origin.
fn unit_cube() -> Mesh {
    let corner = |k: u32| Vec3::from_array([0, 1, 2].map(|axis| (k >> axis & 1) as f32 - 0.5));
    let mut cube = Mesh { positions: (0..8).map(corner).collect(), ..Mesh::default() };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    cube.triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    cube.primitives.push(Primitive { triangles: 0..12, material: None });
    cube
}

/// A scene and its view so far from the origin; and long needles, sheets and blocks around the eye.
fn far_away(seed: u64, away: f64) -> (Scene, View) {
    let mut random = trouble::Random::new(seed + 31);
    let (mut scene, mut view) = (trouble::scene(seed), trouble::view(seed));
    let offset = DAffine3::from_translation(random.point(1.0).normalize_or(DVec3::X) * away);
    scene.meshes.push(unit_cube());
    let mesh = scene.meshes.len() as u32 - 1;
    let eye = view.eye_in_world();
    let root = scene.root as usize;
    for _ in 0..12 {
        let mut size = || [1e-4, 0.01, 0.3, 2.0, 30.0, 1e4][random.below(6) as usize];
        let size = DVec3::new(size(), size(), size());
        let place = DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, eye + random.point(4.0));
        let node = Node {
            name: String::new(),
            parent: None,
            local: Transform::Affine(place),
            content: Content::Mesh(mesh),
        };
        scene.groups[root].push(node);
    }
    let nodes = &mut scene.groups[root].nodes;
    for node in nodes.iter_mut().filter(|n| n.parent.is_none()) {
        node.local = Transform::Affine(offset * node.local.matrix());
    }
    view.view_from_world *= offset.inverse();
    (scene, view)
}

#[test]
fn what_shows_far_from_the_origin_and_around_the_eye_is_never_left_out() {
    let mut culler = Culler::new();
    let (mut left_out, mut shown_in_all) = (0, 0);
    for seed in 0..240 {
        let away = [0.0, 1e3, 1e5, 1e6, 5.5e6, 1e8][seed as usize % 6];
        let (scene, view) = far_away(seed, away);
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let shown = shown(&index, &view);
        let options = CullOptions { least_occluder_px: 0, least_piece_px: 0, ..CullOptions::default() };
        let found = culler.cull(&index, &view, &options).unwrap();
        let visible: HashSet<u32> = found.visible.iter().copied().collect();
        assert!(
            shown.is_subset(&visible),
            "seed {seed}, {away} m away: {shown:?} show, {visible:?} were found"
        );
        left_out += index.scene().instance_count() as usize - visible.len();
        shown_in_all += shown.len();
    }
    assert!(left_out > 100 && shown_in_all > 300, "{left_out} left out, {shown_in_all} show");
}

#[test]
fn what_is_switched_off_neither_shows_nor_hides_nor_is_found() {
    let mut culler = Culler::new();
    let (mut off_in_all, mut came_into_view) = (0, 0);
    for seed in 0..120 {
        let random = &mut trouble::Random::new(seed + 3);
        let view = trouble::view(seed);
        let scene = trouble::scene(seed);
        let before = scene.root_group().nodes.clone();
        let mut index = SceneIndex::build(scene, &IndexOptions::default());
        let all = shown(&index, &view);
        let options = CullOptions { least_occluder_px: 0, least_piece_px: 0, ..CullOptions::default() };
        for _ in 0..4 {
            for node in 0..before.len() as u32 {
                index.set_shown(node, random.one_in(2));
            }
            let found = culler.cull(&index, &view, &options).unwrap();
            let visible: HashSet<u32> = found.visible.iter().copied().collect();
            let now = shown(&index, &view);
            assert!(now.is_subset(&visible), "seed {seed}: {now:?} show, {visible:?} were found");
            came_into_view += now.difference(&all).count();
            let instances = index.scene().instances();
            let is_off = |i: &u32| instances[*i as usize].world_from_mesh.matrix3 == DMat3::ZERO;
            assert!(!visible.iter().any(is_off), "seed {seed}: what is off was found");
            off_in_all += (0..instances.len() as u32).filter(is_off).count();
        }
        for node in 0..before.len() as u32 {
            index.set_shown(node, true);
        }
        assert_eq!(shown(&index, &view), all, "seed {seed}");
        let scene = index.into_scene();
        let after = &scene.root_group().nodes;
        assert!(before.iter().map(|n| n.local).eq(after.iter().map(|n| n.local)), "seed {seed}");
    }
    assert!(off_in_all > 200 && came_into_view > 20, "{off_in_all} off, {came_into_view} came into view");
}

#[test]
fn what_shows_at_a_pixel_centre_is_never_left_out_when_sampled() {
    let mut culler = Culler::new();
    let (mut continuous, mut sampled) = (0, 0);
    for seed in 0..600 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let view = trouble::view(seed);
        let picture = zbuffer::draw(index.scene(), &view);
        let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        let shown: HashSet<u32> =
            pixels.filter_map(|(x, y)| picture.seen(x, y)).map(|(id, _)| id.instance).collect();
        let options = CullOptions { least_occluder_px: 0, least_piece_px: 0, ..CullOptions::default() };
        continuous += culler.cull(&index, &view, &options).unwrap().visible.len();
        let options = CullOptions { meaning: Meaning::Sampled, ..options };
        let found = culler.cull(&index, &view, &options).unwrap();
        let visible: HashSet<u32> = found.visible.iter().copied().collect();
        assert!(shown.is_subset(&visible), "seed {seed}: {shown:?} show, {visible:?} were found");
        sampled += visible.len();
    }
    assert!(sampled < continuous, "{sampled} sampled, {continuous} in the continuous image");
    let index = SceneIndex::build(trouble::scene(1), &IndexOptions::default());
    let moving = CullOptions { meaning: Meaning::Sampled, eye_moves: 0.1, ..CullOptions::default() };
    assert!(cull(&index, &trouble::view(1), &moving).is_err());
}

#[test]
fn what_shows_is_never_left_out_at_any_coarseness() {
    let mut culler = Culler::new();
    let mut left_out = [0; 2];
    for seed in 0..400 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let random = &mut trouble::Random::new(seed);
        // Sizes that a pixel of several does not divide.
        let view =
            View { width: 30 + random.below(60), height: 20 + random.below(50), ..trouble::view(seed) };
        let shown = shown(&index, &view);
        for (k, coarseness) in [1, [2, 3, 4, 7, 100][random.below(5) as usize]].into_iter().enumerate() {
            let least = [0, 40, 400][random.below(3) as usize];
            let options = CullOptions {
                coarseness: Some(coarseness),
                least_occluder_px: least,
                least_piece_px: 0,
                reasons: true,
                ..CullOptions::default()
            };
            let found = culler.cull(&index, &view, &options).unwrap();
            let visible: HashSet<u32> = found.visible.iter().copied().collect();
            assert!(
                shown.is_subset(&visible),
                "seed {seed}, coarseness {coarseness}: {shown:?} show, {visible:?} were found"
            );
            every_instance_is_judged_once(&index, &found);
            left_out[k] += index.scene().instance_count() as usize - visible.len();
        }
    }
    assert!(left_out[0] > left_out[1] && left_out[1] > 50, "{left_out:?}");
}

#[test]
fn coarse_pixels_are_refused_where_they_have_no_meaning() {
    let index = SceneIndex::build(trouble::scene(1), &IndexOptions::default());
    let sampled = CullOptions { meaning: Meaning::Sampled, coarseness: Some(2), ..CullOptions::default() };
    assert!(cull(&index, &trouble::view(1), &sampled).is_err());
    let none = CullOptions { coarseness: Some(0), ..CullOptions::default() };
    assert!(cull(&index, &trouble::view(1), &none).is_err());
    let huge = CullOptions { coarseness: Some(u32::MAX), ..CullOptions::default() };
    assert!(cull(&index, &trouble::view(1), &huge).is_ok());
}

#[test]
fn many_pixels_are_culled_by_twos() {
    let usual = CullOptions::default();
    assert_eq!([(1000, 1000), (1000, 1001), (u32::MAX, u32::MAX)].map(|s| usual.coarseness_in(s)), [1, 2, 2]);
    let sampled = CullOptions { meaning: Meaning::Sampled, ..usual };
    assert_eq!(sampled.coarseness_in((1920, 1080)), 1);
    assert_eq!(CullOptions { coarseness: Some(3), ..usual }.coarseness_in((8, 8)), 3);
    // The one who says nothing gets what saying it gives.
    let index = SceneIndex::build(trouble::scene(3), &IndexOptions::default());
    let view = View { width: 1300, height: 800, ..trouble::view(3) };
    let [by_default, said] = [None, Some(2)]
        .map(|coarseness| cull(&index, &view, &CullOptions { coarseness, ..usual }).unwrap().visible);
    assert_eq!(by_default, said);
}

#[test]
fn pixels_larger_than_any_image_leave_out_nothing_that_shows() {
    for seed in 0..20 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let view = trouble::view(seed);
        for (coarseness, eye_moves) in [(1 << 20, 0.0), (1 << 16, 0.01), (1 << 28, 0.01), (u32::MAX, 0.01)] {
            let options = CullOptions { coarseness: Some(coarseness), eye_moves, ..CullOptions::default() };
            let visible: HashSet<u32> = cull(&index, &view, &options).unwrap().visible.into_iter().collect();
            assert!(shown(&index, &view).is_subset(&visible), "seed {seed}, {coarseness}");
        }
    }
}

#[test]
fn occluders_that_rest_and_wake_change_nothing_that_shows() {
    let (mut idle, mut drawn) = (0, 0);
    for seed in 0..60 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let random = &mut trouble::Random::new(seed);
        let mut view = trouble::view(seed);
        let mut culler = Culler::new();
        for frame in 0..24 {
            let options = CullOptions {
                coherence: true,
                faces_a_hidden_box: 0,
                least_occluder_px: 0,
                least_piece_px: 0,
                reasons: true,
                ..CullOptions::default()
            };
            let found = culler.cull(&index, &view, &options).unwrap();
            let visible: HashSet<u32> = found.visible.iter().copied().collect();
            let shown = shown(&index, &view);
            assert!(
                shown.is_subset(&visible),
                "seed {seed}, frame {frame}: {shown:?} show, not all {visible:?}"
            );
            every_instance_is_judged_once(&index, &found);
            idle += found.counters.occluders_idle;
            drawn += found.counters.occluders;
            view.view_from_world.translation.x += random.between(-0.1, 0.1);
            view.view_from_world.translation.z += random.between(-0.1, 0.2);
        }
    }
    assert!(idle > 300 && drawn > 300, "{idle} rested, {drawn} were drawn");
}

#[test]
fn a_view_that_jumps_begins_from_nothing() {
    let mut rested = 0;
    for seed in 0..60 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let options = CullOptions {
            coherence: true,
            faces_a_hidden_box: 0,
            least_occluder_px: 0,
            least_piece_px: 0,
            ..CullOptions::default()
        };
        let mut culler = Culler::new();
        let here = trouble::view(seed);
        let mut there = here;
        there.view_from_world.translation += DVec3::new(1.0, 0.5, -2.0);
        for _ in 0..3 {
            let again = culler.cull(&index, &here, &options).unwrap();
            rested += again.counters.occluders_idle;
        }
        let found = culler.cull(&index, &there, &options).unwrap();
        let anew = cull(&index, &there, &options).unwrap();
        assert_eq!((found.visible, found.counters), (anew.visible, anew.counters), "seed {seed}");
        // Going on at that pace is no jump, but turning that far is one each time.
        there.view_from_world.translation.x += 1.0;
        rested += culler.cull(&index, &there, &options).unwrap().counters.occluders_idle;
        for _ in 0..2 {
            there.view_from_world = DAffine3::from_rotation_y(0.6) * there.view_from_world;
            let turned = culler.cull(&index, &there, &options).unwrap();
            assert_eq!(turned.visible, cull(&index, &there, &options).unwrap().visible, "seed {seed}");
            assert_eq!(turned.counters.occluders_idle, 0);
        }
    }
    assert!(rested > 60, "{rested} rested");
}

#[test]
fn planes_and_the_buffer_contradict_neither_each_other_nor_the_truth() {
    let (mut both, mut one) = (0, 0);
    for seed in 0..300 {
        let view = trouble::view(seed);
        if matches!(view.projection, Projection::Orthographic { .. }) {
            continue;
        }
        let scene = trouble::scene(seed);
        let mut planes = PlaneCuller::new(&scene, &PlanesOptions::default());
        let polygons = planes.look(&view).unwrap().visible;
        let by_planes: HashSet<u32> =
            polygons.iter().map(|&p| planes.model().polygons()[p as usize].instance).collect();
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let options = CullOptions { least_occluder_px: 0, least_piece_px: 0, ..CullOptions::default() };
        let by_buffer: HashSet<u32> = cull(&index, &view, &options).unwrap().visible.into_iter().collect();
        for instance in shown(&index, &view) {
            let (planes, buffer) = (by_planes.contains(&instance), by_buffer.contains(&instance));
            assert!(planes && buffer, "seed {seed}: {instance} shows; planes {planes}, buffer {buffer}");
        }
        for instance in 0..index.scene().instance_count() as u32 {
            let hidden = [&by_planes, &by_buffer].map(|found| !found.contains(&instance));
            both += u32::from(hidden == [true, true]);
            one += u32::from(hidden[0] != hidden[1]);
        }
    }
    assert!(both > 100, "{both} instances hidden by both, {one} by one alone");
}

fn every_instance_is_judged_once(index: &SceneIndex, found: &Culling) {
    let mut times = vec![0; index.scene().instance_count() as usize];
    for judged in &found.judged {
        judged.instances.clone().for_each(|i| times[i as usize] += 1);
        for i in judged.instances.clone() {
            let visible = matches!(judged.reason, Reason::Shows | Reason::ReachesNearPlane);
            assert_eq!(visible, found.visible.contains(&i), "instance {i}: {:?}", judged.reason);
        }
    }
    // Nothing is said of an instance of a mesh without triangles.
    assert!(times.iter().all(|&t| t <= 1), "{times:?}");
}

#[test]
fn several_views_at_once_are_what_they_are_one_by_one() {
    let index = SceneIndex::build(trouble::scene(7), &IndexOptions::default());
    let views: Vec<View> = (0..6).map(trouble::view).collect();
    let options = CullOptions::default();
    let together = Culler::new().cull_views(&index, &views, &options).unwrap();
    for (view, found) in views.iter().zip(&together) {
        assert_eq!(found.visible, cull(&index, view, &options).unwrap().visible);
    }
    let wrong = View { width: 0, ..views[0] };
    assert!(cull(&index, &wrong, &options).is_err());
}

#[test]
fn within_the_margin_a_moved_eye_sees_nothing_that_was_left_out() {
    let random = &mut trouble::Random::new(11);
    let mut left_out = 0;
    for seed in 0..300 {
        let index = SceneIndex::build(trouble::scene(seed), &IndexOptions::default());
        let view = View { width: 64, height: 48, ..trouble::view(seed) };
        if matches!(view.projection, Projection::Perspective { fov_y, .. } if fov_y > 2.0) {
            continue;
        }
        let r = [0.01, 0.05, 0.2][random.below(3) as usize];
        let options = CullOptions {
            eye_moves: r,
            coarseness: [None, Some(1), Some(2), Some(3)][random.below(4) as usize],
            least_occluder_px: [0, 0, 60][random.below(3) as usize],
            least_piece_px: 0,
            ..CullOptions::default()
        };
        let found = cull(&index, &view, &options).unwrap();
        let visible: HashSet<u32> = found.visible.iter().copied().collect();
        left_out += index.scene().instance_count() as usize - visible.len();
        for _ in 0..6 {
            let mut direction = || random.between(-1.0, 1.0);
            let step = DVec3::new(direction(), direction(), direction()).normalize_or_zero() * r * 0.999;
            let mut moved = view;
            moved.view_from_world.translation -= step;
            let shown = shown(&index, &moved);
            assert!(
                shown.is_subset(&visible),
                "seed {seed}, step {step}: {shown:?} show, {visible:?} were found"
            );
        }
    }
    assert!(left_out > 20, "{left_out}");
}

/// How near a box comes to the eye, as depth: what reaches the near plane is as near as can be.
fn nearest_depth(view: &View, b: &Aabb) -> f64 {
    let corners =
        (0..8).map(|k| DVec3::select(glam::BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0), b.max, b.min));
    let along = corners.map(|p| -view.view_from_world.transform_point3(p).z);
    let distance = along.fold(f64::INFINITY, f64::min);
    match view.projection {
        Projection::Perspective { near, .. } => near / distance.max(near),
        Projection::Orthographic { near, far, .. } => (far - distance.max(near)) / (far - near),
    }
}

#[test]
fn what_may_be_seen_comes_nearest_first() {
    let mut culler = Culler::new();
    let mut pairs = 0;
    for seed in 0..60 {
        let mut random = trouble::Random::new(seed + 700);
        let mut scene = Scene::new("boxes");
        scene.meshes.push(unit_cube());
        for _ in 0..200 {
            let size = DVec3::from_array([(); 3].map(|()| random.between(0.05, 1.5)));
            let at = DAffine3::from_translation(random.point(20.0)) * DAffine3::from_scale(size);
            let local = Transform::Affine(at);
            scene.groups[0].push(Node { content: Content::Mesh(0), local, ..Node::default() });
        }
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let unit = Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
        let instances = index.scene().instances();
        let view = trouble::view(seed);
        for coherence in [false, true, true] {
            let found =
                culler.cull(&index, &view, &CullOptions { coherence, ..CullOptions::default() }).unwrap();
            let depth =
                |&i: &u32| nearest_depth(&view, &unit.transformed(&instances[i as usize].world_from_mesh));
            let depths: Vec<f64> = found.visible.iter().map(depth).collect();
            for pair in depths.windows(2) {
                pairs += 1;
                // f32 in an orthographic view is as exact for what is near as for what is far.
                let least = match view.projection {
                    Projection::Perspective { .. } => pair[1] * (1.0 - 1e-5),
                    Projection::Orthographic { .. } => pair[1] - 1e-5,
                };
                assert!(pair[0] >= least, "seed {seed}: {pair:?} of {depths:?}");
            }
        }
    }
    assert!(pairs > 3000, "{pairs}");
}

/// A rough wall 16 metres wide and 12 high, 5 metres before the eye, of so many squares each way.
fn rough_wall(cells: u32) -> Mesh {
    let random = &mut trouble::Random::new(3);
    let mut wall = Mesh::default();
    for (row, column) in (0..=cells).flat_map(|row| (0..=cells).map(move |column| (row, column))) {
        let at = |n: u32, size: f64| size * (f64::from(n) / f64::from(cells) - 0.5);
        wall.positions
            .push(DVec3::new(at(column, 16.0), at(row, 12.0), -5.0 + random.between(-0.03, 0.03)).as_vec3());
    }
    for (row, column) in (0..cells).flat_map(|row| (0..cells).map(move |column| (row, column))) {
        let a = row * (cells + 1) + column;
        let (b, c, d) = (a + 1, a + cells + 2, a + cells + 1);
        wall.triangles.extend([[a, b, c], [a, c, d]]);
    }
    wall.primitives.push(Primitive { triangles: 0..wall.triangles.len() as u32, material: None });
    wall
}

#[test]
fn a_wall_that_fills_the_view_hides_whatever_it_is_made_of() {
    let projection = Projection::Perspective { fov_y: 0.6, near: 0.1 };
    let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (640, 360));
    for cells in [4, 40, 160] {
        let mut scene = Scene::new("rough wall");
        scene.meshes = vec![rough_wall(cells), unit_cube()];
        for (mesh, z) in [(0, 0.0), (1, -8.0), (1, -20.0), (1, -3.0)] {
            let local = Transform::from_translation(DVec3::Z * z);
            scene.groups[0].push(Node { content: Content::Mesh(mesh), local, ..Node::default() });
        }
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let found = cull(&index, &view, &CullOptions::default()).unwrap();
        assert_eq!(found.visible, [3, 0], "{cells}");
    }
}

/// A thousand bolts close behind a wall, in a plant's coordinates and in a country's.
#[test]
fn small_things_far_from_the_origin_take_no_more_questions() {
    let asked_at = |origin: DVec3| {
        let mut scene = Scene::new("bolts");
        scene.meshes.push(unit_cube());
        let mut random = trouble::Random::new(9);
        let mut place = |at: DVec3, size: DVec3| {
            let local = DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, origin + at);
            let local = Transform::Affine(local);
            let node = Node { name: String::new(), parent: None, local, content: Content::Mesh(0) };
            scene.groups[0].push(node);
        };
        place(DVec3::new(0.0, 0.0, -5.0), DVec3::new(8.0, 8.0, 0.1));
        for _ in 0..1000 {
            let at = DVec3::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0), -5.2);
            place(at, DVec3::splat(0.01));
        }
        let index = SceneIndex::build(scene, &IndexOptions::default());
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view = View::look_at(origin, origin + DVec3::NEG_Z, DVec3::Y, projection, (640, 480));
        let found = Culler::new().cull(&index, &view, &CullOptions::default()).unwrap();
        assert_eq!(found.visible, [0]);
        found.counters.boxes_asked
    };
    let far = DVec3::new(512_345.6, 30.0, -5_412_345.7);
    assert!(asked_at(far) < asked_at(DVec3::ZERO) * 2, "{} {}", asked_at(far), asked_at(DVec3::ZERO));
}
