//! Exact visibility all around an eye, without an image: from each triangle everything that another hides
//! is cut away, and what is left can be seen.
//!
//! Slow and obvious: every triangle against every other, as convex polygons in space, in `f64`. What is left
//! counts only if a ball of some angular size fits into it, because the seams of touching surfaces leave
//! slivers as wide as a rounding error.

use crate::scene::{AlphaMode, Scene};
use glam::DVec3;

/// A triangle of a scene that can be seen, and a point of it that can.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Number of the instance.
    pub instance: u32,
    /// Number of the triangle in its mesh.
    pub triangle: u32,
    /// In the middle of a part that can be seen, world space.
    pub point: DVec3,
    /// Half the width of that part as seen from the eye, radians.
    pub radius: f64,
}

struct Target {
    instance: u32,
    triangle: u32,
    /// Relative to the eye.
    corners: [DVec3; 3],
    opaque: bool,
    /// A cone around it: axis and cosine of half its angle.
    axis: DVec3,
    cosine: f64,
    sine: f64,
}

/// Every triangle of `scene` that can be seen from `eye` through a part of angular radius `least` or more,
/// with its facing and the material's sidedness taken into account. Masked and blended surfaces hide
/// nothing here.
pub fn sightings(scene: &Scene, eye: DVec3, least: f64) -> Vec<Sighting> {
    let targets = targets(scene, eye);
    // The largest first: they hide most.
    let mut hiders: Vec<usize> = (0..targets.len()).filter(|&i| targets[i].opaque).collect();
    hiders.sort_by(|&i, &j| targets[i].cosine.total_cmp(&targets[j].cosine).then(i.cmp(&j)));
    let mut found = Vec::new();
    for (i, target) in targets.iter().enumerate() {
        let near: Vec<usize> =
            hiders.iter().copied().filter(|&j| j != i && overlap(target, &targets[j])).collect();
        if let Some((point, radius)) = remaining(target, &near, &targets, least) {
            let Target { instance, triangle, .. } = *target;
            found.push(Sighting { instance, triangle, point: point + eye, radius });
        }
    }
    found
}

fn targets(scene: &Scene, eye: DVec3) -> Vec<Target> {
    let mut targets = Vec::new();
    for (number, instance) in scene.instances().iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mirrored = instance.world_from_mesh.matrix3.determinant() < 0.0;
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let corners = corners.map(|v| {
                instance.world_from_mesh.transform_point3(mesh.positions[v as usize].as_dvec3()) - eye
            });
            let material = mesh.material_of(t as u32).map(|m| &scene.materials[m as usize]);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            let faces = (-a.dot(normal) > 0.0) != mirrored;
            if normal == DVec3::ZERO || !(faces || material.is_some_and(|m| m.double_sided)) {
                continue;
            }
            let axis = corners.map(|p| p.normalize_or_zero()).iter().sum::<DVec3>().normalize_or_zero();
            let cosines = corners.map(|p| p.normalize_or_zero().dot(axis));
            let cosine = cosines.into_iter().fold(1.0, f64::min);
            targets.push(Target {
                instance: number as u32,
                triangle: t as u32,
                corners,
                opaque: material.is_none_or(|m| m.alpha == AlphaMode::Opaque),
                axis,
                cosine,
                sine: (1.0 - cosine * cosine).max(0.0).sqrt(),
            });
        }
    }
    targets
}

/// Whether the cones around two triangles meet.
fn overlap(a: &Target, b: &Target) -> bool {
    // Beyond a right angle a cone is no bound.
    if a.cosine <= 0.0 || b.cosine <= 0.0 {
        return true;
    }
    let cosine_of_sum = a.cosine * b.cosine - a.sine * b.sine;
    a.axis.dot(b.axis) >= cosine_of_sum - 1e-12
}

/// A point that no hider hides, with the radius of the part around it.
fn remaining(target: &Target, hiders: &[usize], targets: &[Target], least: f64) -> Option<(DVec3, f64)> {
    let mut parts = vec![(target.corners.to_vec(), 0)];
    while let Some((part, next)) = parts.pop() {
        let middle = part.iter().sum::<DVec3>() / part.len() as f64;
        let radius = radius(&part, middle);
        if radius < least {
            continue;
        }
        match hiders.get(next) {
            None => return Some((middle, radius)),
            Some(&j) => subtract(part, &targets[j], |rest| parts.push((rest, next + 1))),
        }
    }
    None
}

/// How wide a part is around its middle, radians: the least angle from the middle to the plane of the eye
/// and a side. Parts at the eye are no part of a picture.
fn radius(part: &[DVec3], middle: DVec3) -> f64 {
    let to_side = |i: usize| {
        let (a, b) = (part[i], part[(i + 1) % part.len()]);
        let normal = a.cross(b).normalize_or_zero();
        // A side of no length bounds nothing.
        if normal == DVec3::ZERO { f64::INFINITY } else { (normal.dot(middle) / middle.length()).abs() }
    };
    // Of a speck the sides have no direction; but its corners are near.
    let to_corner = part.iter().map(|p| p.normalize_or_zero().distance(middle.normalize_or_zero()));
    let farthest = to_corner.fold(0.0, f64::max);
    let least = (0..part.len()).map(to_side).fold(farthest, f64::min);
    if part.len() < 3 { 0.0 } else { least }
}

/// Hands on the convex parts of `part` that `hider` does not hide.
fn subtract(part: Vec<DVec3>, hider: &Target, mut rest: impl FnMut(Vec<DVec3>)) {
    let [a, b, c] = hider.corners;
    let normal = (b - a).cross(c - a);
    // Towards the eye; an eye in the plane sees nothing of it, and nothing is behind it.
    let normal = if a.dot(normal) > 0.0 { -normal } else { normal };
    let level = a.dot(normal);
    if level >= 0.0 {
        rest(part);
        return;
    }
    // Not behind it: as far away as its own plane, or nearer. What lies in that plane is not hidden by it.
    let scale = normal.length() * (a.length() + part.iter().map(|p| p.length()).fold(0.0, f64::max));
    let before = cut(&part, |p| p.dot(normal) - level + 1e-12 * scale);
    let mut behind = cut(&part, |p| level - 1e-12 * scale - p.dot(normal));
    if before.len() >= 3 {
        rest(before);
    }
    let turn = a.dot(b.cross(c)).signum();
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let side = p.cross(q) * turn;
        if behind.len() < 3 {
            return;
        }
        let outside = cut(&behind, |x| -x.dot(side));
        if outside.len() >= 3 {
            rest(outside);
        }
        behind = cut(&behind, |x| x.dot(side));
    }
}

/// The part of a convex polygon where `height` is not negative.
fn cut(polygon: &[DVec3], height: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (hp, hq) = (height(p), height(q));
        if hp >= 0.0 {
            kept.push(p);
        }
        if (hp >= 0.0) != (hq >= 0.0) {
            kept.push(p + (q - p) * (hp / (hp - hq)));
        }
    }
    kept
}
