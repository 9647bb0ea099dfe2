//! A scene as convex polygons in world space.
//!
//! Triangles of an instance that share vertices by number and lie in one plane are one polygon, as they
//! were modelled; what is hidden is said of polygons. Vertices of all instances in exactly the same place
//! are one vertex, so that polygons of different parts are neighbours where they meet.

use super::merge::{Cell, merge};
use crate::geometry::Aabb;
use crate::scene::{AlphaMode, HidingMaterials, Material, Mesh, Scene};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::ops::Range;

/// A convex polygon of an instance.
#[derive(Clone, Debug)]
pub struct Polygon {
    /// Number of the instance.
    pub instance: u32,
    /// Whether both sides are drawn.
    pub double_sided: bool,
    /// Whether nothing is seen through it: opaque, and not without area.
    pub opaque: bool,
    /// Smallest box around it, world space.
    pub bounds: Aabb,
    /// Which of the model's corners.
    pub(super) corners: Range<u32>,
    /// Which of the model's triangles.
    pub(super) triangles: Range<u32>,
}

/// All polygons of a scene in its present pose.
#[derive(Clone, Debug, Default)]
pub struct PolygonModel {
    /// Different vertices, world space.
    pub(super) vertices: Vec<DVec3>,
    polygons: Vec<Polygon>,
    corners: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// For each instance, where its triangles begin in `polygon_of`.
    first: Vec<u32>,
    polygon_of: Vec<u32>,
}

impl PolygonModel {
    /// The polygons of `scene`, which must be valid. Cost: n log n in its triangles, instances counted.
    pub fn new(scene: &Scene) -> PolygonModel {
        let mut model = PolygonModel::default();
        let mut welded = HashMap::new();
        let materials = HidingMaterials::new(scene);
        for (number, instance) in scene.instances().iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh as usize];
            model.add(materials.of(mesh), mesh, number as u32, &instance.world_from_mesh, &mut welded);
        }
        model
    }

    /// The polygons; a polygon's number is its place here.
    pub fn polygons(&self) -> &[Polygon] {
        &self.polygons
    }

    /// Corners of polygon `number` in order, world space.
    pub fn corners(&self, number: u32) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        self.corner_numbers(number).iter().map(|&v| self.vertices[v as usize])
    }

    /// The polygon that holds a triangle of an instance.
    pub fn polygon_of(&self, instance: u32, triangle: u32) -> u32 {
        self.polygon_of[(self.first[instance as usize] + triangle) as usize]
    }

    pub(super) fn corner_numbers(&self, number: u32) -> &[u32] {
        let range = &self.polygons[number as usize].corners;
        &self.corners[range.start as usize..range.end as usize]
    }

    pub(super) fn triangles(&self, number: u32) -> &[[u32; 3]] {
        let range = &self.polygons[number as usize].triangles;
        &self.triangles[range.start as usize..range.end as usize]
    }

    /// Box around all polygons.
    pub fn bounds(&self) -> Aabb {
        self.polygons.iter().fold(Aabb::EMPTY, |b, p| b.union(&p.bounds))
    }

    fn add(
        &mut self,
        materials: &[Material],
        mesh: &Mesh,
        instance: u32,
        world_from_mesh: &DAffine3,
        welded: &mut HashMap<[u64; 3], u32>,
    ) {
        let points: Vec<DVec3> =
            mesh.positions.iter().map(|p| world_from_mesh.transform_point3(p.as_dvec3())).collect();
        let numbers: Vec<u32> = points.iter().map(|p| self.weld(*p, welded)).collect();
        let mirrored = world_from_mesh.matrix3.determinant() < 0.0;
        let triangles: Vec<[u32; 3]> =
            mesh.triangles.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }).collect();
        let looks: Vec<u64> = (0..triangles.len() as u32).map(|t| look(materials, mesh, t)).collect();
        let (mut cells, mut cell_triangle, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        for (t, corners) in triangles.iter().enumerate() {
            match normal(corners.map(|v| points[v as usize])) {
                Some(normal) => {
                    cells.push(Cell { corners: corners.to_vec(), normal, kind: looks[t] });
                    cell_triangle.push(t as u32);
                }
                None => alone.push(t as u32),
            }
        }
        self.first.push(self.polygon_of.len() as u32);
        let first = self.polygon_of.len();
        self.polygon_of.resize(first + triangles.len(), 0);
        let world = |t: u32| triangles[t as usize].map(|v| numbers[v as usize]);
        for made in merge(&points, cells) {
            let members: Vec<u32> = made.members.iter().map(|&m| cell_triangle[m as usize]).collect();
            let corners: Vec<u32> = made.corners.iter().map(|&v| numbers[v as usize]).collect();
            self.push(instance, looks[members[0] as usize], &corners, members.iter().map(|&t| world(t)));
            members
                .iter()
                .for_each(|&t| self.polygon_of[first + t as usize] = self.polygons.len() as u32 - 1);
        }
        for t in alone {
            self.push(instance, looks[t as usize] & !OPAQUE, &world(t), [world(t)].into_iter());
            self.polygon_of[first + t as usize] = self.polygons.len() as u32 - 1;
        }
    }

    fn push(&mut self, instance: u32, look: u64, corners: &[u32], triangles: impl Iterator<Item = [u32; 3]>) {
        let (first_corner, first_triangle) = (self.corners.len() as u32, self.triangles.len() as u32);
        self.corners.extend(corners);
        self.triangles.extend(triangles);
        let bounds = Aabb::around(corners.iter().map(|&v| self.vertices[v as usize]));
        self.polygons.push(Polygon {
            instance,
            double_sided: look & DOUBLE_SIDED != 0,
            opaque: look & OPAQUE != 0,
            bounds,
            corners: first_corner..self.corners.len() as u32,
            triangles: first_triangle..self.triangles.len() as u32,
        });
    }

    fn weld(&mut self, point: DVec3, welded: &mut HashMap<[u64; 3], u32>) -> u32 {
        // −0 and 0 are the same place.
        let key = (point + DVec3::ZERO).to_array().map(f64::to_bits);
        *welded.entry(key).or_insert_with(|| {
            self.vertices.push(point);
            self.vertices.len() as u32 - 1
        })
    }
}

const DOUBLE_SIDED: u64 = 1;
const OPAQUE: u64 = 2;

/// What of a triangle's material decides what it hides.
fn look(materials: &[Material], mesh: &Mesh, triangle: u32) -> u64 {
    let material = mesh.material_of(triangle).map(|m| &materials[m as usize]);
    let opaque = material.is_none_or(|m| m.alpha == AlphaMode::Opaque);
    let double_sided = material.is_some_and(|m| m.double_sided);
    u64::from(double_sided) * DOUBLE_SIDED + u64::from(opaque) * OPAQUE
}

/// Unit normal; `None` where the triangle is so thin that its plane is not known.
fn normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let (u, v) = (b - a, c - a);
    let n = u.cross(v);
    let longest = u.length_squared().max(v.length_squared()).max(b.distance_squared(c));
    (n.length() > 1e-9 * longest).then(|| n.normalize())
}
