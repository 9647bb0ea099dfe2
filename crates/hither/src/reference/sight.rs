//! Lines of sight: the nearest surface that hides, along the ray through any point of the image plane, by asking
//! every triangle. The truth that conservative culling is held against.

use crate::conventions::{Projection, View};
use crate::scene::{AlphaMode, Scene};
use glam::DVec3;

/// Triangles that hide what is behind them, in view space.
#[derive(Clone, Debug)]
pub struct Sight {
    view: View,
    triangles: Vec<Triangle>,
}

#[derive(Clone, Copy, Debug)]
struct Triangle {
    corner: [DVec3; 3],
    two_sided: bool,
}

/// How far outside a triangle, in its barycentric weights, a ray may pass and still meet it: two triangles that
/// share an edge leave no gap between them.
const EDGE: f64 = 1e-10;

impl Sight {
    /// What of `scene` hides from the eye of `view`: opaque triangles, where they face it or have two sides.
    pub fn new(scene: &Scene, view: &View) -> Sight {
        let mut triangles = Vec::new();
        for instance in scene.instances() {
            let at = view.view_from_world * instance.world_from_mesh;
            let mirrored = at.matrix3.determinant() < 0.0;
            let mesh = &scene.meshes[instance.mesh as usize];
            for (t, corners) in mesh.triangles.iter().enumerate() {
                let material = mesh.material_of(t as u32).map(|m| &scene.materials[m as usize]);
                if material.is_some_and(|m| m.alpha != AlphaMode::Opaque) {
                    continue;
                }
                let mut corner = corners.map(|v| at.transform_point3(mesh.positions[v as usize].as_dvec3()));
                if mirrored {
                    corner.swap(1, 2);
                }
                triangles.push(Triangle { corner, two_sided: material.is_some_and(|m| m.double_sided) });
            }
        }
        Sight { view: *view, triangles }
    }

    /// Where the ray through (x, y), pixels from the image's corner, starts, and where it goes per metre along
    /// the view axis; view space.
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let scale = self.view.pixels_per_unit();
        let across = (x - f64::from(self.view.width) * 0.5) / scale;
        let up = (f64::from(self.view.height) * 0.5 - y) / scale;
        match self.view.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, DVec3::new(across, up, -1.0)),
            Projection::Orthographic { .. } => (DVec3::new(across, up, 0.0), DVec3::NEG_Z),
        }
    }

    /// Distance along the view axis of the nearest surface, at or beyond the near plane, that a ray meets.
    pub fn distance(&self, (origin, direction): (DVec3, DVec3)) -> f64 {
        let near = self.view.projection.near() * (1.0 - 1e-12);
        self.triangles
            .iter()
            .filter_map(|t| meet(t, origin, direction))
            .filter(|&d| d >= near)
            .fold(f64::INFINITY, f64::min)
    }

    /// Depth of the nearest surface through (x, y), as `conventions` counts it; 0 where there is none.
    pub fn depth(&self, x: f64, y: f64) -> f64 {
        let distance = self.distance(self.ray(x, y));
        match self.view.projection {
            Projection::Perspective { near, .. } => near / distance,
            Projection::Orthographic { near, far, .. } => ((far - distance) / (far - near)).max(0.0),
        }
    }
}

/// Distance in multiples of `direction` at which a ray meets a triangle from its drawn side.
fn meet(t: &Triangle, origin: DVec3, direction: DVec3) -> Option<f64> {
    let [a, b, c] = t.corner;
    let normal = (b - a).cross(c - a);
    let against = normal.dot(direction);
    if against == 0.0 || (against > 0.0 && !t.two_sided) {
        return None;
    }
    // Volumes of the ray's direction with the edges, seen from its origin.
    let [p, q, r] = [a - origin, b - origin, c - origin];
    let u = direction.dot(q.cross(r));
    let v = direction.dot(r.cross(p));
    let w = direction.dot(p.cross(q));
    let sum = u + v + w;
    let edge = EDGE * sum.abs();
    let inside = if sum > 0.0 { u.min(v).min(w) >= -edge } else { u.max(v).max(w) <= edge };
    (inside && sum != 0.0).then(|| p.dot(normal) / against)
}
