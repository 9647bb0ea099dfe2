//! What reports have in common: their opening, and how counts become JSON.

use glam::DVec3;
use hither::geometry::Aabb;
use hither::render::{Counters, Frame};
use serde_json::{Map, Value, json};
use std::collections::HashSet;
use std::time::Duration;

/// The opening of every report: schema `hither.<command>/1`, and the engine's version.
pub fn opening(command: &str) -> Map<String, Value> {
    let mut report = Map::new();
    report.insert("schema".into(), format!("hither.{command}/1").into());
    report.insert("version".into(), hither::VERSION.into());
    report
}

/// Milliseconds, to the microsecond.
pub fn milliseconds(duration: Duration) -> Value {
    let microseconds = duration.as_secs_f64() * 1e6;
    json!(microseconds.round() / 1e3)
}

/// Three coordinates.
pub fn point(p: DVec3) -> Value {
    json!([p.x, p.y, p.z])
}

/// Two corners, or null where there is nothing.
pub fn bounds(bounds: Option<Aabb>) -> Value {
    bounds.map_or(Value::Null, |b| json!({ "min": point(b.min), "max": point(b.max) }))
}

/// The counters of a frame. The depth complexity is null where it was not recorded.
pub fn counters(counters: &Counters) -> Value {
    let complexity = (counters.depth_complexity > 0.0).then_some(counters.depth_complexity);
    json!({
        "nodes_visited": counters.nodes_visited,
        "nodes_outside": counters.nodes_outside,
        "nodes_culled": counters.nodes_culled,
        "triangles_tested": counters.triangles_tested,
        "triangles_front_facing": counters.triangles_front_facing,
        "triangles_drawn": counters.triangles_drawn,
        "pixels_written": counters.pixels_written,
        "depth_complexity": complexity,
    })
}

/// What a finished frame shows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Different instances.
    pub instances: u64,
    /// Different triangles.
    pub triangles: u64,
    /// Pixels that show a surface.
    pub pixels: u64,
}

impl Seen {
    /// Counts the surfaces that are nearest at some pixel centre.
    pub fn count(frame: &Frame) -> Seen {
        let (mut instances, mut triangles) = (HashSet::new(), HashSet::new());
        let mut pixels = 0;
        for y in 0..frame.view.height {
            let mut last = None;
            for x in 0..frame.view.width {
                let Some(id) = frame.id(x, y) else { continue };
                pixels += 1;
                if last != Some(id) {
                    instances.insert(id.instance);
                    triangles.insert(id);
                    last = Some(id);
                }
            }
        }
        Seen { instances: instances.len() as u64, triangles: triangles.len() as u64, pixels }
    }
}
