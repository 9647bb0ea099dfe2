//! The module: 1,250 boxes, 15,000 triangles, in the benchmarks' order. Materials are runs of them.

use crate::benchmark_axes::push_box;
use crate::lcg::Lcg;
use crate::palette::{paint, tint};
use glam::Vec4;
use hither::scene::{Material, Mesh, Primitive};

/// Boxes in the module.
const BOXES: usize = 1250;

/// What a box is part of; the index of its material.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Floor,
    Column,
    Light,
    Wall,
    Desk,
    Chair,
    Monitor,
    Shelf,
    Book,
    Clutter,
}

fn materials() -> Vec<Material> {
    vec![
        paint("floor", 0x8a8f98),
        paint("column", 0xd8d4cc),
        paint("light", 0xfff6dc),
        paint("cubicle wall", 0x9fb3a6),
        paint("desk", 0xc49a6c),
        paint("chair", 0x3f5f8a),
        paint("monitor", 0x2b2d33),
        paint("shelf", 0xe8e2d6),
        paint("book", 0xffffff),
        paint("clutter", 0xffffff),
    ]
}

/// Collects boxes; positions in metres in the benchmarks' axes.
struct Boxes {
    mesh: Mesh,
    random: Lcg,
}

impl Boxes {
    fn len(&self) -> usize {
        self.mesh.positions.len() / 8
    }

    fn push(&mut self, part: Part, min: [f32; 3], max: [f32; 3]) {
        let number = self.len() as u32;
        let color = if matches!(part, Part::Book | Part::Clutter) { tint(number) } else { Vec4::ONE };
        push_box(&mut self.mesh, min, max, color);
        let end = self.mesh.triangles.len() as u32;
        let material = Some(part as u32);
        match self.mesh.primitives.last_mut() {
            Some(run) if run.material == material => run.triangles.end = end,
            _ => self.mesh.primitives.push(Primitive { triangles: end - 12..end, material }),
        }
    }
}

/// The mesh, and the materials that its primitives name.
pub(super) fn module() -> (Mesh, Vec<Material>) {
    let mesh = Mesh { name: "module".to_owned(), ..Mesh::default() };
    let mut boxes = Boxes { mesh, random: Lcg::new(7) };
    shell(&mut boxes);
    for qx in [0u8, 1] {
        for qz in [0u8, 1] {
            for a in [0u8, 1] {
                for b in [0u8, 1] {
                    cubicle(&mut boxes, corner(qx, a), corner(qz, b));
                }
            }
        }
    }
    while boxes.len() < BOXES {
        clutter(&mut boxes);
    }
    (boxes.mesh, materials())
}

/// x or z of the `second` (0 or 1) of the two cubicles in `quadrant` (0 or 1).
fn corner(quadrant: u8, second: u8) -> f32 {
    f32::from(quadrant) * 7.2 + 0.1 + f32::from(second) * 2.3
}

/// Floor slab with a two-metre well where the corridors cross, columns round it, and lights.
fn shell(boxes: &mut Boxes) {
    boxes.push(Part::Floor, [0.0, 0.0, 0.0], [12.0, 0.3, 5.0]);
    boxes.push(Part::Floor, [0.0, 0.0, 7.0], [12.0, 0.3, 12.0]);
    boxes.push(Part::Floor, [0.0, 0.0, 5.0], [5.0, 0.3, 7.0]);
    boxes.push(Part::Floor, [7.0, 0.0, 5.0], [12.0, 0.3, 7.0]);
    for x in [4.7f32, 7.0] {
        for z in [4.7f32, 7.0] {
            boxes.push(Part::Column, [x, 0.3, z], [x + 0.3, 4.0, z + 0.3]);
        }
    }
    for a in 0..4u8 {
        for b in 0..4u8 {
            let (x, z) = (1.0 + 2.8 * f32::from(a), 1.3 + 2.8 * f32::from(b));
            boxes.push(Part::Light, [x, 3.9, z], [x + 1.2, 3.95, z + 0.3]);
        }
    }
}

