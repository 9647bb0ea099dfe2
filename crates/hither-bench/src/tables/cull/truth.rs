//! Which boxes are truly hidden, by 4×4 samples a pixel: a box is seen if at one sample its front is at least as
//! near as the nearest surface.

use glam::DVec3;
use hither::SceneIndex;
use hither::conventions::{Projection, View};
use hither::geometry::Aabb;
use hither::render::{Frame, RenderOptions, render};

/// Samples along each side of a pixel.
const SIDE: u32 = 4;

/// For each box whether no sample shows it.
pub(super) fn hidden(index: &SceneIndex, view: &View, boxes: &[Aabb]) -> Result<Vec<bool>, String> {
    let fine = View { width: view.width * SIDE, height: view.height * SIDE, ..*view };
    let frame = render(index, &fine, &RenderOptions::default()).map_err(|e| e.to_string())?;
    let depths = Depths::new(&frame);
    Ok(boxes.iter().map(|b| !depths.shows(b)).collect())
}

/// Distances along the view axis, and for each block of samples the farthest.
struct Depths {
    view: View,
    distance: Vec<f32>,
    farthest: Vec<f32>,
    columns: usize,
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
        let mut farthest = vec![0.0f32; columns * height.div_ceil(BLOCK)];
        for y in 0..height {
            for x in 0..width {
                let block = &mut farthest[y / BLOCK * columns + x / BLOCK];
                *block = block.max(distance[y * width + x]);
            }
        }
        Depths { view, distance, farthest, columns }
    }

    fn shows(&self, b: &Aabb) -> bool {
        let view = &self.view;
        let Projection::Perspective { near, .. } = view.projection else { return true };
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            let p =
                DVec3::new(pick(0, b.min.x, b.max.x), pick(1, b.min.y, b.max.y), pick(2, b.min.z, b.max.z));
            view.view_from_world.transform_point3(p)
        });
        let corners: Vec<DVec3> = corners.collect();
        if corners.iter().all(|p| -p.z < near) {
            return false;
        }
        let crosses = corners.iter().any(|p| -p.z < near);
        let scale = view.pixels_per_unit();
        let (w, h) = (f64::from(view.width), f64::from(view.height));
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
        self.shows_in(b, rect, nearest)
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
