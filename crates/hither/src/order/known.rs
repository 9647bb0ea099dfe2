//! What is known of two parts beforehand: further answers to *does A occlude B from here?*

use glam::DVec3;

/// Something known of a pair of parts, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// A plane n·p = d with the first part where n·p ≤ d and the second where n·p ≥ d, whatever their hulls
    /// say: pieces of one surface that overlap at their seam [Snyder & Lengyel 1997, §9].
    Plane {
        /// Unit normal, towards the second part.
        normal: DVec3,
        /// Distance of the plane from the origin along the normal, metres.
        offset: f64,
    },
    /// The first part is a sphere, the second a cylinder that leaves it, their surfaces meeting in a circle
    /// [Snyder & Lengyel 1997, app. C]. The eye must be in neither.
    Joint {
        /// Centre of the sphere.
        center: DVec3,
        /// Its radius s.
        sphere_radius: f64,
        /// Unit axis of the cylinder, away from the sphere.
        axis: DVec3,
        /// Its radius r, at most s.
        cylinder_radius: f64,
    },
}

/// What a known relation says of one direction of occlusion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Says {
    /// The one in front cannot occlude the other.
    No,
    /// It does.
    Yes,
    /// Ask the hulls.
    AskHulls,
}

impl Known {
    /// Whether the first part occludes the second (`first_in_front`), or the second the first.
    pub(super) fn says(&self, eye: DVec3, first_in_front: bool) -> Says {
        match *self {
            Known::Plane { normal, offset } => {
                let side = normal.dot(eye) - offset;
                let possible = if first_in_front { side < 0.0 } else { side > 0.0 };
                if possible { Says::AskHulls } else { Says::No }
            }
            Known::Joint { center, sphere_radius, axis, cylinder_radius } => {
                let front = joint(eye, center, sphere_radius, axis, cylinder_radius);
                let it_is = match front {
                    JointFront::Sphere => first_in_front,
                    JointFront::Cylinder => !first_in_front,
                    JointFront::Neither => return Says::Yes,
                };
                if it_is { Says::Yes } else { Says::No }
            }
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum JointFront {
    Sphere,
    Cylinder,
    Neither,
}

/// Appendix C. The apex P of the cone that touches the sphere in the circle of intersection is at distance
/// l = s²/h = h + r²/h from its centre; the paper prints h + s·r/h, with which the cone would not touch.
fn joint(eye: DVec3, center: DVec3, s: f64, axis: DVec3, r: f64) -> JointFront {
    let h = (s * s - r * r).max(0.0).sqrt();
    if axis.dot(eye - center) - h >= 0.0 {
        return JointFront::Cylinder;
    }
    if h == 0.0 {
        // The cone has become a half space: its apex is at infinity.
        return JointFront::Sphere;
    }
    let l = s * s / h;
    let apex = center + axis * l;
    let (to_eye, to_center) = (eye - apex, center - apex);
    let along = to_eye.dot(to_center);
    if along >= 0.0 && along * along >= (l * l - s * s) * to_eye.length_squared() {
        JointFront::Sphere
    } else {
        JointFront::Neither
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_lets_only_the_eyes_side_occlude() {
        let plane = Known::Plane { normal: DVec3::X, offset: 1.0 };
        assert_eq!(plane.says(DVec3::ZERO, true), Says::AskHulls);
        assert_eq!(plane.says(DVec3::ZERO, false), Says::No);
        assert_eq!(plane.says(DVec3::X * 2.0, true), Says::No);
        assert_eq!(plane.says(DVec3::X, true), Says::No);
        assert_eq!(plane.says(DVec3::X, false), Says::No);
    }

    /// Rays judge: is the circle where sphere and cylinder meet hidden by the sphere?
    #[test]
    fn the_joints_circle_is_hidden_exactly_where_the_cone_says() {
        let (s, r) = (1.0f64, 0.4);
        let h = (s * s - r * r).sqrt();
        let hidden = |eye: DVec3| {
            (0..720).all(|i| {
                let (y, x) = (f64::from(i) * 0.5f64.to_radians()).sin_cos();
                let p = DVec3::new(x * r, y * r, h);
                // A point of the sphere is hidden by it where its normal faces away.
                (eye - p).dot(p) <= 0.0
            })
        };
        for i in 0..4000 {
            let t = f64::from(i);
            let eye = DVec3::new((t * 0.7).sin() * 4.0, (t * 1.3).cos() * 4.0, (t * 0.31).sin() * 6.0);
            if eye.length() <= s || (eye.truncate().length() <= r && eye.z > 0.0) {
                continue;
            }
            let front = joint(eye, DVec3::ZERO, s, DVec3::Z, r);
            let expected = if eye.z >= h {
                JointFront::Cylinder
            } else if hidden(eye) {
                JointFront::Sphere
            } else {
                JointFront::Neither
            };
            assert_eq!(front, expected, "{eye}");
        }
    }
}
