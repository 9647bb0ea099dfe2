//! The reader and the writer as a whole, on files that are made here, byte by byte.

mod build;
mod layouts;
mod mutation;
mod refusals;
mod round_trip;
mod scenes;
mod textures;
