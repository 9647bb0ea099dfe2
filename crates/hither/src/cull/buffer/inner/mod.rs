//! Large boxes inside a closed patch, to be drawn in its place where its own faces are too many for what they
//! cover: simplification from the inside.
//!
//! # What is promised
//!
//! Round every point of the convex hull of a box's eight corners, as rounded to f32, the patch winds at least
//! once. Outside the patch's bounding box it winds not at all. So each ray that comes from there to a point of
//! the box crosses a face of the patch from front to back before it, and what the box hides from an eye outside
//! the bounding box, the patch hides too. The patch may intersect itself and may be of several pieces; what
//! does not close has no boxes. How *many* boxes there are, and how large, is not promised.
//!
//! # Why it is so
//!
//! Let A be the affine map, exact, from the patch's space into a *lattice* of integers ([`lattice`]): a rotation,
//! an offset, and a scale for each axis, all of them the very f64 numbers that are used. It keeps orientation.
//!
//! 1. Corners of the patch are moved to lattice points, each coordinate by at most ½ and 2⁻¹². Moving them there
//!    along straight ways moves each point of each triangle by no more. So what is farther than one unit from the
//!    moved triangles, in some coordinate, is met neither by the patch nor on the way: its winding number is the
//!    same for both, and constant on what hangs together.
//! 2. A cell of a grid of integer planes is *touched* if it meets a moved triangle when it is made wider by two
//!    units on all sides ([`cells`]; the triangle is cut to slabs in f64, which is off by less than 2⁻²⁰ units).
//!    Cells that are not touched are clear by more than one unit.
//! 3. In a row of cells along x, a cell's winding number is the sum of the signs of the moved triangles that the
//!    row's middle line meets beyond the cell. Which triangles it meets is decided in integers, with a tie rule
//!    that is one infinitesimal shift of the line for all; in which cell is an exact floor. The meeting points
//!    lie on the closed triangles, hence in touched cells, so the sum is right in all others.
//! 4. A box is made of untouched cells whose numbers are at least 1, then grown to where triangles, cut to what
//!    the growing side sweeps, are two units away. It is connected and clear, so its number is one number.
//! 5. Its corners are taken back, somewhat inside, and rounded to f32. The preimage of the box under A is convex,
//!    and each rounded corner is checked to lie in it, computed with an error below ½; so the hull does.

mod cells;
mod choose;
mod frame;
mod lattice;
#[cfg(test)]
mod tests;

use crate::cull::closed::is_closed;
use cells::Cells;
use glam::{DVec3, Vec3};
use lattice::{Lattice, UNITS};

/// A box inside a patch. It need not lie along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InnerBox {
    /// Corner k is at the far end of axis i if bit i of k is set; the axes are right-handed.
    pub corners: [Vec3; 8],
}

/// A box of the lattice, closed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LatticeBox {
    min: [i32; 3],
    max: [i32; 3],
}

/// At most `most` large boxes inside a patch, those that cover most first; none if it does not close. They may
/// overlap. `points` are positions in f32, corners run counter-clockwise seen from outside.
///
/// Cost: triangles, and for each the cells it touches; choosing takes at worst a bounded number of steps.
pub(super) fn inner_boxes(points: &[DVec3], triangles: &[[u32; 3]], most: usize) -> Vec<InnerBox> {
    let known = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < points.len());
    if most == 0 || triangles.len() < 4 || !triangles.iter().all(known) || !is_closed(triangles) {
        return Vec::new();
    }
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|v| points[v as usize])).collect();
    let Some(lattice) = Lattice::around(&corners) else { return Vec::new() };
    let moved: Vec<[[i32; 3]; 3]> = corners.iter().map(|t| t.map(|p| lattice.snapped(p))).collect();
    let cuts = cells::cuts(&moved, lattice.size());
    let cells = Cells::new(cuts, &moved);
    choose::boxes(&cells, lattice.size(), most)
        .into_iter()
        .map(|found| cells::grown(found, &moved))
        .filter_map(|found| lattice.taken_back(&found))
        .collect()
}
