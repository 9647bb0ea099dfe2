//! As separate images: layers that need not be cut, and the expression that puts the picture back together.
//!
//! An [`Order`](crate::order::Order) of whole parts becomes *components*. Most are one part; a cycle of occlusion
//! is merged where two of its members occlude each other, and again, until none do: what is merged must be drawn
//! together and is one *layer* [Snyder & Lengyel 1997, §8]. [`decompose`] does that. The layers of a component
//! still occlude each other in cycles, and an [`Expression`] of Porter and Duff's operators on their images is the
//! component's picture all the same. [`Program`] is its form for a machine with three image registers.
//!
//! [`LayerPainter::look`] looks closer at a cycle: at the samples of a picture much of it falls apart.
//! [`LayerPainter`] draws layers with [`render`](mod@crate::render); [`depth_of_field`](mod@depth_of_field) blurs each
//! by its own circle of confusion, and [`reuse`](mod@reuse) warps what was drawn before instead of drawing it again.
//!
//! Where pixels are either covered or not, the composite is the direct picture to the last bit. Where surfaces blend it
//! is so up to rounding, some 1e-7: the direct picture blends them one after the other, here a layer's are blended
//! first, and in floating point that is not quite the same. Where coverage is fractional, each layer's is that of what
//! the layers before it leave open ([`Openness`]), and the composite is the direct picture up to rounding, but for
//! pixels that three layers of one cycle share.

mod components;
mod coverage;
pub mod depth_of_field;
mod expression;
mod paint;
mod plan;
mod program;
pub mod reuse;
mod sight;
mod sprite;
#[cfg(test)]
mod tests;

pub use components::{Component, Mutual, decompose, decompose_by_sight};
pub use coverage::{Drawn, Openness};
pub use expression::{Expression, sum_of_outs};
pub use paint::{LayerPainter, PaintOptions, Painted};
pub use program::{Instruction, Operation, Program, Register, Source};
pub use sight::{Holdout, Sight};
pub use sprite::{Canvas, Sprite};
