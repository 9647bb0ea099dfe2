//! The agreements every room relies on, stated once.
//!
//! - World: right-handed, +Y up, metres, counter-clockwise front faces (glTF's). A view looks down −Z.
//! - Images: +y down, pixel centres at +0.5, half-open rectangles.
//! - Depth: [`Projection`] says how it is made. Larger is nearer, it is linear across the screen, and 0 is
//!   "nothing there". A pyramid keeps the farthest, that is the smallest.
//! - Fill rule: top-left, on coordinates snapped to 1/256 pixel ([`SUBPIXEL`]), so that a shared edge is
//!   drawn exactly once.
//! - A tie in depth goes to the smaller instance, then to the smaller triangle, whatever the drawing order.
//! - Matrices name both ends: `view_from_world * point_in_world`.
//! - Colours are linear and premultiplied inside; sRGB only at the file.

use glam::{DAffine3, DMat3, DVec3};

/// Snapped screen coordinates are whole multiples of `1 / SUBPIXEL` pixel.
pub const SUBPIXEL: i32 = 256;

/// The largest image side, in pixels. Keeps snapped edge functions exact (see `raster`).
pub const MAX_IMAGE_SIDE: u32 = 16_384;

/// The id of "no instance" and "no triangle" in a picture.
pub const NO_ID: u32 = u32::MAX;

/// What is seen at a pixel: an instance, and a triangle within that instance's mesh.
///
/// Instances are numbered depth-first through the scene's nodes, one a node with a mesh; triangles in
/// the order of the mesh. The derived order is the tie rule for equal depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SurfaceId {
    /// Index of the instance in the scene's depth-first order.
    pub instance: u32,
    /// Index of the triangle in the instance's mesh.
    pub triangle: u32,
}

/// How points in view space reach the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole. Depth is `near / distance`, in (0, 1]; there is no far plane.
    Perspective {
        /// Full vertical field of view, radians, in (0, π).
        fov_y: f64,
        /// Distance of the near plane, metres, > 0.
        near: f64,
    },
    /// Parallel rays along −Z. Depth is `(far − distance) / (far − near)`, in (0, 1], which is linear
    /// across the screen where `near / distance` would not be; what lies beyond `far` is not seen.
    Orthographic {
        /// Half the height of the view, metres, > 0. (Half the width follows from the aspect ratio.)
        half_height: f64,
        /// Distance of the near plane, metres; may be zero or negative.
        near: f64,
        /// Distance of the far plane, metres, > near.
        far: f64,
    },
}

impl Projection {
    /// Distance of the near plane along the view axis, metres.
    pub fn near(&self) -> f64 {
        match *self {
            Projection::Perspective { near, .. } | Projection::Orthographic { near, .. } => near,
        }
    }

    /// Distance along the view axis, metres, of a surface at `depth`; +∞ where `depth` is 0.
    pub fn distance(&self, depth: f32) -> f64 {
        if depth <= 0.0 {
            return f64::INFINITY;
        }
        match *self {
            Projection::Perspective { near, .. } => near / f64::from(depth),
            Projection::Orthographic { near, far, .. } => far - f64::from(depth) * (far - near),
        }
    }
}

/// An eye and the image it looks at: everything a picture depends on besides the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Rigid transform from world to view space (right-handed, looking down −Z, +Y up).
    pub view_from_world: DAffine3,
    /// How view space reaches the screen. Pixels are square.
    pub projection: Projection,
    /// Image width, pixels, 1 to [`MAX_IMAGE_SIDE`].
    pub width: u32,
    /// Image height, pixels, 1 to [`MAX_IMAGE_SIDE`].
    pub height: u32,
}

/// Why a [`View`] cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// A side is zero or above [`MAX_IMAGE_SIDE`].
    #[error("an image of {width}x{height} pixels cannot be drawn; each side must be from 1 to 16384")]
    Size {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
    },
    /// The pose, field of view or clipping distances are not finite or out of range.
    #[error("the camera cannot be used: {0}")]
    Camera(&'static str),
}

