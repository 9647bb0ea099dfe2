//! What `order` and `layers` share: the parts of a scene, and their sort.

use crate::console::Verbosity;
use crate::failure::Failure;
use clap::ValueEnum;
use hither::Scene;
use hither::conventions::{Projection, View};
use hither::layers::{Component, Holdout, LayerPainter, Mutual, PaintOptions, decompose, decompose_by_sight};
use hither::order::{
    Granularity, Known, Parts, Seam, Shapes, SortOptions, SplitBy, VisibilitySort, split_nodes,
};
use serde_json::{Value, json};
use std::collections::HashMap;
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
    /// Parts that are behind all others, as a sky is; by name or number
    #[arg(long, value_name = "NAME|INDEX,…", value_delimiter = ',')]
    backdrop: Vec<String>,
    /// Cut the meshes of, and below, a node, or a part by its number, into pieces that are parts of their own:
    /// `NAME=grid:NxM` over x and z, `NAME=cylinder:SECTORSxHEIGHTS` about its upright axis, `NAME=boxes:NxMxK`, or
    /// `NAME=adaptive:N`, up to N pieces where it is least convex
    #[arg(long, value_name = "NAME|INDEX=HOW", value_parser = pieces)]
    split: Vec<(String, SplitBy)>,
    /// By how many per cent a piece is larger, so that no gap shows between pieces; those of meshes that blend are not
    #[arg(long, value_name = "PERCENT", default_value_t = 20.0, value_parser = overlap, requires = "split")]
    overlap: f64,
}

/// A scene with what is to be split in pieces, and what was known of it before.
pub struct Prepared {
    pieces: Vec<u32>,
    seams: Vec<(u32, u32, Seam)>,
    /// By the paths of instances.
    known: Vec<(Vec<u32>, Vec<u32>, Known)>,
    backdrops: Vec<Vec<u32>>,
}

impl Prepared {
    /// What is known of a scene that is not split.
    pub fn of(scene: &Scene) -> Prepared {
        let (known, backdrops) = (hither_worlds::known_relations(scene), hither_worlds::backdrops(scene));
        let paths: Vec<Vec<u32>> = match known.is_empty() && backdrops.is_empty() {
            true => Vec::new(),
            false => scene.instances().into_iter().map(|i| i.path).collect(),
        };
        let path = |instance: u32| paths[instance as usize].clone();
        let known = known.into_iter().map(|(a, b, known)| (path(a), path(b), known)).collect();
        let backdrops = backdrops.into_iter().map(path).collect();
        Prepared { pieces: Vec::new(), seams: Vec::new(), known, backdrops }
    }
}

impl PartOptions {
    /// Whether anything is to be split.
    pub fn splits(&self) -> bool {
        !self.split.is_empty()
    }

    /// Splits what is to be split. The scene must be as it was opened.
    pub fn prepare(&self, scene: &mut Scene, source: &str) -> Result<Prepared, Failure> {
        let mut prepared = Prepared::of(scene);
        if self.splits() {
            let split = split_nodes(std::mem::take(scene), &self.split, self.overlap / 100.0);
            let split = split.map_err(|e| Failure::work(format!("{source}: {e}")))?;
            *scene = split.scene;
            (prepared.pieces, prepared.seams) = (split.pieces, split.seams);
        }
        Ok(prepared)
    }
}

/// `--occlusion`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum OcclusionName {
    /// Of parts that are a cycle by their hulls, what is drawn at the picture's samples
    #[default]
    Samples,
    /// Convex hulls alone: holds wherever the view turns, at any size
    Hulls,
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

/// Most pieces that a mesh is split into.
const MOST_PIECES: u64 = 10_000;

fn pieces(text: &str) -> Result<(String, SplitBy), String> {
    let wrong = || {
        "write NAME=grid:NxM, NAME=cylinder:SECTORSxHEIGHTS, NAME=boxes:NxMxK or NAME=adaptive:N, as in \
         ground=grid:8x8"
            .to_owned()
    };
    let (name, how) = text.rsplit_once('=').filter(|(name, _)| !name.is_empty()).ok_or_else(wrong)?;
    let (kind, numbers) = how.split_once(':').ok_or_else(wrong)?;
    let numbers: Option<Vec<u32>> = numbers.split('x').map(|n| n.parse().ok().filter(|&n| n > 0)).collect();
    let numbers = numbers.ok_or_else(wrong)?;
    let all = numbers.iter().try_fold(1u64, |all, &n| all.checked_mul(u64::from(n)));
    if all.is_none_or(|all| all > MOST_PIECES) {
        return Err("a mesh is split into up to 10,000 pieces".into());
    }
    let by = match (kind, numbers.as_slice()) {
        ("grid", &[columns, rows]) => SplitBy::HeightField { columns, rows },
        ("cylinder", &[sectors, heights]) => SplitBy::Cylinder { sectors, heights },
        ("boxes", &[x, y, z]) => SplitBy::Boxes([x, y, z]),
        ("adaptive", &[pieces]) => SplitBy::Adaptive { pieces, depth: 0.0 },
        _ => return Err(wrong()),
    };
    Ok((name.to_owned(), by))
}

fn overlap(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|p| (0.0..=100.0).contains(p));
    value.ok_or_else(|| "write a number from 0 to 100".into())
}

fn percent(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|p| (0.0..=50.0).contains(p));
    value.ok_or_else(|| "write a number from 0 to 50".into())
}

/// How parts become layers.
#[derive(clap::Args, Debug, Default)]
pub struct LayerOptions {
    /// What decides which of two parts occludes the other
    #[arg(long, value_name = "WHAT", default_value = "samples")]
    pub occlusion: OcclusionName,
    /// Keep parts apart that occlude each other both ways: each is cut where another is before it, instead of all
    /// being one layer
    #[arg(long)]
    pub holdout: bool,
}

