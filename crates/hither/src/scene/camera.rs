//! Cameras as files describe them, and the views they give.

use super::{Scene, SceneError, Transform, fault};
use crate::conventions::{Projection, View};

/// A named camera, fixed or carried by a node.
#[derive(Clone, Debug)]
pub struct Camera {
    /// The camera's name; where the file names only its node, that name.
    pub name: String,
    /// Node of the root group that carries it.
    pub node: Option<u32>,
    /// Pose relative to the node (or the world): looks down −Z, +Y up.
    pub local: Transform,
    /// Lens.
    pub projection: CameraProjection,
}

/// A camera's lens. What an image's shape adds is settled by [`Scene::view`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraProjection {
    /// A pinhole.
    Perspective {
        /// Full vertical field of view, radians.
        fov_y: f64,
        /// Near plane, metres. A file's far plane is not used: sight is unbounded.
        near: f64,
    },
    /// Parallel projection.
    Orthographic {
        /// Half the width of the view, metres. An image of another shape shows at least this much.
        half_width: f64,
        /// Half the height of the view, metres.
        half_height: f64,
        /// Near plane, metres.
        near: f64,
        /// Far plane, metres.
        far: f64,
    },
}

impl Scene {
    /// What camera `index` sees in an image of `size` (width, height); `None` if there is no such camera.
    ///
    /// Scale in the camera's node is ignored, as glTF asks.
    pub fn view(&self, index: usize, size: (u32, u32)) -> Option<View> {
        let pose = self.world_from_camera(index)?;
        let (_, rotation, translation) = pose.to_scale_rotation_translation();
        let world_from_view = glam::DAffine3::from_rotation_translation(rotation.normalize(), translation);
        let projection = match self.cameras[index].projection {
            CameraProjection::Perspective { fov_y, near } => Projection::Perspective { fov_y, near },
            CameraProjection::Orthographic { half_width, half_height, near, far } => {
                let aspect = f64::from(size.0.max(1)) / f64::from(size.1.max(1));
                Projection::Orthographic { half_height: half_height.max(half_width / aspect), near, far }
            }
        };
        Some(View { view_from_world: world_from_view.inverse(), projection, width: size.0, height: size.1 })
    }

    /// The camera called `name`, else the one whose index `name` spells.
    pub fn find_camera(&self, name: &str) -> Option<usize> {
        let by_name = self.cameras.iter().position(|c| c.name == name);
        by_name.or_else(|| name.parse::<usize>().ok().filter(|&i| i < self.cameras.len()))
    }
}

pub(super) fn validate(scene: &Scene) -> Result<(), SceneError> {
    let nodes = scene.root_group().nodes.len();
    for (i, camera) in scene.cameras.iter().enumerate() {
        let wrong = |what: &str| Err(fault(format!("camera {i} (\"{}\")", camera.name), what));
        if camera.node.is_some_and(|n| n as usize >= nodes) {
            return wrong("it hangs from a node that does not exist");
        }
        let usable = match camera.projection {
            CameraProjection::Perspective { fov_y, near } => {
                fov_y > 0.0 && fov_y < std::f64::consts::PI && near > 0.0 && near.is_finite()
            }
            CameraProjection::Orthographic { half_width, half_height, near, far } => {
                half_width > 0.0
                    && half_height > 0.0
                    && far > near
                    && half_width.is_finite()
                    && half_height.is_finite()
                    && near.is_finite()
                    && far.is_finite()
            }
        };
        if !usable || !camera.local.matrix().is_finite() {
            return wrong("its lens or its pose is out of range");
        }
    }
    Ok(())
}
