//! Small scenes of which one can say what is hidden: the situations of the paper's figures, and bad input.

use super::{scene_of, sign, wall};
use crate::conventions::{Projection, View};
use crate::cull::planes::{Amount, Culled, PlaneCuller, PlanesError, PlanesOptions, State};
use crate::scene::{AlphaMode, Content, Node, Scene};
use glam::DVec3;

const EYE: DVec3 = DVec3::new(0.0, 1.5, 0.0);

fn alone() -> PlanesOptions {
    PlanesOptions { connected: false, fusion: false, ..PlanesOptions::default() }
}

fn connected() -> PlanesOptions {
    PlanesOptions { fusion: false, ..PlanesOptions::default() }
}

fn look(scene: &Scene, options: &PlanesOptions, eye: DVec3) -> Culled {
    PlaneCuller::new(scene, options).look_around(eye).unwrap()
}

#[test]
fn one_wall_hides_what_is_wholly_behind_it() {
    let scene = scene_of(&[wall(-2.0, -4.0, 2.0, -4.0), sign(0.0, 1.5, -8.0), sign(5.0, 1.5, -8.0)]);
    assert_eq!(look(&scene, &alone(), EYE).visible, [0, 2]);
    // From the other side it is the sign that is in front.
    assert_eq!(look(&scene, &alone(), DVec3::new(0.0, 1.5, -12.0)).visible, [0, 1, 2]);
}

#[test]
fn a_shared_edge_leaks_only_where_it_is_a_silhouette() {
    // Two walls that meet at an edge in front of a sign: bent away from the eye, towards it, and apart.
    for bend in [0.0, 1.0, -1.0] {
        let walls = [wall(-2.0, -4.0, 0.0, -4.0 + bend), wall(0.0, -4.0 + bend, 2.0, -4.0)];
        let scene = scene_of(&[walls[0].clone(), walls[1].clone(), sign(0.0, 1.5, -8.0)]);
        if bend != 0.0 {
            assert_eq!(look(&scene, &alone(), EYE).visible, [0, 1, 2], "{bend}");
        }
        assert_eq!(look(&scene, &connected(), EYE).visible, [0, 1], "{bend}");
    }
    // Both on the same side of their common edge, which is a silhouette: the paper's figure 4c.
    let scene = scene_of(&[
        wall(0.0, -3.0, 2.0, -4.0),
        wall(0.0, -3.0, 2.0, -6.0),
        vec![[-0.5, 1.0, -9.0], [0.5, 1.0, -9.0], [0.5, 2.0, -9.0], [-0.5, 2.0, -9.0]],
    ]);
    assert!(look(&scene, &PlanesOptions::default(), EYE).visible.contains(&2));
}

#[test]
fn behind_the_inner_corner_of_a_room_is_hidden() {
    // The sign is beyond neither wall's plane alone: it is seen through both.
    let scene = scene_of(&[
        wall(-3.0, -4.0, 3.0, -4.0),
        wall(3.0, -4.0, 3.0, 3.0),
        vec![[3.5, 1.0, -5.5], [5.0, 1.0, -3.5], [5.0, 2.0, -3.5], [3.5, 2.0, -5.5]],
    ]);
    assert!(look(&scene, &alone(), EYE).visible.contains(&2));
    assert!(!look(&scene, &connected(), EYE).visible.contains(&2));
}

#[test]
fn separate_walls_hide_together_if_they_overlap_in_the_image() {
    let near = wall(-2.0, -4.0, 0.3, -4.0);
    for (gap, visible) in [(0.3, vec![0, 1]), (0.4, vec![0, 1, 2])] {
        let far = wall(gap, -5.0, 3.0, -5.0);
        let scene = scene_of(&[near.clone(), far, sign(0.45, 1.5, -6.0)]);
        assert_eq!(look(&scene, &connected(), EYE).visible, [0, 1, 2], "{gap}");
        assert_eq!(look(&scene, &PlanesOptions::default(), EYE).visible, visible, "{gap}");
    }
}

