//! Which edges of the meshes are drawn in a view, and as what.

use super::shown::{Fate, Shown, Solid};
use super::topology::{Edge, NONE, trait_of};
use super::{Kind, Kinds};

/// Neighbours whose normals differ by less than this, radians, are one flat face.
pub(super) const FLAT: f64 = 2e-4;

/// What decides about an edge, settled once a drawing.
pub(super) struct Choice {
    pub kinds: Kinds,
    /// 1 − cos of the angle from which on an edge is a crease.
    least_bend: f32,
    /// Whether edges of hidden triangles are drawn, too.
    pub hidden: bool,
}

impl Choice {
    pub fn new(kinds: Kinds, crease_angle: f64, hidden: bool) -> Choice {
        let half = crease_angle.max(FLAT) * 0.5;
        Choice { kinds, least_bend: (2.0 * half.sin().powi(2)) as f32, hidden }
    }

    /// As what an edge is drawn, if it is.
    pub fn kind(&self, shown: &Shown, solid: &Solid, edge: &Edge) -> Option<Kind> {
        if edge.triangles[0] == NONE {
            return self.kinds.marked.then_some(Kind::Marked);
        }
        let places = edge.triangles.map(|t| shown.place(solid, t));
        // Of a triangle that is cut, the edge may belong to another piece.
        let fate = |k: usize| {
            if places[k] != NONE && shown.is_whole(solid, edge.triangles[k]) {
                shown.fate[places[k] as usize]
            } else {
                Fate::EdgeOn
            }
        };
        let fates = [fate(0), fate(1)];
        // The edge is part of both triangles: what is true of all of one is true of the edge.
        if fates.contains(&Fate::Outside) || (!self.hidden && fates.contains(&Fate::Hidden)) {
            return None;
        }
        // On the back of a body.
        if fates == [Fate::Back; 2] || places == [NONE; 2] {
            return None;
        }
        let kinds = &self.kinds;
        if edge.triangles[1] == NONE || edge.traits & trait_of::NON_MANIFOLD != 0 {
            return kinds.boundary.then_some(Kind::Boundary);
        }
        if kinds.silhouette && places[0] != NONE && places[1] != NONE && turns(shown, edge, places) {
            return Some(Kind::Silhouette);
        }
        if kinds.crease && self.bend(shown, solid, edge, places) > self.least_bend {
            return Some(Kind::Crease);
        }
        if kinds.border && edge.traits & trait_of::BORDER != 0 {
            return Some(Kind::Border);
        }
        (kinds.marked && edge.traits & trait_of::MARKED != 0).then_some(Kind::Marked)
    }

    /// How much the surface bends in the world.
    fn bend(&self, shown: &Shown, solid: &Solid, edge: &Edge, places: [u32; 2]) -> f32 {
        let is_known = solid.keeps_angles || edge.traits & trait_of::THIN != 0;
        if is_known || places.contains(&NONE) {
            return edge.bend;
        }
        let normal = |t: u32| {
            let [a, b, c] = shown.corners_in_view(t);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let [m, n] = places.map(normal);
        ((m - sense(edge) * n).length_squared() * 0.5) as f32
    }
}

/// −1 where the two triangles of an edge wind in opposite senses.
fn sense(edge: &Edge) -> f64 {
    if edge.traits & trait_of::FLIPPED != 0 { -1.0 } else { 1.0 }
}

/// Whether one side of an edge faces the eye and the other does not. Edge-on counts as facing away.
fn turns(shown: &Shown, edge: &Edge, places: [u32; 2]) -> bool {
    let facing = places.map(|t| shown.facing[t as usize]);
    let other = if edge.traits & trait_of::FLIPPED != 0 { -facing[1] } else { facing[1] };
    (facing[0] > 0) != (other > 0)
}
