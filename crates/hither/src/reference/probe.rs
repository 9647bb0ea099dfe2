//! What a ray meets, and whether another algorithm's answer for the same pixel can be true.
//!
//! An answer is held against the ray with the freedom that the conventions leave and no more. Vertices are
//! snapped to whole multiples of 1/256 pixel, so a surface may be there or not at a pixel whose centre is as
//! close to one of its edges as snapping moves them ([`EDGE_PX`]). Depth is that of the surface's own plane, which
//! is not snapped, at the pixel's centre; but it is an `f32`, so of two surfaces nearer to each other than its
//! rounding ([`Meeting::depth_slack`]) either may be called the nearer. [`Probe::judge`] says what follows.

use crate::conventions::{SUBPIXEL, SurfaceId};
use glam::DVec3;

/// How far an edge may be displaced on screen by snapping, pixels: both its ends by half a step along each axis at
/// most. The millionth is for `f64`, where a vertex a thousand kilometres away ends a triangle at the eye.
pub const EDGE_PX: f64 = std::f64::consts::FRAC_1_SQRT_2 / SUBPIXEL as f64 + 1e-6;

/// Relative error allowed to a depth, which is rounded to `f32` twice: two roundings, and two to spare.
const DEPTH_RELATIVE: f64 = 1.0 / (1 << 22) as f64;

/// Error allowed to the place at which a depth is taken, pixels: slopes and the steps from one pixel to the next may
/// be `f32`, no more than four roundings over the four pixels of a block; the rest is to spare.
const DEPTH_PX: f64 = 1.0 / (1 << 18) as f64;

/// A surface at, or within [`EDGE_PX`] of, a pixel's centre.
#[derive(Clone, Debug)]
pub struct Meeting {
    /// Which surface.
    pub id: SurfaceId,
    /// Whether its material blends: it tints what is behind it and hides nothing.
    pub blended: bool,
    /// Whether the ray through the centre meets it, on a side that is drawn and not in a hole.
    pub covers: bool,
    /// Whether `covers` holds everywhere within [`EDGE_PX`] of the centre too.
    pub certain: bool,
    /// Depth as `conventions` defines it. Where the ray misses, that of the surface's plane, kept within
    /// the range of its corners.
    pub depth: f64,
    /// By how much another's depth may differ from `depth`: rounding only.
    pub depth_slack: f64,
    /// Distance along the view axis that `depth` stands for, metres.
    pub distance: f64,
    /// Weights of the three corners where the ray meets the plane; they sum to 1.
    pub barycentric: DVec3,
    /// Distance on screen from the centre to the nearest edge of the part in front of the near plane.
    pub edge_distance_px: f64,
    /// Corners in view space, to know exact copies by.
    pub(super) corners: [DVec3; 3],
}

impl Meeting {
    /// Depths of one surface lie within `range` of each other, however steep it is.
    pub(super) fn slack(depth: f64, slope_per_px: f64, range: f64) -> f64 {
        let slope = slope_per_px * DEPTH_PX;
        // No number: the plane holds the eye.
        depth * DEPTH_RELATIVE + if slope.is_finite() { slope.min(range) } else { range }
    }

    fn depth_matches(&self, depth: f32) -> bool {
        (f64::from(depth) - self.depth).abs() <= self.depth_slack
    }
}

/// Everything near the ray through one pixel's centre.
#[derive(Clone, Debug)]
pub struct Probe {
    /// Column and row.
    pub pixel: (u32, u32),
    /// What is met, nearest first; equal depths by id.
    pub meetings: Vec<Meeting>,
}

/// How an answer compares with the ray's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// The same surface at the same depth.
    Agrees,
    /// Another surface, or none, which snapping or the precision of `f32` explains.
    Excused,
    /// An answer that nothing explains, and why.
    Wrong(String),
}

impl Probe {
    /// Opaque surfaces, and masked ones outside their holes, that the ray meets; nearest first.
    pub fn hits(&self) -> impl Iterator<Item = &Meeting> {
        self.solid().filter(|m| m.covers)
    }

