//! The pixels that a triangle covers, for what is not drawn into a target: the very pixels that it would get there, so
//! that an edge between the two kinds is drawn once, too.

use super::clip::{bounded, clip, doubled_area};
use super::guard::{GUARD_MAX, GUARD_MIN};
use super::pyramid::Rect;
use super::transform::ScreenFromObject;
use std::ops::Range;

/// The pixels of an image whose centres a triangle covers, by the fill rule.
pub(crate) struct Footprint {
    /// The triangle, or what clipping left of it.
    pieces: [Option<Piece>; 6],
}

#[derive(Clone, Copy)]
struct Piece {
    /// Snapped corners, 1/256 pixel, in the order that makes the doubled area positive.
    x: [i32; 3],
    y: [i32; 3],
    /// Pixels that may be covered; not empty.
    bounds: Rect,
}

impl Footprint {
    /// Of a triangle in object space, in an image of `size` (width, height). Empty where the triangle faces away and is
    /// not `two_sided`.
    pub fn new(
        corners: &[[f32; 3]; 3],
        at: &ScreenFromObject,
        two_sided: bool,
        size: (u32, u32),
    ) -> Footprint {
        let image = Rect { left: 0, top: 0, right: size.0 as i32, bottom: size.1 as i32 };
        let mut pieces = [None; 6];
        match snapped(corners, at) {
            Some(corners) => pieces[0] = whole(corners, at, two_sided, image),
            None => {
                let clipped = clip(corners, at, two_sided, image);
                for (piece, t) in pieces.iter_mut().zip(clipped.triangles()) {
                    *piece = Some(Piece { x: t.x, y: t.y, bounds: t.bounds });
                }
            }
        }
        Footprint { pieces }
    }

    /// Rows outside of which it has no pixels.
    pub fn rows(&self) -> Range<u32> {
        let bounds = || self.pieces.iter().flatten().map(|p| p.bounds);
        let first = bounds().map(|b| b.top as u32).min();
        first.map_or(0..0, |first| first..bounds().map(|b| b.bottom as u32).max().unwrap_or(first))
    }

    /// The columns of row `y` that it covers: none twice.
    pub fn columns(&self, y: u32) -> impl Iterator<Item = u32> {
        self.pieces.iter().flatten().flat_map(move |piece| piece.columns(y as i32))
    }
}

/// A triangle's corners, snapped as in setup; `None` if it must be clipped first.
fn snapped(corners: &[[f32; 3]; 3], at: &ScreenFromObject) -> Option<[[i32; 2]; 3]> {
    let mut all = [[0; 2]; 3];
    for (snapped, corner) in all.iter_mut().zip(corners) {
        let [x, y, w, d] = at.point(corner.map(f64::from));
        let scale = if at.perspective { 1.0 / w } else { 1.0 };
        for (to, v) in snapped.iter_mut().zip([x * scale, y * scale]) {
            // Written so that NaN is not inside.
            if !(d <= w && (GUARD_MIN * 256.0..=GUARD_MAX * 256.0).contains(&v)) {
                return None;
            }
            *to = v.round_ties_even() as i32;
        }
    }
    Some(all)
}

fn whole(corners: [[i32; 2]; 3], at: &ScreenFromObject, two_sided: bool, image: Rect) -> Option<Piece> {
    let area = doubled_area(corners);
    let is_front = (area > 0) == (at.front_sign > 0.0);
    if !(is_front || two_sided) {
        return None;
    }
    let (x, y, bounds) = bounded(corners, area > 0, image)?;
    Some(Piece { x, y, bounds })
}

