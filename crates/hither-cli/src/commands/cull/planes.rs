//! `hither cull --method planes`: what supporting planes cannot hide, and a map of it.

use super::{Arguments, Found, MethodName};
use crate::failure::Failure;
use crate::numbers::grouped;
use crate::outputs;
use glam::DAffine3;
use hither::conventions::View;
use hither::cull::planes::{Amount, Culled, PlaneCuller, PlanesOptions};
use hither::{Scene, SceneIndex};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// What only this method understands.
#[derive(clap::Args, Debug)]
pub struct Options {
    /// Write a top view of what is hidden, seen and outside the view; numbered with --frames
    #[arg(long, value_name = "FILE.svg", help_heading = "Planes")]
    map: Option<PathBuf>,
    /// Look all around, not only into the view
    #[arg(long, help_heading = "Planes")]
    around: bool,
    /// Occluders in use at once, up to 1024, or `auto` for as many as pay [default: auto]
    #[arg(long, value_name = "K", value_parser = amount, help_heading = "Planes")]
    occluders: Option<Amount>,
    /// Polygons up to which a part of space is not divided further, or `auto` [default: auto]
    #[arg(long, value_name = "N", value_parser = amount, help_heading = "Planes")]
    leaf: Option<Amount>,
    /// Only the paper's own tests: single and connected occluders, 32 of them, against boxes
    #[arg(long, help_heading = "Planes")]
    paper: bool,
    /// Worker threads; 0 is one for each core
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u16).range(..=1024),
          help_heading = "Planes")]
    threads: u16,
}

/// Every polygon of every instance is kept.
const MOST_TRIANGLES: u64 = 4_000_000;

/// Refuses a scene that is too large for this method.
pub fn check_scene(scene: &Scene, source: &str) -> Result<(), Failure> {
    let triangles = scene.instanced_triangle_count();
    if triangles <= MOST_TRIANGLES {
        return Ok(());
    }
    Err(Failure::work(format!(
        "{source}: {} triangles, instances counted, are more than the {} that method planes can keep; use --method \
         buffer",
        grouped(triangles),
        grouped(MOST_TRIANGLES)
    )))
}

/// Refuses a map that could not be written, before any work.
pub fn check_map(arguments: &Arguments) -> Result<(), Failure> {
    let Some(map) = &arguments.planes.map else { return Ok(()) };
    if arguments.method != MethodName::Planes {
        return Err(Failure::usage("--map goes with --method planes"));
    }
    if !outputs::has_extension(map, "svg") {
        return Err(Failure::usage(format!("--map {}: give the file the extension .svg", map.display())));
    }
    match &arguments.view.frames {
        None => hither_io::check_writable(map)?,
        Some(frames) => {
            for frame in frames.clone().take(1000) {
                hither_io::check_writable(&outputs::numbered(map, frame))?;
            }
        }
    }
    Ok(())
}

/// The method with what it keeps from frame to frame.
pub struct Planes {
    culler: PlaneCuller,
    options: PlanesOptions,
    margin: f64,
    around: bool,
    map: Option<PathBuf>,
    /// Where everything was when the tree was made.
    poses: Vec<DAffine3>,
}

impl Planes {
    /// Prepares the scene as the arguments ask.
    pub fn new(arguments: &Arguments, index: &SceneIndex) -> Planes {
        let wanted = &arguments.planes;
        let own = if wanted.paper { PlanesOptions::paper() } else { PlanesOptions::default() };
        let options = PlanesOptions {
            occluders: wanted.occluders.unwrap_or(own.occluders),
            leaf_polygons: wanted.leaf.unwrap_or(own.leaf_polygons),
            threads: usize::from(wanted.threads),
            ..own
        };
        Planes {
            culler: PlaneCuller::new(index.scene(), &options),
            options,
            margin: arguments.margin,
            around: wanted.around,
            map: wanted.map.clone(),
            poses: poses(index.scene()),
        }
    }

    /// Looks in one frame. Where anything has moved since the last, everything is prepared anew.
    pub fn find(&mut self, index: &SceneIndex, view: &View) -> Result<Found, Failure> {
        let start = Instant::now();
        let now = poses(index.scene());
        if now != self.poses {
            self.culler = PlaneCuller::new(index.scene(), &self.options);
            self.poses = now;
        }
        let culled = if self.margin > 0.0 {
            self.culler.foresee(view.eye_in_world(), self.margin)
        } else if self.around {
            self.culler.look_around(view.eye_in_world())
        } else {
            self.culler.look(view)
        };
        let culled = culled.map_err(|e| Failure::work(e.to_string()))?;
        let time = start.elapsed();
        Ok(Found { visible: self.instances(&culled), reasons: None, counters: self.counters(&culled), time })
    }

    /// Writes the map of the last frame, if one is asked for.
    pub fn write_map(&self, number: u32, numbered: bool) -> Result<(), Failure> {
        let Some(map) = &self.map else { return Ok(()) };
        let file = if numbered { outputs::numbered(map, number) } else { map.clone() };
        Ok(hither_io::write_map(&file, &self.culler.top_view())?)
    }

    /// Instances with a polygon that may be seen, by the distance of the nearest of these.
    fn instances(&self, culled: &Culled) -> Vec<u32> {
        let of = |&p: &u32| {
            let polygon = &self.culler.model().polygons()[p as usize];
            let nearest = culled.eye.clamp(polygon.bounds.min, polygon.bounds.max);
            (polygon.instance, nearest.distance(culled.eye))
        };
        let mut seen: Vec<(u32, f64)> = culled.visible.iter().map(of).collect();
        seen.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        seen.dedup_by_key(|s| s.0);
        seen.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        seen.into_iter().map(|s| s.0).collect()
    }

    fn counters(&self, culled: &Culled) -> Value {
        let (work, all) = (&culled.work, self.culler.model().polygons().len());
        json!({
            "polygons": all,
            "polygons_hidden": all - culled.visible.len(),
            "occluders": culled.occluders,
            "nodes_visited": work.nodes_visited,
            "nodes_remembered": work.nodes_remembered,
            "nodes_outside": work.nodes_outside,
            "relations_tested": work.relations,
            "polygon_relations_tested": work.piece_relations,
            "nodes_hidden_by_one": work.hidden_by_one,
            "nodes_hidden_by_connected": work.hidden_by_connected,
            "nodes_hidden_by_separate": work.hidden_by_fusion,
        })
    }
}

fn poses(scene: &Scene) -> Vec<DAffine3> {
    scene.instances().into_iter().map(|instance| instance.world_from_mesh).collect()
}

fn amount(text: &str) -> Result<Amount, String> {
    if text == "auto" {
        return Ok(Amount::Automatic);
    }
    let number = text.parse().ok().filter(|n| (1..=1024).contains(n));
    number.map(Amount::Fixed).ok_or_else(|| "write a whole number from 1 to 1024, or auto".into())
}
