//! Which boxes are truly hidden, by 4×4 samples a pixel: a box is seen if at one sample its front is at least as
//! near as the nearest surface. And which would be found hidden by an ideal image, which holds in each pixel the
//! farthest of its samples: asked about rectangles and the nearest depth in them, as buffers are, no conservative one of
//! so many pixels hides more.

use glam::DVec3;
use hither::SceneIndex;
use hither::conventions::{Projection, View};
use hither::geometry::Aabb;
use hither::render::{Frame, RenderOptions, render};

/// Samples along each side of a pixel.
const SIDE: u32 = 4;

/// What is so of a box.
pub(super) struct Truth {
    /// No sample shows it.
    pub is_hidden: bool,
    /// Nor does an ideal image.
    pub is_found: bool,
}

/// The truth about each box.
pub(super) fn of_boxes(index: &SceneIndex, view: &View, boxes: &[Aabb]) -> Result<Vec<Truth>, String> {
    let fine = View { width: view.width * SIDE, height: view.height * SIDE, ..*view };
    let frame = render(index, &fine, &RenderOptions::default()).map_err(|e| e.to_string())?;
    let depths = Depths::new(&frame);
    Ok(boxes.iter().map(|b| depths.truth_about(b)).collect())
}

/// Distances along the view axis, and for each block of samples, and for each pixel, the farthest.
struct Depths {
    view: View,
    distance: Vec<f32>,
    farthest: Vec<f32>,
    columns: usize,
    ideal: Vec<f32>,
}

const BLOCK: usize = 16;

impl Depths {
    fn new(frame: &Frame) -> Depths {
        let view = frame.view;
        let (width, height) = (view.width as usize, view.height as usize);
        let mut distance = Vec::with_capacity(width * height);
        for y in 0..view.height {
            distance.extend((0..view.width).map(|x| frame.distance(x, y) as f32));
        }
        let columns = width.div_ceil(BLOCK);
        let farthest_of = |side: usize| {
            let columns = width.div_ceil(side);
            let mut farthest = vec![0.0f32; columns * height.div_ceil(side)];
            for (y, row) in distance.chunks_exact(width).enumerate() {
                for (x, distance) in row.iter().enumerate() {
                    let block = &mut farthest[y / side * columns + x / side];
                    *block = block.max(*distance);
                }
            }
            farthest
        };
        let (farthest, ideal) = (farthest_of(BLOCK), farthest_of(SIDE as usize));
        Depths { view, distance, farthest, columns, ideal }
    }

    fn truth_about(&self, b: &Aabb) -> Truth {
        let Some((rect, nearest)) = self.place(b) else { return Truth { is_hidden: true, is_found: true } };
        let is_hidden = !self.shows_in(b, rect, nearest);
        Truth { is_hidden, is_found: is_hidden && !self.ideal_shows(rect, nearest) }
    }

    /// The rectangle of samples around a box, and no more than the distance of its nearest point; nothing for what is
    /// before the near plane.
    fn place(&self, b: &Aabb) -> Option<([f64; 4], f64)> {
        let view = &self.view;
        let (w, h) = (f64::from(view.width), f64::from(view.height));
        let Projection::Perspective { near, .. } = view.projection else {
            return Some(([0.0, 0.0, w, h], 0.0));
        };
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            let p =
                DVec3::new(pick(0, b.min.x, b.max.x), pick(1, b.min.y, b.max.y), pick(2, b.min.z, b.max.z));
            view.view_from_world.transform_point3(p)
        });
        let corners: Vec<DVec3> = corners.collect();
        if corners.iter().all(|p| -p.z < near) {
            return None;
        }
        let crosses = corners.iter().any(|p| -p.z < near);
        let scale = view.pixels_per_unit();
        let mut rect = [0.0, 0.0, w, h];
        let mut nearest = near;
        if !crosses {
            let x = || corners.iter().map(|p| p.x / -p.z * scale + w * 0.5);
            let y = || corners.iter().map(|p| -p.y / -p.z * scale + h * 0.5);
            rect = [
                x().fold(w, f64::min),
                y().fold(h, f64::min),
                x().fold(0.0, f64::max),
                y().fold(0.0, f64::max),
            ];
            nearest = corners.iter().map(|p| -p.z).fold(f64::INFINITY, f64::min);
        }
        Some((rect, nearest))
    }

    /// Whether a pixel that a rectangle meets holds something that is not nearer.
    fn ideal_shows(&self, [left, top, right, bottom]: [f64; 4], nearest: f64) -> bool {
        let (width, height) = (self.view.width / SIDE, self.view.height / SIDE);
        let pixel = |v: f64, size: u32| ((v / f64::from(SIDE)).max(0.0) as u32).min(size - 1);
        let columns = pixel(left, width)..=pixel(right, width);
        let mut rows = pixel(top, height)..=pixel(bottom, height);
        rows.any(|y| columns.clone().any(|x| f64::from(self.ideal[(y * width + x) as usize]) >= nearest))
    }

    /// Whether a sample in a rectangle shows a box that is nowhere nearer than `nearest`.
    fn shows_in(&self, b: &Aabb, rect: [f64; 4], nearest: f64) -> bool {
        let (width, height) = (self.view.width as usize, self.view.height as usize);
        let first = |v: f64| (v - 0.5).ceil().max(0.0) as usize;
        let last = |v: f64, size: usize| ((v - 0.5).floor() + 1.0).clamp(0.0, size as f64) as usize;
        let (left, right) = (first(rect[0]), last(rect[2], width));
        let (top, bottom) = (first(rect[1]), last(rect[3], height));
        if left >= right {
            return false;
        }
        let eye = self.view.eye_in_world();
        let world_from_view = self.view.view_from_world.inverse();
        let scale = self.view.pixels_per_unit();
        for y in top..bottom {
            for block in left / BLOCK..=(right - 1) / BLOCK {
                if f64::from(self.farthest[y / BLOCK * self.columns + block]) < nearest {
                    continue;
                }
                for x in (block * BLOCK).max(left)..((block + 1) * BLOCK).min(right) {
                    let surface = f64::from(self.distance[y * width + x]);
                    if surface < nearest {
                        continue;
                    }
                    let across = (x as f64 + 0.5 - width as f64 * 0.5) / scale;
                    let up = (height as f64 * 0.5 - (y as f64 + 0.5)) / scale;
                    let direction = world_from_view.transform_vector3(DVec3::new(across, up, -1.0));
                    if entry(b, eye, direction).is_some_and(|d| d <= surface) {
                        return true;
                    }
                }
            }
        }
        false
    }
}

/// How far along a ray, in multiples of its direction, it enters a box.
fn entry(b: &Aabb, origin: DVec3, direction: DVec3) -> Option<f64> {
    let (low, high) = ((b.min - origin) / direction, (b.max - origin) / direction);
    let (enter, leave) = (low.min(high).max_element(), low.max(high).min_element());
    (enter <= leave && leave >= 0.0).then_some(enter)
}
