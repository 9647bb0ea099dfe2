//! Drawing less often: a layer's earlier picture, warped by an affine map [Snyder & Lengyel 1997, §12.2;
//! Lengyel & Snyder 1997].
//!
//! From the points of a layer where they were when it was drawn and where they are now, the affine map of the
//! picture that fits best is found (least squares), and by how many pixels it misses the worst of them.

use super::sprite::Sprite;
use crate::conventions::{Projection, View};
use glam::{DAffine2, DMat2, DMat3, DVec2, DVec3};
use std::collections::HashMap;

/// What layers looked like when they were drawn last, and where their points were.
#[derive(Debug, Default)]
pub struct Memory {
    kept: HashMap<Vec<u32>, Kept>,
}

#[derive(Debug)]
struct Kept {
    points: Vec<DVec2>,
    sprite: Sprite,
}

/// The points of a layer on the screen, pixels; `None` if one is not beyond the eye's near plane and before the far one,
/// if there is one, or lies outside of the picture, where an earlier picture would have been cut off.
pub fn on_screen(view: &View, points: impl IntoIterator<Item = DVec3>) -> Option<Vec<DVec2>> {
    let (width, height) = (f64::from(view.width), f64::from(view.height));
    let scale = view.pixels_per_unit();
    let place = |p: DVec3| {
        let p = view.view_from_world.transform_point3(p);
        let by = match view.projection {
            Projection::Perspective { near, .. } if -p.z > near => scale / -p.z,
            Projection::Perspective { .. } => return None,
            Projection::Orthographic { near, far, .. } if -p.z > near && -p.z < far => scale,
            Projection::Orthographic { .. } => return None,
        };
        let at = DVec2::new(width * 0.5 + p.x * by, height * 0.5 - p.y * by);
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x <= width && at.y <= height;
        inside.then_some(at)
    };
    points.into_iter().map(place).collect()
}

impl Memory {
    /// The map from a layer's last picture to the present one, if it misses none of its points by more than
    /// `budget_px`.
    pub fn recall(&self, parts: &[u32], now: Option<&[DVec2]>, budget_px: f64) -> Option<Fit> {
        let kept = self.kept.get(parts)?;
        let now = now.filter(|now| now.len() == kept.points.len())?;
        fit(&kept.points, now).filter(|fit| fit.error_px <= budget_px)
    }

    /// A layer's last picture.
    pub fn picture(&self, parts: &[u32]) -> Option<&Sprite> {
        self.kept.get(parts).map(|kept| &kept.sprite)
    }

    /// Keeps a picture that was drawn; without points it cannot be recalled.
    pub fn keep(&mut self, parts: &[u32], now: Option<Vec<DVec2>>, sprite: Sprite) {
        match now {
            Some(points) => self.kept.insert(parts.to_vec(), Kept { points, sprite }),
            None => self.kept.remove(parts),
        };
    }
}

/// An affine map of the picture and the largest distance, pixels, by which it misses a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// From the earlier picture to the present one.
    pub now_from_then: DAffine2,
    /// Pixels.
    pub error_px: f64,
}

/// The map that takes `then` to `now` best; `None` if there are fewer than three points or they lie on a line.
pub fn fit(then: &[DVec2], now: &[DVec2]) -> Option<Fit> {
    assert_eq!(then.len(), now.len(), "points in pairs");
    let mut normal = DMat3::ZERO;
    let (mut right_x, mut right_y) = (DVec3::ZERO, DVec3::ZERO);
    let middle = then.iter().sum::<DVec2>() / then.len().max(1) as f64;
    for (p, q) in then.iter().zip(now) {
        let row = (*p - middle).extend(1.0);
        normal += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
        right_x += row * q.x;
        right_y += row * q.y;
    }
    let spread = normal.x_axis.x + normal.y_axis.y;
    if then.len() < 3 || normal.determinant() <= 1e-12 * spread * spread * then.len() as f64 {
        return None;
    }
    let inverse = normal.inverse();
    let (x, y) = (inverse * right_x, inverse * right_y);
    let matrix2 = DMat2::from_cols(DVec2::new(x.x, y.x), DVec2::new(x.y, y.y));
    let now_from_then = DAffine2 { matrix2, translation: DVec2::new(x.z, y.z) - matrix2 * middle };
    let miss = |(p, q): (&DVec2, &DVec2)| now_from_then.transform_point2(*p).distance(*q);
    let error_px = then.iter().zip(now).map(miss).fold(0.0, f64::max);
    Some(Fit { now_from_then, error_px })
}

