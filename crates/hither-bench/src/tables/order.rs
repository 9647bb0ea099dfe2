//! Visibility sorting in the tables of [Snyder & Lengyel 1997, figs. 18–21, §12.1, §12.2], ours beside the paper's,
//! and against sorting by one point and against all pairs.
//!
//! A frame's time is that of placing the parts and sorting them; posing the scene is not in it. Their times are of
//! a Pentium II at 300 MHz.

mod canyon;
mod rivals;

use super::{TableInfo, column, world};
use crate::Options;
use crate::report::{Cell, Table};
pub(crate) use canyon::CANYON;
use hither::Scene;
use hither::order::{BroadPhase, Counters, Granularity, Parts, SortOptions, VisibilitySort};
pub(crate) use rivals::RIVALS;
use std::time::Instant;

/// A walk through a world's animation.
pub(crate) struct Walk {
    /// Of each frame.
    pub(crate) times_ms: Vec<f64>,
    pub(crate) counters: Vec<Counters>,
    /// Groups in each frame's order.
    pub(crate) groups: Vec<usize>,
}

impl Walk {
    fn mean(&self) -> f64 {
        self.times_ms.iter().sum::<f64>() / self.times_ms.len() as f64
    }

    fn worst(&self) -> f64 {
        self.times_ms.iter().copied().fold(0.0, f64::max)
    }

    fn average(&self, of: impl Fn(&Counters, f64) -> f64) -> f64 {
        let each = self.counters.iter().zip(&self.groups).map(|(c, &g)| of(c, g as f64));
        each.sum::<f64>() / self.counters.len() as f64
    }
}

/// Frames of the animation.
const FRAMES: u32 = 250;

/// Sorts a world frame by frame; `visit` sees the sort after each. Each frame is timed `runs` times over the whole
/// walk, and the least counts: a frame that was disturbed does not.
pub(crate) fn walk(
    spec: &str,
    frames: u32,
    runs: usize,
    options: SortOptions,
    mut visit: impl FnMut(&Scene, &Parts, &mut VisibilitySort),
) -> Result<Walk, String> {
    let mut scene = world(spec)?;
    let parts = Parts::of(&scene, &Granularity::Instances).map_err(|e| e.to_string())?;
    let known = hither_worlds::known_relations(&scene);
    let mut found =
        Walk { times_ms: vec![f64::INFINITY; frames as usize], counters: Vec::new(), groups: Vec::new() };
    for run in 0..runs {
        let mut sort = VisibilitySort::new(options);
        parts.add_to(&mut sort);
        known.iter().for_each(|&(a, b, k)| sort.know(a, b, k));
        hither_worlds::backdrops(&scene).into_iter().for_each(|p| sort.set_backdrop(p, true));
        for frame in 0..frames {
            scene.pose(0, f64::from(frame) / 60.0);
            let instances = scene.instances();
            let eye = scene.view(0, (640, 480)).ok_or("the world has no camera")?.eye_in_world();
            let start = Instant::now();
            parts.place_at(&mut sort, &instances);
            sort.sort(eye);
            let time = start.elapsed().as_secs_f64() * 1e3;
            let least = &mut found.times_ms[frame as usize];
            *least = least.min(time);
            if run == 0 {
                found.counters.push(sort.counters());
                found.groups.push(sort.order().groups().count());
                visit(&scene, &parts, &mut sort);
            }
        }
    }
    Ok(found)
}

fn runs(objects: u64) -> (u32, usize) {
    match objects {
        0..=1_600 => (FRAMES, 3),
        1_601..=12_800 => (100, 2),
        _ => (40, 2),
    }
}

fn ignore(_: &Scene, _: &Parts, _: &mut VisibilitySort) {}

pub(crate) const OBJECTS: TableInfo = TableInfo {
    name: "order",
    title: "toothpicks: time of a frame by number of objects (fig. 18), ud uniform density, us uniform scale",
    make: objects,
    columns: &[
        column("density", "density", 0),
        column("objects", "objects", 0),
        column("paper_mean_ms", "paper, mean ms", 2),
        column("paper_worst_ms", "paper, worst ms", 2),
        column("mean_ms", "mean ms", 3),
        column("worst_ms", "worst ms", 3),
        column("exponent", "growth n^", 2),
        column("candidates", "candidates", 0),
        column("exact_tests", "exact tests", 0),
        column("arcs_found", "arcs found", 0),
    ],
};

/// Objects, and the paper's mean and worst milliseconds in both densities.
#[expect(clippy::approx_constant, reason = "6.28 is a time here")]
const FIG_18: [(u64, [f64; 4]); 7] = [
    (25, [1.51, 2.40, 1.32, 2.28]),
    (50, [2.51, 3.55, 2.17, 3.11]),
    (100, [4.81, 6.28, 4.21, 5.57]),
    (200, [9.97, 11.8, 10.1, 11.9]),
    (400, [23.1, 26.3, 27.0, 30.5]),
    (800, [51.7, 56.9, 92.5, 134.0]),
    (1600, [122.0, 131.0, 849.0, 3090.0]),
];

