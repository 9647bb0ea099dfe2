//! The textbook z-buffer: every triangle in the view frustum is transformed in `f64`, clipped, snapped to
//! 1/256 pixel and drawn with the fill rule of `conventions`, one sample at a time.
//!
//! It is the second witness beside the ray caster and shares no code with it, and it is the plain code that
//! speed-ups are measured against: decent, but without SIMD, trees, pyramids or threads. The one thing it
//! leaves out early is an instance whose box lies outside the frustum.
//!
//! Depth comes from the triangle's own plane in view space, not from snapped corners.

use crate::conventions::{NO_ID, Projection, SUBPIXEL, SurfaceId, View};
use crate::scene::{AlphaMode, Instance, Mesh, Scene, Surface};
use glam::{DAffine3, DVec2, DVec3};

/// A finished picture.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Row by row; [`NO_ID`] twice where there is nothing.
    pub ids: Vec<SurfaceId>,
    /// Row by row; 0 where there is nothing.
    pub depth: Vec<f32>,
    /// What was done.
    pub work: Work,
}

/// What drawing a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Instances whose box is not outside the frustum.
    pub instances_drawn: u64,
    /// Their triangles.
    pub triangles_tested: u64,
    /// Of these, facing the eye (or two-sided) with some area.
    pub triangles_front_facing: u64,
    /// Samples covered, hidden ones included.
    pub samples_covered: u64,
    /// Samples written, overwriting included.
    pub samples_written: u64,
}

impl Drawing {
    /// What is seen at pixel (`x`, `y`), and its depth.
    pub fn seen(&self, x: u32, y: u32) -> Option<(SurfaceId, f32)> {
        let at = y as usize * self.width as usize + x as usize;
        (self.ids[at].instance != NO_ID).then(|| (self.ids[at], self.depth[at]))
    }

    /// How many surfaces lie over each other at a pixel, on average.
    pub fn depth_complexity(&self) -> f64 {
        self.work.samples_covered as f64 / self.depth.len() as f64
    }
}

/// Draws `scene` in its present pose. Scene and view must be valid.
pub fn draw(scene: &Scene, view: &View) -> Drawing {
    let mut painter = Painter::new(view);
    let boxes: Vec<[DVec3; 8]> = scene.meshes.iter().map(box_corners).collect();
    let mut corners = Vec::new();
    for (number, instance) in scene.instances().iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        let view_from_mesh = view.view_from_world * instance.world_from_mesh;
        if mesh.triangles.is_empty() || painter.is_outside(&boxes[instance.mesh as usize], &view_from_mesh) {
            continue;
        }
        corners.clear();
        let points_in_view = mesh.positions.iter().map(|p| view_from_mesh.transform_point3(p.as_dvec3()));
        corners.extend(points_in_view.map(|p| painter.corner(p)));
        painter.draw_instance(scene, number as u32, instance, &corners);
    }
    painter.drawing
}

