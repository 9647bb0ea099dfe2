//! Surfaces that are really closed have no cracks and no double hits, wherever they are seen from.
//!
//! Each triangle of a closed surface is drawn alone, once with its own winding and once reversed, and hits are counted
//! pixel by pixel. On snapped vertices that are shared, the fill rule makes a pixel's count of faces towards the eye,
//! less that of faces away from it, what it is for a ray: the number of times that the surface winds around the eye,
//! 1 inside and 0 outside, at silhouettes and along every edge and vertex too.

use glam::{DVec3, Vec3};
use hither::conventions::{Projection, View};
use hither::reference::trouble::Random;
use hither::scene::{Content, Mesh, Node, Primitive};
use hither::{Algorithm, Frame, IndexOptions, RenderOptions, Scene, SceneIndex, render};
use std::collections::HashMap;

const ALGORITHMS: [Algorithm; 2] = [Algorithm::Hzb, Algorithm::ZBuffer];

/// A subdivided icosahedron, counter-clockwise from outside, whose vertices are moved by up to `stir`.
struct Ball {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Ball {
    fn new(subdivisions: u32, stir: f64, random: &mut Random) -> Ball {
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        let mut points = Vec::new();
        for (s, t) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            points.extend([DVec3::new(0.0, s, t), DVec3::new(s, t, 0.0), DVec3::new(t, 0.0, s)]);
        }
        // Its faces are the triples of vertices that are 2 apart.
        let mut triangles = Vec::new();
        let apart = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    let [p, q, r] = [a, b, c].map(|i| points[i]);
                    if apart(p, q) && apart(q, r) && apart(r, p) {
                        let outwards = (q - p).cross(r - p).dot(p) > 0.0;
                        let [a, b, c] = [a as u32, b as u32, c as u32];
                        triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
        for _ in 0..subdivisions {
            let mut halves = HashMap::new();
            let mut half = |a: u32, b: u32| {
                *halves.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    points.push((points[a as usize] + points[b as usize]) * 0.5);
                    points.len() as u32 - 1
                })
            };
            let split = |[a, b, c]: [u32; 3]| {
                let [ab, bc, ca] = [half(a, b), half(b, c), half(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            triangles = triangles.into_iter().flat_map(split).collect();
        }
        let stirred = |p: DVec3| (p.normalize() + random.point(stir)).as_vec3();
        Ball { positions: points.into_iter().map(stirred).collect(), triangles }
    }

    fn index(&self, triangles: Vec<[u32; 3]>) -> SceneIndex {
        let primitives = vec![Primitive { triangles: 0..triangles.len() as u32, material: None }];
        let mesh = Mesh { positions: self.positions.clone(), triangles, primitives, ..Mesh::default() };
        let mut scene = Scene::new("ball");
        scene.meshes.push(mesh);
        scene.groups[0].push(Node { content: Content::Mesh(0), ..Node::default() });
        SceneIndex::build(scene, &IndexOptions::default())
    }

    /// Outwards and inwards: each triangle alone, then all together.
    fn indices(&self) -> [(Vec<SceneIndex>, SceneIndex); 2] {
        let reversed = self.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        [self.triangles.clone(), reversed].map(|triangles: Vec<[u32; 3]>| {
            let alone = triangles.iter().map(|&t| self.index(vec![t])).collect();
            (alone, self.index(triangles))
        })
    }
}

fn draw(index: &SceneIndex, view: &View, algorithm: Algorithm) -> Frame {
    render(index, view, &RenderOptions { algorithm, ..RenderOptions::default() }).unwrap()
}

fn covered(frame: &Frame) -> Vec<bool> {
    let pixels = (0..frame.view.height).flat_map(|y| (0..frame.view.width).map(move |x| (x, y)));
    pixels.map(|(x, y)| frame.id(x, y).is_some()).collect()
}

/// How many of the triangles cover each pixel.
fn hits(alone: &[SceneIndex], view: &View, algorithm: Algorithm) -> Vec<i32> {
    let mut hits = vec![0; (view.width * view.height) as usize];
    for index in alone {
        let frame = draw(index, view, algorithm);
        hits.iter_mut().zip(covered(&frame)).for_each(|(n, covered)| *n += i32::from(covered));
    }
    hits
}

/// Hits of the faces wound outwards and inwards. Checks that the whole surface covers what its triangles cover.
fn both_hits(
    indices: &[(Vec<SceneIndex>, SceneIndex); 2],
    view: &View,
    algorithm: Algorithm,
) -> [Vec<i32>; 2] {
    [0, 1].map(|winding| {
        let (alone, whole) = &indices[winding];
        let hits = hits(alone, view, algorithm);
        let at_least_once: Vec<bool> = hits.iter().map(|&n| n > 0).collect();
        assert!(covered(&draw(whole, view, algorithm)) == at_least_once, "{algorithm:?}, {view:?}");
        hits
    })
}

fn pinhole(random: &mut Random, eye: DVec3, target: DVec3, fov_y: f64, near: f64) -> View {
    let size = (33 + random.below(64), 33 + random.below(64));
    View::look_at(eye, target, random.point(1.0), Projection::Perspective { fov_y, near }, size)
}

#[test]
fn from_around_its_middle_a_closed_surface_covers_every_pixel_once() {
    let random = &mut Random::new(1);
    for (subdivisions, stir) in [(0, 0.0), (1, 0.05), (2, 0.0), (2, 0.03)] {
        let ball = Ball::new(subdivisions, stir, random);
        let indices = ball.indices();
        for _ in 0..8 {
            let eye = random.point(0.08);
            let fov_y = random.between(0.3, 2.4);
            let target = eye + random.point(1.0);
            let view = pinhole(random, eye, target, fov_y, 0.05);
            for algorithm in ALGORITHMS {
                let [outwards, inwards] = both_hits(&indices, &view, algorithm);
                assert!(inwards.iter().all(|&n| n == 1), "{algorithm:?}, {view:?}");
                assert!(outwards.iter().all(|&n| n == 0), "{algorithm:?}, {view:?}");
                // What is covered once is written once.
                let written = draw(&indices[1].1, &view, algorithm).counters.pixels_written;
                assert_eq!(written, u64::from(view.width * view.height), "{algorithm:?}, {view:?}");
            }
        }
    }
}

#[test]
fn from_anywhere_inside_a_closed_surface_is_hit_from_behind_once_more_than_from_the_front() {
    let random = &mut Random::new(2);
    for stir in [0.0, 0.1, 0.2] {
        let ball = Ball::new(2, stir, random);
        let indices = ball.indices();
        for _ in 0..8 {
            // Farther from the surface than the near plane's corners: what the near plane takes is not in the view.
            let eye = random.point(0.25);
            let fov_y = random.between(0.1, 2.0);
            let target = eye + random.point(1.0);
            let view = pinhole(random, eye, target, fov_y, 0.02);
            for algorithm in ALGORITHMS {
                let [outwards, inwards] = both_hits(&indices, &view, algorithm);
                let once = inwards.iter().zip(&outwards).all(|(i, o)| i - o == 1);
                assert!(once, "{algorithm:?}, stir {stir}, {view:?}");
            }
        }
    }
}

#[test]
fn from_outside_a_closed_surface_is_hit_from_behind_as_often_as_from_the_front() {
    let random = &mut Random::new(3);
    for stir in [0.0, 0.1, 0.4] {
        let ball = Ball::new(2, stir, random);
        let indices = ball.indices();
        for round in 0..8 {
            let eye = random.point(1.0).normalize_or(DVec3::X) * random.between(2.0, 6.0);
            let target = random.point(0.9);
            let mut view = pinhole(random, eye, target, [1.2, 0.3, 0.03, 0.002][round % 4], 0.1);
            if round >= 6 {
                let half_height = random.between(0.1, 1.5);
                view.projection = Projection::Orthographic { half_height, near: 0.0, far: 20.0 };
            }
            for algorithm in ALGORITHMS {
                let [outwards, inwards] = both_hits(&indices, &view, algorithm);
                assert!(outwards == inwards, "{algorithm:?}, stir {stir}, {view:?}");
            }
        }
    }
}
