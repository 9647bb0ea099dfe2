//! What is hidden: verdicts on objects, boxes and nodes.
//!
//! [`OcclusionBuffer`] is the small interface that an engine wants: draw occluders, ask about boxes, balls,
//! rectangles and meshes, in any order. What it calls hidden is hidden in the continuous image, whatever the
//! buffer's resolution; [`buffer`] says why. [`Culler`] does that for a whole scene: it chooses the occluders
//! and returns the instances that may be seen, front to back.
//!
//! [`planes`] needs no image and has no resolution: large polygons near the eye cast shadows, and what lies
//! wholly in a shadow is hidden [Coorg & Teller 1996].

pub mod buffer;
mod closed;
pub mod planes;
mod queue;
mod scene;

pub use buffer::{
    Ball, Boxes, CannotMerge, Drawn, Occludee, Occluder, OccluderError, OcclusionBuffer, OcclusionOptions,
    PlacedMesh, SampledBuffer, ScreenRect, SharedBuffer, Sides,
};
pub use scene::{CullCounters, CullOptions, Culler, Culling, Judged, MANY_PIXELS, Reason, cull};

/// Where something must show to count as seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Meaning {
    /// Anywhere in the continuous image: true at every resolution.
    #[default]
    Continuous,
    /// At a pixel's centre, as a rasteriser that draws at this resolution samples it: what falls between the
    /// centres is left out too.
    Sampled,
}

/// What is known about something that was asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// It may be seen. The error of a conservative test is on this side.
    Visible,
    /// No point of it can be seen: occluders are before all of it that the view could show.
    Hidden,
    /// No point of it lies in the view.
    Outside,
}
