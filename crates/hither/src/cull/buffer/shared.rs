//! An occlusion buffer that several threads draw into and ask at once.

use super::draw::Band;
use super::{
    Ball, Boxes, Drawn, Frame, Occludee, Occluder, OcclusionOptions, PlacedMesh, ScreenRect, Verdict,
};
use crate::conventions::{View, ViewError};
use crate::geometry::Aabb;
use fearless_simd::dispatch;
use glam::{DAffine3, DVec3};
use std::sync::{RwLock, RwLockReadGuard};

/// As [`OcclusionBuffer`](super::OcclusionBuffer), but drawing takes `&self` too.
///
/// The image is cut into bands, each with a lock of its own: threads that draw into different bands do not
/// wait for each other, and any number may ask a band that nobody draws into. What is drawn is, in the end, the
/// same to the last bit whatever the threads do; what an answer knows is what was drawn before it.
#[derive(Debug)]
pub struct SharedBuffer {
    frame: Frame,
    /// How many bands were asked for.
    wanted: usize,
    /// Rows of each band but the last.
    rows: u32,
    bands: Vec<RwLock<Band>>,
}

impl SharedBuffer {
    /// An empty buffer for `view`, cut into about `bands` bands; a few for each thread are good. With a margin
    /// there is one band: erosion needs what lies beyond a band's border.
    pub fn new(view: &View, options: &OcclusionOptions, bands: usize) -> Result<SharedBuffer, ViewError> {
        let frame = Frame::new(view, options)?;
        let wanted = bands;
        let bands = if frame.margin().is_some() { 1 } else { bands.clamp(1, 256) as u32 };
        let rows = view.height.div_ceil(bands).next_multiple_of(64);
        let band = |top: u32| RwLock::new(Band::new(view.width, top, rows.min(view.height - top)));
        let bands = (0..view.height).step_by(rows as usize).map(band).collect();
        Ok(SharedBuffer { frame, wanted, rows, bands })
    }

    /// Makes it empty.
    pub fn clear(&mut self) {
        for band in &mut self.bands {
            band.get_mut().unwrap_or_else(|broken| broken.into_inner()).clear();
        }
    }

    /// Makes it empty and looks from elsewhere; with another size than before it is made anew, in as many bands.
    pub fn look(&mut self, view: &View) -> Result<(), ViewError> {
        let before = &self.frame.view;
        if (before.width, before.height) != (view.width, view.height) {
            let options = self.frame.options;
            *self = SharedBuffer::new(view, &options, self.wanted)?;
            return Ok(());
        }
        self.frame = Frame::new(view, &self.frame.options)?;
        self.clear();
        Ok(())
    }

    /// Draws an occluder; see [`OcclusionBuffer::draw`](super::OcclusionBuffer::draw). What is counted is
    /// counted in every band.
    pub fn draw(&self, occluder: &Occluder, world_from_object: &DAffine3) -> Drawn {
        let standing = self.frame.standing(occluder, world_from_object);
        let mut drawn = Drawn::default();
        for band in &self.bands {
            let mut band = band.write().unwrap_or_else(|broken| broken.into_inner());
            let band = &mut *band;
            dispatch!(self.frame.options.level, simd => band.draw(simd, &standing, &mut drawn));
        }
        drawn
    }

    /// Asks about many boxes; see [`OcclusionBuffer::ask`](super::OcclusionBuffer::ask).
    pub fn ask(&self, boxes: &Boxes, verdicts: &mut Vec<Verdict>) {
        self.asked(|bands| self.frame.ask(bands, boxes, verdicts));
    }

    /// Asks about one box of world space.
    pub fn ask_box(&self, bounds: &Aabb) -> Verdict {
        self.asked(|bands| self.frame.ask_box(bands, bounds))
    }

    /// Asks about a ball.
    pub fn ask_sphere(&self, center: DVec3, radius: f64) -> Verdict {
        self.asked(|bands| self.frame.ask_sphere(bands, center, radius))
    }

    /// Asks about many balls.
    pub fn ask_balls(&self, balls: &[Ball], verdicts: &mut Vec<Verdict>) {
        self.asked(|bands| self.frame.ask_balls(bands, balls, verdicts));
    }

    /// Asks about a rectangle of the screen.
    pub fn ask_rect(&self, rect: &ScreenRect) -> Verdict {
        self.asked(|bands| self.frame.ask_rect(bands, rect))
    }

    /// Asks about many rectangles of the screen.
    pub fn ask_rects(&self, rects: &[ScreenRect], verdicts: &mut Vec<Verdict>) {
        self.asked(|bands| self.frame.ask_rects(bands, rects, verdicts));
    }

    /// Asks about another mesh.
    pub fn ask_mesh(&self, mesh: &Occludee, world_from_object: &DAffine3) -> Verdict {
        self.asked(|bands| self.frame.ask_mesh(bands, mesh, world_from_object))
    }

    /// Asks about many meshes.
    pub fn ask_meshes(&self, meshes: &[PlacedMesh], verdicts: &mut Vec<Verdict>) {
        self.asked(|bands| self.frame.ask_meshes(bands, meshes, verdicts));
    }

    /// What pixel (x, y) holds.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        let band = self.bands[(y / self.rows) as usize].read().unwrap_or_else(|broken| broken.into_inner());
        band.surface.depth(x, y % self.rows)
    }

    /// All depths, row by row.
    pub fn depths(&self) -> Vec<f32> {
        let bands = self.read();
        let view = &self.frame.view;
        let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        pixels.map(|(x, y)| bands[(y / self.rows) as usize].surface.depth(x, y % self.rows)).collect()
    }

    fn read(&self) -> Vec<RwLockReadGuard<'_, Band>> {
        self.bands.iter().map(|b| b.read().unwrap_or_else(|broken| broken.into_inner())).collect()
    }

    fn asked<T>(&self, ask: impl FnOnce(&[&Band]) -> T) -> T {
        let bands = self.read();
        let bands: Vec<&Band> = bands.iter().map(|b| &**b).collect();
        ask(&bands)
    }
}
