//! The product of a rendering: at every pixel centre the nearest opaque or masked surface, and its depth.

use crate::conventions::{SurfaceId, View};
use crate::raster::Target;

/// Ids and depth of the visible surface at every pixel centre.
#[derive(Debug)]
pub struct Frame {
    /// What was asked for.
    pub view: View,
    /// What was done.
    pub counters: Counters,
    /// Where it was done, if asked for.
    pub complexity: Option<Complexity>,
    pub(super) windows: Vec<Target>,
    /// Image column at which each window begins.
    pub(super) columns: Vec<u32>,
}

/// What a rendering did, in the terms of [Greene 1995, §3.5.2–3.5.3].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Tree nodes (cubes, boxes) tested against the frustum and the pyramid.
    pub nodes_visited: u64,
    /// Of these, found outside the frustum.
    pub nodes_outside: u64,
    /// Of these, found hidden by the z-pyramid.
    pub nodes_culled: u64,
    /// Triangles in the leaves that were not culled.
    pub triangles_tested: u64,
    /// Of these, facing the eye.
    pub triangles_front_facing: u64,
    /// Of these, rasterised: not shown to be hidden or to miss every pixel centre beforehand.
    pub triangles_drawn: u64,
    /// Depth samples written, overwriting included.
    pub pixels_written: u64,
    /// Average number of times a pixel was visited by all tiling: cubes and polygons. 0 if not recorded.
    pub depth_complexity: f64,
}

/// Where the work was done: for each pixel, row by row, how often it was visited; a pyramid cell of n×n
/// pixels counts 1/n² for each of them [Greene 1995, §3.5.3].
#[derive(Clone, Debug, PartialEq)]
pub struct Complexity {
    /// Visits by z-pyramid tests of cubes.
    pub cubes: Vec<f32>,
    /// Visits by tests and scan conversion of polygons.
    pub polygons: Vec<f32>,
}

impl Frame {
    /// The surface at pixel (x, y), if there is one.
    pub fn id(&self, x: u32, y: u32) -> Option<SurfaceId> {
        let (window, x) = self.window(x, y);
        window.surface_at(x, y)
    }

    /// Depth at pixel (x, y) as `conventions` defines it; 0 where there is nothing.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        let (window, x) = self.window(x, y);
        window.depth_at(x, y)
    }

    /// Distance along the view axis at pixel (x, y), metres; +∞ where there is nothing.
    pub fn distance(&self, x: u32, y: u32) -> f64 {
        self.view.projection.distance(self.depth(x, y))
    }

    /// Collects the windows' visit counts into one picture.
    pub(super) fn gather_complexity(&mut self) {
        let pixels = self.view.width as usize * self.view.height as usize;
        let mut all = Complexity { cubes: vec![0.0; pixels], polygons: vec![0.0; pixels] };
        for window in &mut self.windows {
            let Some(visits) = window.visits.take() else { continue };
            let width = window.width as usize;
            for y in 0..window.height as usize {
                let from = y * width..(y + 1) * width;
                let at = y * self.view.width as usize + window.left as usize;
                all.cubes[at..at + width].copy_from_slice(&visits.cubes[from.clone()]);
                all.polygons[at..at + width].copy_from_slice(&visits.polygons[from]);
            }
        }
        let sum: f64 = all.cubes.iter().chain(&all.polygons).map(|&v| f64::from(v)).sum();
        self.counters.depth_complexity = sum / pixels as f64;
        self.complexity = Some(all);
    }

    fn window(&self, x: u32, y: u32) -> (&Target, u32) {
        assert!(x < self.view.width && y < self.view.height, "pixel ({x}, {y}) is outside the frame");
        let at = self.columns.partition_point(|&c| c <= x) - 1;
        (&self.windows[at], x - self.columns[at])
    }
}

impl std::ops::AddAssign for Counters {
    /// Adds counts; the depth complexity is set from the whole frame, not summed.
    fn add_assign(&mut self, o: Counters) {
        self.nodes_visited += o.nodes_visited;
        self.nodes_outside += o.nodes_outside;
        self.nodes_culled += o.nodes_culled;
        self.triangles_tested += o.triangles_tested;
        self.triangles_front_facing += o.triangles_front_facing;
        self.triangles_drawn += o.triangles_drawn;
        self.pixels_written += o.pixels_written;
    }
}
