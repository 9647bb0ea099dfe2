//! `hither cull --method exact`: what a picture of this very size shows, blended surfaces included.

use super::Found;
use crate::commands::report;
use crate::failure::Failure;
use hither::conventions::View;
use hither::render::{Frame, Shader};
use hither::{RenderOptions, Renderer, SceneIndex};
use std::collections::HashMap;
use std::time::Instant;

/// The method with what it keeps from frame to frame.
pub struct Exact {
    renderer: Renderer,
    shader: Shader,
}

impl Exact {
    /// Prepares the scene.
    pub fn new(index: &SceneIndex) -> Exact {
        Exact { renderer: Renderer::new(), shader: Shader::new(index.scene(), THREADS) }
    }

    /// Draws one frame and looks which instances it shows.
    pub fn find(&mut self, index: &SceneIndex, view: &View) -> Result<Found, Failure> {
        let start = Instant::now();
        let options = RenderOptions { threads: THREADS, ..RenderOptions::default() };
        let frame = self.renderer.render(index, view, &options).map_err(|e| Failure::work(e.to_string()))?;
        let blended = self.shader.blended_instances(index.scene(), &frame);
        let visible = nearest_first(&frame, blended);
        let time = start.elapsed();
        let counters = report::counters(&frame.counters);
        self.renderer.recycle(frame);
        Ok(Found { visible, reasons: None, polygons: None, counters, time })
    }
}

const THREADS: usize = 1;

/// Instances that are nearest at some pixel centre of `frame`, and the `blended` ones with their nearest depths, in the
/// order of the nearest such depth of each.
fn nearest_first(frame: &Frame, blended: Vec<(u32, f32)>) -> Vec<u32> {
    let mut nearest: HashMap<u32, f32> = blended.into_iter().collect();
    for y in 0..frame.view.height {
        for x in 0..frame.view.width {
            if let Some(id) = frame.id(x, y) {
                let depth = frame.depth(x, y);
                let known = nearest.entry(id.instance).or_insert(depth);
                *known = depth.max(*known);
            }
        }
    }
    let mut instances: Vec<(u32, f32)> = nearest.into_iter().collect();
    instances.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    instances.into_iter().map(|(instance, _)| instance).collect()
}
