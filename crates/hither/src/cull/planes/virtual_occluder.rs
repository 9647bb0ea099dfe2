//! Virtual occluders: large boxes inside closed meshes of many small polygons, which the paper leaves to the
//! future (§5, "complex CAD meshes").
//!
//! A mesh that is closed has an inside: the points round which its surface winds at least once. A sight line
//! from outside to a point inside crosses the surface on the way, somewhere from front to back. So a box
//! that lies inside, touching no triangle, hides whatever its own faces would hide, from every eye outside
//! the mesh, and does it with six polygons that are large and connected.
//!
//! A box is grown from the middle of the mesh, as a cube first and then along each axis, as long as it
//! meets no triangle.

use super::model::PolygonModel;
use super::occluder::Occluders;
use crate::cull::closed::is_closed;
use crate::geometry::{Aabb, box_meets_polygon};
use glam::DVec3;
use std::collections::HashMap;

/// Meshes of fewer polygons are left to hide with their own.
const FEWEST_POLYGONS: usize = 16;
/// Halvings of the interval in which the largest cube, and then each side, is looked for.
const STEPS: u32 = 7;
/// Places along each axis where a seed is looked for if the middle is outside.
const SEEDS: u32 = 4;

/// A connected part of an instance.
#[derive(Default)]
struct Component {
    polygons: Vec<u32>,
    bounds: Option<Aabb>,
}

/// Adds boxes for all closed meshes of `model`. Cost: for each, its triangles some tens of times.
pub(super) fn add(model: &PolygonModel, occluders: &mut Occluders) {
    for component in components(model) {
        if component.polygons.len() < FEWEST_POLYGONS {
            continue;
        }
        let triangles: Vec<[u32; 3]> =
            component.polygons.iter().flat_map(|&p| model.triangles(p).iter().copied()).collect();
        let polygons = || component.polygons.iter().map(|&p| &model.polygons()[p as usize]);
        let (Some(bounds), true) = (component.bounds, is_closed(&triangles)) else { continue };
        if !polygons().all(|p| p.opaque) {
            continue;
        }
        let double_sided = polygons().all(|p| p.double_sided);
        let corners: Vec<[DVec3; 3]> =
            triangles.iter().map(|t| t.map(|v| model.vertices[v as usize])).collect();
        if let Some(seed) = seed(&corners, &bounds, double_sided)
            && let Some(inner) = grow(&corners, &bounds, seed)
        {
            push_box(occluders, &inner, &bounds);
        }
    }
}

/// Polygons of an instance that hang together by vertices.
fn components(model: &PolygonModel) -> Vec<Component> {
    let mut head: HashMap<(u32, u32), u32> = HashMap::new();
    let mut into: Vec<u32> = (0..model.polygons().len() as u32).collect();
    fn find(into: &mut [u32], mut at: u32) -> u32 {
        while into[at as usize] != at {
            into[at as usize] = into[into[at as usize] as usize];
            at = into[at as usize];
        }
        at
    }
    for (number, polygon) in (0u32..).zip(model.polygons()) {
        for triangle in model.triangles(number) {
            for &v in triangle {
                let other = *head.entry((polygon.instance, v)).or_insert(number);
                let (a, b) = (find(&mut into, number), find(&mut into, other));
                into[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut found: Vec<Component> = into.iter().map(|_| Component::default()).collect();
    for number in 0..into.len() as u32 {
        let component = &mut found[find(&mut into, number) as usize];
        component.polygons.push(number);
        let bounds = model.polygons()[number as usize].bounds;
        component.bounds = Some(component.bounds.map_or(bounds, |b| b.union(&bounds)));
    }
    found.retain(|c| !c.polygons.is_empty());
    found
}

/// How often the surface winds round `at`, as seen from its fronts; near a whole number but at the surface.
fn winding(corners: &[[DVec3; 3]], at: DVec3) -> f64 {
    let solid_angle = |t: &[DVec3; 3]| {
        let [a, b, c] = t.map(|p| p - at);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    corners.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// A point well inside.
fn seed(corners: &[[DVec3; 3]], bounds: &Aabb, double_sided: bool) -> Option<DVec3> {
    let inside = |p: &DVec3| {
        let turns = winding(corners, *p).round();
        turns >= 1.0 || (double_sided && turns <= -1.0)
    };
    let middle = bounds.center();
    if inside(&middle) {
        return Some(middle);
    }
    let place = |i: u32| {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SEEDS);
        bounds.min + bounds.size() * DVec3::new(at(i % SEEDS), at(i / SEEDS % SEEDS), at(i / SEEDS / SEEDS))
    };
    (0..SEEDS * SEEDS * SEEDS).map(place).find(inside)
}

/// The box that grows from `seed`; `None` if the surface is too near.
fn grow(corners: &[[DVec3; 3]], bounds: &Aabb, seed: DVec3) -> Option<Aabb> {
    let slack = DVec3::splat(1e-6 * bounds.size().max_element());
    let free = |b: &Aabb| {
        let wide = Aabb { min: b.min - slack, max: b.max + slack };
        !corners.iter().any(|t| box_meets_polygon(&wide, t))
    };
    let cube = |half: f64| Aabb { min: seed - half, max: seed + half };
    let most = bounds.size().max_element() / 2.0;
    let half = largest(most, |half| free(&cube(half)))?;
    let mut grown = cube(half);
    for axis in 0..3 {
        for upper in [false, true] {
            let moved = |by: f64| {
                let mut b = grown;
                if upper {
                    b.max[axis] += by;
                } else {
                    b.min[axis] -= by;
                }
                b
            };
            if let Some(by) = largest(most, |by| free(&moved(by))) {
                grown = moved(by);
            }
        }
    }
    Some(grown)
}

/// The largest length that passes, of those that halving meets; `None` if none does.
fn largest(most: f64, passes: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..STEPS {
        let middle = (low + high) / 2.0;
        if passes(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low > 0.0).then_some(low)
}

/// Adds the six faces of a box, connected, as occluders.
fn push_box(occluders: &mut Occluders, inner: &Aabb, solid: &Aabb) {
    let first = occluders.vertices.len() as u32;
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { inner.min[axis] } else { inner.max[axis] };
        occluders.vertices.push(DVec3::new(pick(0), pick(1), pick(2)));
    }
    for face in [[0u32, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        let [a, b, c, d] = face.map(|v| first + v);
        occluders.push(&[a, b, c, d], &[[a, b, c], [a, c, d]], false, Some(*solid));
    }
}