impl View {
    /// A view from `eye` towards `target`. `up` need not be perpendicular to the line of sight; where it
    /// is parallel to it, another direction is chosen.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, projection: Projection, size: (u32, u32)) -> View {
        let forward = (target - eye).normalize_or(DVec3::NEG_Z);
        let right = forward
            .cross(up.normalize_or(DVec3::Y))
            .try_normalize()
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        let true_up = right.cross(forward);
        let rotation = DMat3::from_cols(right, true_up, -forward).transpose();
        View {
            view_from_world: DAffine3 { matrix3: rotation, translation: rotation * -eye },
            projection,
            width: size.0,
            height: size.1,
        }
    }

    /// A view that shows all that an off-axis picture of one eye does, to cull with: a headset's eye, a tile of a wall
    /// of screens, a picture moved by parts of a pixel from frame to frame.
    ///
    /// `tangents` are those of the angles from the axis to the picture's left, right, lower and upper border, as
    /// x/distance and y/distance: left below right, lower below upper; a picture all on one side of the axis has two of
    /// a sign. `height` is the picture's, pixels. The view has the same eye, axis, near plane and size of pixels, its
    /// borders are on both sides as far from the axis as the farther one, and it has half a pixel or more to spare.
    ///
    /// What it calls hidden is hidden in the picture, for that depends on the eye alone, and so is what it calls
    /// outside; but not what is sampled: the picture's centres of pixels are others. A picture around its axis costs
    /// nothing more, one that ends at it twice the pixels in that direction, one far beside it as many as lie
    /// between. Refused where that is more than [`MAX_IMAGE_SIDE`].
    pub fn around_off_axis(
        view_from_world: DAffine3,
        tangents: [f64; 4],
        near: f64,
        height: u32,
    ) -> Result<View, ViewError> {
        let [left, right, lower, upper] = tangents;
        if !(tangents.iter().all(|t| t.is_finite()) && left < right && lower < upper) {
            return Err(ViewError::Camera(
                "its borders must be finite, the left below the right, the lower below the upper",
            ));
        }
        if height == 0 {
            return Err(ViewError::Size { width: 0, height });
        }
        let pixel = (upper - lower) / f64::from(height);
        // A whole number of pixels on both sides of the axis; saturating, for `validate` to refuse.
        let half = |a: f64, b: f64| (a.abs().max(b.abs()) / pixel + 0.5).ceil();
        let (half_width, half_height) = (half(left, right), half(lower, upper));
        let fov_y = 2.0 * (half_height * pixel).atan();
        let projection = Projection::Perspective { fov_y, near };
        let (width, height) = ((half_width * 2.0) as u32, (half_height * 2.0) as u32);
        let view = View { view_from_world, projection, width, height };
        view.validate()?;
        // So wide an angle that its f64 no longer tells the borders apart.
        if (view.pixels_per_unit() * pixel - 1.0).abs() > 1e-6 {
            return Err(ViewError::Camera("its field of view must be between 0 and 180 degrees"));
        }
        Ok(view)
    }

    /// So many units of view space, or a little more, a metre of the world can be: 1 where the transform is rigid.
    pub(crate) fn stretch(&self) -> f64 {
        let matrix = self.view_from_world.matrix3.to_cols_array();
        let largest = matrix.into_iter().fold(0.0, |most, c| c.abs().max(most));
        // The largest eigenvalue of MᵀM is no farther from their mean than what the mean leaves is long.
        let m = DMat3::from_cols_array(&matrix.map(|c| c / largest));
        let squared = m.transpose() * m;
        let mean = (squared.x_axis.x + squared.y_axis.y + squared.z_axis.z) / 3.0;
        let rest = (squared - DMat3::from_diagonal(DVec3::splat(mean))).to_cols_array();
        let rest = rest.into_iter().map(|c| c * c).sum::<f64>().sqrt();
        (mean + rest).sqrt() * largest * (1.0 + 1e-12)
    }

    /// The eye in world space (for an orthographic view, a point on its axis at distance 0).
    pub fn eye_in_world(&self) -> DVec3 {
        self.view_from_world.inverse().translation
    }

    /// Pixels a unit of view-space width covers at distance 1 (perspective) or at any distance
    /// (orthographic).
    pub fn pixels_per_unit(&self) -> f64 {
        let half_height = match self.projection {
            Projection::Perspective { fov_y, .. } => (fov_y * 0.5).tan(),
            Projection::Orthographic { half_height, .. } => half_height,
        };
        f64::from(self.height) * 0.5 / half_height
    }

    /// Checks size, pose and projection; call it where a view comes from outside.
    pub fn validate(&self) -> Result<(), ViewError> {
        let side = 1..=MAX_IMAGE_SIDE;
        if !side.contains(&self.width) || !side.contains(&self.height) {
            return Err(ViewError::Size { width: self.width, height: self.height });
        }
        if !self.view_from_world.is_finite() {
            return Err(ViewError::Camera("its position and direction must be finite numbers"));
        }
        if is_singular(&self.view_from_world.matrix3) {
            return Err(ViewError::Camera("its matrix flattens space: it must have an inverse"));
        }
        match self.projection {
            Projection::Perspective { fov_y, near } => {
                if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) {
                    return Err(ViewError::Camera("its field of view must be between 0 and 180 degrees"));
                }
                if !(near > 0.0 && near.is_finite()) {
                    return Err(ViewError::Camera("its near plane must be a finite distance above 0"));
                }
            }
            Projection::Orthographic { half_height, near, far } => {
                if !(half_height > 0.0 && half_height.is_finite()) {
                    return Err(ViewError::Camera("the height of its view must be finite and above 0"));
                }
                if !(near.is_finite() && far.is_finite() && far > near) {
                    return Err(ViewError::Camera("its far plane must lie beyond its near plane"));
                }
            }
        }
        if !self.pixels_per_unit().is_finite() {
            return Err(ViewError::Camera("it sees so little that no number says how large that is drawn"));
        }
        Ok(())
    }
}

