//! The other meaning of hidden: as a GPU that draws at this resolution would see it.

use super::queries::is_beyond;
use super::{Ball, Boxes, CannotMerge, Occludee, Occluder, PlacedMesh, ScreenRect, Verdict};
use crate::conventions::{SurfaceId, View, ViewError};
use crate::geometry::Aabb;
use crate::raster::{
    BoxSet, Drawing, ProjectedBoxes, Rect, ScreenFromObject, TILE, Target, TriangleBlock, draw_block,
    project_boxes,
};
use fearless_simd::{Level, Simd, dispatch};
use glam::{DAffine3, DVec3};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A buffer of samples at pixel centres, exact in the sense of the rasteriser: for those who draw at the same
/// resolution. [`Verdict::Hidden`] means that at no pixel centre it would be drawn; between centres it may show.
///
/// Drawing and asking take `&self`: several threads may do both at once. The image is cut into bands, each with a
/// lock of its own, held also while it is asked, for minima are brought up to date when they are asked for.
#[derive(Debug)]
pub struct SampledBuffer {
    view: View,
    screen_from_world: ScreenFromObject,
    /// How many bands were asked for.
    wanted: usize,
    /// Rows of each band but the last.
    rows: u32,
    bands: Vec<Mutex<Target>>,
    pub(super) level: Level,
    drawn: AtomicU32,
}

impl SampledBuffer {
    /// An empty buffer for `view`, of its size, in one band: for one thread.
    pub fn new(view: &View) -> Result<SampledBuffer, ViewError> {
        SampledBuffer::in_bands(view, 1)
    }

    /// The same in about `bands` bands; a few for each thread are good. What is drawn is set up anew in each.
    pub fn in_bands(view: &View, bands: usize) -> Result<SampledBuffer, ViewError> {
        view.validate()?;
        let rows = view.height.div_ceil(bands.clamp(1, 256) as u32).next_multiple_of(TILE);
        let band = |top: u32| Mutex::new(Target::new(0, top, view.width, rows.min(view.height - top)));
        Ok(SampledBuffer {
            view: *view,
            screen_from_world: ScreenFromObject::of_view(view),
            wanted: bands,
            rows,
            bands: (0..view.height).step_by(rows as usize).map(band).collect(),
            level: Level::new(),
            drawn: AtomicU32::new(0),
        })
    }

    /// Makes the buffer empty.
    pub fn clear(&mut self) {
        for band in &mut self.bands {
            band.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
        }
        *self.drawn.get_mut() = 0;
    }

    /// Makes it empty and looks from elsewhere; with another size than before it is made anew, in as many bands.
    pub fn look(&mut self, view: &View) -> Result<(), ViewError> {
        if (self.view.width, self.view.height) != (view.width, view.height) {
            *self = SampledBuffer::in_bands(view, self.wanted)?;
            return Ok(());
        }
        view.validate()?;
        (self.view, self.screen_from_world) = (*view, ScreenFromObject::of_view(view));
        self.clear();
        Ok(())
    }

    /// Draws an occluder: its faces as a rasteriser would, culling those that turn away. Returns its number, which
    /// counts up from 0 in the order of the calls.
    pub fn draw(&self, occluder: &Occluder, world_from_object: &DAffine3) -> u32 {
        let number = self.drawn.fetch_add(1, Ordering::Relaxed);
        let at = self.screen_from_world.after(world_from_object);
        let drawing = Drawing { instance: number, at: &at, hierarchical: true };
        for band in &self.bands {
            self.draw_into(&mut lock(band), occluder, &drawing);
        }
        number
    }