#[test]
fn coplanar_walls_become_one_occluder_and_stay_two_polygons() {
    let scene = scene_of(&[wall(-2.0, -4.0, 0.0, -4.0), wall(2.0, -4.0, 0.0, -4.0), sign(0.0, 1.5, -8.0)]);
    let mut culler = PlaneCuller::new(&scene, &alone());
    assert_eq!(culler.model().polygons().len(), 3);
    assert_eq!(culler.occluder_total(), 2);
    assert_eq!(culler.look_around(EYE).unwrap().visible, [0, 1]);
}

#[test]
fn only_what_is_opaque_and_drawn_hides() {
    let hidden = |change: &dyn Fn(&mut Scene)| {
        let mut scene = scene_of(&[wall(-2.0, -4.0, 2.0, -4.0), sign(0.0, 1.5, -8.0)]);
        change(&mut scene);
        !look(&scene, &PlanesOptions::default(), EYE).visible.contains(&1)
    };
    assert!(hidden(&|_| ()));
    assert!(!hidden(&|s| s.materials[0].alpha = AlphaMode::Blend));
    // A mask may have holes, unless its alpha reaches the cutoff everywhere.
    assert!(!hidden(&|s| s.materials[0].alpha = AlphaMode::Mask { cutoff: 1.0 }));
    assert!(hidden(&|s| s.materials[0].alpha = AlphaMode::Mask { cutoff: 0.5 }));
    // One-sided: from its front only.
    assert!(hidden(&|s| s.materials[0].double_sided = false));
    assert!(!hidden(&|s| {
        s.materials[0].double_sided = false;
        s.meshes[0].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }));
}

