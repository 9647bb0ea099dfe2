//! Greene's octree: cubes halved along every axis, and two ways of assigning primitives to them
//! [Greene 1995, §3.3.1].
//!
//! - *Smallest cube*: a primitive belongs to the smallest cube that encloses it, so one that crosses a plane
//!   between a cube's children stays with that cube, however small it is.
//! - *Pushed down*: a primitive that crosses such a plane but is small beside the cube goes to every child
//!   that it really meets ([`box_meets_polygon`]), and so on downwards. Small is: a square as wide as the
//!   longest side of the primitive's box covers less than a tenth of the cube's face.
//!
//! Departures:
//!
//! - Greene compares the primitive's own area with the face's. By that rule slivers would be pushed to the
//!   bottom along all their length; by ours a primitive meets at most two cubes an axis, eight in all, at
//!   whatever depth it comes to rest.
//! - What is tested while rendering is not a cube but the tight box of all that the cube holds, *whole*
//!   primitives included where the cube has only a part. A cube clipped to its contents would be smaller, but
//!   then a hidden box would not prove a hidden primitive: a pixel's depth is interpolated from snapped
//!   corners, and close to edge-on it may be that of a point outside the cube. This way pictures are the same
//!   to the last bit whichever tree is used. To be drawn twice changes nothing: id and depth are the same.
//! - A node has sixteen slots: a cube's children, and its own primitives in leaves made by `bvh`. A child
//!   with fewer than [`FEW`] primitives hands them to its parent, and a cube with only one child is skipped.

