//! The triangles that a picture shows, placed before the eye, with what it takes to shade a point of them.
//!
//! Only instances that are seen are looked up, once a picture; a triangle's corners and normals are computed
//! once for each run of pixels that show it.

use super::light::{Light, exposed};
use super::triangle::{Rays, TriangleInView};
use crate::conventions::{SurfaceId, View};
use crate::scene::{InstanceLocator, Scene, Surface, TexturePyramids};
use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3, Vec4};

/// An instance before the eye.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct Placed {
    pub(in crate::render) mesh: u32,
    pub(in crate::render) view_from_mesh: DAffine3,
}

impl Placed {
    /// Corners of a triangle of the instance, in view space.
    pub(in crate::render) fn corners(&self, scene: &Scene, triangle: u32) -> [DVec3; 3] {
        let mesh = &scene.meshes[self.mesh as usize];
        let corners = mesh.triangles[triangle as usize];
        corners.map(|v| self.view_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3()))
    }

    /// Takes normals of the mesh to view space, but for length and sign: the matrix of cofactors, which
    /// exists for flattened instances too.
    fn normals_to_view(&self) -> DMat3 {
        let m = self.view_from_mesh.matrix3;
        DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
    }
}

/// The instances that a picture, or a part of one, shows; ascending by number.
#[derive(Clone, Debug, Default)]
pub(in crate::render) struct PlacedInstances {
    numbers: Vec<u32>,
    placed: Vec<Placed>,
}

impl PlacedInstances {
    /// Looks up `numbers`, in any order and repeated at will.
    pub(in crate::render) fn look_up(
        mut numbers: Vec<u32>,
        scene: &Scene,
        locator: &InstanceLocator,
        view: &View,
    ) -> PlacedInstances {
        numbers.sort_unstable();
        numbers.dedup();
        let placed = numbers.iter().map(|&number| {
            let (mesh, world_from_mesh) =
                locator.locate(scene, number).expect("a frame shows instances of its own scene");
            Placed { mesh, view_from_mesh: view.view_from_world * world_from_mesh }
        });
        let placed = placed.collect();
        PlacedInstances { numbers, placed }
    }

    pub(in crate::render) fn get(&self, number: u32) -> &Placed {
        let at = self.numbers.binary_search(&number).expect("instances are looked up before shading");
        &self.placed[at]
    }

    /// The meshes shown, with repetitions.
    pub(in crate::render) fn meshes(&self) -> impl Iterator<Item = u32> {
        self.placed.iter().map(|p| p.mesh)
    }
}

/// Whether normals are interpolated between vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::render) enum Normals {
    /// The face's own.
    Face,
    /// The vertices', where there are any.
    Vertices,
}

/// What every triangle of a picture is shaded with.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct Setting<'a> {
    pub(in crate::render) scene: &'a Scene,
    pub(in crate::render) rays: Rays,
    pub(in crate::render) light: Light,
    pub(in crate::render) normals: Normals,
    /// Prepared for the materials of all that is shaded.
    pub(in crate::render) pyramids: &'a TexturePyramids,
}

/// A triangle that is about to be shaded at one or more pixels.
pub(in crate::render) struct SeenTriangle<'a> {
    in_view: TriangleInView,
    surface: Surface<'a>,
    /// Base colour if it is the same everywhere.
    uniform: Option<Vec4>,
    /// Unit, on the eye's side, in view space.
    face_normal: DVec3,
    /// Light around the face's normal.
    face_light: Vec3,
    /// On the eye's side of the face taken together, in view space; of lengths that are right relative to each other.
    vertex_normals: Option<[DVec3; 3]>,
}

impl<'a> SeenTriangle<'a> {
    pub(in crate::render) fn new(setting: &Setting<'a>, placed: &Placed, triangle: u32) -> SeenTriangle<'a> {
        let corners = placed.corners(setting.scene, triangle);
        let in_view = TriangleInView::new(&setting.rays, corners);
        let [a, b, c] = corners;
        // The winding says which side is the front; the eye's side is what is lit, whichever that is.
        let face_normal = ((b - a).cross(c - a) * in_view.orientation.signum()).normalize_or(DVec3::Z);
        let vertex_normals = match setting.normals {
            Normals::Face => None,
            Normals::Vertices => vertex_normals(setting.scene, placed, triangle, face_normal),
        };
        let surface = setting.scene.surface(placed.mesh, triangle);
        let face_light = setting.light.around(face_normal);
        let uniform = surface.uniform_color();
        SeenTriangle { in_view, surface, uniform, face_normal, face_light, vertex_normals }
    }

    /// Unit normal on the eye's side, in view space, at the point seen at `at` (pixels).
    pub(in crate::render) fn normal(&self, at: DVec2) -> DVec3 {
        match self.vertex_normals {
            None => self.face_normal,
            Some([a, b, c]) => {
                let w = self.in_view.weights(at);
                (a * w.x + b * w.y + c * w.z).normalize_or(self.face_normal)
            }
        }
    }

    /// Linear RGBA, straight alpha, of the pixel centred at `at` (pixels), lit.
    pub(in crate::render) fn color(&self, setting: &Setting, at: DVec2) -> Vec4 {
        let base = self.uniform.unwrap_or_else(|| {
            let weights = self.in_view.weights(at);
            let textured = self.surface.is_textured();
            let per_pixel = if textured { self.in_view.weights_per_pixel(at) } else { [DVec3::ZERO; 2] };
            self.surface.base_color(weights, per_pixel, setting.pyramids)
        });
        let normal = self.normal(at);
        let around = match self.vertex_normals {
            None => self.face_light,
            Some(_) => setting.light.around(normal),
        };
        exposed(base, around + setting.light.ahead(normal, setting.rays.toward_eye(at)))
    }
}

/// The vertices' normals in view space, turned to the side of `face_normal`; `None` where the mesh has none
/// or they say nothing.
fn vertex_normals(scene: &Scene, placed: &Placed, triangle: u32, face_normal: DVec3) -> Option<[DVec3; 3]> {
    let mesh = &scene.meshes[placed.mesh as usize];
    if mesh.normals.is_empty() {
        return None;
    }
    let to_view = placed.normals_to_view();
    let corners = mesh.triangles[triangle as usize];
    let normals = corners.map(|v| to_view * mesh.normals[v as usize].as_dvec3());
    // Back faces, mirrors and files with inward normals all come out right: taken together, the normals
    // point to the side from which the face is seen.
    let together = (normals[0] + normals[1] + normals[2]).dot(face_normal);
    if together == 0.0 {
        return None;
    }
    let longest = normals.iter().map(|n| n.length()).fold(0.0, f64::max);
    Some(normals.map(|n| if n == DVec3::ZERO { face_normal * longest } else { n * together.signum() }))
}

/// The instances among `ids`, for [`PlacedInstances::look_up`]: neighbours that repeat are left out.
pub(in crate::render) fn instances_among(ids: impl IntoIterator<Item = SurfaceId>) -> Vec<u32> {
    let mut numbers: Vec<u32> = ids.into_iter().map(|id| id.instance).collect();
    numbers.dedup();
    numbers
}
