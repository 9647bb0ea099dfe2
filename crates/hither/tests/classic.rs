//! The textbook algorithms and the visible faces of a drawing show the same.

use glam::{DVec3, Vec3};
use hither::Scene;
use hither::classic::{Facet, area, newell_newell_sancha, painted, weiler_atherton};
use hither::conventions::{Projection, View};
use hither::hidden_line::{FaceColor, Kinds, LineOptions, Preparation, PrepareOptions};
use hither::reference::trouble::Random;
use hither::scene::{Content, Mesh, Node, Primitive};

/// Each triangle is a part of its own.
fn scene(triangles: &[[DVec3; 3]]) -> Scene {
    let mut scene = Scene::new("triangles");
    for t in triangles {
        scene.meshes.push(Mesh {
            positions: t.map(|p| p.as_vec3()).to_vec(),
            triangles: vec![[0, 1, 2]],
            primitives: vec![Primitive { triangles: 0..1, material: None }],
            ..Mesh::default()
        });
        let content = Content::Mesh(scene.meshes.len() as u32 - 1);
        scene.groups[0].push(Node { content, ..Node::default() });
    }
    scene
}

fn view() -> View {
    let projection = Projection::Orthographic { half_height: 3.0, near: 0.0, far: 40.0 };
    View::look_at(DVec3::Z * 20.0, DVec3::ZERO, DVec3::Y, projection, (600, 600))
}

/// Visible area of each triangle, square pixels.
fn by_faces(triangles: &[[DVec3; 3]]) -> Vec<f64> {
    let preparation = Preparation::new(&scene(triangles), &PrepareOptions::default());
    let options = LineOptions { faces: Some(FaceColor::White), kinds: Kinds::NONE, ..LineOptions::default() };
    let drawing = preparation.draw(&view(), &options).unwrap();
    let mut areas = vec![0.0; triangles.len()];
    for face in &drawing.faces {
        areas[face.part as usize] += face.area();
    }
    areas
}

fn facets(triangles: &[[DVec3; 3]]) -> Vec<Facet> {
    // The view's own pixels; y up or down makes no difference to areas.
    let points = |t: &[DVec3; 3]| {
        t.iter().map(|p| p.as_vec3().as_dvec3() * DVec3::new(100.0, 100.0, 1.0)).collect::<Vec<DVec3>>()
    };
    triangles.iter().enumerate().map(|(source, t)| Facet { points: points(t), source }).collect()
}

fn random_point(random: &mut Random, reach: f64) -> DVec3 {
    let mut c = || random.between(-reach, reach);
    DVec3::new(c(), c(), c())
}

fn agree(name: &str, ours: &[f64], theirs: &[f64]) {
    for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!((a - b).abs() < 0.05, "{name}, triangle {i}: {a} and {b}");
    }
}

#[test]
fn newell_newell_sancha_shows_the_same_of_triangles_that_pass_through_each_other() {
    for seed in 0..150 {
        let random = &mut Random::new(seed);
        let count = 2 + seed as usize % 7;
        let triangles: Vec<[DVec3; 3]> =
            (0..count).map(|_| [0; 3].map(|_| random_point(random, 2.5))).collect();
        let order = newell_newell_sancha(&facets(&triangles));
        let mut theirs = vec![0.0; count];
        for (facet, region) in order.iter().zip(painted(&order)) {
            theirs[facet.source] += area(&region);
        }
        agree(&format!("seed {seed}"), &by_faces(&triangles), &theirs);
    }
}

#[test]
fn weiler_atherton_shows_the_same_of_triangles_that_do_not() {
    for seed in 0..150 {
        let random = &mut Random::new(seed + 1000);
        // Fewer than eleven, so that 11 steps through all layers.
        let count = 2 + seed as usize % 9;
        // Layers that lean, each within a slab of its own, in any order.
        let triangles: Vec<[DVec3; 3]> = (0..count)
            .map(|layer| {
                [0; 3].map(|_| {
                    let p = random_point(random, 2.5);
                    let depth = ((layer * 11) % count) as f64 * 0.5;
                    DVec3::new(p.x, p.y, depth + p.z * 0.09)
                })
            })
            .collect();
        let theirs: Vec<f64> = weiler_atherton(&facets(&triangles)).iter().map(area).collect();
        agree(&format!("seed {seed}"), &by_faces(&triangles), &theirs);
    }
}

#[test]
fn both_resolve_a_cycle() {
    let bar = |a: Vec3, b: Vec3| {
        let aside = (b - a).truncate().perp().normalize().extend(0.0) * 0.2;
        [a - aside, b, a + aside].map(|p| p.as_dvec3())
    };
    let triangles = [
        bar(Vec3::new(-2.0, -1.0, 0.0), Vec3::new(2.0, -1.1, 1.0)),
        bar(Vec3::new(1.6, -2.0, 0.0), Vec3::new(-0.4, 2.0, 1.0)),
        bar(Vec3::new(0.5, 2.0, 0.0), Vec3::new(-1.5, -2.0, 1.0)),
    ];
    let order = newell_newell_sancha(&facets(&triangles));
    let mut theirs = vec![0.0; 3];
    for (facet, region) in order.iter().zip(painted(&order)) {
        theirs[facet.source] += area(&region);
    }
    let ours = by_faces(&triangles);
    agree("cycle", &ours, &theirs);
    let shown: Vec<f64> = weiler_atherton(&facets(&triangles)).iter().map(area).collect();
    agree("cycle", &ours, &shown);
}
