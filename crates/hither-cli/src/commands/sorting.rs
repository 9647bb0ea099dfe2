//! What `order` and `layers` share: the parts of a scene, and their sort.

use crate::console::Verbosity;
use crate::failure::Failure;
use hither::Scene;
use hither::conventions::{Projection, View};
use hither::order::{Granularity, Parts, SortOptions, VisibilitySort};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// What is sorted as one.
#[derive(clap::Args, Debug, Default)]
pub struct PartOptions {
    /// What is one part: everything below a node of these names, or below each node at a depth, as in
    /// `--parts body,wheels` or `--parts depth=1` [default: every node with a mesh]
    #[arg(long, value_name = "NAME,…|depth=N", value_parser = granularity)]
    parts: Option<Granularity>,
    /// Up to so many convex hulls around each mesh that is not convex; with one, holes are filled
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    hulls: u32,
    /// Make hulls smaller by so many per cent: parts that only touch then have an order
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, value_parser = percent)]
    shrink: f64,
    /// Parts that are behind all others, as a sky is
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    backdrop: Vec<String>,
}

fn granularity(text: &str) -> Result<Granularity, String> {
    if let Some(depth) = text.strip_prefix("depth=") {
        let depth = depth.parse().ok().filter(|&d: &u32| d > 0);
        return depth.map(Granularity::Depth).ok_or_else(|| "write depth=N with N from 1".into());
    }
    let names: Vec<String> = text.split(',').map(str::to_owned).collect();
    if names.iter().any(String::is_empty) {
        return Err("write names with commas between them, or depth=N".into());
    }
    Ok(Granularity::Names(names))
}

fn percent(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|p| (0.0..=50.0).contains(p));
    value.ok_or_else(|| "write a number from 0 to 50".into())
}

/// How much farther than the scene is large the eye of an orthographic view stands.
const FAR: f64 = 1e5;

/// The parts of a scene and their sort.
pub struct Sorting {
    /// The parts.
    pub parts: Parts,
    /// Their sort.
    pub sort: VisibilitySort,
    size: f64,
}

impl Sorting {
    /// Makes parts and hulls, and says what is odd about them.
    pub fn new(
        scene: &Scene,
        source: &str,
        options: &PartOptions,
        sort: SortOptions,
        verbosity: Verbosity,
    ) -> Result<Sorting, Failure> {
        let spinner = verbosity.spinner("making hulls".into());
        let granularity = options.parts.clone().unwrap_or_default();
        let parts = Parts::with_hulls(scene, &granularity, options.hulls.max(1), options.shrink / 100.0);
        spinner.finish_and_clear();
        let parts = parts.map_err(|e| Failure::work(format!("{source}: {e}")))?;
        if !parts.empty_instances.is_empty() {
            let count = parts.empty_instances.len();
            verbosity.warning(&format!("{source}: {count} instances have no triangles; they are in no part"));
        }
        if parts.parts.is_empty() {
            verbosity.warning(&format!("{source}: there is nothing to sort"));
        }
        let mut sort = VisibilitySort::new(sort);
        parts.add_to(&mut sort);
        if options.parts.is_none() && parts.empty_instances.is_empty() {
            for (first, second, known) in hither_worlds::known_relations(scene) {
                sort.know(first, second, known);
            }
            hither_worlds::backdrops(scene).into_iter().for_each(|part| sort.set_backdrop(part, true));
        }
        for name in &options.backdrop {
            let found = parts.parts.iter().position(|p| p.name == *name);
            let part = found.ok_or_else(|| {
                Failure::work(format!(
                    "{source}: no part \"{name}\"; `hither order` lists the names there are"
                ))
            })?;
            sort.set_backdrop(part as u32, true);
        }
        let size = scene.bounds().map_or(1.0, |b| b.size().length());
        Ok(Sorting { parts, sort, size })
    }

    /// Sorts the scene as it is posed, as `view` sees it, and says how long that took without the posing.
    pub fn sort(&mut self, scene: &Scene, view: &View) -> Duration {
        let instances = scene.instances();
        let eye = match view.projection {
            Projection::Perspective { .. } => view.eye_in_world(),
            // Parallel rays meet far away, nearly.
            Projection::Orthographic { .. } => {
                let backward = view.view_from_world.matrix3.transpose().z_axis;
                view.eye_in_world() + backward * (FAR * self.size)
            }
        };
        let start = Instant::now();
        self.parts.place_at(&mut self.sort, &instances);
        self.sort.sort(eye);
        start.elapsed()
    }

    /// A part's name, or its number where it has none.
    pub fn name(&self, part: u32) -> String {
        match self.parts.parts[part as usize].name.as_str() {
            "" => format!("part {part}"),
            name => name.to_owned(),
        }
    }

    /// The parts by index and name.
    pub fn parts_json(&self) -> Value {
        let part = |(index, part): (usize, &hither::order::Part)| {
            json!({
                "index": index,
                "name": part.name,
                "instances": part.instances,
                "triangles": part.triangles,
                "hull_triangles": self.parts.hull_triangles(index),
            })
        };
        self.parts.parts.iter().enumerate().map(part).collect()
    }
}
