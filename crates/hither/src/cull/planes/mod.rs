//! Object-space culling by supporting and separating planes [Coorg & Teller 1996].
//!
//! From the eye, a few large polygons nearby hide most of a scene. [`PlaneCuller`] keeps them chosen while
//! the eye moves, and tests the boxes of a kd-tree against the planes through the eye and their sides: what
//! is inside all of them and beyond the polygon is hidden. No image is drawn, and the answer has no
//! resolution.
//!
//! **The promise.** What is not in [`Culled::visible`] cannot be seen from the eye, in the continuous image:
//! every test is on the safe side of its rounding ([`ROUNDING`]). What is in it may be hidden all the same.
//! Masked and blended surfaces hide nothing, one-sided ones only from their front.
//!
//! Notation: *S* the occluders in use, *T* a box, *E* the eye; a polygon's *side* is a straight stretch of
//! its outline; *full*, *partial* and *none* as in §2.1. Where a file departs from the paper, its first
//! lines say how and why. In short:
//!
//! | paper | here | in |
//! | --- | --- | --- |
//! | planes by an edge and a box's corner, asked about the eye | by the eye and an edge, asked about the corner: the same determinant, once a frame | `frame`, `relation` |
//! | connected occluders with a convex silhouette | any connected set, the largest that hides | `connected` |
//! | lists of planes at the nodes | the distance to the nearest of them | `visible` |
//! | – (future work) | separate occluders together | `fusion` |
//! | – (future work) | boxes inside closed meshes of many polygons | `virtual_occluder` |
//! | – (future work) | number of occluders and size of leaves by measured gain | `automatic` |
//! | – (future work) | what will be visible from where the eye may get to | [`PlaneCuller::foresee`] |

mod automatic;
mod connected;
mod culler;
mod frame;
mod fusion;
mod merge;
mod model;
mod occluder;
mod relation;
mod select;
mod top_view;
mod tree;
mod virtual_occluder;
mod visible;

#[cfg(test)]
mod tests;

pub use culler::PlaneCuller;
pub use model::{Polygon, PolygonModel};
pub use top_view::{TopView, TopViewBox, TopViewPolygon};
pub use visible::{State, Work};

use crate::conventions::ViewError;
use glam::DVec3;

/// By how much, relative to the lengths that went into it, a number must differ from 0 before its sign
/// decides that something is hidden. A determinant of three vectors in `f64` is wrong by less than
/// 20 × 2⁻⁵³ = 2.3e-15 of their lengths' product; vertices carry the rounding of their transforms besides.
pub const ROUNDING: f64 = 1e-12;

/// How many, or as many as pay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amount {
    /// This many.
    Fixed(usize),
    /// Chosen by the gain that is measured.
    Automatic,
}

/// What is done to find hidden polygons. More costs time and hides more, but see `fusion`; nothing is ever hidden
/// wrongly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanesOptions {
    /// Occluders in use at once, the paper's k. At most 1,024.
    pub occluders: Amount,
    /// Polygons up to which a part of space is not divided further, at least 1. The paper fixes the depth
    /// of the tree; this decides the same.
    pub leaf_polygons: Amount,
    /// Area-angle, steradians, below which a polygon is no occluder. Smaller costs memory, and time to choose.
    pub threshold: f64,
    /// Let connected occluders hide together.
    pub connected: bool,
    /// Let separate occluders hide together. The effort for each box and piece is bounded, so that this is not
    /// monotone: with more occluders in use, one polygon or another that was found hidden may count as seen again.
    pub fusion: bool,
    /// Test the polygons of partially hidden leaves.
    pub pieces: bool,
    /// Also use boxes inside closed meshes of many polygons.
    pub virtual_occluders: bool,
    /// Worker threads; 0 means one for each core.
    pub threads: usize,
}

impl Default for PlanesOptions {
    /// Everything, as much as pays, on one thread.
    fn default() -> Self {
        PlanesOptions {
            occluders: Amount::Automatic,
            leaf_polygons: Amount::Automatic,
            threshold: 1.5e-3,
            connected: true,
            fusion: true,
            pieces: true,
            virtual_occluders: true,
            threads: 1,
        }
    }
}

impl PlanesOptions {
    /// What the paper does: 32 occluders, single and connected, boxes only.
    pub fn paper() -> PlanesOptions {
        PlanesOptions {
            occluders: Amount::Fixed(32),
            leaf_polygons: Amount::Fixed(8),
            fusion: false,
            pieces: false,
            virtual_occluders: false,
            ..PlanesOptions::default()
        }
    }
}

/// What may be seen from an eye.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Culled {
    /// The eye, world space.
    pub eye: DVec3,
    /// What is not in `visible` is hidden from every eye this near to `eye`, metres.
    pub reach: f64,
    /// Numbers of the polygons that may be seen, ascending.
    pub visible: Vec<u32>,
    /// Occluders in use.
    pub occluders: usize,
    /// Leaves' polygons found hidden, whether in hidden nodes or alone.
    pub hidden_pieces: u64,
    /// What it took.
    pub work: Work,
}

/// Why nothing can be said.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlanesError {
    /// The eye or the reach is no number.
    #[error("the eye and its reach must be finite numbers, and the reach not below 0")]
    Eye,
    /// Parallel sight has no eye.
    #[error("occluder planes need an eye; an orthographic view has none: use another method")]
    Orthographic,
    /// The view is out of range.
    #[error(transparent)]
    View(#[from] ViewError),
}