    fn draw_into(&self, target: &mut Target, occluder: &Occluder, drawing: &Drawing) {
        let mut block = TriangleBlock::EMPTY;
        let mut lane = 0;
        let mut draw = |block: &TriangleBlock| {
            dispatch!(self.level, simd => draw_block(simd, target, block, drawing, &mut |_, _, _| false));
        };
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
                draw(&block);
                (block, lane) = (TriangleBlock::EMPTY, 0);
            }
        }
        if lane > 0 {
            draw(&block);
        }
    }

    /// Adds what another buffer of the same view, in as many bands, holds, as if its occluders had been drawn after
    /// those that are here: number k of the other becomes k plus how many were drawn here.
    pub fn merge(&mut self, other: &SampledBuffer) -> Result<(), CannotMerge> {
        if self.view != other.view || self.rows != other.rows {
            return Err(CannotMerge);
        }
        let theirs = other.locked();
        let first = self.drawn.get_mut();
        for (band, theirs) in self.bands.iter_mut().zip(&theirs) {
            band.get_mut().unwrap_or_else(PoisonError::into_inner).merge(theirs, *first);
        }
        *first += other.drawn.load(Ordering::Relaxed);
        Ok(())
    }

    /// Asks about many boxes of world space: one verdict each, in their order, into `verdicts`.
    pub fn ask(&self, boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        self.ask_bands(&mut self.locked(), boxes, verdicts);
    }

    /// Asks about one box.
    pub fn ask_box(&self, bounds: &Aabb) -> Verdict {
        let mut verdicts = Vec::new();
        self.ask(&Boxes::from_iter([*bounds]), &mut verdicts);
        verdicts[0]
    }

    /// Asks about a ball. A radius or centre that is no finite number is never hidden.
    pub fn ask_sphere(&self, center: DVec3, radius: f64) -> Verdict {
        self.judge_ball(&mut self.locked(), &Ball { center, radius })
    }

    /// Asks about many balls: one verdict each, in their order, into `verdicts`.
    pub fn ask_balls(&self, balls: &[Ball], verdicts: &mut Vec<Verdict>) {
        let bands = &mut self.locked();
        verdicts.clear();
        verdicts.extend(balls.iter().map(|ball| self.judge_ball(bands, ball)));
    }

    /// Asks about a rectangle of the screen: the pixels whose centres lie in it, or no farther from it than snapping
    /// to 1/256 pixel could move them. One without any is outside.
    pub fn ask_rect(&self, rect: &ScreenRect) -> Verdict {
        self.judge_rect(&mut self.locked(), rect)
    }

    /// Asks about many rectangles of the screen: one verdict each, in their order, into `verdicts`.
    pub fn ask_rects(&self, rects: &[ScreenRect], verdicts: &mut Vec<Verdict>) {
        let bands = &mut self.locked();
        verdicts.clear();
        verdicts.extend(rects.iter().map(|rect| self.judge_rect(bands, rect)));
    }

    /// Asks about another mesh: hidden if the boxes around its triangles are. Finer than a box around it.
    pub fn ask_mesh(&self, mesh: &Occludee, world_from_object: &DAffine3) -> Verdict {
        let bands = &mut self.locked();
        mesh.judge(world_from_object, |boxes, verdicts| self.ask_bands(bands, boxes, verdicts))
    }

    /// Asks about many meshes: one verdict each, in their order, into `verdicts`.
    pub fn ask_meshes(&self, meshes: &[PlacedMesh], verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        verdicts.extend(meshes.iter().map(|one| self.ask_mesh(one.mesh, &one.world_from_object)));
    }

    fn ask_bands(&self, bands: &mut [MutexGuard<Target>], boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        verdicts.clear();
        let set = BoxSet::new(&boxes.screen_from_boxes(&self.screen_from_world), boxes.reach());
        let image = Rect { left: 0, top: 0, right: self.view.width as i32, bottom: self.view.height as i32 };
        dispatch!(self.level, simd => ask(simd, bands, image, &set, boxes, verdicts));
        verdicts.truncate(boxes.len());
    }

    fn judge_ball(&self, bands: &mut [MutexGuard<Target>], ball: &Ball) -> Verdict {
        match ball.on_screen(&self.view, None) {
            // As much nearer as the rasteriser's rounding could make it.
            Ok(rect) => self.judge_rect(bands, &ScreenRect { depth: rect.depth * 1.000_001, ..rect }),
            Err(verdict) => verdict,
        }
    }

    fn judge_rect(&self, bands: &mut [MutexGuard<Target>], rect: &ScreenRect) -> Verdict {
        let ScreenRect { left, top, right, bottom, depth } = *rect;
        if !(left <= right && top <= bottom) || depth.is_nan() {
            return Verdict::Visible;
        }
        const SNAP: f64 = 1.0 / 256.0;
        let first = |v: f64| (v - 0.5 - SNAP).ceil().max(0.0) as i32;
        let end = |v: f64, size: u32| (v - 0.5 + SNAP).floor().min(f64::from(size) - 1.0) as i32 + 1;
        let rect = Rect {
            left: first(left),
            top: first(top),
            right: end(right, self.view.width),
            bottom: end(bottom, self.view.height),
        };
        if rect.left >= rect.right || rect.top >= rect.bottom || is_beyond(&self.view, depth, 0.0) {
            return Verdict::Outside;
        }
        let hidden = dispatch!(self.level, simd => hides(simd, bands, rect, depth));
        if hidden { Verdict::Hidden } else { Verdict::Visible }
    }

    /// Depth of the nearest surface at a pixel's centre; 0 where there is none.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        lock(&self.bands[(y / self.rows) as usize]).depth_at(x, y % self.rows)
    }

    /// All depths, row by row.
    pub fn depths(&self) -> Vec<f32> {
        let bands = self.locked();
        let pixels = (0..self.view.height).flat_map(|y| (0..self.view.width).map(move |x| (x, y)));
        pixels.map(|(x, y)| bands[(y / self.rows) as usize].depth_at(x, y % self.rows)).collect()
    }

    /// Number of the occluder that is nearest at a pixel's centre; see [`SampledBuffer::draw`].
    pub fn occluder(&self, x: u32, y: u32) -> Option<u32> {
        let surface = lock(&self.bands[(y / self.rows) as usize]).surface_at(x, y % self.rows);
        surface.map(|SurfaceId { instance, .. }| instance)
    }

    /// The view it was made for.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// All bands, taken in their order, so that no two threads wait for each other.
    fn locked(&self) -> Vec<MutexGuard<'_, Target>> {
        self.bands.iter().map(lock).collect()
    }
}

fn lock(band: &Mutex<Target>) -> MutexGuard<'_, Target> {
    band.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether a rectangle of the image is hidden in every band that it meets.
#[inline(always)]
fn hides<S: Simd>(simd: S, bands: &mut [MutexGuard<Target>], rect: Rect, depth: f32) -> bool {
    for band in bands {
        let top = band.top;
        if !band.hides(simd, Rect { top: rect.top - top, bottom: rect.bottom - top, ..rect }, depth) {
            return false;
        }
    }
    true
}

#[inline(always)]
fn ask<S: Simd>(
    simd: S,
    bands: &mut [MutexGuard<Target>],
    image: Rect,
    set: &BoxSet,
    boxes: &Boxes,
    verdicts: &mut Vec<Verdict>,
) {
    let mut at = ProjectedBoxes::default();
    for sixteen in &boxes.sixteen {
        let boxes = &mut at;
        simd.vectorize(
            #[inline(always)]
            || project_boxes(simd, set, &sixteen.min, &sixteen.max, image, boxes),
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
            } else if hides(simd, bands, rect, at.depth[lane]) {
                Verdict::Hidden
            } else {
                Verdict::Visible
            });
        }
    }
}
