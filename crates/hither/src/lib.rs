//! Hither: a visibility engine.
//!
//! For a 3D scene and an eye it answers *what can be seen*, *in what order*, and *how it looks*.
//! The crate opens no file, no device and no socket, and prints nothing; `hither-io` reads and writes files.
//!
//! Rooms, from the ground up (a room uses only rooms below it; `cargo xtask tidy` checks):
//! [`conventions`]; [`geometry`]; [`scene`], [`raster`]; [`index`]; [`order`], [`cull`]; [`render`](mod@render),
//! [`hidden_line`], [`classic`]; [`layers`].
//! [`reference`](mod@reference) is the brute-force truth that every fast answer is tested against.
//!
//! # In debug builds
//!
//! Vector code that is not optimised is slow, and keeps every vector that it made on the stack: drawing into occlusion
//! buffers has been seen to need more than the 2 MiB that Rust gives a thread by itself. A program that depends on this
//! crate wants in its `Cargo.toml`
//!
//! ```toml
//! [profile.dev.package]
//! hither.opt-level = 2
//! fearless_simd.opt-level = 2
//! glam.opt-level = 2
//! ```
#![forbid(unsafe_code)]

pub mod classic;
pub mod conventions;
pub mod cull;
pub mod geometry;
pub mod hidden_line;
pub mod index;
pub mod layers;
pub mod order;
pub mod raster;
pub mod reference;
pub mod render;
pub mod scene;

pub use fearless_simd::Level;
pub use index::{IndexOptions, SceneIndex};
pub use render::{Algorithm, Frame, RenderOptions, Renderer, render};
pub use scene::Scene;

/// The engine's version, as JSON reports state it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
