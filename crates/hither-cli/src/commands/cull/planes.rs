//! `hither cull --method planes`: what supporting planes cannot hide, and a map of it.

use super::{Arguments, Found, MethodName};
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{count, grouped};
use crate::options;
use crate::outputs;
use glam::DAffine3;
use hither::conventions::View;
use hither::cull::planes::{Amount, Culled, PlaneCuller, PlanesOptions, State};
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
    /// Worker threads; 0 is one for each core [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(..=1024), help_heading = "Planes")]
    threads: Option<u16>,
}

impl Options {
    /// Refuses what the method would not look at, and what contradicts itself.
    pub fn check(&self, method: MethodName) -> Result<(), Failure> {
        let given = [
            ("--map", self.map.is_some()),
            ("--around", self.around),
            ("--occluders", self.occluders.is_some()),
            ("--leaf", self.leaf.is_some()),
            ("--paper", self.paper),
            ("--threads", self.threads.is_some()),
        ];
        let first = given.iter().find(|(_, given)| *given);
        if let (Some((option, _)), true) = (first, method != MethodName::Planes) {
            return Err(Failure::usage(format!("{option} goes with --method planes")));
        }
        if self.paper && (self.occluders.is_some() || self.leaf.is_some()) {
            return Err(Failure::usage(
                "--paper means 32 occluders and leaves of 8 polygons: it goes without --occluders and --leaf",
            ));
        }
        Ok(())
    }
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
pub fn check_map(arguments: &Arguments, files: &mut Files) -> Result<(), Failure> {
    let Some(map) = &arguments.planes.map else { return Ok(()) };
    if !outputs::has_extension(map, "svg") {
        return Err(Failure::usage(format!("--map {}: give the file the extension .svg", map.display())));
    }
    files.writes("--map", Some(map), arguments.view.frames.as_ref())
}

/// The method with what it keeps from frame to frame.
pub struct Planes {
    culler: PlaneCuller,
    options: PlanesOptions,
    margin: f64,
    around: bool,
    paper: bool,
    reasons: bool,
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
            threads: options::threads(wanted.threads.unwrap_or(1)),
            ..own
        };
        Planes {
            culler: PlaneCuller::new(index.scene(), &options),
            options,
            margin: arguments.margin,
            around: wanted.around,
            paper: wanted.paper,
            reasons: arguments.reasons,
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
        let visible = self.instances(&culled);
        let polygons = self.reasons.then(|| self.polygons(index));
        Ok(Found { visible, reasons: None, polygons, counters: self.counters(&culled), time })
    }

    /// What the report says of how it is done.
    pub fn settings(&self) -> Value {
        json!({
            "around": self.around || self.margin > 0.0,
            "occluders": amount_json(self.options.occluders),
            "leaf": amount_json(self.options.leaf_polygons),
            "paper": self.paper,
            "threads": self.options.threads,
        })
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

    /// What the last look knows of every polygon.
    fn polygons(&self, index: &SceneIndex) -> Polygons {
        let (scene, model) = (index.scene(), self.culler.model());
        let mut triangles = vec![Vec::new(); model.polygons().len()];
        for (number, instance) in (0..).zip(scene.instances()) {
            let mesh = &scene.meshes[instance.mesh as usize];
            for triangle in 0..mesh.triangles.len() as u32 {
                triangles[model.polygon_of(number, triangle) as usize].push(triangle);
            }
        }
        let instances = model.polygons().iter().map(|p| p.instance);
        let all = instances.zip(self.culler.polygon_states()).zip(triangles);
        Polygons(all.map(|((instance, state), triangles)| Judged { instance, state, triangles }).collect())
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

/// How each polygon was judged; those of an instance follow one another.
pub struct Polygons(Vec<Judged>);

struct Judged {
    instance: u32,
    state: State,
    triangles: Vec<u32>,
}

impl Polygons {
    /// How many polygons there are of each kind.
    pub fn line(&self) -> String {
        let of = |state| grouped(counted(&self.0, state) as u64);
        format!(
            "of {} {} visible, {} partial, {} hidden, {} outside the view",
            count(self.0.len() as u64, "polygon"),
            of(State::Visible),
            of(State::Partial),
            of(State::Hidden),
            of(State::Outside)
        )
    }

    /// An entry for each instance: what of it may be seen as lists of triangles, the rest as numbers.
    pub fn json(&self) -> Value {
        let entry = |of_instance: &[Judged]| {
            let listed = |state| {
                let polygons = of_instance.iter().filter(|j| j.state == state);
                polygons.map(|j| j.triangles.as_slice()).collect::<Vec<_>>()
            };
            json!({
                "instance": of_instance[0].instance,
                "visible": listed(State::Visible),
                "partial": listed(State::Partial),
                "hidden": counted(of_instance, State::Hidden),
                "outside": counted(of_instance, State::Outside),
            })
        };
        self.0.chunk_by(|a, b| a.instance == b.instance).map(entry).collect::<Vec<_>>().into()
    }
}

fn counted(polygons: &[Judged], state: State) -> usize {
    polygons.iter().filter(|j| j.state == state).count()
}

fn poses(scene: &Scene) -> Vec<DAffine3> {
    scene.instances().into_iter().map(|instance| instance.world_from_mesh).collect()
}

fn amount_json(amount: Amount) -> Value {
    match amount {
        Amount::Fixed(number) => number.into(),
        Amount::Automatic => "auto".into(),
    }
}

fn amount(text: &str) -> Result<Amount, String> {
    if text == "auto" {
        return Ok(Amount::Automatic);
    }
    let number = text.parse().ok().filter(|n| (1..=1024).contains(n));
    number.map(Amount::Fixed).ok_or_else(|| "write a whole number from 1 to 1024, or auto".into())
}
