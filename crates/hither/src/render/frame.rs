//! The product of a rendering: at every pixel centre the nearest opaque or masked surface, and its depth.

use crate::conventions::{NO_ID, SurfaceId, View};

/// Ids and depth of the visible surface at every pixel centre.
#[derive(Clone, Debug)]
pub struct Frame {
    /// What was asked for.
    pub view: View,
    /// What was done.
    pub counters: Counters,
    /// Where it was done, if asked for.
    pub complexity: Option<Complexity>,
    pub(super) depth: Vec<f32>,
    pub(super) ids: Vec<SurfaceId>,
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
    pub(super) fn empty(view: View) -> Frame {
        let pixels = view.width as usize * view.height as usize;
        let nothing = SurfaceId { instance: NO_ID, triangle: NO_ID };
        Frame {
            view,
            counters: Counters::default(),
            complexity: None,
            depth: vec![0.0; pixels],
            ids: vec![nothing; pixels],
        }
    }

    /// The surface at pixel (x, y), if there is one.
    pub fn id(&self, x: u32, y: u32) -> Option<SurfaceId> {
        let id = self.ids[self.at(x, y)];
        (id.instance != NO_ID).then_some(id)
    }

    /// Depth at pixel (x, y) as `conventions` defines it; 0 where there is nothing.
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        self.depth[self.at(x, y)]
    }

    /// Distance along the view axis at pixel (x, y), metres; +∞ where there is nothing.
    pub fn distance(&self, x: u32, y: u32) -> f64 {
        self.view.projection.distance(self.depth(x, y))
    }

    fn at(&self, x: u32, y: u32) -> usize {
        assert!(x < self.view.width && y < self.view.height, "pixel ({x}, {y}) is outside the frame");
        y as usize * self.view.width as usize + x as usize
    }
}