#[test]
fn a_closed_mesh_of_small_polygons_hides_by_the_box_inside_it() {
    let (rings, segments) = (12, 24);
    let mut scene = scene_of(&[sign(0.0, 1.5, -12.0)]);
    let point = |ring: usize, segment: usize| {
        let (a, b) = (
            std::f64::consts::PI * ring as f64 / rings as f64,
            std::f64::consts::TAU * (segment % segments) as f64 / segments as f64,
        );
        [2.0 * a.sin() * b.sin(), 1.5 + 2.0 * a.cos(), -6.0 + 2.0 * a.sin() * b.cos()]
    };
    let mut polygons = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(r, s)| point(ring + r, segment + s));
            polygons.push(match ring {
                0 => vec![a, b, c],
                r if r == rings - 1 => vec![a, b, d],
                _ => vec![a, b, c, d],
            });
        }
    }
    // One mesh, so that it is one instance.
    let ball = scene_of(&polygons);
    let mut joined = ball.meshes[0].clone();
    for m in &ball.meshes[1..] {
        let first = joined.positions.len() as u32;
        joined.positions.extend(&m.positions);
        joined.triangles.extend(m.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    // Poles are one point to the last bit, as files have them.
    for p in &mut joined.positions {
        if p.x.abs() < 1e-6 && (p.z + 6.0).abs() < 1e-6 {
            (p.x, p.z) = (0.0, -6.0);
        }
    }
    joined.primitives[0].triangles = 0..joined.triangles.len() as u32;
    joined.primitives[0].material = None;
    let content = Content::Mesh(scene.meshes.len() as u32);
    scene.meshes.push(joined);
    scene.groups[0].push(Node { content, ..Node::default() });
    let hidden = |virtual_occluders: bool, eye: DVec3| {
        let options = PlanesOptions { virtual_occluders, fusion: false, ..PlanesOptions::default() };
        let mut culler = PlaneCuller::new(&scene, &options);
        !culler.look_around(eye).unwrap().visible.contains(&0)
    };
    assert!(hidden(true, EYE));
    // Within the ball, and within the box round it, the box inside it hides nothing.
    assert!(!hidden(true, DVec3::new(0.0, 1.5, -11.0)));
    let from_within = look(&scene, &PlanesOptions::default(), DVec3::new(0.1, 3.3, -6.1));
    assert!(from_within.visible.len() > 1);
}

#[test]
fn an_eye_in_a_wall_or_at_its_corner_sees_past_it() {
    let scene = scene_of(&[wall(-2.0, -4.0, 2.0, -4.0), sign(0.0, 1.5, -8.0)]);
    for eye in [
        DVec3::new(0.0, 1.5, -4.0),
        DVec3::new(-2.0, 0.0, -4.0),
        DVec3::new(2.0, 3.0, -4.0),
        DVec3::new(0.0, 0.0, -4.0),
        DVec3::new(7.0, 1.5, -4.0),
    ] {
        assert_eq!(look(&scene, &PlanesOptions::default(), eye).visible, [0, 1], "{eye}");
    }
}

#[test]
fn a_wall_that_the_near_plane_cuts_away_hides_nothing() {
    let scene = scene_of(&[wall(-2.0, -4.0, 2.0, -4.0), sign(0.0, 1.5, -8.0), sign(0.0, 1.5, 8.0)]);
    let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
    let mut seen = |near: f64| {
        let lens = Projection::Perspective { fov_y: 1.0, near };
        let view = View::look_at(EYE, EYE + DVec3::NEG_Z, DVec3::Y, lens, (64, 48));
        culler.look(&view).unwrap().visible
    };
    // What is behind the eye is outside the view.
    assert_eq!(seen(0.1), [0]);
    assert_eq!(seen(3.9), [0]);
    assert!(seen(4.1).contains(&1));
}

#[test]
fn bad_input_is_refused() {
    let scene = scene_of(&[wall(-2.0, -4.0, 2.0, -4.0)]);
    let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
    for eye in [DVec3::NAN, DVec3::INFINITY, DVec3::new(0.0, f64::NEG_INFINITY, 0.0)] {
        assert_eq!(culler.look_around(eye), Err(PlanesError::Eye));
    }
    assert_eq!(culler.foresee(EYE, f64::NAN), Err(PlanesError::Eye));
    assert_eq!(culler.foresee(EYE, -1.0), Err(PlanesError::Eye));
    let lens = Projection::Orthographic { half_height: 1.0, near: 0.0, far: 9.0 };
    let view = View::look_at(EYE, EYE + DVec3::NEG_Z, DVec3::Y, lens, (64, 48));
    assert_eq!(culler.look(&view), Err(PlanesError::Orthographic));
    let mut empty = PlaneCuller::new(&Scene::new("nothing"), &PlanesOptions::default());
    assert!(empty.look_around(EYE).unwrap().visible.is_empty());
    let none = PlanesOptions { occluders: Amount::Fixed(0), ..PlanesOptions::default() };
    assert_eq!(look(&scene, &none, EYE).visible, [0]);
}

#[test]
fn each_polygon_is_visible_partial_hidden_or_outside() {
    let scene = scene_of(&[
        wall(-1.0, -5.0, 1.0, -5.0),
        sign(0.0, 1.5, -8.0),
        wall(0.0, -9.0, 4.0, -9.0),
        sign(3.0, 1.5, -5.0),
        sign(0.0, 1.5, 4.0),
    ]);
    let mut culler = PlaneCuller::new(&scene, &PlanesOptions::default());
    assert_eq!(culler.polygon_states(), [State::Outside; 5]);
    culler.look_around(EYE).unwrap();
    let [wall, behind, half, beside] = [State::Visible, State::Hidden, State::Partial, State::Visible];
    assert_eq!(culler.polygon_states(), [wall, behind, half, beside, State::Visible]);
    let projection = Projection::Perspective { fov_y: 1.5, near: 0.1 };
    culler.look(&View::look_at(EYE, DVec3::new(0.0, 1.5, -1.0), DVec3::Y, projection, (100, 100))).unwrap();
    assert_eq!(culler.polygon_states(), [wall, behind, half, beside, State::Outside]);
}