fn cubicle(boxes: &mut Boxes, x: f32, z: f32) {
    let (y, w, t, h) = (0.3f32, 2.3f32, 0.05f32, 1.6f32);
    boxes.push(Part::Wall, [x, y, z], [x + t, y + h, z + w]);
    boxes.push(Part::Wall, [x, y, z], [x + w, y + h, z + t]);
    boxes.push(Part::Wall, [x + w - t, y, z], [x + w, y + h, z + w]);
    boxes.push(Part::Wall, [x, y, z + w - t], [x + 1.3, y + h, z + w]);

    boxes.push(Part::Desk, [x + 0.1, y + 0.72, z + 0.1], [x + 1.7, y + 0.75, z + 0.8]);
    for leg in 0..4u8 {
        let lx = x + 0.12 + f32::from(leg & 1) * 1.5;
        let lz = z + 0.12 + f32::from(leg >> 1) * 0.6;
        boxes.push(Part::Desk, [lx, y, lz], [lx + 0.05, y + 0.72, lz + 0.05]);
    }

    boxes.push(Part::Chair, [x + 0.7, y + 0.42, z + 0.9], [x + 1.15, y + 0.48, z + 1.35]);
    boxes.push(Part::Chair, [x + 0.7, y + 0.48, z + 1.3], [x + 1.15, y + 0.95, z + 1.35]);
    boxes.push(Part::Chair, [x + 0.9, y + 0.05, z + 1.1], [x + 0.95, y + 0.42, z + 1.15]);
    boxes.push(Part::Chair, [x + 0.65, y, z + 1.1], [x + 1.2, y + 0.05, z + 1.15]);
    boxes.push(Part::Chair, [x + 0.9, y, z + 0.85], [x + 0.95, y + 0.05, z + 1.4]);

    boxes.push(Part::Monitor, [x + 0.6, y + 0.9, z + 0.25], [x + 1.15, y + 1.25, z + 0.29]);
    boxes.push(Part::Monitor, [x + 0.85, y + 0.77, z + 0.27], [x + 0.9, y + 0.9, z + 0.3]);
    boxes.push(Part::Monitor, [x + 0.75, y + 0.75, z + 0.2], [x + 1.0, y + 0.77, z + 0.4]);
    boxes.push(Part::Monitor, [x + 0.65, y + 0.75, z + 0.5], [x + 1.1, y + 0.77, z + 0.65]);

    bookshelf(boxes, x + w - 0.4, y, z + 0.2);
}

/// Two sides, four boards, and twelve books on each of three of them.
fn bookshelf(boxes: &mut Boxes, x: f32, y: f32, z: f32) {
    boxes.push(Part::Shelf, [x, y, z], [x + 0.33, y + 1.5, z + 0.03]);
    boxes.push(Part::Shelf, [x, y, z + 1.2], [x + 0.33, y + 1.5, z + 1.23]);
    let board = |k: u8, thickness: f32| y + thickness + 0.47 * f32::from(k);
    for k in 0..4 {
        boxes.push(Part::Shelf, [x, board(k, 0.05), z], [x + 0.33, board(k, 0.08), z + 1.23]);
    }
    for k in 0..3 {
        let mut book_z = z + 0.05;
        for _ in 0..12 {
            let thickness = 0.04 + 0.05 * boxes.random.unit();
            let height = 0.2 + 0.15 * boxes.random.unit();
            let min = [x + 0.05, board(k, 0.08), book_z];
            boxes.push(Part::Book, min, [x + 0.28, min[1] + height, book_z + thickness]);
            book_z += thickness + 0.005;
        }
    }
}

/// A small thing on the desk of a random cubicle.
fn clutter(boxes: &mut Boxes) {
    let cubicle = boxes.random.below(16);
    let bit = |k: u32| (cubicle >> k & 1) as u8;
    let (x, z) = (corner(bit(0), bit(1)), corner(bit(2), bit(3)));
    let mut unit = || boxes.random.unit();
    let (px, pz) = (x + 0.15 + 1.4 * unit(), z + 0.15 + 0.55 * unit());
    let (e, h) = (0.02 + 0.08 * unit(), 0.02 + 0.15 * unit());
    boxes.push(Part::Clutter, [px, 1.05, pz], [px + e, 1.05 + h, pz + e]);
}
