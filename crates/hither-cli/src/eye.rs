//! Which view the options ask for: a camera of the scene, an eye of the user's, or all of the scene.

use crate::console::Verbosity;
use crate::failure::Failure;
use crate::numbers;
use crate::options::ViewOptions;
use glam::DVec3;
use hither::Scene;
use hither::conventions::{Projection, View, ViewError};
use hither::geometry::Aabb;

/// Field of view where neither the user nor a camera gives one, degrees.
const DEFAULT_FOV: f64 = 45.0;
/// From where a scene without cameras is looked at.
pub const THREE_QUARTERS: DVec3 = DVec3::new(0.55, 0.45, 0.7);
/// How much room is left around a scene that is framed.
const MARGIN: f64 = 1.05;

/// Where the picture is seen from, settled before the first frame.
#[derive(Clone, Debug)]
pub enum Eye {
    /// A camera of the scene, followed as it moves; perhaps with another field of view, radians.
    Camera {
        /// Its index.
        index: usize,
        /// Overrides its lens.
        fov_y: Option<f64>,
    },
    /// A fixed view.
    Fixed(View),
}

impl Eye {
    /// Chooses the view for `scene`, called `source`, in its present pose.
    pub fn choose(
        scene: &Scene,
        source: &str,
        options: &ViewOptions,
        verbosity: Verbosity,
    ) -> Result<Eye, Failure> {
        let fov_y = options.fov.map(f64::to_radians);
        let eye = if let Some(eye) = options.eye {
            let bounds = scene.bounds();
            let center = bounds.map_or(DVec3::ZERO, |b| b.center());
            let target = options.target.unwrap_or(center);
            if target == eye {
                let what = "the eye and the target are the same point; move one of them";
                return Err(Failure::usage(format!("--eye {}: {what}", numbers::point(eye))));
            }
            let near = near_plane(bounds, eye.distance(target));
            let projection =
                Projection::Perspective { fov_y: fov_y.unwrap_or(DEFAULT_FOV.to_radians()), near };
            Eye::Fixed(View::look_at(eye, target, options.up.unwrap_or(DVec3::Y), projection, options.size))
        } else if let Some(name) = &options.camera {
            let index = scene.find_camera(name).ok_or_else(|| unknown_camera(scene, source, name))?;
            Eye::Camera { index, fov_y }
        } else if let Some(first) = scene.cameras.first() {
            if scene.cameras.len() > 1 {
                verbosity
                    .note(&format!("note: seen by camera 0 (\"{}\"), the first of the scene", first.name));
            }
            Eye::Camera { index: 0, fov_y }
        } else {
            check_can_be_framed(scene.bounds(), source)?;
            let view = framing(scene.bounds(), fov_y.unwrap_or(DEFAULT_FOV.to_radians()), options.size);
            let eye = numbers::point(view.eye_in_world());
            verbosity.note(&format!("note: the scene has no camera; all of it is seen from {eye}"));
            Eye::Fixed(view)
        };
        // A size or a pose that cannot be drawn is refused here, before any work.
        let view = eye.view(scene, source, options.size)?;
        if let (Some((index, _)), Some(step)) = (eye.camera_name(scene), coarse_depth(&view.projection)) {
            verbosity.warning(&format!(
                "{source}: camera {index}: its planes are so far apart that depths within {step:.1e} m are one; \
                 hidden surfaces may show; bring its zfar nearer"
            ));
        }
        Ok(eye)
    }

    /// The view in the present pose of the scene called `source`; a camera that cannot be drawn from is named.
    pub fn view(&self, scene: &Scene, source: &str, size: (u32, u32)) -> Result<View, Failure> {
        let view = self.unchecked_view(scene, size);
        let failure = |error| match (error, self.camera_name(scene)) {
            (ViewError::Camera(what), Some((index, name))) => {
                let name = if name.is_empty() { String::new() } else { format!(" (\"{name}\")") };
                let remedy = "choose another with --camera, or use --eye";
                Failure::work(format!("{source}: camera {index}{name} cannot be used: {what}; {remedy}"))
            }
            _ => Failure::work(error.to_string()),
        };
        view.validate().map_err(failure)?;
        Ok(view)
    }

    fn unchecked_view(&self, scene: &Scene, size: (u32, u32)) -> View {
        match *self {
            Eye::Fixed(view) => view,
            Eye::Camera { index, fov_y } => {
                let mut view = scene.view(index, size).expect("the camera was found in this scene");
                if let (Some(fov), Projection::Perspective { fov_y, .. }) = (fov_y, &mut view.projection) {
                    *fov_y = fov;
                }
                view
            }
        }
    }

    /// How the report names it.
    pub fn camera_name<'s>(&self, scene: &'s Scene) -> Option<(usize, &'s str)> {
        match *self {
            Eye::Camera { index, .. } => Some((index, scene.cameras[index].name.as_str())),
            Eye::Fixed(_) => None,
        }
    }
}

fn unknown_camera(scene: &Scene, source: &str, name: &str) -> Failure {
    const SHOWN: usize = 8;
    let names = scene.cameras.iter().enumerate().map(|(i, c)| format!("{i} \"{}\"", c.name));
    let mut known = names.take(SHOWN).collect::<Vec<_>>().join(", ");
    if scene.cameras.len() > SHOWN {
        known.push_str(", …");
    }
    let remedy = match scene.cameras.is_empty() {
        true => "the scene has none; use --eye and --target".into(),
        false => format!("there are {known}"),
    };
    Failure::work(format!("{source}: no camera \"{name}\"; {remedy}"))
}

