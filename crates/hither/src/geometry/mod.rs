//! Vectors' companions: axis-aligned boxes and the box–polyhedron test.

mod aabb;
mod box_polyhedron;

pub use aabb::Aabb;
pub use box_polyhedron::{ConvexPolyhedron, Overlap, box_meets_polygon};
