//! Cameras as files describe them, and the views they give.

use super::{Scene, SceneError, Transform, fault};
use crate::conventions::{Projection, View};
use glam::{DAffine3, DMat3, DVec3};

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
    /// World pose of camera `index`, following its node; `None` if there is no such camera.
    ///
    /// Scale in and above the camera's node is ignored, as glTF asks. Where it has made axes that are not at right angles,
    /// the camera looks along its −Z axis all the same, and up is where +Y is, as nearly as that allows.
    pub fn world_from_camera(&self, index: usize) -> Option<DAffine3> {
        let camera = self.cameras.get(index)?;
        let node = match camera.node {
            Some(n) => self.root_group().world_transform(n as usize),
            None => DAffine3::IDENTITY,
        };
        Some(without_scale(node * camera.local.matrix()))
    }

    /// What camera `index` sees in an image of `size` (width, height); `None` if there is no such camera.
    pub fn view(&self, index: usize, size: (u32, u32)) -> Option<View> {
        let pose = self.world_from_camera(index)?;
        let (_, rotation, translation) = pose.to_scale_rotation_translation();
        let world_from_view = DAffine3::from_rotation_translation(rotation.normalize(), translation);
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

/// A rigid pose, with the −Z axis and, as nearly as may be, the +Y axis of `pose`; an axis that has no length is taken
/// from the others.
fn without_scale(pose: DAffine3) -> DAffine3 {
    let axes = pose.matrix3;
    if axes.determinant() > 0.0 && (axes.transpose() * axes).abs_diff_eq(DMat3::IDENTITY, 1e-9) {
        return pose;
    }
    let unit = |v: DVec3| (v / v.abs().max_element()).try_normalize();
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis].map(unit);
    let (side, up) = (x.unwrap_or(DVec3::X), y.unwrap_or(DVec3::Y));
    let back = z.or_else(|| unit(side.cross(up))).unwrap_or(DVec3::Z);
    let right = unit(up.cross(back)).or_else(|| unit(side.reject_from_normalized(back)));
    let right = right.unwrap_or_else(|| back.any_orthonormal_vector());
    let matrix3 = DMat3::from_cols(right, back.cross(right), back);
    DAffine3 { matrix3, translation: pose.translation }
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn posed(scale: DVec3, turn: DQuat) -> (DAffine3, DAffine3) {
        let pose = DAffine3::from_scale(scale) * DAffine3::from_quat(turn);
        (pose, without_scale(pose))
    }

    #[test]
    fn a_camera_under_uneven_scales_looks_along_its_own_axis() {
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 0.9);
        for scale in
            [DVec3::new(10.0, 1.0, 1.0), DVec3::new(1.0, 0.2, -3.0), DVec3::splat(-2.0), DVec3::splat(1e-200)]
        {
            let (pose, rigid) = posed(scale, turn);
            let axes = rigid.matrix3;
            assert!((axes.transpose() * axes).abs_diff_eq(DMat3::IDENTITY, 1e-12), "{scale}");
            assert!((axes.determinant() - 1.0).abs() < 1e-12, "{scale}");
            let along = |axis: DVec3| (pose.matrix3 * axis * (1.0 / scale.abs().max_element())).normalize();
            assert!(axes.z_axis.distance(along(DVec3::Z)) < 1e-12, "{scale}");
            // Up is between the axis and the line of sight.
            assert!(
                axes.x_axis.dot(along(DVec3::Y)).abs() < 1e-12 && axes.y_axis.dot(along(DVec3::Y)) > 0.0,
                "{scale}"
            );
        }
        let (pose, rigid) = posed(DVec3::ONE, turn);
        assert_eq!(pose, rigid);
    }

    #[test]
    fn a_scale_of_zero_leaves_a_camera_that_can_be_used() {
        for scale in
            [DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0), DVec3::new(0.0, 0.0, 1.0), DVec3::ZERO]
        {
            for turn in [DQuat::IDENTITY, DQuat::from_axis_angle(DVec3::Y, 0.5)] {
                let axes = posed(scale, turn).1.matrix3;
                assert!((axes.transpose() * axes).abs_diff_eq(DMat3::IDENTITY, 1e-12), "{scale}");
            }
        }
        assert_eq!(posed(DVec3::new(1.0, 1.0, 0.0), DQuat::IDENTITY).1, DAffine3::IDENTITY);
    }
}
