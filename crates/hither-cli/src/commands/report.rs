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
    /// Numbers of the instances that are nearest at some pixel centre, in the order of their nearest such depth.
    pub fn instances_of(frame: &Frame) -> Vec<u32> {
        let mut nearest = std::collections::HashMap::new();
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
