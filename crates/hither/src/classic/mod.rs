//! The textbook hidden-surface algorithms, for study and as independent witnesses.
//!
//! They work on polygons in the space of a drawing: x and y on the paper, z towards the eye, lines of sight
//! parallel to z. None of them is fast: each polygon is compared with each other. They share no code with
//! the rooms that do the work, and agree with them where both apply ([Crawfis, *Visibility Algorithms*]).

mod newell;
mod weiler_atherton;

pub use newell::{Facet, newell_newell_sancha};
pub use weiler_atherton::{Clipped, Contour, Region, area, clip, painted, weiler_atherton};
