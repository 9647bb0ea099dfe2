//! Plants of some thousand triangles: trunks, and leaves as small two-sided quadrilaterals.

use crate::lcg::Lcg;
use glam::{DVec3, Vec3};
use hither::scene::{Mesh, Primitive};
use std::f64::consts::TAU;

/// A kind of plant; the number is its mesh's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Plant {
    Spruce,
    Broadleaf,
    Bush,
}

/// What a plant is made of.
struct Shape {
    name: &'static str,
    leaf_material: u32,
    /// Height and radius of the trunk at the ground, metres.
    trunk: (f64, f64),
    leaves: u32,
    /// Side of a leaf, metres.
    leaf: f64,
    /// Of twenty plants, how many are of this kind.
    share: usize,
}

/// Sides of a trunk.
const TRUNK_SIDES: u32 = 12;
const BARK: u32 = 1;

impl Plant {
    pub(super) const ALL: [Plant; 3] = [Plant::Spruce, Plant::Broadleaf, Plant::Bush];

    fn shape(self) -> Shape {
        match self {
            Plant::Spruce => Shape {
                name: "spruce",
                leaf_material: 2,
                trunk: (11.0, 0.22),
                leaves: 4_000,
                leaf: 0.34,
                share: 7,
            },
            Plant::Broadleaf => Shape {
                name: "broadleaf",
                leaf_material: 3,
                trunk: (5.5, 0.3),
                leaves: 5_000,
                leaf: 0.36,
                share: 5,
            },
            Plant::Bush => Shape {
                name: "bush",
                leaf_material: 4,
                trunk: (0.8, 0.06),
                leaves: 1_000,
                leaf: 0.2,
                share: 8,
            },
        }
    }

    pub(super) fn name(self) -> &'static str {
        self.shape().name
    }

    fn triangles(self) -> u32 {
        2 * self.shape().leaves + 2 * TRUNK_SIDES
    }

    /// Triangles of a plant on average, in the kinds' proportion.
    pub(super) fn mean_triangles() -> f64 {
        let sum: usize = Plant::ALL.map(|p| p.triangles() as usize * p.shape().share).iter().sum();
        sum as f64 / 20.0
    }

    /// Kinds in their proportion, for consecutive numbers.
    pub(super) fn in_proportion(number: usize) -> Plant {
        // Seven has no factor in common with twenty, so a part of a round is mixed too.
        let at = number * 7 % 20;
        let spruces = Plant::Spruce.shape().share;
        match at {
            _ if at < spruces => Plant::Spruce,
            _ if at < spruces + Plant::Broadleaf.shape().share => Plant::Broadleaf,
            _ => Plant::Bush,
        }
    }

    /// The plant, standing on the origin.
    pub(super) fn mesh(self) -> Mesh {
        let shape = self.shape();
        let mut mesh = Mesh { name: shape.name.to_owned(), ..Mesh::default() };
        push_trunk(&mut mesh, shape.trunk.0, shape.trunk.1);
        let bark = mesh.triangles.len() as u32;
        let mut random = Lcg::new(100 + self as u32);
        for number in 0..shape.leaves {
            let (at, outwards) = self.leaf(number, shape.leaves, &mut random);
            push_leaf(&mut mesh, at, outwards, shape.leaf, &mut random);
        }
        mesh.primitives = vec![
            Primitive { triangles: 0..bark, material: Some(BARK) },
            Primitive { triangles: bark..mesh.triangles.len() as u32, material: Some(shape.leaf_material) },
        ];
        mesh
    }

    /// Where a leaf is, and the direction it is lit from.
    fn leaf(self, number: u32, leaves: u32, random: &mut Lcg) -> (DVec3, DVec3) {
        let mut unit = || f64::from(random.unit());
        let direction = |y: f64, angle: f64| {
            let r = (1.0 - y * y).max(0.0).sqrt();
            DVec3::new(r * libm::cos(angle), y, r * libm::sin(angle))
        };
        match self {
            // On branches in whorls, longer towards the ground, hanging.
            Plant::Spruce => {
                let up = 1.0 - (f64::from(number) / f64::from(leaves)).sqrt();
                let whorl = (up * 22.0).floor();
                let branch = (unit() * 9.0).floor() + whorl * 0.37;
                let angle = (branch + 0.35 * (unit() - 0.5)) / 9.0 * TAU;
                let reach = 0.15 + unit().sqrt() * (2.6 * (1.0 - up) + 0.1);
                let y = 1.2 + up * 9.9 - 0.28 * reach;
                let outwards = direction(0.35, angle);
                (DVec3::new(reach * libm::cos(angle), y, reach * libm::sin(angle)), outwards)
            }
            // In the shells of seven overlapping balls.
            Plant::Broadleaf => {
                let ball = f64::from(number % 7);
                let middle = if number.is_multiple_of(7) {
                    DVec3::new(0.0, 7.6, 0.0)
                } else {
                    let angle = ball / 6.0 * TAU;
                    DVec3::new(1.7 * libm::cos(angle), 5.6 + 0.7 * (ball % 2.0), 1.7 * libm::sin(angle))
                };
                let outwards = direction(2.0 * unit() - 1.0, TAU * unit());
                (middle + outwards * (1.7 + 0.3 * (unit() - 0.5)), outwards)
            }
            // In the shell of half a ball.
            Plant::Bush => {
                let outwards = direction(1.2 * unit() - 0.2, TAU * unit());
                let radius = 1.1 * (0.55 + 0.45 * unit().sqrt());
                (DVec3::new(0.0, 0.25, 0.0) + outwards * DVec3::new(radius, radius * 0.9, radius), outwards)
            }
        }
    }
}