/// A sprite seen through an affine map of the picture, bilinear between pixels.
pub fn warp(sprite: &Sprite, now_from_then: &DAffine2, size: (u32, u32)) -> Sprite {
    if sprite.is_empty() || now_from_then.matrix2.determinant().abs() < 1e-12 {
        return Sprite::default();
    }
    // Between the outermost pixels and what is transparent around them it fades over half a pixel beyond the edge.
    let (x0, y0) = (f64::from(sprite.x) - 0.5, f64::from(sprite.y) - 0.5);
    let (x1, y1) = (x0 + f64::from(sprite.width) + 1.0, y0 + f64::from(sprite.height) + 1.0);
    let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)]
        .map(|(x, y)| now_from_then.transform_point2(DVec2::new(x, y)));
    let least = corners.iter().fold(DVec2::INFINITY, |m, c| m.min(*c)).floor() - 1.0;
    let most = corners.iter().fold(DVec2::NEG_INFINITY, |m, c| m.max(*c)).ceil() + 1.0;
    let limit = DVec2::new(f64::from(size.0), f64::from(size.1));
    let (least, most) = (least.clamp(DVec2::ZERO, limit), most.clamp(DVec2::ZERO, limit));
    let (x, y) = (least.x as u32, least.y as u32);
    let (width, height) = (most.x as u32 - x, most.y as u32 - y);
    let back = now_from_then.inverse();
    let pixels = (0..height).flat_map(|row| {
        (0..width).map(move |column| {
            let centre = DVec2::new(f64::from(x + column) + 0.5, f64::from(y + row) + 0.5);
            sample(sprite, back.transform_point2(centre) - 0.5)
        })
    });
    Sprite { x, y, width, height, pixels: pixels.collect() }
}

fn sample(sprite: &Sprite, at: DVec2) -> [f32; 4] {
    let corner = at.floor();
    let (fx, fy) = ((at.x - corner.x) as f32, (at.y - corner.y) as f32);
    let pixel = |dx: f64, dy: f64| {
        let (x, y) = (corner.x + dx, corner.y + dy);
        if x < 0.0 || y < 0.0 { [0.0; 4] } else { sprite.at(x as u32, y as u32) }
    };
    let mut sum = [0.0; 4];
    let weights = [
        (0.0, 0.0, (1.0 - fx) * (1.0 - fy)),
        (1.0, 0.0, fx * (1.0 - fy)),
        (0.0, 1.0, (1.0 - fx) * fy),
        (1.0, 1.0, fx * fy),
    ];
    for (dx, dy, weight) in weights {
        if weight > 0.0 {
            sum.iter_mut().zip(pixel(dx, dy)).for_each(|(s, c)| *s += c * weight);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_affine_motion_is_found_and_another_is_measured() {
        let then: Vec<DVec2> = [(0.0, 0.0), (10.0, 1.0), (3.0, 8.0), (7.0, 7.0)]
            .map(|(x, y)| DVec2::new(x + 300.0, y + 200.0))
            .into();
        let map = DAffine2 {
            matrix2: DMat2::from_cols(DVec2::new(1.1, 0.2), DVec2::new(-0.1, 0.9)),
            translation: DVec2::new(5.0, -3.0),
        };
        let now: Vec<DVec2> = then.iter().map(|&p| map.transform_point2(p)).collect();
        let found = fit(&then, &now).unwrap();
        assert!(found.error_px < 1e-9, "{found:?}");
        let mut bent = now.clone();
        bent[2].x += 2.0;
        let error = fit(&then, &bent).unwrap().error_px;
        assert!(error > 0.2 && error < 2.0, "{error}");
        assert!(fit(&then[..2], &now[..2]).is_none());
        assert!(fit(&[DVec2::ZERO, DVec2::X, DVec2::X * 2.0], &[DVec2::ZERO; 3]).is_none());
    }

    #[test]
    fn moving_by_whole_pixels_moves_pixels() {
        let pixels: Vec<[f32; 4]> = (1..=6).map(|i| [i as f32 / 8.0, 0.5, 0.25, 1.0]).collect();
        let sprite = Sprite { x: 4, y: 5, width: 3, height: 2, pixels };
        let moved = warp(&sprite, &DAffine2::from_translation(DVec2::new(-2.0, 3.0)), (20, 20));
        for y in 0..20 {
            for x in 0..20 {
                let from = if y >= 3 { sprite.at(x + 2, y - 3) } else { [0.0; 4] };
                assert_eq!(moved.at(x, y), from);
            }
        }
    }

    #[test]
    fn what_grows_fades_at_its_edges() {
        let sprite = Sprite { x: 1, y: 1, width: 1, height: 1, pixels: vec![[1.0; 4]] };
        let grown = warp(&sprite, &DAffine2::from_scale(DVec2::splat(8.0)), (24, 24));
        for y in 0..24 {
            for x in 0..24 {
                let [dx, dy] = [x, y].map(|at: u32| (f64::from(at) + 0.5 - 12.0).abs() / 8.0);
                let expected = (1.0 - dx).max(0.0) * (1.0 - dy).max(0.0);
                assert!((f64::from(grown.at(x, y)[3]) - expected).abs() < 1e-6, "({x}, {y})");
            }
        }
    }

    #[test]
    fn what_a_plane_of_the_view_may_cut_is_nowhere_on_the_screen() {
        let perspective = Projection::Perspective { fov_y: 1.0, near: 1.0 };
        let orthographic = Projection::Orthographic { half_height: 2.0, near: 1.0, far: 5.0 };
        for (projection, far_is_seen) in [(perspective, true), (orthographic, false)] {
            let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, (40, 40));
            let seen = |z: f64| on_screen(&view, [DVec3::new(0.1, 0.2, -2.0), DVec3::NEG_Z * z]).is_some();
            assert_eq!([0.5, 1.5, 4.9, 5.5].map(seen), [false, true, true, far_is_seen]);
        }
    }
}
