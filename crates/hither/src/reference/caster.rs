//! Looks along the ray through a pixel's centre: every triangle of every instance, in `f64`.
//!
//! Nothing is stored but instances and their rectangles on screen, so that a scene of half a billion
//! triangles can be asked about some of its pixels. Cost of a pixel: the instances, and the triangles of
//! those whose rectangle holds it.

use super::probe::{EDGE_PX, Meeting, Probe};
use crate::conventions::{Projection, SurfaceId, View};
use crate::scene::{AlphaMode, Scene};
use glam::{DAffine3, DVec2, DVec3};

/// A scene as seen from one eye.
pub struct Caster<'a> {
    scene: &'a Scene,
    lens: Lens,
    instances: Vec<Placed>,
}

/// An instance in view space.
struct Placed {
    number: u32,
    mesh: u32,
    view_from_mesh: DAffine3,
    mirrored: bool,
    /// Smallest and largest screen coordinates, pixels.
    screen: [DVec2; 2],
}

/// The view's own arithmetic, written out once more.
struct Lens {
    projection: Projection,
    pixels_per_unit: f64,
    /// Half the image's size, pixels: where the view axis meets it.
    middle: DVec2,
}

/// A ray in view space; a point at distance t along the view axis is `origin + t * direction`.
struct Ray {
    origin: DVec3,
    direction: DVec3,
}

/// Where a ray meets a triangle's plane.
struct Crossing {
    distance: f64,
    barycentric: DVec3,
}

impl Lens {
    fn screen(&self, point_in_view: DVec3) -> DVec2 {
        let scale = match self.projection {
            Projection::Perspective { .. } => self.pixels_per_unit / -point_in_view.z,
            Projection::Orthographic { .. } => self.pixels_per_unit,
        };
        self.middle + DVec2::new(point_in_view.x, -point_in_view.y) * scale
    }

    fn ray(&self, screen: DVec2) -> Ray {
        let across = (screen - self.middle) / self.pixels_per_unit;
        let across = DVec3::new(across.x, -across.y, 0.0);
        match self.projection {
            Projection::Perspective { .. } => Ray { origin: DVec3::ZERO, direction: across + DVec3::NEG_Z },
            Projection::Orthographic { .. } => Ray { origin: across, direction: DVec3::NEG_Z },
        }
    }

    fn depth(&self, distance: f64) -> f64 {
        match self.projection {
            Projection::Perspective { near, .. } => near / distance,
            Projection::Orthographic { near, far, .. } => (far - distance) / (far - near),
        }
    }

    fn is_in_range(&self, distance: f64) -> bool {
        match self.projection {
            Projection::Perspective { near, .. } => distance >= near,
            Projection::Orthographic { near, far, .. } => distance >= near && distance < far,
        }
    }

    /// Change of depth across a pixel, |∂/∂x| + |∂/∂y|, of the plane through the corners.
    fn depth_slope(&self, [a, b, c]: [DVec3; 3]) -> f64 {
        let n = (b - a).cross(c - a);
        let per_unit = match self.projection {
            Projection::Perspective { near, .. } => near * n / a.dot(n),
            Projection::Orthographic { near, far, .. } => n / (n.z * (far - near)),
        };
        (per_unit.x.abs() + per_unit.y.abs()) / self.pixels_per_unit
    }

    /// The part of a triangle between the near plane and the far plane: up to five corners.
    fn clipped(&self, corners: [DVec3; 3]) -> Vec<DVec3> {
        let near = self.projection.near();
        let beyond_near = cut(&corners, |p| -p.z - near);
        match self.projection {
            Projection::Perspective { .. } => beyond_near,
            Projection::Orthographic { far, .. } => cut(&beyond_near, |p| far + p.z),
        }
    }
}

/// The part of a convex polygon where `side` is not negative.
fn cut(polygon: &[DVec3], side: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(5);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (sp, sq) = (side(p), side(q));
        if sp >= 0.0 {
            kept.push(p);
        }
        if (sp >= 0.0) != (sq >= 0.0) {
            kept.push(p + (q - p) * (sp / (sp - sq)));
        }
    }
    kept
}

fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let length_squared = along.length_squared();
    let t = if length_squared > 0.0 { ((p - a).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + along * t)
}

impl Ray {
    /// `None` where the plane is seen edge-on.
    fn cross(&self, [a, b, c]: [DVec3; 3]) -> Option<Crossing> {
        let n = (b - a).cross(c - a);
        let distance = (a - self.origin).dot(n) / self.direction.dot(n);
        let p = self.origin + self.direction * distance;
        let weight = |q: DVec3, r: DVec3| (q - p).cross(r - p).dot(n) / n.length_squared();
        let barycentric = DVec3::new(weight(b, c), weight(c, a), weight(a, b));
        (distance.is_finite() && barycentric.is_finite()).then_some(Crossing { distance, barycentric })
    }
}

impl<'a> Caster<'a> {
    /// Prepares to look at `scene` in its present pose. Scene and view must be valid.
    pub fn new(scene: &'a Scene, view: &View) -> Caster<'a> {
        let lens = Lens {
            projection: view.projection,
            pixels_per_unit: view.pixels_per_unit(),
            middle: DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5,
        };
        let mut instances = Vec::new();
        for (number, instance) in scene.instances().iter().enumerate() {
            let view_from_mesh = view.view_from_world * instance.world_from_mesh;
            let bounds = scene.meshes[instance.mesh as usize].bounds();
            if bounds.is_empty() {
                continue;
            }
            let corners = (0..8).map(|k| {
                let pick = |axis: usize| if k >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
                view_from_mesh.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
            });
            let Some(screen) = screen_rectangle(&lens, corners) else { continue };
            let mirrored = instance.world_from_mesh.matrix3.determinant() < 0.0;
            instances.push(Placed {
                number: number as u32,
                mesh: instance.mesh,
                view_from_mesh,
                mirrored,
                screen,
            });
        }
        Caster { scene, lens, instances }
    }

    /// Looks along the ray through the centre of pixel (`x`, `y`).
    pub fn probe(&self, x: u32, y: u32) -> Probe {
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let mut meetings = Vec::new();
        for placed in &self.instances {
            let [min, max] = placed.screen;
            if centre.cmpge(min - 1.0).all() && centre.cmple(max + 1.0).all() {
                self.probe_instance(placed, centre, &mut meetings);
            }
        }
        meetings.sort_by(|a: &Meeting, b| b.depth.total_cmp(&a.depth).then(a.id.cmp(&b.id)));
        Probe { pixel: (x, y), meetings }
    }

    fn probe_instance(&self, placed: &Placed, centre: DVec2, meetings: &mut Vec<Meeting>) {
        let mesh = &self.scene.meshes[placed.mesh as usize];
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            let corners = corners
                .map(|v| placed.view_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3()));
            if self.is_far_off(corners, centre) {
                continue;
            }
            meetings.extend(self.meet(placed, triangle as u32, corners, centre));
        }
    }

    /// A quick answer for most triangles: wholly in view and wholly to one side of the pixel.
    fn is_far_off(&self, corners: [DVec3; 3], centre: DVec2) -> bool {
        let near = self.lens.projection.near();
        if corners.iter().any(|p| -p.z < near) {
            return corners.iter().all(|p| -p.z < near);
        }
        let [a, b, c] = corners.map(|p| self.lens.screen(p));
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        centre.cmplt(min - 1.0).any() || centre.cmpgt(max + 1.0).any()
    }

    fn meet(&self, placed: &Placed, triangle: u32, corners: [DVec3; 3], centre: DVec2) -> Option<Meeting> {
        let lens = &self.lens;
        let polygon = lens.clipped(corners);
        let outline: Vec<DVec2> = polygon.iter().map(|&p| lens.screen(p)).collect();
        if outline.len() < 3 {
            return None;
        }
        let sides = || (0..outline.len()).map(|i| (outline[i], outline[(i + 1) % outline.len()]));
        let edge_distance_px =
            sides().map(|(p, q)| distance_to_segment(centre, p, q)).fold(f64::INFINITY, f64::min);
        let near_edge = edge_distance_px <= EDGE_PX;

        let crossing = lens.ray(centre).cross(corners);
        let inside = crossing
            .as_ref()
            .is_some_and(|x| x.barycentric.cmpge(DVec3::ZERO).all() && lens.is_in_range(x.distance));
        if !inside && !near_edge {
            return None;
        }

        let drawn = self.is_drawn(placed, triangle, corners);
        // Snapping may turn a sliver's back into its front; nothing else's.
        let may_be_turned_over = near_edge && is_sliver(&outline);
        if !(drawn || may_be_turned_over) {
            return None;
        }

        let surface = self.scene.surface(placed.mesh, triangle);
        let hole = crossing.as_ref().is_some_and(|x| surface.is_hole(x.barycentric));
        let hole_is_certain = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].iter().all(|&shift| {
            let beside = lens.ray(centre + shift * EDGE_PX).cross(corners);
            beside.is_none_or(|x| surface.is_hole(x.barycentric) == hole)
        });
        if hole && hole_is_certain && !near_edge {
            return None;
        }

        let depths = polygon.iter().map(|p| lens.depth(-p.z));
        let (lowest, highest) = depths.fold((f64::INFINITY, 0.0f64), |(l, h), d| (l.min(d), h.max(d)));
        let depth = crossing.as_ref().map_or(highest, |x| lens.depth(x.distance).clamp(lowest, highest));
        Some(Meeting {
            id: SurfaceId { instance: placed.number, triangle },
            blended: surface.alpha_mode() == AlphaMode::Blend,
            covers: inside && drawn && !hole,
            certain: !near_edge && hole_is_certain,
            depth,
            depth_slack: Meeting::slack(depth, lens.depth_slope(corners), highest - lowest),
            distance: match lens.projection {
                Projection::Perspective { near, .. } => near / depth,
                Projection::Orthographic { near, far, .. } => far - depth * (far - near),
            },
            barycentric: crossing.map_or(DVec3::splat(1.0 / 3.0), |x| x.barycentric),
            edge_distance_px,
            corners,
        })
    }
}

