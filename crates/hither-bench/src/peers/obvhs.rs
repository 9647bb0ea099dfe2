//! The ray-casting crate `obvhs`: a binary tree a mesh and one over the instances.
//!
//! Its binary tree is traced, not its compressed eight-wide one, which was slower on every scene here.

use super::{Peer, RowsOut, instances, only_mesh_in_place};
use crate::peers::Rays;
use glam::{DVec3, Mat3A, Vec3, Vec3A};
use hither::conventions::NO_ID;
use hither::scene::{Mesh, Scene};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::{build_bvh2, build_bvh2_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::ops::Range;
use std::time::Duration;

/// A scene in `obvhs`.
pub struct Obvhs {
    meshes: Vec<MeshTree>,
    instances: Vec<Placed>,
    /// Tree over the instances; absent where the only instance stands where its mesh does.
    top: Option<Bvh2>,
}

struct MeshTree {
    tree: Bvh2,
    /// In the tree's own order.
    triangles: Vec<RtTriangle>,
}

struct Placed {
    number: u32,
    mesh: u32,
    mesh_from_world: Mat3A,
    origin: Vec3A,
}

/// The nearest hit so far.
#[derive(Clone, Copy)]
struct Found {
    instance: u32,
    triangle: u32,
}

impl Obvhs {
    /// Builds the trees of a scene in its present pose, as well as the crate can.
    pub fn build(scene: &Scene) -> Obvhs {
        let meshes: Vec<MeshTree> = scene.meshes.iter().map(MeshTree::build).collect();
        let placed = instances(scene);
        let only_mesh = only_mesh_in_place(&placed);
        let boxes: Vec<Aabb> = placed
            .iter()
            .map(|(mesh, world_from_mesh)| {
                let b = scene.meshes[*mesh as usize].bounds().transformed(world_from_mesh);
                Aabb::new(toward(b.min, f32::NEG_INFINITY), toward(b.max, f32::INFINITY))
            })
            .collect();
        let instances: Vec<Placed> = placed
            .iter()
            .enumerate()
            .map(|(number, (mesh, world_from_mesh))| {
                let mesh_from_world = world_from_mesh.inverse();
                Placed {
                    number: number as u32,
                    mesh: *mesh,
                    mesh_from_world: mesh_from_world.matrix3.as_mat3().into(),
                    origin: mesh_from_world.translation.as_vec3a(),
                }
            })
            .collect();
        let top = only_mesh
            .is_none()
            .then(|| build_bvh2(&boxes, BvhBuildParams::very_slow_build(), &mut Duration::default()));
        Obvhs { meshes, instances, top }
    }

    fn trace(&self, origin: Vec3, direction: Vec3, near: f32, far: f32) -> (Found, f32) {
        let mut found = Found { instance: NO_ID, triangle: NO_ID };
        let ray = Ray::new(origin.into(), direction.into(), near, far);
        let mut hit = RayHit::none();
        match &self.top {
            None => {
                if let Some(triangle) = self.meshes[self.instances[0].mesh as usize].trace(ray, &mut hit) {
                    found = Found { instance: 0, triangle };
                }
            }
            Some(top) => {
                top.ray_traverse(ray, &mut hit, |ray, at| {
                    let placed = &self.instances[top.primitive_indices[at] as usize];
                    let local = Ray::new(
                        placed.mesh_from_world * ray.origin + placed.origin,
                        placed.mesh_from_world * ray.direction,
                        ray.tmin,
                        ray.tmax,
                    );
                    let mut inner = RayHit::none();
                    if let Some(triangle) = self.meshes[placed.mesh as usize].trace(local, &mut inner) {
                        found = Found { instance: placed.number, triangle };
                    }
                    inner.t
                });
            }
        }
        (found, hit.t)
    }
}

/// The `f32` next to `v` towards `limit`, or `v` itself where it is one.
fn toward(v: DVec3, limit: f32) -> Vec3A {
    let step = |x: f64| {
        let near = x as f32;
        let reached = if limit > 0.0 { f64::from(near) >= x } else { f64::from(near) <= x };
        match (reached, limit > 0.0) {
            (true, _) => near,
            (false, true) => near.next_up(),
            (false, false) => near.next_down(),
        }
    };
    Vec3A::new(step(v.x), step(v.y), step(v.z))
}

impl MeshTree {
    fn build(mesh: &Mesh) -> MeshTree {
        let corner = |v: u32| Vec3A::from(mesh.positions[v as usize]);
        let triangles: Vec<Triangle> = mesh
            .triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) })
            .collect();
        let tree =
            build_bvh2_from_tris(&triangles, BvhBuildParams::very_slow_build(), &mut Duration::default());
        let in_tree_order = tree.primitive_indices.iter().map(|&i| {
            let t = &triangles[i as usize];
            RtTriangle::new(t.v0, t.v1, t.v2)
        });
        MeshTree { triangles: in_tree_order.collect(), tree }
    }

    #[inline(always)]
    fn trace(&self, ray: Ray, hit: &mut RayHit) -> Option<u32> {
        self.tree.ray_traverse(ray, hit, |ray, at| self.triangles[at].intersect(ray));
        (hit.primitive_id != NO_ID).then(|| self.tree.primitive_indices[hit.primitive_id as usize])
    }
}

impl Peer for Obvhs {
    fn name(&self) -> String {
        "obvhs 0.4".to_owned()
    }

    fn trace_rows(&self, rays: &Rays, rows: Range<u32>, out: RowsOut<'_>) {
        for (row, y) in rows.enumerate() {
            for x in 0..rays.width {
                let (origin, direction) = rays.ray(x, y);
                let (found, distance) = self.trace(origin, direction, rays.near, rays.far);
                let at = row * rays.width as usize + x as usize;
                out.instance[at] = found.instance;
                out.triangle[at] = found.triangle;
                out.distance[at] = distance;
            }
        }
    }
}
