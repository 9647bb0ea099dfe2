//! The other meaning of hidden: as a GPU that draws at this resolution would see it.

use super::{Boxes, Occluder, Verdict};
use crate::conventions::{SurfaceId, View, ViewError};
use crate::geometry::Aabb;
use crate::raster::{
    BoxSet, Drawing, ProjectedBoxes, Rect, ScreenFromObject, Target, TriangleBlock, draw_block, project_boxes,
};
use fearless_simd::{Level, Simd, dispatch};
use glam::DAffine3;

/// A buffer of samples at pixel centres, exact in the sense of the rasteriser: for those who draw at the same
/// resolution. [`Verdict::Hidden`] means that at no pixel centre it would be drawn; between centres it may show.
///
/// Asking takes `&mut self`: minima are brought up to date when they are asked for.
#[derive(Debug)]
pub struct SampledBuffer {
    view: View,
    screen_from_world: ScreenFromObject,
    target: Target,
    level: Level,
    drawn: u32,
}

impl SampledBuffer {
    /// An empty buffer for `view`, of its size.
    pub fn new(view: &View) -> Result<SampledBuffer, ViewError> {
        view.validate()?;
        Ok(SampledBuffer {
            view: *view,
            screen_from_world: ScreenFromObject::of_view(view),
            target: Target::new(0, 0, view.width, view.height),
            level: Level::new(),
            drawn: 0,
        })
    }

    /// Makes the buffer empty.
    pub fn clear(&mut self) {
        self.target.clear();
        self.drawn = 0;
    }

    /// Draws an occluder: its faces as a rasteriser would, culling those that turn away.
    pub fn draw(&mut self, occluder: &Occluder, world_from_object: &DAffine3) {
        let at = self.screen_from_world.after(world_from_object);
        let drawing = Drawing { instance: self.drawn, at: &at, hierarchical: true };
        self.drawn += 1;
        let target = &mut self.target;
        let mut block = TriangleBlock::EMPTY;
        let mut lane = 0;
        for (number, (corners, two_sided)) in occluder.triangles().enumerate() {
            for (k, p) in corners.into_iter().enumerate() {
                for (axis, coordinate) in p.into_iter().enumerate() {
                    block.corner[k][axis][lane] = coordinate;
                }
            }
            block.triangle[lane] = number as u32;
            block.lanes |= 1 << lane;
            block.two_sided |= u16::from(two_sided) << lane;
            lane += 1;
            if lane == 16 {
                dispatch!(self.level, simd => draw_block(simd, target, &block, &drawing, &mut |_, _, _| false));
                (block, lane) = (TriangleBlock::EMPTY, 0);
            }
        }
        if lane > 0 {
            dispatch!(self.level, simd => draw_block(simd, target, &block, &drawing, &mut |_, _, _| false));
        }
    }

    /// Asks about many boxes of world space: one verdict each, in their order, into `verdicts`.
    pub fn ask(&mut self, boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        let reach = boxes.reach();
        let set = BoxSet::new(&self.screen_from_world, reach);
        let (target, level) = (&mut self.target, self.level);
        dispatch!(level, simd => ask(simd, target, &set, boxes, verdicts));
        verdicts.truncate(boxes.len());
    }

    /// Asks about one box.
    pub fn ask_box(&mut self, bounds: &Aabb) -> Verdict {
        let mut verdicts = Vec::new();
        self.ask(&Boxes::from_iter([*bounds]), &mut verdicts);
        verdicts[0]
    }

    /// Depth of the nearest surface at a pixel's centre; 0 where there is none.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        self.target.depth_at(x, y)
    }

    /// Number of the occluder, in the order of drawing, that is nearest at a pixel's centre.
    pub fn occluder(&self, x: u32, y: u32) -> Option<u32> {
        self.target.surface_at(x, y).map(|SurfaceId { instance, .. }| instance)
    }

    /// The view it was made for.
    pub fn view(&self) -> &View {
        &self.view
    }
}

#[inline(always)]
fn ask<S: Simd>(simd: S, target: &mut Target, set: &BoxSet, boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
    let window = target.bounds();
    let mut at = ProjectedBoxes::default();
    for sixteen in &boxes.sixteen {
        let boxes = &mut at;
        simd.vectorize(
            #[inline(always)]
            || project_boxes(simd, set, &sixteen.min, &sixteen.max, window, boxes),
        );
        for lane in 0..16 {
            let rect = Rect {
                left: at.left[lane],
                top: at.top[lane],
                right: at.right[lane] + 1,
                bottom: at.bottom[lane] + 1,
            };
            verdicts.push(if !sixteen.is_box(lane) {
                Verdict::Visible
            } else if at.alive >> lane & 1 == 0 {
                Verdict::Outside
            } else if target.hides(simd, rect, at.depth[lane]) {
                Verdict::Hidden
            } else {
                Verdict::Visible
            });
        }
    }
}