impl Caster<'_> {
    /// Whether the side towards the eye is drawn at all.
    fn is_drawn(&self, placed: &Placed, triangle: u32, [a, b, c]: [DVec3; 3]) -> bool {
        let material = self.scene.meshes[placed.mesh as usize].material_of(triangle);
        if material.is_some_and(|m| self.scene.materials[m as usize].double_sided) {
            return true;
        }
        let n = (b - a).cross(c - a);
        let towards_eye = match self.lens.projection {
            Projection::Perspective { .. } => a.dot(n) < 0.0,
            Projection::Orthographic { .. } => n.z > 0.0,
        };
        towards_eye != placed.mirrored
    }
}

/// Bounds on screen of the convex hull of `corners`; `None` if nothing of it is in front of the near plane.
fn screen_rectangle(lens: &Lens, corners: impl Iterator<Item = DVec3> + Clone) -> Option<[DVec2; 2]> {
    let near = lens.projection.near();
    let behind = corners.clone().filter(|p| -p.z < near).count();
    match behind {
        0 => {}
        8 => return None,
        _ => return Some([DVec2::NEG_INFINITY, DVec2::INFINITY]),
    }
    let on_screen = corners.map(|p| lens.screen(p));
    Some(on_screen.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[l, h], p| [l.min(p), h.max(p)]))
}

/// Whether a polygon on screen is so thin that snapping may turn it over.
fn is_sliver(outline: &[DVec2]) -> bool {
    let origin = outline[0];
    let mut double_area = 0.0;
    let mut longest: f64 = 0.0;
    for (i, &p) in outline.iter().enumerate() {
        let q = outline[(i + 1) % outline.len()];
        double_area += (p - origin).perp_dot(q - origin);
        longest = longest.max(p.distance(q));
    }
    double_area.abs() <= longest * 2.0 * EDGE_PX
}