fn push_trunk(mesh: &mut Mesh, height: f64, radius: f64) {
    for (y, r) in [(-0.5, radius * 1.1), (height, radius * 0.25)] {
        for side in 0..TRUNK_SIDES {
            let angle = f64::from(side) / f64::from(TRUNK_SIDES) * TAU;
            let (cos, sin) = (libm::cos(angle), libm::sin(angle));
            mesh.positions.push(DVec3::new(r * cos, y, r * sin).as_vec3());
            mesh.normals.push(DVec3::new(cos, 0.0, sin).as_vec3());
        }
    }
    for side in 0..TRUNK_SIDES {
        let next = (side + 1) % TRUNK_SIDES;
        let top = |s: u32| s + TRUNK_SIDES;
        mesh.triangles.extend([[side, top(next), next], [side, top(side), top(next)]]);
    }
}

/// A square of side `size` in a random plane.
fn push_leaf(mesh: &mut Mesh, at: DVec3, outwards: DVec3, size: f64, random: &mut Lcg) {
    let mut signed = || f64::from(random.unit()) * 2.0 - 1.0;
    let across = DVec3::new(signed(), signed(), signed()).normalize_or(DVec3::X);
    let along = across.cross(DVec3::new(signed(), signed(), signed())).normalize_or(DVec3::Y);
    let first = mesh.positions.len() as u32;
    let half = size * 0.5;
    for (a, b) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
        mesh.positions.push((at + across * a + along * b).as_vec3());
        mesh.normals.push(outwards.as_vec3().normalize_or(Vec3::Y));
    }
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plants_have_the_triangles_that_are_planned_for_and_stand_on_the_origin() {
        for plant in Plant::ALL {
            let mesh = plant.mesh();
            assert_eq!(mesh.triangles.len() as u32, plant.triangles());
            let bounds = mesh.bounds();
            assert!(bounds.min.y < 0.0 && bounds.min.y >= -0.51, "{plant:?} {bounds:?}");
            assert!(bounds.max.y < 12.0 && bounds.size().x < 9.0, "{plant:?} {bounds:?}");
        }
        assert_eq!(Plant::ALL.map(|p| p.shape().share).iter().sum::<usize>(), 20);
    }
}