fn box_corners(mesh: &Mesh) -> [DVec3; 8] {
    let b = mesh.bounds();
    [0, 1, 2, 3, 4, 5, 6, 7].map(|k| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { b.min[axis] } else { b.max[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

struct Painter {
    view: View,
    pixels_per_unit: f64,
    /// What may be seen, a pixel around the image included.
    frustum: Vec<HalfSpace>,
    /// In front of the near plane and not so far to the side that snapped coordinates grow large.
    guard: Vec<HalfSpace>,
    drawing: Drawing,
}

/// The half-space `normal · p >= offset` of view space.
#[derive(Clone, Copy)]
struct HalfSpace {
    normal: DVec3,
    offset: f64,
}

impl HalfSpace {
    /// Not negative inside.
    fn side(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
}

/// A vertex in view space and on screen.
#[derive(Clone, Copy)]
struct Corner {
    in_view: DVec3,
    /// Meaningless outside the guard half-spaces.
    on_screen: Snapped,
    /// One bit for each half-space of the frustum that it is outside of.
    outside: u8,
    needs_clipping: bool,
}

/// A place on screen, in 1/256 pixel.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Snapped {
    x: i64,
    y: i64,
}

/// A triangle on its way to the screen.
struct Triangle<'a> {
    id: SurfaceId,
    in_view: [DVec3; 3],
    plane: DepthPlane,
    /// Present only where alpha may cut holes.
    mask: Option<Surface<'a>>,
}

/// Depth as a function of the place on screen, in pixels, and the range it takes.
#[derive(Clone, Copy)]
struct DepthPlane {
    at_origin: f64,
    per_x: f64,
    per_y: f64,
    min: f64,
    max: f64,
}

/// The near plane (and the far plane) and the sides of the image, `margin` pixels farther out.
fn half_spaces(view: &View, margin: f64) -> Vec<HalfSpace> {
    let pixels_per_unit = view.pixels_per_unit();
    let x = (f64::from(view.width) * 0.5 + margin) / pixels_per_unit;
    let y = (f64::from(view.height) * 0.5 + margin) / pixels_per_unit;
    let sides = [(DVec3::X, x), (DVec3::NEG_X, x), (DVec3::Y, y), (DVec3::NEG_Y, y)];
    let mut spaces = vec![HalfSpace { normal: DVec3::NEG_Z, offset: view.projection.near() }];
    spaces.extend(sides.map(|(outwards, reach)| match view.projection {
        Projection::Perspective { .. } => HalfSpace { normal: DVec3::NEG_Z * reach - outwards, offset: 0.0 },
        Projection::Orthographic { .. } => HalfSpace { normal: -outwards, offset: -reach },
    }));
    if let Projection::Orthographic { far, .. } = view.projection {
        spaces.push(HalfSpace { normal: DVec3::Z, offset: -far });
    }
    spaces
}

impl Painter {
    fn new(view: &View) -> Painter {
        const GUARD_PX: f64 = 16_384.0;
        let pixels = view.width as usize * view.height as usize;
        let nothing = SurfaceId { instance: NO_ID, triangle: NO_ID };
        Painter {
            view: *view,
            pixels_per_unit: view.pixels_per_unit(),
            frustum: half_spaces(view, 1.0),
            guard: half_spaces(view, GUARD_PX),
            drawing: Drawing {
                width: view.width,
                height: view.height,
                ids: vec![nothing; pixels],
                depth: vec![0.0; pixels],
                work: Work::default(),
            },
        }
    }

    fn is_outside(&self, corners: &[DVec3; 8], view_from_mesh: &DAffine3) -> bool {
        let corners = corners.map(|c| view_from_mesh.transform_point3(c));
        self.frustum.iter().any(|space| corners.iter().all(|&c| space.side(c) < 0.0))
    }

    fn corner(&self, in_view: DVec3) -> Corner {
        let outside =
            self.frustum.iter().enumerate().map(|(i, space)| u8::from(space.side(in_view) < 0.0) << i).sum();
        let needs_clipping = outside != 0 && self.guard.iter().any(|space| space.side(in_view) < 0.0);
        Corner { in_view, on_screen: self.snap(in_view), outside, needs_clipping }
    }

    fn draw_instance(&mut self, scene: &Scene, number: u32, instance: &Instance, corners: &[Corner]) {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mirrored = instance.world_from_mesh.matrix3.determinant() < 0.0;
        self.drawing.work.instances_drawn += 1;
        self.drawing.work.triangles_tested += mesh.triangles.len() as u64;
        for primitive in &mesh.primitives {
            let material = primitive.material.map(|m| &scene.materials[m as usize]);
            let alpha = material.map_or(AlphaMode::Opaque, |m| m.alpha);
            if alpha == AlphaMode::Blend {
                continue;
            }
            let two_sided = material.is_some_and(|m| m.double_sided);
            for triangle in primitive.triangles.clone() {
                let [a, b, c] = mesh.triangles[triangle as usize].map(|v| &corners[v as usize]);
                if a.outside & b.outside & c.outside != 0 {
                    continue;
                }
                let outline = if a.needs_clipping || b.needs_clipping || c.needs_clipping {
                    &self.clipped([a, b, c])[..]
                } else {
                    &[a.on_screen, b.on_screen, c.on_screen][..]
                };
                let area = doubled_area(outline);
                // With y down a counter-clockwise outline has negative area.
                let front = (area < 0) != mirrored;
                if area == 0 || !(front || two_sided) {
                    continue;
                }
                self.drawing.work.triangles_front_facing += 1;
                let in_view = [a, b, c].map(|corner| corner.in_view);
                let Some(plane) = self.depth_plane(in_view) else { continue };
                let triangle = Triangle {
                    id: SurfaceId { instance: number, triangle },
                    in_view,
                    plane,
                    mask: (alpha != AlphaMode::Opaque).then(|| scene.surface(instance.mesh, triangle)),
                };
                for i in 1..outline.len() - 1 {
                    let (p, q, r) = (outline[0], outline[i], outline[i + 1]);
                    self.fill(&triangle, if area > 0 { [p, q, r] } else { [p, r, q] });
                }
            }
        }
    }

    /// The outline of the part inside the guard half-spaces.
    fn clipped(&self, corners: [&Corner; 3]) -> Vec<Snapped> {
        let mut polygon = corners.map(|c| c.in_view).to_vec();
        for space in &self.guard {
            if polygon.iter().any(|&p| space.side(p) < 0.0) {
                polygon = clip(&polygon, |p| space.side(p));
            }
        }
        polygon.iter().map(|&p| self.snap(p)).collect()
    }

    /// `None` for a triangle seen edge-on.
    fn depth_plane(&self, [a, b, c]: [DVec3; 3]) -> Option<DepthPlane> {
        let near = self.view.projection.near();
        let n = (b - a).cross(c - a);
        let nearest = (-a.z).min(-b.z).min(-c.z).max(near);
        let farthest = (-a.z).max(-b.z).max(-c.z).max(near);
        // Depth of the point seen through (x, y, -1), as factors of x, y and 1.
        let (factors, min, max) = match self.view.projection {
            Projection::Perspective { .. } => {
                (DVec3::new(n.x, n.y, -n.z) * (near / a.dot(n)), near / farthest, near / nearest)
            }
            Projection::Orthographic { far, .. } => {
                let span = far - near;
                let per_unit = DVec3::new(-n.x, -n.y, a.dot(n)) / (n.z * span);
                (per_unit + DVec3::Z * (far / span), (far - farthest) / span, (far - nearest) / span)
            }
        };
        let (per_x, per_y) = (factors.x / self.pixels_per_unit, -factors.y / self.pixels_per_unit);
        let to_middle = DVec2::new(f64::from(self.view.width), f64::from(self.view.height)) * 0.5;
        let at_origin = factors.z - DVec2::new(per_x, per_y).dot(to_middle);
        at_origin.is_finite().then_some(DepthPlane { at_origin, per_x, per_y, min, max })
    }

    fn snap(&self, p: DVec3) -> Snapped {
        let scale = match self.view.projection {
            Projection::Perspective { .. } => self.pixels_per_unit / -p.z,
            Projection::Orthographic { .. } => self.pixels_per_unit,
        };
        let middle = DVec2::new(f64::from(self.view.width), f64::from(self.view.height)) * 0.5;
        let screen = (middle + DVec2::new(p.x, -p.y) * scale) * f64::from(SUBPIXEL);
        Snapped { x: screen.x.round() as i64, y: screen.y.round() as i64 }
    }

    /// Fills a triangle whose doubled area is not negative (clockwise on screen).
    fn fill(&mut self, triangle: &Triangle, [a, b, c]: [Snapped; 3]) {
        const UNIT: i64 = SUBPIXEL as i64;
        let edges = [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)];
        if doubled_area(&[a, b, c]) == 0 {
            return;
        }
        // First pixel whose centre is not before the smallest coordinate, last whose is not after the largest.
        let first = |v: i64| (v - UNIT / 2).div_euclid(UNIT).max(0);
        let last = |v: i64, side: u32| (v - UNIT / 2).div_euclid(UNIT).min(i64::from(side) - 1);
        let (x0, x1) = (first(a.x.min(b.x).min(c.x)), last(a.x.max(b.x).max(c.x), self.view.width));
        let (y0, y1) = (first(a.y.min(b.y).min(c.y)), last(a.y.max(b.y).max(c.y), self.view.height));
        for y in y0..=y1 {
            let start = Snapped { x: x0 * UNIT + UNIT / 2, y: y * UNIT + UNIT / 2 };
            let mut values = edges.map(|e| e.at(start));
            for x in x0..=x1 {
                if values.iter().all(|&v| v >= 0) {
                    self.sample(triangle, x as u32, y as u32);
                }
                for (value, edge) in values.iter_mut().zip(&edges) {
                    *value -= edge.dy * UNIT;
                }
            }
        }
    }

    fn sample(&mut self, triangle: &Triangle, x: u32, y: u32) {
        let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let plane = &triangle.plane;
        // A snapped outline may hold a centre that the triangle does not; its plane must not run away there.
        let depth =
            (plane.at_origin + plane.per_x * px + plane.per_y * py).clamp(plane.min, plane.max) as f32;
        if triangle.mask.is_some_and(|surface| surface.is_hole(self.barycentric(triangle.in_view, px, py))) {
            return;
        }
        let drawing = &mut self.drawing;
        drawing.work.samples_covered += 1;
        let at = y as usize * drawing.width as usize + x as usize;
        // Surfaces come in the order of their ids, so on a tie the one already there has the smaller.
        if depth > drawing.depth[at] {
            drawing.depth[at] = depth;
            drawing.ids[at] = triangle.id;
            drawing.work.samples_written += 1;
        }
    }

    /// Weights of the corners where the sight through (`px`, `py`) meets their plane.
    fn barycentric(&self, [a, b, c]: [DVec3; 3], px: f64, py: f64) -> DVec3 {
        let x = (px - f64::from(self.view.width) * 0.5) / self.pixels_per_unit;
        let y = (f64::from(self.view.height) * 0.5 - py) / self.pixels_per_unit;
        let (shift, direction) = match self.view.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, DVec3::new(x, y, -1.0)),
            Projection::Orthographic { .. } => (DVec3::new(x, y, 0.0), DVec3::NEG_Z),
        };
        let [a, b, c] = [a - shift, b - shift, c - shift];
        let weights =
            DVec3::new(direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b)));
        weights / weights.element_sum()
    }
}