fn objects(table: &mut Table, options: &Options) -> Result<(), String> {
    for (density, at) in [("ud", 0), ("us", 2)] {
        let paper = FIG_18.iter().map(|&(n, ms)| (n, Some(ms[at]), Some(ms[at + 1])));
        let beyond: &[u64] = match density {
            "ud" => &[3_200, 6_400, 12_800, 25_600, 51_200, 102_400],
            _ => &[],
        };
        let rows = paper.chain(beyond.iter().map(|&n| (n, None, None)));
        let mut times: Vec<(u64, f64)> = Vec::new();
        for (n, mean, worst) in rows {
            (options.progress)(&format!("order: {n} toothpicks, {density}"));
            let (frames, runs) = runs(n);
            let spec = format!("toothpicks?n={n}&density={density}");
            let found = walk(&spec, frames, runs, SortOptions::default(), ignore)?;
            times.push((n, found.mean()));
            let last = times.len().saturating_sub(2);
            table.push([
                Cell::from(density),
                n.into(),
                mean.into(),
                worst.into(),
                found.mean().into(),
                found.worst().into(),
                growth(&times[last..]).into(),
                found.average(|c, _| c.candidates as f64).into(),
                found.average(|c, _| c.exact_tests as f64).into(),
                found.average(|c, _| c.arcs_found as f64).into(),
            ]);
        }
        if density == "ud" {
            let fits = [0, 3, 6].map(|from| {
                format!("from {}: n^{:.2}", times[from].0, growth(&times[from..]).unwrap_or(f64::NAN))
            });
            table.notes.push(format!("growth, fitted to the rows of uniform density {}", fits.join("; ")));
        }
    }
    table.notes.push(
        "20 more parts are the cube's, and count for the growth; the first frame, sorted from nothing, is in the mean"
            .into(),
    );
    Ok(())
}

/// The exponent that fits times of so many objects and the cube's parts best, by least squares of the logarithms.
fn growth(times: &[(u64, f64)]) -> Option<f64> {
    let points: Vec<(f64, f64)> = times.iter().map(|&(n, ms)| (((n + 20) as f64).ln(), ms.ln())).collect();
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>();
    let spread = points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    (spread > 0.0).then_some(slope / spread)
}

pub(crate) const BUILD: TableInfo = TableInfo {
    name: "order-build",
    title: "toothpicks: the first frame, all from nothing, beside the paper's building of its kd-tree (fig. 19)",
    make: build,
    columns: &[
        column("objects", "objects", 0),
        column("paper_ud_ms", "paper, ud ms", 2),
        column("ud_ms", "ud ms", 3),
        column("paper_us_ms", "paper, us worst ms", 2),
        column("us_ms", "us ms", 3),
        column("tree_ud_ms", "kd-tree ud ms", 3),
    ],
};

const FIG_19: [(u64, f64, f64); 7] = [
    (25, 6.61, 6.14),
    (50, 9.52, 9.51),
    (100, 17.5, 17.6),
    (200, 36.6, 36.7),
    (400, 75.9, 77.4),
    (800, 173.0, 181.0),
    (1600, 387.0, 442.0),
];

fn build(table: &mut Table, options: &Options) -> Result<(), String> {
    for (n, paper_ud, paper_us) in FIG_19 {
        (options.progress)(&format!("order-build: {n}"));
        let first = |density, broad_phase| {
            let spec = format!("toothpicks?n={n}&density={density}");
            let options = SortOptions { broad_phase, ..SortOptions::default() };
            Ok::<f64, String>(walk(&spec, 1, 9, options, ignore)?.times_ms[0])
        };
        let (ud, us) = (first("ud", BroadPhase::Grids)?, first("us", BroadPhase::Grids)?);
        let tree = first("ud", BroadPhase::KdTree)?;
        table.push([Cell::from(n), paper_ud.into(), ud.into(), paper_us.into(), us.into(), tree.into()]);
    }
    Ok(())
}

pub(crate) const COHERENCE: TableInfo = TableInfo {
    name: "order-coherence",
    title: "200 toothpicks at growing speed (fig. 20)",
    make: coherence,
    columns: &[
        column("speed", "speed", 3),
        column("paper_mean_ms", "paper, mean ms", 2),
        column("paper_worst_ms", "paper, worst ms", 2),
        column("mean_ms", "mean ms", 3),
        column("worst_ms", "worst ms", 3),
        column("scratch_ms", "each from scratch, mean ms", 3),
        column("moved_up", "moved up", 1),
    ],
};

/// Speed, and the paper's mean and worst.
const FIG_20: [(f64, f64, f64); 11] = [
    (0.125, 8.73, 10.3),
    (0.25, 9.15, 10.9),
    (0.5, 9.52, 11.2),
    (1.0, 9.78, 11.6),
    (2.0, 11.0, 13.2),
    (4.0, 12.6, 15.3),
    (8.0, 13.8, 16.7),
    (16.0, 16.1, 19.5),
    (32.0, 19.3, 25.0),
    (48.0, 22.5, 26.9),
    (64.0, 25.2, 32.0),
];