/// By how much orthographic depths, f32 numbers up to 1, can differ and be one, metres; if that is a visible distance.
fn coarse_depth(projection: &Projection) -> Option<f64> {
    let Projection::Orthographic { half_height, near, far } = *projection else { return None };
    let step = (far - near) * f64::from(f32::EPSILON) * 0.5;
    (step > half_height * VISIBLE).then_some(step)
}

/// What share of half a picture's height can be seen.
const VISIBLE: f64 = 1e-3;

/// Refuses a scene whose squared size f64 cannot hold.
fn check_can_be_framed(bounds: Option<Aabb>, source: &str) -> Result<(), Failure> {
    let size = bounds.map_or(0.0, |b| b.size().max_element());
    if size == 0.0 || (1e-100..=1e100).contains(&size) {
        return Ok(());
    }
    let what = format!("it is {size:e} metres large, and only 1e-100 to 1e100 can be looked at as a whole");
    Err(Failure::work(format!("{source}: {what}; scale it, or give it a camera")))
}

/// A near plane that cuts nothing off that one could wish to see. Depth is a floating-point quotient, so a
/// plane very near costs no precision.
fn near_plane(bounds: Option<Aabb>, distance: f64) -> f64 {
    let size = bounds.map_or(0.0, |b| b.size().length());
    let near = if size > 0.0 { (size * 1e-5).min(distance * 1e-3) } else { distance * 1e-3 };
    near.max(f64::MIN_POSITIVE)
}

/// A view of all of `bounds` from the front, the right and above.
fn framing(bounds: Option<Aabb>, fov_y: f64, size: (u32, u32)) -> View {
    let bounds = bounds.unwrap_or(Aabb { min: -DVec3::ONE, max: DVec3::ONE });
    let center = bounds.center();
    let backward = THREE_QUARTERS.normalize();
    let right = DVec3::Y.cross(backward).normalize();
    let up = backward.cross(right);
    let tan_y = (fov_y * 0.5).tan();
    let tan_x = tan_y * f64::from(size.0.max(1)) / f64::from(size.1.max(1));
    let half = bounds.size() * 0.5;
    let corners = (0..8).map(|i| {
        let sign = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
        half * DVec3::new(sign(1), sign(2), sign(4))
    });
    // A corner is inside the picture from this far away, or farther.
    let needed = corners.map(|c| {
        let aside = (c.dot(right).abs() / tan_x).max(c.dot(up).abs() / tan_y);
        c.dot(backward) + aside
    });
    let distance = needed.fold(0.0, f64::max) * MARGIN;
    let distance = if distance > 0.0 { distance } else { 1.0 };
    let projection = Projection::Perspective { fov_y, near: near_plane(Some(bounds), distance) };
    View::look_at(center + backward * distance, center, DVec3::Y, projection, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_or_too_small_to_be_framed_is_refused() {
        let of = |size: f64| Some(Aabb { min: DVec3::ZERO, max: DVec3::new(size, size, 0.0) });
        for size in [0.0, 1e-99, 1.0, 1e99] {
            assert!(check_can_be_framed(of(size), "a.glb").is_ok(), "{size}");
        }
        for size in [1e-300, 1e200, f64::INFINITY] {
            let text = check_can_be_framed(of(size), "a.glb").unwrap_err().line;
            assert!(text.starts_with("a.glb: it is ") && text.contains("scale it"), "{text}");
        }
        assert!(check_can_be_framed(None, "a.glb").is_ok());
    }

    #[test]
    fn a_framed_box_fills_the_picture_without_being_cut() {
        for scale in [1e-18, 1.0, 1e18] {
            for size in [(1280, 720), (100, 900)] {
                let bounds =
                    Aabb { min: DVec3::new(1.0, -2.0, 3.0) * scale, max: DVec3::new(2.0, 5.0, 4.0) * scale };
                let view = framing(Some(bounds), 0.8, size);
                view.validate().unwrap();
                let edge = farthest(&view, &bounds);
                assert!((0.8..=1.0).contains(&edge), "scale {scale}, {size:?}: {edge}");
            }
        }
    }

    #[test]
    fn a_point_and_an_empty_scene_can_be_framed() {
        let point = Aabb { min: DVec3::ONE, max: DVec3::ONE };
        framing(Some(point), 0.8, (64, 64)).validate().unwrap();
        framing(None, 0.8, (64, 64)).validate().unwrap();
    }

    /// How far a corner of `bounds` is from the picture's middle, in halves of the picture.
    fn farthest(view: &View, bounds: &Aabb) -> f64 {
        let corner = |i: u32| {
            let side = |bit: u32, min: f64, max: f64| if i & bit == 0 { min } else { max };
            let (a, b) = (bounds.min, bounds.max);
            DVec3::new(side(1, a.x, b.x), side(2, a.y, b.y), side(4, a.z, b.z))
        };
        let halves = glam::DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5;
        let on_screen = (0..8).map(|i| {
            let p = view.view_from_world.transform_point3(corner(i));
            let at = p.truncate() / -p.z * view.pixels_per_unit() / halves;
            at.x.abs().max(at.y.abs())
        });
        on_screen.fold(0.0, f64::max)
    }
}
