//! Vectors' companions: axis-aligned boxes, the box–polyhedron test, convex hulls and their separation.

mod aabb;
mod box_polyhedron;
mod hull;
mod separation;

pub use aabb::Aabb;
pub use box_polyhedron::{ConvexPolyhedron, Overlap, box_meets_polygon};
pub use hull::Hull;
pub use separation::{Body, Witness, disjoint};