fn coherence(table: &mut Table, options: &Options) -> Result<(), String> {
    for (speed, mean, worst) in FIG_20 {
        (options.progress)(&format!("order-coherence: {speed}"));
        let spec = format!("toothpicks?n=200&speed={speed}");
        let found = walk(&spec, FRAMES, 3, SortOptions::default(), ignore)?;
        let scratch = SortOptions { incremental: false, ..SortOptions::default() };
        let scratch = walk(&spec, FRAMES, 3, scratch, ignore)?;
        table.push([
            Cell::from(speed),
            mean.into(),
            worst.into(),
            found.mean().into(),
            found.worst().into(),
            scratch.mean().into(),
            found.average(|c, _| c.moved_up as f64).into(),
        ]);
    }
    Ok(())
}

pub(crate) const EXTENTS: TableInfo = TableInfo {
    name: "order-extents",
    title: "toothpicks: occluders found by depth and directions, by depth alone, by the kd-tree (fig. 21)",
    make: extents,
    columns: &[
        column("density", "density", 0),
        column("objects", "objects", 0),
        column("paper_k3_ms", "paper, k = 3 ms", 2),
        column("paper_k1_ms", "paper, k = 1 ms", 2),
        column("grids_ms", "grids ms", 3),
        column("depth_ms", "depth alone ms", 3),
        column("ratio", "ratio", 2),
        column("tree_ms", "kd-tree ms", 3),
    ],
};

const FIG_21: [(u64, [f64; 4]); 6] = [
    (50, [2.51, 2.65, 2.17, 2.28]),
    (100, [4.81, 5.48, 4.21, 4.79]),
    (200, [9.97, 12.7, 10.1, 12.9]),
    (400, [23.1, 38.0, 27.0, 47.2]),
    (800, [51.7, 124.0, 92.5, 215.0]),
    (1600, [122.0, 447.0, 849.0, 1780.0]),
];

fn extents(table: &mut Table, options: &Options) -> Result<(), String> {
    for (density, at) in [("ud", 0), ("us", 2)] {
        for (n, paper) in FIG_21 {
            (options.progress)(&format!("order-extents: {n}, {density}"));
            let spec = format!("toothpicks?n={n}&density={density}");
            let all = walk(&spec, FRAMES, 2, SortOptions::default(), ignore)?.mean();
            let by = |broad_phase| SortOptions { broad_phase, ..SortOptions::default() };
            let depth = walk(&spec, FRAMES, 2, by(BroadPhase::Depth), ignore)?.mean();
            let tree = walk(&spec, FRAMES, 2, by(BroadPhase::KdTree), ignore)?.mean();
            table.push([
                Cell::from(density),
                n.into(),
                paper[at].into(),
                paper[at + 1].into(),
                all.into(),
                depth.into(),
                (depth / all).into(),
                tree.into(),
            ]);
        }
    }
    Ok(())
}

pub(crate) const STATISTICS: TableInfo = TableInfo {
    name: "order-statistics",
    title: "toothpicks: cycles, averaged over all frames (§12.1)",
    make: statistics,
    columns: &[
        column("measure", "measure", 0),
        column("paper_200", "paper 200", 4),
        column("n200", "200", 4),
        column("paper_1600_ud", "paper 1600 ud", 4),
        column("n1600_ud", "1600 ud", 4),
        column("paper_1600_us", "paper 1600 us", 4),
        column("n1600_us", "1600 us", 4),
    ],
};

fn statistics(table: &mut Table, options: &Options) -> Result<(), String> {
    let mut found = Vec::new();
    for spec in ["toothpicks?n=200", "toothpicks?n=1600", "toothpicks?n=1600&density=us"] {
        (options.progress)(&format!("order-statistics: {spec}"));
        found.push(walk(spec, FRAMES, 1, SortOptions::default(), ignore)?);
    }
    let paper: [(&str, [f64; 3]); 4] = [
        ("share of components that are cycles", [0.0454, 0.04633, 0.2542]),
        ("share of parts in cycles", [0.0907, 0.0929, 0.5642]),
        ("mean size of a cycle", [2.097, 2.107, 3.798]),
        ("largest cycle", [2.64, 3.672, 45.588]),
    ];
    for (row, (measure, paper)) in paper.into_iter().enumerate() {
        let ours = |walk: &Walk| match row {
            0 => walk.average(|c, groups| c.groups as f64 / groups),
            1 => walk.average(|c, _| c.grouped_parts as f64 / c.parts as f64),
            2 => {
                let with: Vec<&Counters> = walk.counters.iter().filter(|c| c.groups > 0).collect();
                with.iter().map(|c| c.grouped_parts as f64 / c.groups as f64).sum::<f64>() / with.len() as f64
            }
            _ => walk.average(|c, _| c.largest_group as f64),
        };
        let mut cells = vec![Cell::from(measure)];
        for (paper, walk) in paper.iter().zip(&found) {
            cells.push((*paper).into());
            cells.push(ours(walk).into());
        }
        table.push(cells);
    }
    Ok(())
}
