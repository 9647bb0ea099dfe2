//! Against exact visibility: nothing that can be seen is called hidden, from awkward places in awkward scenes.

use crate::conventions::Projection;
use crate::cull::planes::{Culled, PlaneCuller, PlanesOptions, State};
use crate::reference::Caster;
use crate::reference::all_around::sightings;
use crate::reference::trouble::{self, Random};
use crate::scene::Scene;
use glam::{DAffine3, DMat3, DVec3};

/// Parts thinner than this are not held against an answer: the reference cuts in `f64`.
const THINNEST: f64 = 1e-7;

fn assert_nothing_visible_is_hidden(scene: &Scene, culler: &PlaneCuller, culled: &Culled, about: &str) {
    for seen in sightings(scene, culled.eye, THINNEST) {
        let polygon = culler.model().polygon_of(seen.instance, seen.triangle);
        let known = culled.visible.binary_search(&polygon).is_ok();
        assert!(known, "{about}: from {} polygon {polygon} is called hidden, but {seen:?}", culled.eye);
    }
}

/// Anywhere; or at a vertex, on an edge, in a triangle, or on the plane of one.
fn awkward_eye(scene: &Scene, random: &mut Random) -> DVec3 {
    let instances = scene.instances();
    let kind = random.below(8);
    if kind < 3 || instances.is_empty() {
        return random.point(6.0);
    }
    let instance = &instances[random.below(instances.len() as u32) as usize];
    let mesh = &scene.meshes[instance.mesh as usize];
    if mesh.triangles.is_empty() {
        return random.point(6.0).round();
    }
    let triangle = mesh.triangles[random.below(mesh.triangles.len() as u32) as usize];
    let [a, b, c] =
        triangle.map(|v| instance.world_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3()));
    match kind {
        3 => a,
        4 => a.lerp(b, 0.5),
        5 => (a + b + c) / 3.0,
        6 => a + (b - a) * random.between(-2.0, 2.0) + (c - a) * random.between(-2.0, 2.0),
        _ => (a + b + c) / 3.0 + random.point(1e-6),
    }
}

#[test]
fn nothing_visible_is_hidden_in_troublesome_scenes() {
    let (mut asked, mut hidden) = (0, 0);
    for seed in 0..400 {
        let scene = trouble::scene(seed);
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let random = &mut Random::new(seed + 1000);
        for look in 0..8 {
            let eye = awkward_eye(&scene, random);
            let culled = culler.look_around(eye).unwrap();
            assert_nothing_visible_is_hidden(&scene, &culler, &culled, &format!("seed {seed} look {look}"));
            asked += culler.model().polygons().len();
            hidden += culler.model().polygons().len() - culled.visible.len();
        }
    }
    assert!(hidden > asked / 50, "{hidden} of {asked}");
}

#[test]
fn what_a_ray_meets_in_a_view_is_never_hidden() {
    let mut rays = 0;
    for seed in 0..1000 {
        let scene = trouble::scene(seed);
        let mut view = trouble::view(seed);
        if matches!(view.projection, Projection::Orthographic { .. }) {
            continue;
        }
        if seed % 4 == 0 {
            // View space need not be rigid.
            let random = &mut Random::new(seed);
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis + random.point(0.4));
            let sheared = DMat3::from_cols(x, y, z) * random.between(0.1, 4.0);
            view.view_from_world = DAffine3::from_mat3(sheared) * view.view_from_world;
        }
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let culled = culler.look(&view).unwrap();
        let seen = |state: &State| matches!(state, State::Visible | State::Partial);
        let states = (0..).zip(culler.polygon_states()).filter(|(_, state)| seen(state));
        assert!(states.map(|(polygon, _)| polygon).eq(culled.visible.iter().copied()), "seed {seed}");
        let caster = Caster::new(&scene, &view);
        for (x, y) in
            (0..view.height).step_by(3).flat_map(|y| (0..view.width).step_by(3).map(move |x| (x, y)))
        {
            let probe = caster.probe(x, y);
            let Some(seen) = probe.nearest().filter(|m| m.certain) else { continue };
            // A surface whose depth ties with another's may be hidden by it.
            let tied = probe.hits().nth(1).is_some_and(|m| m.depth + m.depth_slack >= seen.depth);
            if tied || probe.edge_distance_px() < 1e-6 {
                continue;
            }
            rays += 1;
            let polygon = culler.model().polygon_of(seen.id.instance, seen.id.triangle);
            let known = culled.visible.binary_search(&polygon).is_ok();
            assert!(known, "seed {seed} pixel ({x}, {y}): polygon {polygon} is called hidden; {view:?}");
        }
    }
    assert!(rays > 10_000, "{rays}");
}

#[test]
fn far_from_the_origin_nothing_visible_is_hidden_either() {
    let mut hidden = 0;
    for seed in 0..60 {
        let mut scene = trouble::scene(seed);
        let far = [1e3, 1e5, 1e7][seed as usize % 3];
        let offset = DVec3::new(far, -far, 0.5 * far);
        for node in &mut scene.groups[1].nodes {
            if node.parent.is_none() {
                let moved = DAffine3::from_translation(offset) * node.local.matrix();
                node.local = crate::scene::Transform::Affine(moved);
            }
        }
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let random = &mut Random::new(seed);
        for look in 0..4 {
            let eye = offset + random.point(6.0);
            let culled = culler.look_around(eye).unwrap();
            assert_nothing_visible_is_hidden(&scene, &culler, &culled, &format!("seed {seed} look {look}"));
            hidden += culler.model().polygons().len() - culled.visible.len();
        }
    }
    assert!(hidden > 1000, "{hidden}");
}

#[test]
fn what_any_eye_within_reach_sees_was_foreseen() {
    let mut hidden = 0;
    for seed in 0..120 {
        let scene = trouble::scene(seed);
        let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
        let random = &mut Random::new(seed + 9);
        let eye = awkward_eye(&scene, random);
        let reach = [0.01, 0.1, 0.5][seed as usize % 3];
        let foreseen = culler.foresee(eye, reach).unwrap();
        hidden += culler.model().polygons().len() - foreseen.visible.len();
        for at in 0..6 {
            // On the ball's surface, where it is hardest.
            let there = eye + random.point(1.0).normalize() * reach * 0.999_999;
            let about = format!("seed {seed} eye {at}");
            assert_nothing_visible_is_hidden(
                &scene,
                &culler,
                &Culled { eye: there, ..foreseen.clone() },
                &about,
            );
        }
        let around = culler.look_around(eye).unwrap();
        let inside = around.visible.iter().all(|p| foreseen.visible.binary_search(p).is_ok());
        assert!(inside, "seed {seed}: seen from the middle and not foreseen");
    }
    assert!(hidden > 500, "{hidden}");
}
