//! Hills: a terrain mesh with plants replicated on a two-dimensional grid [Greene 1995, §3.5.4].
//!
//! The land is a square whose front edge is z = 0 and which reaches away along −Z; its size follows from
//! `polygons`, the density of plants does not. One hill, long across the view, stands near the front: from
//! camera `valley`, near its foot, it hides nearly everything, while camera `open` looks over the land from
//! high above its front left corner.
//!
//! At 512 × 512 pixels, `valley` sees 25,404 of 53 million triangles (the thesis: about 25,000), and `open`
//! with `polygons=5000000` sees 22,420 of 5 million, and half of all plants.
//!
//! The land is cut into square tiles. Each is a group of its own, with its piece of the terrain first and
//! then its plants, so instances are numbered tile by tile: along x, then away from the front.

mod plants;
mod terrain;

use crate::lcg::Lcg;
use crate::palette::paint;
use crate::spec::{KeyDefault, KeyInfo, Values, WorldInfo};
use glam::{DQuat, DVec3};
use hither::conventions::{Projection, View};
use hither::scene::{Camera, CameraProjection, Content, Group, Material, Node, Scene, Transform};
use plants::Plant;
use terrain::{TILE, Terrain};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "hills",
    description: "a hilly terrain with trees and bushes, most of it behind a hill",
    keys: &[
        KeyInfo {
            name: "polygons",
            description: "triangles in all, about",
            min: 1_000_000,
            max: 2_000_000_000,
            default: KeyDefault::Number(53_000_000),
        },
        KeyInfo {
            name: "seed",
            description: "another land of the same kind",
            min: 0,
            max: u32::MAX as u64,
            default: KeyDefault::Number(2),
        },
    ],
    make: hills,
};

/// Land to each plant, square metres.
const AREA_PER_PLANT: f64 = 290.0;

fn hills(values: &Values) -> Scene {
    let seed = values.get("seed") as u32;
    let plan = Plan::new(values.get("polygons"));
    let terrain = Terrain::new(plan.tiles_a_side, seed);
    let mut scene = Scene::new(INFO.name);
    scene.materials = materials();
    scene.meshes = Plant::ALL.map(Plant::mesh).to_vec();
    scene.groups.clear();

    let mut planted = plant_nodes(&plan, &terrain, seed);
    let mut root = Group { name: "land".to_owned(), nodes: Vec::new() };
    for (tile, plants) in planted.iter_mut().enumerate() {
        let (ix, iz) = (tile % plan.tiles_a_side, tile / plan.tiles_a_side);
        let ground = Content::Mesh(scene.meshes.len() as u32);
        scene.meshes.push(terrain.tile_mesh(ix, iz));
        let mut nodes = vec![Node { name: "ground".to_owned(), content: ground, ..Node::default() }];
        nodes.append(plants);
        root.push(Node {
            name: format!("tile {ix} {iz}"),
            local: Transform::from_translation(terrain.tile_corner(ix, iz)),
            content: Content::Group(scene.groups.len() as u32),
            ..Node::default()
        });
        scene.groups.push(Group { name: format!("tile {ix} {iz}"), nodes });
    }
    scene.root = scene.groups.len() as u32;
    scene.groups.push(root);
    scene.cameras = cameras(&terrain);
    scene
}

fn materials() -> Vec<Material> {
    let leaves = |name, srgb| Material { double_sided: true, ..paint(name, srgb) };
    vec![
        paint("grass", 0x7d9a4f),
        paint("bark", 0x6b4f3a),
        leaves("needles", 0x2f5d3a),
        leaves("leaves", 0x5b8c3e),
        leaves("bush leaves", 0x86a13f),
    ]
}

/// How large the land is and how many plants stand on it.
struct Plan {
    tiles_a_side: usize,
    /// Plants along x and along z.
    plants: (usize, usize),
}

impl Plan {
    /// The side of the land and of the plants' grid, so that the triangles come to about `polygons`.
    fn new(polygons: u64) -> Plan {
        let per_plant = Plant::mean_triangles() + AREA_PER_PLANT * terrain::TRIANGLES_PER_SQUARE_METRE;
        let plants = polygons as f64 / per_plant;
        let tiles_a_side = (plants * AREA_PER_PLANT).sqrt() / TILE;
        let tiles_a_side = tiles_a_side.round().max(4.0);
        let ground = tiles_a_side * tiles_a_side * TILE * TILE * terrain::TRIANGLES_PER_SQUARE_METRE;
        let plants = (polygons as f64 - ground) / Plant::mean_triangles();
        let columns = plants.sqrt().round();
        let rows = (plants / columns).round();
        Plan { tiles_a_side: tiles_a_side as usize, plants: (columns as usize, rows as usize) }
    }
}

/// The plants of each tile, in the tile's coordinates: one in each cell of the grid, somewhere in its middle.
fn plant_nodes(plan: &Plan, terrain: &Terrain, seed: u32) -> Vec<Vec<Node>> {
    let (columns, rows) = plan.plants;
    let mut random = Lcg::new(seed.wrapping_mul(747_796_405).wrapping_add(11));
    let mut kinds: Vec<Plant> = (0..columns * rows).map(Plant::in_proportion).collect();
    for i in (1..kinds.len()).rev() {
        kinds.swap(i, random.below_wide(i as u32 + 1) as usize);
    }
    let side = terrain.side();
    let mut tiles = vec![Vec::new(); plan.tiles_a_side * plan.tiles_a_side];
    for (i, kind) in kinds.into_iter().enumerate() {
        let mut within = |cell: usize, cells: usize| {
            (cell as f64 + 0.5 + 0.7 * (f64::from(random.unit()) - 0.5)) * side / cells as f64
        };
        let (x, z) = (within(i % columns, columns) - side / 2.0, -within(i / columns, rows));
        let turn = std::f64::consts::TAU * f64::from(random.unit());
        let scale = 0.7 + 0.6 * f64::from(random.unit());
        let (ix, iz) = terrain.tile_of(x, z);
        let foot = DVec3::new(x, terrain.ground(x, z), z) - terrain.tile_corner(ix, iz);
        tiles[iz * plan.tiles_a_side + ix].push(Node {
            name: kind.name().to_owned(),
            parent: None,
            local: Transform::Trs {
                translation: foot,
                rotation: DQuat::from_xyzw(0.0, libm::sin(turn / 2.0), 0.0, libm::cos(turn / 2.0)),
                scale: DVec3::splat(scale),
            },
            content: Content::Mesh(kind as u32),
        });
    }
    tiles
}

fn cameras(terrain: &Terrain) -> Vec<Camera> {
    let camera = |name: &str, eye: DVec3, direction: DVec3| {
        let lens = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view = View::look_at(eye, eye + direction, DVec3::Y, lens, (1, 1));
        Camera {
            name: name.to_owned(),
            node: None,
            local: Transform::Affine(view.view_from_world.inverse()),
            projection: CameraProjection::Perspective { fov_y: 60f64.to_radians(), near: 0.1 },
        }
    };
    let above = |x: f64, height: f64, z: f64| DVec3::new(x, terrain.ground(x, z) + height, z);
    let side = terrain.side();
    let corner = above(-side / 2.0, 180.0, 0.0);
    vec![
        camera("valley", above(0.0, 2.0, -24.0), DVec3::new(0.02, 0.16, -1.0)),
        camera("open", corner, DVec3::new(0.0, 0.0, -0.55 * side) - corner),
    ]
}
