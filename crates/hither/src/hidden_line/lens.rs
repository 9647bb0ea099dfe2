//! From view space to the drawing: where a point is on the paper, and how near.
//!
//! A projected point is (x, y, w): x and y in pixels, +y down, and w a depth that is *linear on the paper*
//! along every line and across every plane, larger nearer: −1/z in perspective, z in a parallel view. All of
//! hidden-line removal happens in this space, where lines of sight are parallel and planes are planes.

use super::ROUNDING;
use crate::conventions::{Projection, View};
use glam::{DAffine3, DVec2, DVec3};

/// A half-space in view space: kept is where `normal · p + offset ≥ 0`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfSpace {
    pub normal: DVec3,
    pub offset: f64,
    /// A section plane of the user's: where it cuts, lines and caps are drawn.
    pub section: bool,
    /// How far from a section plane a point in view space still lies in it.
    pub lens: Option<Lens>,
}

impl HalfSpace {
    /// Signed distance times the normal's length. Of a section plane, whose normal is a unit vector, 0 where rounding
    /// may have put the point: however the view is turned, the same points lie in the plane.
    pub fn side(&self, p: DVec3) -> f64 {
        let side = self.normal.dot(p) + self.offset;
        match &self.lens {
            Some(lens) if side.abs() <= lens.tolerance && side.abs() <= lens.rounding_of_point(p) => 0.0,
            _ => side,
        }
    }
}

/// The arithmetic of a [`View`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    perspective: bool,
    pixels_per_unit: f64,
    middle: DVec2,
    world_from_view: DAffine3,
    /// What differs by more than this, metres, is nowhere at the same place.
    pub tolerance: f64,
}

/// The part of a coordinate in view space that is rounding of the arithmetic in `f64`, several operations of it.
const ARITHMETIC: f64 = 1e-14;

/// Surfaces at a flatter angle to the line of sight than this (its sine) are judged as if at this angle.
const FLATTEST: f64 = 1e-3;

impl Lens {
    pub fn new(view: &View, tolerance: f64) -> Lens {
        Lens {
            perspective: matches!(view.projection, Projection::Perspective { .. }),
            pixels_per_unit: view.pixels_per_unit(),
            middle: DVec2::new(f64::from(view.width), f64::from(view.height)) * 0.5,
            world_from_view: view.view_from_world.inverse(),
            tolerance,
        }
    }

    /// (x, y, w) of a point in front of the near plane.
    pub fn project(&self, p: DVec3) -> DVec3 {
        let (scale, w) = if self.perspective {
            let w = -1.0 / p.z;
            (self.pixels_per_unit * w, w)
        } else {
            (self.pixels_per_unit, p.z)
        };
        DVec3::new(self.middle.x + p.x * scale, self.middle.y - p.y * scale, w)
    }

    /// What a metre at right angles to the line of sight is on the paper at depth `w`.
    pub fn pixels_per_metre(&self, w: f64) -> f64 {
        if self.perspective { self.pixels_per_unit * w } else { self.pixels_per_unit }
    }

    /// A projected point in view space.
    fn unproject(&self, p: DVec3) -> DVec3 {
        let (scale, z) = if self.perspective {
            (self.pixels_per_unit * p.z, -1.0 / p.z)
        } else {
            (self.pixels_per_unit, p.z)
        };
        DVec3::new((p.x - self.middle.x) / scale, (self.middle.y - p.y) / scale, z)
    }

    /// How far the plane of a triangle, of which these are the normal and the corners in view space, may be
    /// from its true place along the normal, for rounding of the corners' world coordinates. A ground plane
    /// that is level is where it is, however far it reaches.
    pub fn rounding_of_plane(&self, normal: DVec3, corners: &[DVec3; 3]) -> f64 {
        let n = (self.world_from_view.matrix3 * normal).abs();
        let reach = corners.map(|c| n.dot(self.world_from_view.transform_point3(c).abs()));
        ROUNDING * reach[0].max(reach[1]).max(reach[2])
    }

    /// The same of a point in view space, in any direction; never more than [`Lens::tolerance`].
    pub fn rounding_of_point(&self, p: DVec3) -> f64 {
        let stored = ROUNDING * self.world_from_view.transform_point3(p).abs().max_element();
        // Of that little is left near the origin of the world, where the view's own arithmetic rounds as elsewhere.
        let eye = self.world_from_view.translation;
        let computed = ARITHMETIC * (p.abs().max_element() + eye.abs().max_element());
        // Of NaN, what is no NaN.
        (stored + computed).min(self.tolerance)
    }

    /// The largest difference of w, near depth `w`, that any surface calls the same place.
    pub fn coarse(&self, w: f64) -> f64 {
        let per_metre = if self.perspective { w * w } else { 1.0 };
        self.tolerance * per_metre / FLATTEST
    }

    /// The difference of w, at a projected point, that is as far from the plane of a triangle with these
    /// corners in view space as rounding may put either.
    pub fn same_depth(&self, corners: [DVec3; 3], at: DVec3) -> f64 {
        let ([a, b, c], w) = (corners, at.z);
        let n = (b - a).cross(c - a);
        let length = n.length();
        let of_plane = self.rounding_of_plane(n / length, &corners);
        let tolerance = of_plane.max(self.rounding_of_point(self.unproject(at))).min(self.tolerance);
        // Sine of the angle between the plane and the line of sight, and what a metre along it is in w.
        let (sine, per_metre) =
            if self.perspective { (n.dot(a).abs() * w / length, w * w) } else { (n.z.abs() / length, 1.0) };
        // The comparison also catches a plane that cannot be told, NaN.
        let sine = if sine > FLATTEST { sine } else { FLATTEST };
        tolerance * per_metre / sine
    }

    /// Half-spaces that a view shows: beyond the near plane and before the far one.
    pub fn range(projection: &Projection) -> Vec<HalfSpace> {
        let near = HalfSpace { normal: DVec3::NEG_Z, offset: -projection.near(), section: false, lens: None };
        match *projection {
            Projection::Perspective { .. } => vec![near],
            Projection::Orthographic { far, .. } => {
                vec![near, HalfSpace { normal: DVec3::Z, offset: far, section: false, lens: None }]
            }
        }
    }
}