use super::bvh;
use super::parts::{Built, Part, Primitive, bounds_of};
use super::tree::Box3;
use crate::geometry::{Aabb, box_meets_polygon};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A cube with no more primitives is not divided (Greene's *m*).
const MOST: usize = 16;

/// A child with fewer primitives is dissolved.
const FEW: usize = 8;

/// Cubes are at most this many times halved: then they are as small as f32 can tell.
const DEPTH: u32 = 24;

/// A primitive is small if it covers less than this part of a cube's face.
const SMALL: f64 = 0.1;

/// Lists longer than this are divided on several threads.
const PARALLEL: usize = 4096;

/// Each primitive in the smallest cube around it. Cost: n times the depth.
pub(super) fn build_smallest(primitives: Vec<Primitive>, leaf_size: usize) -> Built {
    build(primitives, leaf_size, |p, cube| cube.octant_around(&p.bounds()))
}

/// Small primitives in every child they cross; their numbers occur in several leaves. `corners` gives a
/// primitive's triangle.
pub(super) fn build_pushed(
    primitives: Vec<Primitive>,
    leaf_size: usize,
    corners: impl Fn(u32) -> [Vec3; 3] + Sync,
) -> Built {
    build(primitives, leaf_size, |p, cube| {
        let bounds = p.bounds();
        match cube.octant_around(&bounds) {
            0 if cube.is_large_beside(&bounds) => cube.octants_met(&bounds, &corners(p.index())),
            octant => octant,
        }
    })
}

/// Octants as bits; bit i of an octant's number says on which side of the plane across axis i it lies.
type Octants = u8;

#[derive(Clone, Copy, Debug)]
struct Cube {
    center: DVec3,
    half: f64,
    /// How often it may still be halved.
    depth: u32,
}

impl Cube {
    /// The root's cube.
    fn around(bounds: &Box3) -> Cube {
        let bounds = bounds.to_aabb();
        Cube { center: bounds.center(), half: bounds.size().max_element() * 0.5, depth: DEPTH }
    }

    fn octant(&self, octant: usize) -> Cube {
        let half = self.half * 0.5;
        let offset = [0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { -half } else { half });
        Cube { center: self.center + DVec3::from_array(offset), half, depth: self.depth - 1 }
    }

    /// On which sides of each of the three dividing planes a box has points: bit 0 below, bit 1 above.
    fn sides(&self, bounds: &Box3) -> [u8; 3] {
        [0, 1, 2].map(|axis| {
            let at = self.center[axis];
            // What lies in the plane belongs below.
            let below = f64::from(bounds.min[axis]) < at || f64::from(bounds.max[axis]) <= at;
            let above = f64::from(bounds.max[axis]) > at;
            u8::from(below) | u8::from(above) << 1
        })
    }

    /// The octant that encloses a box, if there is one.
    fn octant_around(&self, bounds: &Box3) -> Octants {
        let sides = self.sides(bounds);
        if sides.contains(&3) {
            return 0;
        }
        let octant = (0..3).fold(0, |o, axis| o | (sides[axis] >> 1) << axis);
        1 << octant
    }

    /// The tenth-of-a-face rule.
    fn is_large_beside(&self, bounds: &Box3) -> bool {
        let longest = bounds.to_aabb().size().max_element();
        let side = self.half * 2.0;
        longest * longest < side * side * SMALL
    }

    /// The octants that a triangle with these bounds has points in, or almost.
    fn octants_met(&self, bounds: &Box3, corners: &[Vec3; 3]) -> Octants {
        let sides = self.sides(bounds);
        let corners = corners.map(|c| c.as_dvec3());
        // Within the cube, what crosses a single plane has a corner on either side of it.
        let bounds = bounds.to_aabb();
        let within = self.bounds().contains(bounds.min) && self.bounds().contains(bounds.max);
        let certain = within && sides.iter().filter(|&&s| s == 3).count() == 1;
        let mut met = 0;
        for octant in 0..8 {
            let possible = (0..3).all(|axis| sides[axis] >> (octant >> axis & 1) & 1 == 1);
            if possible && (certain || box_meets_polygon(&self.octant_bounds(octant), &corners)) {
                met |= 1 << octant;
            }
        }
        met
    }

    fn bounds(&self) -> Aabb {
        Aabb { min: self.center - self.half, max: self.center + self.half }
    }

    fn octant_bounds(&self, octant: usize) -> Aabb {
        let mut b = self.bounds();
        for axis in 0..3 {
            let inner = if octant >> axis & 1 == 0 { &mut b.max } else { &mut b.min };
            inner[axis] = self.center[axis];
        }
        b
    }
}

struct Octree<A> {
    leaf_size: usize,
    /// The octants of a cube that a primitive goes to; none if it stays.
    assign: A,
}

fn build<A: Fn(&Primitive, &Cube) -> Octants + Sync>(
    primitives: Vec<Primitive>,
    leaf_size: usize,
    assign: A,
) -> Built {
    if primitives.is_empty() {
        return Built::from_root(None);
    }
    let cube = Cube::around(&bounds_of(&primitives).finish());
    Built::from_root(Some(Octree { leaf_size, assign }.part(primitives, cube)))
}

impl<A: Fn(&Primitive, &Cube) -> Octants + Sync> Octree<A> {
    /// What becomes of the primitives assigned to `cube`; the list is not empty.
    fn part(&self, mut list: Vec<Primitive>, mut cube: Cube) -> Part {
        if list.len() <= MOST {
            return bvh::part(&mut list, self.leaf_size);
        }
        let bounds = bounds_of(&list).finish();
        loop {
            if cube.depth == 0 {
                return bvh::part(&mut list, self.leaf_size);
            }
            match cube.octant_around(&bounds) {
                0 => break,
                only => cube = cube.octant(only.trailing_zeros() as usize),
            }
        }
        let parallel = list.len() > PARALLEL;
        let (mut own, children) = self.divide(list, &cube);
        let child = |(octant, list): (usize, Vec<Primitive>)| {
            (!list.is_empty()).then(|| self.part(list, cube.octant(octant)))
        };
        let children = children.into_iter().enumerate();
        let mut parts: Vec<Part> = if parallel {
            let parts: Vec<_> = children.collect::<Vec<_>>().into_par_iter().map(child).collect();
            parts.into_iter().flatten().collect()
        } else {
            children.filter_map(child).collect()
        };
        if !own.is_empty() {
            parts.push(bvh::part(&mut own, self.leaf_size));
        }
        Part::around(parts)
    }

    /// The cube's own primitives, and those of its octants.
    fn divide(&self, list: Vec<Primitive>, cube: &Cube) -> (Vec<Primitive>, [Vec<Primitive>; 8]) {
        let mut own = Vec::new();
        let mut children: [Vec<Primitive>; 8] = Default::default();
        for p in list {
            let octants = (self.assign)(&p, cube);
            if octants == 0 {
                own.push(p);
            }
            for (octant, child) in children.iter_mut().enumerate() {
                if octants >> octant & 1 == 1 {
                    child.push(p);
                }
            }
        }
        let mut dissolved = false;
        for child in children.iter_mut().filter(|c| (1..FEW).contains(&c.len())) {
            own.append(child);
            dissolved = true;
        }
        if dissolved {
            // One primitive may come from several children.
            own.sort_unstable_by_key(Primitive::index);
            own.dedup_by_key(|p| p.index());
        }
        (own, children)
    }
}
