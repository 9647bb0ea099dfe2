//! The canyon in the table of [Snyder & Lengyel 1997, §12.2]: splits of the terrain, time, and how often parts are
//! drawn if aircraft are drawn every fifth frame, the terrain in 70 % and the sky in 40 % of the frames, and what
//! is merged always: the paper's assumptions.

use super::{FRAMES, TableInfo, column, walk};
use crate::Options;
use crate::report::{Cell, Table};
use hither::layers::decompose;
use hither::order::{Parts, SortOptions, VisibilitySort};
use hither::scene::Scene;

pub(crate) const CANYON: TableInfo = TableInfo {
    name: "order-canyon",
    title: "canyon flyby: splits of the terrain (§12.2); shares in per cent",
    make,
    columns: &[
        column("grid", "grid", 0),
        column("who", "", 0),
        column("pieces", "pieces", 0),
        column("polygons", "polygons/piece", 1),
        column("hull_polygons", "hull polygons/piece", 1),
        column("mean_ms", "mean ms", 3),
        column("worst_ms", "worst ms", 3),
        column("expansion", "expansion", 2),
        column("layers_merged", "layers merged", 1),
        column("parts_merged", "parts merged", 1),
        column("unit_merged", "rate, unit", 1),
        column("unit_alone", "no penalty", 1),
        column("polygon_merged", "rate, polygons", 1),
        column("polygon_alone", "no penalty", 1),
    ],
};

/// Grid, pieces, polygons and hull polygons a piece, mean and worst ms, expansion, shares.
const PAPER: [[f64; 13]; 5] = [
    [20.0, 390.0, 31.98, 29.01, 17.33, 29.82, 5.04, 0.1, 0.2, 58.3, 58.1, 41.8, 40.7],
    [14.0, 191.0, 48.91, 37.78, 8.08, 14.59, 3.78, 0.4, 1.0, 51.3, 50.2, 38.0, 36.0],
    [10.0, 100.0, 76.48, 42.42, 5.17, 9.88, 3.09, 1.9, 6.4, 48.7, 40.9, 40.4, 30.7],
    [7.0, 49.0, 130.45, 57.51, 4.51, 9.68, 2.58, 5.2, 22.5, 51.9, 37.8, 42.4, 27.8],
    [5.0, 25.0, 225.32, 72.72, 5.37, 11.01, 2.28, 13.0, 53.1, 71.5, 32.3, 72.0, 26.1],
];

/// Triangles of the terrain before it is split.
const UNSPLIT: f64 = 2450.0;

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    for paper in PAPER {
        (options.progress)(&format!("order-canyon: {}", paper[0]));
        let mut row = vec![Cell::from(format!("{0}×{0}", paper[0])), "paper".into()];
        row.extend(paper[1..].iter().map(|&x| Cell::from(x)));
        table.push(row);
        let mut sums = Sums::default();
        let spec = format!("canyon?grid={}", paper[0]);
        let found = walk(&spec, FRAMES, 3, SortOptions::default(), |scene, parts, sort| {
            sums.add(scene, parts, sort)
        })?;
        let frames = f64::from(FRAMES);
        let share = |x: f64| 100.0 * x / frames;
        table.push([
            Cell::Nothing,
            "hither".into(),
            sums.pieces.into(),
            (sums.terrain / sums.pieces).into(),
            (sums.terrain_hulls / sums.pieces).into(),
            found.mean().into(),
            found.worst().into(),
            (sums.terrain / UNSPLIT).into(),
            share(sums.layers_merged).into(),
            share(sums.parts_merged).into(),
            share(sums.rates[0]).into(),
            share(sums.rates[1]).into(),
            share(sums.rates[2]).into(),
            share(sums.rates[3]).into(),
        ]);
    }
    table.notes.push(
        "parts whose box is outside the view are not counted as merged or drawn, as in the paper; its view, valley \
         and aircraft are others"
            .into(),
    );
    Ok(())
}

