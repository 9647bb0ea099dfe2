//! The views of technical drawing, and where they go on a sheet.
//!
//! In third-angle projection each view stands on the side from which it is seen: the top view above the
//! front view, the right one to its right. In first-angle projection it stands on the opposite side. Views
//! beside or above each other share a scale and their middle, so that a point of the scene has the same
//! height, or the same place across, in both.

use crate::conventions::{Projection, View};
use crate::geometry::Aabb;
use glam::{DVec2, DVec3};

/// A direction to draw a scene from, in parallel projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// From the scene towards the eye.
    pub backward: DVec3,
    /// What is up on the paper.
    pub up: DVec3,
}

/// Which side of the front view a view from the right goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Angle {
    /// To the right (usual in America).
    Third,
    /// To the left (usual in Europe).
    First,
}

/// Names of the standard views: front looks along −Z, with +Y up.
pub const STANDARD_VIEWS: [&str; 7] = ["front", "back", "left", "right", "top", "bottom", "iso"];

/// The direction of a standard view.
pub fn standard_view(name: &str) -> Option<Direction> {
    let of = |backward: DVec3, up: DVec3| Some(Direction { backward, up });
    match name {
        "front" => of(DVec3::Z, DVec3::Y),
        "back" => of(DVec3::NEG_Z, DVec3::Y),
        "right" => of(DVec3::X, DVec3::Y),
        "left" => of(DVec3::NEG_X, DVec3::Y),
        "top" => of(DVec3::Y, DVec3::NEG_Z),
        "bottom" => of(DVec3::NEG_Y, DVec3::Z),
        "iso" => of(DVec3::ONE, DVec3::Y),
        _ => None,
    }
}

/// Column and row of a standard view on a sheet, from the upper left.
pub fn place_on_sheet(name: &str, angle: Angle) -> (usize, usize) {
    let first = angle == Angle::First;
    match name {
        "top" => (1, if first { 2 } else { 0 }),
        "bottom" => (1, if first { 0 } else { 2 }),
        "right" => (if first { 0 } else { 2 }, 1),
        "left" => (if first { 2 } else { 0 }, 1),
        "back" => (3, 1),
        "iso" => (2, 0),
        _ => (1, 1),
    }
}

impl Direction {
    /// Right and up on the paper, unit vectors.
    fn axes(&self) -> (DVec3, DVec3) {
        let backward = self.backward.normalize_or(DVec3::Z);
        let right = self.up.cross(backward).try_normalize();
        let right = right.unwrap_or_else(|| backward.any_orthonormal_vector());
        (right, backward.cross(right))
    }

    /// Width and height of a box seen from here, metres.
    pub fn extent(&self, bounds: &Aabb) -> DVec2 {
        let (right, up) = self.axes();
        let half = bounds.size() * 0.5;
        let reach = |axis: DVec3| (axis.abs() * half).element_sum() * 2.0;
        DVec2::new(reach(right), reach(up))
    }

    /// A parallel view of all of a box, its middle in the middle of the picture. The picture is as large as
    /// the box needs, and `margin_px` on each side.
    pub fn view(&self, bounds: &Aabb, pixels_per_metre: f64, margin_px: u32) -> View {
        let extent = self.extent(bounds) * pixels_per_metre;
        let side = |length: f64| (length.ceil().max(1.0) as u32).saturating_add(2 * margin_px);
        let size = (side(extent.x), side(extent.y));
        let backward = self.backward.normalize_or(DVec3::Z);
        let reach = bounds.size().length().max(f64::MIN_POSITIVE);
        let projection = Projection::Orthographic {
            half_height: f64::from(size.1) * 0.5 / pixels_per_metre,
            near: 0.0,
            far: 2.0 * reach,
        };
        let center = bounds.center();
        View::look_at(center + backward * reach, center, self.up, projection, size)
    }
}
