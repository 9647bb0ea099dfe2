//! Greene's octree [Greene 1995, §3.3.1].

use super::bvh::{self, Built, Primitive};
use glam::Vec3;

pub(super) fn build(
    primitives: &mut [Primitive],
    _pushed: bool,
    _corners: impl Fn(u32) -> [Vec3; 3],
) -> Built {
    bvh::build(primitives, 16)
}
