//! The rectangle test against every pixel of the rectangle.

use super::*;
use crate::conventions::{Projection, View};
use crate::raster::{Drawing, ScreenFromObject, TriangleBlock, draw_block, levels};
use glam::DAffine3;

/// Numbers that follow from a seed (a linear congruential generator's high bits).
struct Random(u64);

impl Random {
    fn below(&mut self, n: i32) -> i32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as i32
    }
}

/// Draws sixteen triangles of about `size` pixels, from 1 to 9 metres away, anywhere in the window.
fn draw_some(target: &mut Target, level: Level, size: i32, random: &mut Random) {
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.5 };
    let (width, height) = (target.width as u32, target.height as u32);
    let view = View { view_from_world: DAffine3::IDENTITY, projection, width, height };
    let mut block = TriangleBlock { lanes: 0xFFFF, two_sided: 0xFFFF, ..TriangleBlock::EMPTY };
    for lane in 0..16 {
        let at = [random.below(width as i32), random.below(height as i32)];
        for k in 0..3 {
            let distance = 1.0 + random.below(80) as f64 / 10.0;
            let pixel = at.map(|p| f64::from(p + random.below(size) - size / 2));
            let scale = distance / view.pixels_per_unit();
            block.corner[k][0][lane] = ((pixel[0] - f64::from(width) / 2.0) * scale) as f32;
            block.corner[k][1][lane] = ((f64::from(height) / 2.0 - pixel[1]) * scale) as f32;
            block.corner[k][2][lane] = -distance as f32;
        }
    }
    let drawing = Drawing { instance: 0, at: &ScreenFromObject::of_view(&view), hierarchical: true };
    dispatch!(level, simd => {
        simd.vectorize(
            #[inline(always)]
            || draw_block(simd, target, &block, &drawing, &mut |_, _, _| false),
        );
    });
}

/// A rectangle that meets the window, now and then reaching beyond it.
fn some_rectangle(target: &Target, random: &mut Random) -> Rect {
    let most = 1 << random.below(9);
    let (left, top) = (random.below(target.width + 8) - 4, random.below(target.height + 8) - 4);
    Rect { left, top, right: left + 1 + random.below(most), bottom: top + 1 + random.below(most) }
}

fn nothing_shows(target: &Target, rect: Rect, depth: f32) -> bool {
    let columns = || rect.left.max(0)..rect.right.min(target.width);
    (rect.top.max(0)..rect.bottom.min(target.height))
        .all(|y| columns().all(|x| target.depth_at(x as u32, y as u32) > depth))
}

#[test]
fn a_rectangle_is_hidden_exactly_where_all_its_pixels_are() {
    let mut random = Random(1);
    let mut hidden = 0;
    for (width, height) in [(1, 1), (17, 5), (64, 64), (203, 90), (500, 333)] {
        for level in levels() {
            let mut target = Target::new(0, 0, width, height);
            for size in [900, 200, 40, 9] {
                draw_some(&mut target, level, size, &mut random);
                for _ in 0..400 {
                    let rect = some_rectangle(&target, &mut random);
                    // Depths that occur, and some between.
                    let from = [random.below(width as i32) as u32, random.below(height as i32) as u32];
                    let depth = match random.below(3) {
                        0 => random.below(100) as f32 / 200.0,
                        _ => target.depth_at(from[0], from[1]),
                    };
                    let expected = nothing_shows(&target, rect, depth);
                    let found = target.is_hidden(level, rect, depth);
                    assert_eq!(found, expected, "{rect:?} at {depth} of {width}x{height}");
                    hidden += u32::from(found);
                }
            }
        }
    }
    assert!(hidden > 1000, "{hidden} rectangles were hidden: too few to tell");
}
