//! Vectors' companions: axis-aligned boxes and the box–polyhedron test.

mod aabb;

pub use aabb::Aabb;
