//! Image space: triangle coverage, depth buffer in blocks, z-pyramid. Knows pixels, no objects.
//!
//! # Guarantees
//!
//! - *One answer.* What a pixel holds after a set of triangles was drawn depends on the set alone, not on
//!   their order, the window, the number of threads, or the instruction set. Every lane does the same
//!   IEEE operations in the same order (no fused multiply-add), integers decide coverage exactly, and
//!   ties go to the smaller [`SurfaceId`](crate::conventions::SurfaceId).
//! - *Shared edges are drawn once*: top-left rule on coordinates snapped to 1/256 pixel, exact in 64-bit
//!   integers.
//! - *Culling never shows.* Every bound used to skip work is named where it is computed: a skipped
//!   triangle, block or box could not have changed a single pixel.
//!
//! # Coordinates
//!
//! *Image* pixels count from the picture's corner. A [`Target`] is a *window*: a rectangle of the image
//! that starts at multiples of [`TILE`]. Pixels are kept in *blocks* of 4×4 (one cache line of depths),
//! blocks in *tiles* of 4×4 blocks, tiles in cells of 4×4, and so on: each level of the z-pyramid has
//! sixteen children a parent, the width of one AVX-512 register, where [Greene 1995, §3.3.2] has four.
//!
//! SIMD goes through `fearless_simd`: one source for AVX-512, AVX2, SSE, NEON and plain code, chosen at
//! run time, and no `unsafe` here.

mod box_corners;
mod boxes;
mod clip;
mod coverage;
mod definitive;
mod fill;
mod footprint;
mod guard;
mod hidden;
mod paint;
mod pyramid;
mod setup;
mod small;
mod transform;

pub(crate) use box_corners::{axes, corner_sums, corners, largest, smallest};
pub use boxes::{BoxSet, ProjectedBoxes, project_boxes};
pub use fill::{Drawing, draw_block};
pub(crate) use footprint::Footprint;
pub(crate) use guard::{GUARD_MAX, GUARD_MIN, GuardedPolygon};
pub use pyramid::{Rect, Target, TargetCounters};
pub use setup::TriangleBlock;
pub use transform::ScreenFromObject;

/// Side of a tile, pixels. Windows start at multiples of it.
pub const TILE: u32 = 16;

/// Side of a block, pixels.
pub const BLOCK: u32 = 4;

/// The best and the plainest instruction set of this machine; with the feature `portable`, code without any too.
#[cfg(test)]
pub(crate) fn levels() -> Vec<fearless_simd::Level> {
    use fearless_simd::Level;
    vec![
        Level::new(),
        Level::baseline(),
        #[cfg(feature = "portable")]
        Level::fallback(),
    ]
}