/// Whether a matrix of finite numbers has no inverse, or one of rounding alone. Scales that are tiny or differ are no
/// reason: rows, then columns, are first brought to a largest entry of 1. Then a determinant in f64, of entries that
/// are themselves rounded, is wrong by less than 10⁻¹⁴.
fn is_singular(matrix: &DMat3) -> bool {
    let scaled = |v: DVec3| v / v.abs().max_element();
    let rows = matrix.transpose();
    let rows = DMat3::from_cols(scaled(rows.x_axis), scaled(rows.y_axis), scaled(rows.z_axis));
    let columns = rows.transpose();
    let even = DMat3::from_cols(scaled(columns.x_axis), scaled(columns.y_axis), scaled(columns.z_axis));
    let determinant = even.determinant().abs();
    // A row or column of zeros has made it no number.
    determinant.is_nan() || determinant < 1e-14
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A view whose pose turns, then scales by `scale` along its own axes, then turns again.
    fn scaled(scale: DVec3) -> View {
        let turn = |angle| DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), angle);
        let matrix3 = turn(0.7) * DMat3::from_diagonal(scale) * turn(-2.0);
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        let view_from_world = DAffine3 { matrix3, translation: DVec3::new(1.0, -2.0, 3.0) };
        View { view_from_world, projection, width: 64, height: 48 }
    }

    #[test]
    fn no_metre_is_longer_in_view_space_than_its_stretch() {
        let rigid = scaled(DVec3::ONE).stretch();
        assert!((1.0..1.0 + 1e-11).contains(&rigid), "{rigid}");
        for size in [1e-310, 1e-200, 1e-9, 1.0, 1e9, 1e200] {
            for scale in [DVec3::ONE, DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1e-3, 3.0)] {
                let view = scaled(scale * size);
                let longest = scale.abs().max_element() * size;
                let stretch = view.stretch();
                assert!((longest..longest * 1.5).contains(&stretch), "{scale} {size}: {stretch}");
            }
        }
    }

    #[test]
    fn a_view_around_an_off_axis_picture_shows_all_of_it() {
        let pose = scaled(DVec3::ONE).view_from_world;
        let pictures = [
            ([-1.0, 1.0, -0.5, 0.5], 500),
            ([-1.37, 0.92, -1.1, 1.2], 1833),
            ([0.2, 0.9, -0.3, 0.001], 90),
            ([-3.0, -2.9, 1.0, 1.1], 100),
            ([-1e-3, 1.0, -1.0, 1e-3], 16),
        ];
        for (tangents, height) in pictures {
            let view = View::around_off_axis(pose, tangents, 0.1, height).unwrap();
            let pixel = (tangents[3] - tangents[2]) / f64::from(height);
            assert!(
                (view.pixels_per_unit() * pixel - 1.0).abs() < 1e-12,
                "{tangents:?}: pixels of another size"
            );
            let reach = |size: u32| f64::from(size) * 0.5 * pixel;
            let farthest = [(view.width, 0), (view.height, 2)]
                .map(|(size, k)| (reach(size), tangents[k].abs().max(tangents[k + 1].abs())));
            for (reach, farthest) in farthest {
                assert!((0.499..1.6).contains(&((reach - farthest) / pixel)), "{tangents:?}");
            }
        }
        let refused = |tangents, near, height| View::around_off_axis(pose, tangents, near, height).is_err();
        assert!(refused([1.0, -1.0, -1.0, 1.0], 0.1, 100) && refused([-1.0, f64::NAN, -1.0, 1.0], 0.1, 100));
        assert!(refused([-1.0, 1.0, -1.0, 1.0], 0.0, 100) && refused([-1.0, 1.0, -1.0, 1.0], 0.1, 0));
        assert!(
            refused([-1.0, 1.0, 5e3, 5e3 + 1.0], 0.1, 1000) && refused([-1e300, 1e300, -1.0, 1.0], 0.1, 9)
        );
    }

    #[test]
    fn a_pose_that_flattens_space_is_refused_and_tiny_scales_are_not() {
        let along_axes = |scale| View { view_from_world: DAffine3::from_scale(scale), ..scaled(DVec3::ONE) };
        let flat = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1e-9, 1.0), DVec3::Y * 1e200];
        for scale in flat {
            for view in [scaled(scale), along_axes(scale)] {
                let refused = view.validate();
                assert!(matches!(refused, Err(ViewError::Camera(why)) if why.contains("inverse")), "{scale}");
            }
        }
        for size in [1e-300, 1e-120, 1e-9, 1.0, 1e9, 1e300] {
            for scale in [DVec3::ONE, DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1e-3, 1e-6)] {
                assert_eq!(scaled(scale * size).validate(), Ok(()), "{scale} {size}");
                assert_eq!(along_axes(scale * size).validate(), Ok(()), "{scale} {size}");
            }
        }
        for tiny in [1e-12, 1e-15, 1e-100, 1e-300] {
            assert_eq!(along_axes(DVec3::new(1.0, tiny, 1.0)).validate(), Ok(()), "{tiny}");
        }
    }
}