impl Piece {
    fn columns(&self, row: i32) -> Range<u32> {
        if !(self.bounds.top..self.bounds.bottom).contains(&row) {
            return 0..0;
        }
        let (mut first, mut end) = (i64::from(self.bounds.left), i64::from(self.bounds.right));
        for k in 0..3 {
            let next = (k + 1) % 3;
            let (dx, dy) = (i64::from(self.x[next] - self.x[k]), i64::from(self.y[next] - self.y[k]));
            let owned = dy < 0 || (dy == 0 && dx > 0);
            let below = i64::from(256 * row + 128 - self.y[k]);
            let before = i64::from(128 - self.x[k]);
            // Inside, 256·dy·column is at most this.
            let most = dx * below - dy * before - i64::from(!owned);
            if dy > 0 {
                end = end.min(most.div_euclid(256 * dy) + 1);
            } else if dy < 0 {
                first = first.max(-most.div_euclid(-256 * dy));
            } else if most < 0 {
                return 0..0;
            }
        }
        if first < end { first as u32..end as u32 } else { 0..0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conventions::{Projection, View};
    use crate::raster::{Drawing, Target, TriangleBlock, draw_block, levels};
    use crate::reference::trouble::Random;
    use fearless_simd::{Simd, dispatch};
    use glam::{DAffine3, DVec3};

    const SIZE: (u32, u32) = (90, 70);

    fn drawn(corners: &[[f32; 3]; 3], at: &ScreenFromObject, two_sided: bool) -> Vec<(u32, u32)> {
        let mut block = TriangleBlock { lanes: 1, two_sided: u16::from(two_sided), ..TriangleBlock::EMPTY };
        for (to, from) in block.corner.iter_mut().flatten().zip(corners.as_flattened()) {
            to[0] = *from;
        }
        let mut target = Target::new(0, 0, SIZE.0, SIZE.1);
        let drawing = Drawing { instance: 0, at, hierarchical: false };
        dispatch!(levels()[0], simd => {
            simd.vectorize(
                #[inline(always)]
                || draw_block(simd, &mut target, &block, &drawing, &mut |_, _, _| false),
            );
        });
        let pixels = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y)));
        pixels.filter(|&(x, y)| target.surface_at(x, y).is_some()).collect()
    }

    #[test]
    fn it_is_what_would_be_drawn() {
        let random = &mut Random::new(3);
        let (mut covered, mut empty) = (0, 0);
        for round in 0..5_000u32 {
            let reach = [0.05, 0.5, 3.0, 400.0][round as usize % 4];
            let middle = random.point(2.0) - DVec3::Z * 2.5;
            let corners = [(); 3].map(|()| {
                let p = middle + random.point(reach);
                // Now and then on the corners and centres of pixels, where the fill rule decides.
                let p = if round % 5 == 0 { (p * 28.0).round() / 28.0 } else { p };
                p.as_vec3().to_array()
            });
            let projection = match round % 3 {
                0 => Projection::Orthographic { half_height: 1.25, near: -2.0, far: 1000.0 },
                _ => Projection::Perspective { fov_y: 1.2, near: 0.1 },
            };
            let view =
                View { view_from_world: DAffine3::IDENTITY, projection, width: SIZE.0, height: SIZE.1 };
            let mirror = DAffine3::from_scale(DVec3::new(if round % 7 == 0 { -1.0 } else { 1.0 }, 1.0, 1.0));
            let at = ScreenFromObject::of_view(&view).after(&mirror);
            let two_sided = random.one_in(2);
            let footprint = Footprint::new(&corners, &at, two_sided, SIZE);
            let rows = (0..SIZE.1).flat_map(|y| footprint.columns(y).map(move |x| (x, y)));
            let mut found: Vec<(u32, u32)> = rows.collect();
            found.sort_unstable_by_key(|&(x, y)| (y, x));
            assert_eq!(found, drawn(&corners, &at, two_sided), "round {round}: {corners:?}");
            assert!(found.iter().all(|(_, y)| footprint.rows().contains(y)), "round {round}");
            (covered, empty) = (covered + found.len(), empty + usize::from(found.is_empty()));
        }
        assert!(covered > 250_000 && empty > 250, "{covered} pixels, {empty} without any");
    }
}
