//! A mesh to be asked about: the boxes of its triangles, and boxes of sixteen of them.

use super::Verdict;
use super::occluder::{OccluderError, check_indices};
use super::queries::Boxes;
use crate::geometry::Aabb;
use crate::scene::Mesh;
use glam::{DAffine3, DVec3, Vec3};

/// A mesh to ask an occlusion buffer about, prepared once: all of its triangles, whatever their material, for what is
/// masked or transparent hides nothing but can be seen. Larger than a box around it only by the boxes around its
/// triangles.
#[derive(Clone, Debug, Default)]
pub struct Occludee {
    triangles: Vec<[Vec3; 3]>,
    /// Around each sixteen of them.
    runs: Vec<Aabb>,
    /// Whether a corner is no finite number: such a mesh may be anywhere.
    anywhere: bool,
}

/// A mesh in its place to ask about.
#[derive(Clone, Copy, Debug)]
pub struct PlacedMesh<'a> {
    /// Its surface.
    pub mesh: &'a Occludee,
    /// Where it is.
    pub world_from_object: DAffine3,
}

/// Triangles whose boxes are asked about together.
const RUN: usize = 16;

impl Occludee {
    /// Prepares triangles. A mesh with a triangle of which a corner is not finite is never hidden. Cost: linear.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Occludee, OccluderError> {
        check_indices(positions, triangles)?;
        let triangles: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let around = |run: &[[Vec3; 3]]| Aabb::around(run.as_flattened().iter().map(|p| p.as_dvec3()));
        Ok(Occludee {
            runs: triangles.chunks(RUN).map(around).collect(),
            anywhere: triangles.as_flattened().iter().any(|p| !p.is_finite()),
            triangles,
        })
    }

    /// All triangles of a mesh of a scene.
    pub fn of_mesh(mesh: &Mesh) -> Result<Occludee, OccluderError> {
        Occludee::new(&mesh.positions, &mesh.triangles)
    }

    /// What `ask` says of its boxes where it is, taken together; those of single triangles are asked for only where a
    /// box of sixteen shows.
    pub(super) fn judge(
        &self,
        world_from_object: &DAffine3,
        mut ask: impl FnMut(&Boxes, &mut Vec<Verdict>),
    ) -> Verdict {
        if self.anywhere {
            return Verdict::Visible;
        }
        let away = world_from_object.translation.abs();
        // The transform's rounding: three products and sums.
        let placed = |b: Aabb, sizes: DVec3| {
            let slack = (sizes + away) * 1e-14;
            Aabb { min: b.min - slack, max: b.max + slack }
        };
        let m = world_from_object.matrix3;
        let stretch =
            |reach: DVec3| m.x_axis.abs() * reach.x + m.y_axis.abs() * reach.y + m.z_axis.abs() * reach.z;
        let reach = |b: &Aabb| b.min.abs().max(b.max.abs());
        let runs: Boxes =
            self.runs.iter().map(|b| placed(b.transformed(world_from_object), stretch(reach(b)))).collect();
        let mut of_runs = Vec::new();
        ask(&runs, &mut of_runs);
        let mut verdict = Verdict::Outside;
        let (mut boxes, mut of_triangles) = (runs.like_these(), Vec::new());
        for ((run, bounds), of_run) in self.triangles.chunks(RUN).zip(&self.runs).zip(of_runs) {
            if of_run == Verdict::Visible {
                let sizes = stretch(reach(bounds));
                let around = |t: &[Vec3; 3]| {
                    Aabb::around(t.iter().map(|p| world_from_object.transform_point3(p.as_dvec3())))
                };
                boxes.clear();
                run.iter().for_each(|t| boxes.push(&placed(around(t), sizes)));
                ask(&boxes, &mut of_triangles);
            } else {
                of_triangles.clear();
                of_triangles.push(of_run);
            }
            if of_triangles.contains(&Verdict::Visible) {
                return Verdict::Visible;
            }
            if of_triangles.contains(&Verdict::Hidden) {
                verdict = Verdict::Hidden;
            }
        }
        verdict
    }
}
