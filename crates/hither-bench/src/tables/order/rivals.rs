//! What engines do instead: sort by one point; what a text book does: all pairs and a topological sort; and the
//! sort as it was published, in comparisons.

use super::{TableInfo, column, walk};
use crate::Options;
use crate::report::{Cell, Table};
use hither::order::{Parts, SortOptions, VisibilitySort};
use hither::reference::ivs;
use hither::scene::Scene;
use std::collections::HashSet;
use std::time::Instant;

pub(crate) const RIVALS: TableInfo = TableInfo {
    name: "order-rivals",
    title: "toothpicks, one frame after ten: pairs in the wrong order by one point; time of all pairs; comparisons",
    make,
    columns: &[
        column("density", "density", 0),
        column("objects", "objects", 0),
        column("pairs", "occluding pairs", 0),
        column("centroid_wrong", "% wrong by centroid", 2),
        column("nearest_wrong", "% wrong by nearest depth", 2),
        column("wrong", "% wrong", 2),
        column("sort_ms", "sort ms", 3),
        column("all_pairs_ms", "all pairs ms", 1),
        column("ratio", "ratio", 0),
        column("tests", "comparisons", 0),
        column("published_tests", "published sort, by distance first", 0),
        column("published_again", "published sort, last order", 0),
    ],
};

fn make(table: &mut Table, options: &Options) -> Result<(), String> {
    let sizes =
        [("ud", 200u64), ("ud", 800), ("ud", 1600), ("us", 200), ("us", 400), ("us", 800), ("us", 1600)];
    for (density, n) in sizes {
        (options.progress)(&format!("order-rivals: {n}, {density}"));
        let spec = format!("toothpicks?n={n}&density={density}");
        let mut rows = Vec::new();
        let mut frame = 0;
        let found = walk(&spec, 11, 1, SortOptions::default(), |scene, parts, sort| {
            frame += 1;
            if frame == 11 {
                rows.push(compare(scene, parts, sort));
            }
        })?;
        let Some(row) = rows.pop() else { return Err("no frame was sorted".into()) };
        let sort_ms = found.times_ms[10];
        table.push([
            Cell::from(density),
            n.into(),
            row.pairs.into(),
            row.centroid.into(),
            row.nearest.into(),
            row.ours.into(),
            sort_ms.into(),
            row.all_pairs_ms.into(),
            (row.all_pairs_ms / sort_ms).into(),
            found.counters[10].exact_tests.into(),
            row.published[0].into(),
            row.published[1].into(),
        ]);
    }
    table.notes.push("pairs that occlude each other have no right order and are not counted".into());
    table.notes.push("all pairs: every pair tested with the same extents and hulls, then components".into());
    table.notes.push(
        "published: comparisons of two parts by the algorithm of figs. 4 and 5, its search for occluders not \
         accelerated; – where it would be more than 2 billion"
            .into(),
    );
    Ok(())
}

struct Row {
    pairs: usize,
    centroid: f64,
    nearest: f64,
    ours: f64,
    all_pairs_ms: f64,
    published: [Option<u64>; 2],
}

fn compare(scene: &Scene, parts: &Parts, sort: &mut VisibilitySort) -> Row {
    let all: Vec<u32> = (0..parts.parts.len() as u32).collect();
    let start = Instant::now();
    let arcs = sort.arcs_among(&all);
    let all_pairs_ms = start.elapsed().as_secs_f64() * 1e3;
    let has: HashSet<(u32, u32)> = arcs.iter().copied().collect();
    let one_way: Vec<(u32, u32)> = arcs.iter().copied().filter(|&(a, b)| !has.contains(&(b, a))).collect();
    let view = scene.view(0, (640, 480)).expect("the world has a camera");
    let instances = scene.instances();
    let depths = |part: u32| {
        let instance = &instances[parts.parts[part as usize].instances[0] as usize];
        let view_from_mesh = view.view_from_world * instance.world_from_mesh;
        let mesh = &scene.meshes[instance.mesh as usize];
        let depth = |p: glam::DVec3| -view_from_mesh.transform_point3(p).z;
        let nearest = mesh.positions.iter().map(|p| depth(p.as_dvec3())).fold(f64::INFINITY, f64::min);
        (depth(mesh.bounds().center()), nearest)
    };
    let depths: Vec<(f64, f64)> = all.iter().map(|&p| depths(p)).collect();
    let share = |wrong: &dyn Fn(usize, usize) -> bool| {
        let count = one_way.iter().filter(|&&(a, b)| wrong(a as usize, b as usize)).count();
        100.0 * count as f64 / one_way.len().max(1) as f64
    };
    let mut place = vec![0; all.len()];
    sort.order().groups().enumerate().for_each(|(i, g)| g.iter().for_each(|&p| place[p as usize] = i));
    let mut by_distance = all.clone();
    by_distance.sort_by(|&a, &b| depths[a as usize].0.total_cmp(&depths[b as usize].0));
    let affordable = all.len() <= 820;
    let published =
        |start: &[u32]| affordable.then(|| ivs::sort(start, false, |a, b| has.contains(&(a, b))).tests);
    Row {
        pairs: arcs.len(),
        centroid: share(&|a, b| depths[a].0 > depths[b].0),
        nearest: share(&|a, b| depths[a].1 > depths[b].1),
        ours: share(&|a, b| place[a] > place[b]),
        all_pairs_ms,
        published: [published(&by_distance), published(sort.order().parts())],
    }
}