    /// What is seen: the nearest opaque or masked surface.
    pub fn nearest(&self) -> Option<&Meeting> {
        self.hits().next()
    }

    /// Distance along the view axis of the second opaque or masked surface; +∞ if there is none.
    pub fn second_distance(&self) -> f64 {
        self.hits().nth(1).map_or(f64::INFINITY, |m| m.distance)
    }

    /// Blended surfaces in front of what is seen, nearest first.
    pub fn tints(&self) -> impl Iterator<Item = &Meeting> {
        let limit = self.nearest().map_or(0.0, |n| n.depth);
        self.meetings.iter().filter(move |m| m.blended && m.covers && m.depth > limit)
    }

    /// Distance on screen from the centre to the nearest edge that matters: of what is seen, or of anything
    /// solid that is met or nearly met and not behind it. Edges farther than [`EDGE_PX`] of surfaces that
    /// the ray misses are not looked for.
    pub fn edge_distance_px(&self) -> f64 {
        let limit = self.nearest().map_or(0.0, |n| n.depth - n.depth_slack);
        let matters = self.solid().filter(|m| m.depth + m.depth_slack >= limit);
        matters.map(|m| m.edge_distance_px).fold(f64::INFINITY, f64::min)
    }

    /// Whether `seen`, the surface and depth that another algorithm found at this pixel, can be true.
    ///
    /// Excused is what differs from the ray's answer and yet
    ///
    /// - is nothing, where every surface that the ray meets has an edge, or the edge of a hole, within [`EDGE_PX`];
    /// - or is a surface that the ray meets or that has such an edge there, at its own depth within its
    ///   [`Meeting::depth_slack`], and no surface is in front of it that the ray meets away from all such edges.
    ///   In front is what is nearer than the depth that was *found* by more than its own slack: a pixel keeps the
    ///   largest of the depths it is offered as they are after rounding, so that nothing else explains a farther
    ///   one. Where several are as near as that, any of them may be seen, but of exact copies only the first.
    ///
    /// What is excused away from edges is therefore only the choice between surfaces that meet within rounding.
    pub fn judge(&self, seen: Option<(SurfaceId, f32)>) -> Judgement {
        match (seen, self.nearest()) {
            (None, None) => return Judgement::Agrees,
            (Some((id, depth)), Some(n)) if id == n.id && n.depth_matches(depth) => return Judgement::Agrees,
            _ => {}
        }
        match self.objection(seen) {
            None => Judgement::Excused,
            Some(why) => {
                let (x, y) = self.pixel;
                Judgement::Wrong(format!("pixel ({x}, {y}): found {seen:?}, but {why}; {:#?}", self.meetings))
            }
        }
    }

    fn objection(&self, seen: Option<(SurfaceId, f32)>) -> Option<String> {
        let mut certain = self.hits().filter(|m| m.certain);
        let Some((id, depth)) = seen else {
            return certain.next().map(|m| format!("{:?} is certainly there", m.id));
        };
        let Some(found) = self.solid().find(|m| m.id == id) else {
            return Some("that surface is nowhere near, hidden by its facing, or a hole".to_owned());
        };
        if !found.covers && found.certain {
            return Some("that surface is certainly not there".to_owned());
        }
        if !found.depth_matches(depth) {
            let Meeting { depth: true_depth, depth_slack, .. } = found;
            return Some(format!("its depth is {true_depth} within {depth_slack}"));
        }
        let hides = |m: &&Meeting| {
            let nearer = m.depth - m.depth_slack > f64::from(depth);
            let earlier_copy = m.corners == found.corners && m.id < found.id;
            nearer || earlier_copy
        };
        certain.find(hides).map(|m| format!("{:?} hides it", m.id))
    }

    fn solid(&self) -> impl Iterator<Item = &Meeting> {
        self.meetings.iter().filter(|m| !m.blended)
    }
}