impl LayerOptions {
    /// Refuses what does not go together.
    pub fn check(&self) -> Result<(), Failure> {
        if self.holdout && self.occlusion == OcclusionName::Hulls {
            let what = "--holdout cuts at the picture's samples; leave out --occlusion hulls";
            return Err(Failure::usage(what.to_owned()));
        }
        Ok(())
    }
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
    /// Two parts that are pieces of one mesh, an instance that is in its place, and their seam.
    seams: Vec<(u32, u32, u32, Seam)>,
}

impl Sorting {
    /// Makes parts and hulls, and says what is odd about them.
    pub fn new(
        scene: &Scene,
        source: &str,
        options: &PartOptions,
        prepared: &Prepared,
        sort: SortOptions,
        verbosity: Verbosity,
    ) -> Result<Sorting, Failure> {
        let spinner = verbosity.spinner("making hulls".into());
        let granularity = options.parts.clone().unwrap_or_default();
        let shapes =
            Shapes { hulls: options.hulls, shrink: options.shrink / 100.0, apart: prepared.pieces.clone() };
        let parts = Parts::shaped(scene, &granularity, &shapes);
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
        let seams = tell(&mut sort, &parts, scene, prepared);
        for name in &options.backdrop {
            let named = parts.parts.iter().position(|p| p.name == *name);
            let numbered = || name.parse().ok().filter(|&number: &usize| number < parts.parts.len());
            let part = named.or_else(numbered).ok_or_else(|| {
                Failure::work(format!(
                    "{source}: no part \"{name}\"; `hither order` lists the names there are"
                ))
            })?;
            sort.set_backdrop(part as u32, true);
        }
        let size = scene.bounds().map_or(1.0, |b| b.size().length());
        Ok(Sorting { parts, sort, size, seams })
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
        for (first, second, instance, seam) in &self.seams {
            if let Some(known) = seam.known(&instances[*instance as usize].world_from_mesh) {
                self.sort.know(*first, *second, known);
            }
        }
        self.sort.sort(eye);
        start.elapsed()
    }

    /// The layers of the last sort's order as `view` shows them, and what is held out of which parts.
    pub fn components(
        &mut self,
        options: &LayerOptions,
        painter: &mut LayerPainter,
        view: &View,
        paint: &PaintOptions,
    ) -> Result<(Vec<Component>, HashMap<u32, Holdout>), Failure> {
        let order = self.sort.order().clone();
        if options.occlusion == OcclusionName::Hulls {
            return Ok((decompose(&order, |group| self.sort.arcs_among(group)), HashMap::new()));
        }
        let mutual = if options.holdout { Mutual::HeldOut } else { Mutual::Merged };
        decompose_by_sight(&order, mutual, |group| {
            let members: Vec<Vec<u32>> = group.iter().map(|&p| self.instances_of(&[p])).collect();
            let mut sight = painter.look(&members, view, paint).map_err(|e| Failure::work(e.to_string()))?;
            for (a, b) in sight.arcs() {
                if self.sort.rules_out(group[a as usize], group[b as usize]) {
                    sight.rule_out(a, b);
                }
            }
            Ok(sight)
        })
    }

    /// The instances of some parts, ascending.
    pub fn instances_of(&self, parts: &[u32]) -> Vec<u32> {
        let of = |&part: &u32| self.parts.parts[part as usize].instances.iter().copied();
        let mut instances: Vec<u32> = parts.iter().flat_map(of).collect();
        instances.sort_unstable();
        instances
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

/// Tells a sort what is known of parts that are one instance each; returns the seams between such parts.
fn tell(
    sort: &mut VisibilitySort,
    parts: &Parts,
    scene: &Scene,
    prepared: &Prepared,
) -> Vec<(u32, u32, u32, Seam)> {
    let instances = scene.instances();
    let single = (0..).zip(&parts.parts).filter(|(_, part)| part.instances.len() == 1);
    let of_path: HashMap<&[u32], (u32, u32)> = single
        .map(|(number, part)| {
            (instances[part.instances[0] as usize].path.as_slice(), (number, part.instances[0]))
        })
        .collect();
    let part = |path: &[u32]| of_path.get(path).copied();
    for (first, second, known) in &prepared.known {
        if let (Some((first, _)), Some((second, _))) = (part(first), part(second)) {
            sort.know(first, second, *known);
        }
    }
    prepared.backdrops.iter().filter_map(|p| part(p)).for_each(|(part, _)| sort.set_backdrop(part, true));
    let seam = |&(first, second, seam): &(u32, u32, Seam)| {
        let ((first, instance), (second, _)) = (part(&[first])?, part(&[second])?);
        Some((first, second, instance, seam))
    };
    prepared.seams.iter().filter_map(seam).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_to_split_are_read_or_refused() {
        assert_eq!(pieces("a=b=grid:3x4"), Ok(("a=b".into(), SplitBy::HeightField { columns: 3, rows: 4 })));
        assert_eq!(pieces("cup=boxes:1x2x3"), Ok(("cup".into(), SplitBy::Boxes([1, 2, 3]))));
        let refused = [
            "grid:3x4",
            "=grid:3x4",
            "a=grid",
            "a=grid:3",
            "a=grid:0x3",
            "a=grid:3x-1",
            "a=boxes:2x2",
            "a=adaptive:2x2",
            "a=cone:3",
            "a=adaptive:",
            "a=adaptive:x",
            "a=grid:1000x1000",
            "a=grid:4294967295x4294967295",
            "",
        ];
        for text in refused {
            assert!(pieces(text).is_err(), "{text}");
        }
        assert!(["-1", "101", "nan", ""].iter().all(|t| overlap(t).is_err()));
    }
}
