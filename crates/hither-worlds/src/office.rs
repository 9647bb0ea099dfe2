//! OFFICE: one module of 15,000 triangles, repeated 12 × 4 × 12 m apart along x, y and z by nested groups.
//!
//! Row `z` of floor `y` holds `nx` modules, a floor holds `nz` rows, the building `ny` floors, so instance
//! `(y * nz + z) * nx + x` is module `x` (eastwards) of row `z` (away from the front, along −Z) of floor
//! `y` (upwards). A level of one is left out: `n=1` is the bare module, `nx=3&ny=1&nz=1` three of them in
//! the root group. After Greene's building of the same plan [Greene 1995, §3.5]: cubicles with low walls,
//! so that one sees deep into a floor, and a well at each crossing, so that one sees other floors.
//!
//! Cameras: `corridor` looks along a corridor from the front, `open` across the cubicles from the front
//! left corner, `outside` at the whole building, all on the middle storey; `walk` is carried by node
//! `walker`, which animation `walk` leads along the corridor and round a corner in ten seconds.

mod module;
mod walk;

use crate::benchmark_axes::camera;
use crate::spec::{KeyDefault, KeyInfo, Values, WorldInfo};
use glam::DVec3;
use hither::scene::{Content, Group, Node, Scene, Transform};

pub(crate) const INFO: WorldInfo = WorldInfo {
    name: "office",
    description: "an office building of n x n x n modules of 15,000 triangles",
    keys: &[
        KeyInfo {
            name: "n",
            description: "modules along each side",
            min: 1,
            max: 1000,
            default: KeyDefault::Number(33),
        },
        side("nx", "modules along x"),
        side("ny", "storeys"),
        side("nz", "modules along z"),
    ],
    make: office,
};

const fn side(name: &'static str, description: &'static str) -> KeyInfo {
    KeyInfo { name, description, min: 1, max: 1000, default: KeyDefault::SameAs("n") }
}

/// Size of a module, metres.
const PITCH: DVec3 = DVec3::new(12.0, 4.0, 12.0);
/// Middle of a module's corridors, metres from its corner along x and z.
const CORRIDOR: f64 = 6.0;
/// Height of a walker's eye above the bottom of a module, metres: above the cubicle walls, which end at 1.9.
const EYE: f64 = 1.95;

/// How many modules there are along each side.
#[derive(Clone, Copy)]
struct Sides {
    nx: u64,
    ny: u64,
    nz: u64,
}

impl Sides {
    /// Bottom of the middle storey.
    fn storey(&self) -> f64 {
        (self.ny / 2) as f64 * PITCH.y
    }

    /// x of the middle corridor.
    fn corridor(&self) -> f64 {
        (self.nx / 2) as f64 * PITCH.x + CORRIDOR
    }
}

fn office(values: &Values) -> Scene {
    let sides = Sides { nx: values.get("nx"), ny: values.get("ny"), nz: values.get("nz") };
    let mut scene = Scene::new(INFO.name);
    let (mesh, materials) = module::module();
    scene.meshes = vec![mesh];
    scene.materials = materials;
    scene.groups = nested_groups(sides);
    scene.root = scene.groups.len() as u32 - 1;
    scene.cameras = vec![
        camera("corridor", [sides.corridor(), sides.storey() + EYE, 0.5], [0.03, 0.02, 1.0]),
        camera("open", [0.6, sides.storey() + 2.7, 0.6], [1.0, -0.01, 0.9]),
        outside(sides),
    ];
    walk::add(&mut scene, sides);
    scene
}

/// Rows, floors and the building, innermost first; the last is the root.
fn nested_groups(sides: Sides) -> Vec<Group> {
    let levels = [
        ("row", "module", sides.nx, DVec3::new(PITCH.x, 0.0, 0.0)),
        ("floor", "row", sides.nz, DVec3::new(0.0, 0.0, -PITCH.z)),
        ("building", "floor", sides.ny, DVec3::new(0.0, PITCH.y, 0.0)),
    ];
    let mut groups: Vec<Group> = Vec::new();
    let mut content = Content::Mesh(0);
    for (name, member, count, step) in levels {
        if count == 1 {
            continue;
        }
        let nodes = (0..count).map(|i| Node {
            name: format!("{member} {i}"),
            parent: None,
            local: Transform::from_translation(step * i as f64),
            content,
        });
        groups.push(Group { name: name.to_owned(), nodes: nodes.collect() });
        content = Content::Group(groups.len() as u32 - 1);
    }
    if groups.is_empty() {
        let module = Node { name: "module 0".to_owned(), content, ..Node::default() };
        groups.push(Group { name: "building".to_owned(), nodes: vec![module] });
    }
    groups
}

/// For n = 33 the benchmarks' camera; other buildings are seen from where they look alike.
fn outside(sides: Sides) -> hither::scene::Camera {
    let scale = [sides.nx, sides.ny, sides.nz].map(|n| n as f64 / 33.0);
    let scaled = |v: [f64; 3]| [0, 1, 2].map(|k| v[k] * scale[k]);
    camera("outside", scaled([-150.0, 180.0, -220.0]), scaled([0.62, -0.25, 0.85]))
}
