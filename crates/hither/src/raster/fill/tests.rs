//! The pyramid saves work and nothing else, for triangles that tempt its bounds.

use super::*;
use crate::conventions::{Projection, View};
use crate::raster::levels;
use crate::reference::trouble::Random;
use fearless_simd::{Level, dispatch};
use glam::DAffine3;

const SIDE: u32 = 128;
const NEAR: f64 = 0.001;

fn view() -> View {
    let projection = Projection::Perspective { fov_y: 1.0, near: NEAR };
    View { view_from_world: DAffine3::IDENTITY, projection, width: SIDE, height: SIDE }
}

/// The point that the view shows at a place of the image, pixels, so many metres away.
fn point(place: [f64; 2], distance: f64) -> [f32; 3] {
    let (half, scale) = (f64::from(SIDE) / 2.0, distance / view().pixels_per_unit());
    [((place[0] - half) * scale) as f32, ((half - place[1]) * scale) as f32, -distance as f32]
}

fn block_of(triangles: &[[[f32; 3]; 3]]) -> TriangleBlock {
    let mut block = TriangleBlock::EMPTY;
    for (lane, corners) in triangles.iter().enumerate() {
        for (k, p) in corners.iter().enumerate() {
            (0..3).for_each(|axis| block.corner[k][axis][lane] = p[axis]);
        }
        block.triangle[lane] = lane as u32;
        block.lanes |= 1 << lane;
    }
    TriangleBlock { two_sided: 0xFFFF, ..block }
}

/// A needle that points to the left and away from the eye, and ends just before a wall, at the centre of a pixel, up to
/// snapping: the rule for corners gives it that pixel, where its plane, which rises towards the eye as steeply as can
/// be, may be far below its farthest corner. The pixel is the corner of its block, so that the plane is nowhere in the
/// block above that.
fn needle(random: &mut Random, wall: f64) -> [[f32; 3]; 3] {
    let mut ends = [1.0, -1.0].map(|down| {
        let (length, angle) = (random.between(10.0, 25.0), random.between(0.03, 0.4) * down);
        ([length * angle.cos(), length * angle.sin()], 10f64.powf(random.between(-2.5, 0.5)))
    });
    let [([x1, y1], d1), ([x2, y2], d2)] =
        ends.map(|(place, distance)| (place, distance.recip() - wall.recip()));
    let rises_downwards = (d2 * x1 - d1 * x2) / (x1 * y2 - x2 * y1) > 0.0;
    let [column, row] = [3.5, if rises_downwards { 3.5 } else { 0.5 }]
        .map(|pixel| f64::from(4 * (8 + random.below(12))) + pixel + random.between(-1.0, 1.0) / 600.0);
    ends.iter_mut().for_each(|(place, _)| *place = [place[0] + column, place[1] + row]);
    let gap = 10f64.powf(random.between(-6.5, -1.0));
    [point([column, row], wall * (1.0 - gap)), point(ends[0].0, ends[0].1), point(ends[1].0, ends[1].1)]
}

fn drawn(level: Level, blocks: &[TriangleBlock], hierarchical: bool) -> Target {
    let mut target = Target::new(0, 0, SIDE, SIDE);
    let at = &ScreenFromObject::of_view(&view());
    for (instance, block) in blocks.iter().enumerate() {
        let drawing = Drawing { instance: instance as u32, at, hierarchical };
        dispatch!(level, simd => {
            simd.vectorize(
                #[inline(always)]
                || draw_block(simd, &mut target, block, &drawing, &mut |_, _, _| false),
            );
        });
    }
    target
}

#[test]
fn a_needle_that_ends_just_before_a_wall_is_drawn() {
    let random = &mut Random::new(11);
    let mut written = 0;
    for round in 0..150 {
        let wall = 10.0;
        let corner = |x: f64, y: f64| point([x * f64::from(SIDE), y * f64::from(SIDE)], wall);
        let walls = [
            [corner(-1.0, -1.0), corner(3.0, -1.0), corner(-1.0, 3.0)],
            [corner(3.0, -1.0), corner(3.0, 3.0), corner(-1.0, 3.0)],
        ];
        let needles: Vec<_> = (0..16).map(|_| needle(random, wall)).collect();
        let blocks = [block_of(&walls), block_of(&needles)];
        for level in levels() {
            let [hzb, plain] = [true, false].map(|hierarchical| drawn(level, &blocks, hierarchical));
            for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
                let of = |target: &Target| (target.surface_at(x, y), target.depth_at(x, y).to_bits());
                assert_eq!(of(&hzb), of(&plain), "pixel ({x}, {y}) of round {round}");
                written += u32::from(plain.surface_at(x, y).is_some_and(|s| s.instance == 1));
            }
        }
    }
    assert!(written > 10_000, "{written} pixels");
}
