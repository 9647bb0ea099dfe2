//! All trees on all kinds of trouble; what moves and what rests; nesting.

mod meshes;
mod moving;
mod nesting;

use super::*;
use crate::scene::{Group, Mesh, Node, Primitive};
use glam::DVec3;

const KINDS: [TreeKind; 3] = [TreeKind::Bvh, TreeKind::OctreeSmallest, TreeKind::OctreePushed];

/// Numbers that follow from a seed (a linear congruential generator's high bits).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    fn point(&mut self, reach: f64) -> DVec3 {
        DVec3::new(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5) * (2.0 * reach)
    }
}

fn mesh_of(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Mesh {
    let mut mesh = Mesh::default();
    for corners in triangles {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|c| c.as_vec3()));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    let all = 0..mesh.triangles.len() as u32;
    mesh.primitives.push(Primitive { triangles: all, material: None });
    mesh
}

/// One instance of one mesh.
fn scene_of(mesh: Mesh) -> Scene {
    let mut scene = Scene::new("one mesh");
    scene.meshes.push(mesh);
    scene.groups[0].push(shown(Content::Mesh(0), DVec3::ZERO));
    scene
}

fn shown(content: Content, at: DVec3) -> Node {
    Node { content, local: Transform::from_translation(at), ..Node::default() }
}

fn triangle() -> Mesh {
    mesh_of([[DVec3::ZERO, DVec3::X, DVec3::Y]])
}

/// A scene's trees, node by node, in full.
fn trees(index: &SceneIndex) -> Vec<String> {
    let meshes = index.meshes.iter().flat_map(|m| [&m.solid.tree, &m.blended.tree]);
    let groups = index.groups.iter().flat_map(|g| [&g.resting, &g.moving]);
    meshes.chain(groups).flat_map(|tree| &tree.nodes).map(|node| format!("{node:?}")).collect()
}