#[derive(Default)]
struct Sums {
    pieces: f64,
    terrain: f64,
    terrain_hulls: f64,
    layers_merged: f64,
    parts_merged: f64,
    /// Unit weights with and without the penalty, then polygon weights.
    rates: [f64; 4],
}

impl Sums {
    fn add(&mut self, scene: &Scene, parts: &Parts, sort: &mut VisibilitySort) {
        let is_terrain = |p: usize| parts.parts[p].name.starts_with("terrain");
        let of = |all: &dyn Fn(usize) -> f64| {
            (0..parts.parts.len()).filter(|&p| is_terrain(p)).map(all).sum::<f64>()
        };
        self.pieces = of(&|_| 1.0);
        self.terrain = of(&|p| parts.parts[p].triangles as f64);
        self.terrain_hulls = of(&|p| parts.hull_triangles(p) as f64);
        let seen = seen(scene, parts);
        let order = sort.order().clone();
        let components = decompose(&order, |group| sort.arcs_among(group));
        let (mut layers, mut merged_layers, mut count, mut merged) = (0.0, 0.0, 0.0, 0.0);
        let mut rates = [0.0; 4];
        let mut polygons = 0.0;
        for layer in components.iter().flat_map(|c| &c.layers) {
            let visible: Vec<usize> = layer.iter().map(|&p| p as usize).filter(|&p| seen[p]).collect();
            if visible.is_empty() {
                continue;
            }
            let several = layer.len() > 1;
            layers += 1.0;
            merged_layers += f64::from(several);
            for part in visible {
                let name = &parts.parts[part].name;
                let own = if name == "sky" {
                    0.4
                } else if is_terrain(part) {
                    0.7
                } else {
                    0.2
                };
                let rate = if several { 1.0 } else { own };
                let weight = parts.parts[part].triangles as f64;
                // The terrain's rates are scaled by what the splitting adds to it.
                let expanded = if is_terrain(part) { self.terrain / UNSPLIT } else { 1.0 };
                count += 1.0;
                merged += f64::from(several);
                polygons += weight / expanded;
                rates[0] += rate;
                rates[1] += own;
                rates[2] += rate * weight;
                rates[3] += own * weight;
            }
        }
        if count > 0.0 {
            self.layers_merged += merged_layers / layers;
            self.parts_merged += merged / count;
            let totals = [count, count, polygons, polygons];
            for (sum, (rate, total)) in self.rates.iter_mut().zip(rates.iter().zip(totals)) {
                *sum += rate / total;
            }
        }
    }
}

/// Which parts' boxes meet the view.
fn seen(scene: &Scene, parts: &Parts) -> Vec<bool> {
    let view = scene.view(0, (640, 480)).expect("the world has a camera");
    let scale = view.pixels_per_unit();
    let (w, h) = (f64::from(view.width) * 0.5 / scale, f64::from(view.height) * 0.5 / scale);
    let instances = scene.instances();
    let outside = |part: usize| {
        let instance = &instances[parts.parts[part].instances[0] as usize];
        let bounds = scene.meshes[instance.mesh as usize].bounds();
        let view_from_mesh = view.view_from_world * instance.world_from_mesh;
        let corners: Vec<glam::DVec3> = (0..8)
            .map(|i| {
                let pick = |bit: u32, k: usize| if i >> bit & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
                view_from_mesh.transform_point3(glam::DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2)))
            })
            .collect();
        let beyond = |plane: &dyn Fn(&glam::DVec3) -> f64| corners.iter().all(|c| plane(c) > 0.0);
        beyond(&|c| c.z)
            || beyond(&|c| c.x + w * c.z)
            || beyond(&|c| -c.x + w * c.z)
            || beyond(&|c| c.y + h * c.z)
            || beyond(&|c| -c.y + h * c.z)
    };
    (0..parts.parts.len()).map(|p| !outside(p)).collect()
}
