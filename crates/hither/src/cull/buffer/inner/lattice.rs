//! The lattice: integer coordinates along a frame that suits a patch, and the way back to f32.

use super::{InnerBox, LatticeBox, frame};
use crate::geometry::Aabb;
use glam::{DVec3, Vec3};

/// The patch reaches from 0 to this along each axis: so few that products of three differences fit 64 bits.
pub(super) const UNITS: i32 = 1 << 17;
/// A patch thinner than this part of its largest extent is taken for flat. It bounds the error of computed
/// lattice coordinates: 2³⁷ units for the largest extent, known to some 8·2⁻⁵³ of it, is 2⁻¹³ units.
const FLAT: f64 = 1.0 / (1 << 20) as f64;

/// A box is thicker than this many times what rounding takes from a side, so that it stays a box.
const THICK: f64 = 8.0;

/// An affine map from a patch's space to integers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    center: DVec3,
    axes: [DVec3; 3],
    /// Smallest coordinate along each axis, from the centre.
    low: DVec3,
    /// Units a metre.
    scale: DVec3,
    /// Metres from end to end of each axis.
    size: DVec3,
    /// Largest magnitudes of the patch's coordinates.
    reach: DVec3,
}

impl Lattice {
    /// `None` for what is flat, a point, or not finite.
    pub(super) fn around(triangles: &[[DVec3; 3]]) -> Option<Lattice> {
        let bounds = Aabb::around(triangles.as_flattened().iter().copied());
        let center = bounds.center();
        let extent = bounds.size().max_element();
        let reach = bounds.min.abs().max(bounds.max.abs());
        let finite = triangles.as_flattened().iter().all(|p| p.is_finite());
        if !(finite && extent.is_finite() && extent > 0.0) {
            return None;
        }
        let axes = frame::chosen(triangles, center, extent);
        let along = |p: DVec3| DVec3::from_array(axes.map(|axis| axis.dot(p - center)));
        let within = Aabb::around(triangles.as_flattened().iter().map(|&p| along(p)));
        let size = within.size();
        if size.min_element() <= FLAT * extent {
            return None;
        }
        let scale = f64::from(UNITS) / size;
        scale.is_finite().then_some(Lattice { center, axes, low: within.min, scale, size, reach })
    }

    /// Metres along each axis.
    pub(super) fn size(&self) -> DVec3 {
        self.size
    }

    fn place(&self, p: DVec3) -> DVec3 {
        let p = p - self.center;
        (DVec3::from_array(self.axes.map(|axis| axis.dot(p))) - self.low) * self.scale
    }

    /// The nearest lattice point.
    pub(super) fn snapped(&self, p: DVec3) -> [i32; 3] {
        self.place(p).round().to_array().map(|q| q as i32)
    }

    /// The box in the patch's space, shrunk by what rounding its corners takes; `None` if that leaves nothing.
    pub(super) fn taken_back(&self, found: &LatticeBox) -> Option<InnerBox> {
        let [low, high] = [found.min, found.max].map(|q| DVec3::from_array(q.map(f64::from)));
        // Half a unit in the last place, and as much again for what is computed.
        let rounding = self.reach * f64::from(f32::EPSILON) + f64::from(f32::from_bits(1));
        let shrink = DVec3::from_array(self.axes.map(|axis| axis.abs().dot(rounding))) * self.scale;
        let (from, to) = (low + shrink, high - shrink);
        if !(to - from).cmpgt(shrink * THICK).all() {
            return None;
        }
        let corners: [Vec3; 8] = std::array::from_fn(|k| {
            let end = |axis: usize| if k >> axis & 1 == 0 { from[axis] } else { to[axis] };
            self.metres(DVec3::new(end(0), end(1), end(2))).as_vec3()
        });
        let holds = |c: &Vec3| {
            let q = self.place(c.as_dvec3());
            q.cmpge(low).all() && q.cmple(high).all()
        };
        corners.iter().all(holds).then_some(InnerBox { corners })
    }

    fn metres(&self, q: DVec3) -> DVec3 {
        let along = q / self.scale + self.low;
        self.center + self.axes[0] * along.x + self.axes[1] * along.y + self.axes[2] * along.z
    }
}
