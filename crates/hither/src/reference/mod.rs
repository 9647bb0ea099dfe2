//! Brute-force truth: slow, obvious, sharing no code with the fast paths.
//!
//! - [`Caster`] looks along the ray through a pixel's centre in `f64` and reports every surface it meets,
//!   together with how sure that is. [`Probe::judge`] holds any other answer against it.
//! - [`zbuffer`] is the textbook z-buffer with the fill rule of `conventions`: a second witness that shares
//!   nothing with the first but the scene, and the plain code that speed-ups are measured against.
//! - [`lines`] samples the edges of a line drawing densely and casts a ray to each sample.
//! - [`occlusion`] tells by brute force which convex body occludes which, and [`ivs`] sorts them step by step as
//!   the incremental visibility sort was published.
//! - [`all_around`] says which triangles can be seen at all, looking all around, by cutting away what is hidden.
//! - [`trouble`] makes small scenes that lean towards trouble, for both and for everything else.

pub mod all_around;
mod caster;
pub mod ivs;
pub mod lines;
pub mod occlusion;
mod probe;
pub mod sight;
pub mod trouble;
pub mod zbuffer;

#[cfg(test)]
mod agreement;
#[cfg(test)]
mod known_answers;

pub use caster::Caster;
pub use probe::{EDGE_PX, Judgement, Meeting, Probe};