/// The part of a convex polygon where `side` is not negative. A cut point depends on its edge alone, not on
/// the direction it is walked in, so that neighbours stay joined.
fn clip(polygon: &[DVec3], side: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (sp, sq) = (side(p), side(q));
        if sp >= 0.0 {
            kept.push(p);
        }
        if sp >= 0.0 && sq < 0.0 {
            kept.push(p + (q - p) * (sp / (sp - sq)));
        } else if sp < 0.0 && sq >= 0.0 {
            kept.push(q + (p - q) * (sq / (sq - sp)));
        }
    }
    kept
}

fn doubled_area(outline: &[Snapped]) -> i64 {
    let Some((&origin, rest)) = outline.split_first() else { return 0 };
    let cross =
        |p: Snapped, q: Snapped| (p.x - origin.x) * (q.y - origin.y) - (p.y - origin.y) * (q.x - origin.x);
    rest.windows(2).map(|w| cross(w[0], w[1])).sum()
}

/// An edge of a clockwise outline (on screen, y down); positive inside.
#[derive(Clone, Copy)]
struct Edge {
    from: Snapped,
    dx: i64,
    dy: i64,
    /// -1 where a centre exactly on the edge belongs to the neighbour: not a top and not a left edge.
    bias: i64,
}

impl Edge {
    fn new(from: Snapped, to: Snapped) -> Edge {
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let top = dy == 0 && dx > 0;
        let left = dy < 0;
        Edge { from, dx, dy, bias: if top || left { 0 } else { -1 } }
    }

    /// Not negative where `p` is inside.
    fn at(&self, p: Snapped) -> i64 {
        self.dx * (p.y - self.from.y) - self.dy * (p.x - self.from.x) + self.bias
    }
}
