//! Tables 1 to 4 of Coorg & Teller's paper [1996, §4] beside ours: a tree, what share of the hidden polygons
//! is culled and how fast, how that grows with the speed of motion, and threads.
//!
//! The models have the paper's number of polygons and answer to its descriptions, but are not its models.
//! Its machine was an SGI Onyx with 250 MHz R4400 processors. The eye looks all around.

mod future;

pub(crate) use future::FUTURE;

use super::{TableInfo, column, world};
use crate::Options;
use crate::report::{Cell, Table};
use crate::timing::{median, timed};
use glam::DVec3;
use hither::conventions::{Projection, View};
use hither::cull::planes::{Amount, PlaneCuller, PlanesOptions, PolygonModel, Work};
use hither::reference::all_around::sightings;
use hither::render::{RenderOptions, Renderer};
use hither::{IndexOptions, Scene, SceneIndex};
use std::time::Duration;

pub(crate) const TREE: TableInfo = TableInfo {
    name: "planes",
    title: "[Coorg & Teller 1996, table 1] polygons in the tree's leaves, building it, and the first eye",
    make: tree,
    columns: &[
        column("scene", "scene", 0),
        column("polygons", "polygons", 0),
        column("references", "in leaves", 0),
        column("paper_references", "paper's", 0),
        column("build_ms", "build ms", 2),
        column("paper_build_ms", "paper's", 0),
        column("first_ms", "first eye ms", 2),
        column("paper_first_ms", "paper's", 0),
        column("occluders", "large polygons", 0),
    ],
};

pub(crate) const CULLED: TableInfo = TableInfo {
    name: "planes",
    title: "[Coorg & Teller 1996, table 2] share of the hidden polygons that is culled, random walks, one thread",
    make: culled,
    columns: &[
        column("scene", "scene", 0),
        column("tests", "tests", 0),
        column("k", "k", 0),
        column("paper_share", "paper's share", 2),
        column("share", "share", 3),
        column("share_of_exact", "of exactly hidden", 3),
        column("nodes_per_occluder", "nodes/k", 1),
        column("paper_ms", "paper's ms", 1),
        column("time_ms", "ms", 4),
        column("worst_ms", "slowest 1 % ms", 3),
        column("ratio", "paper's/ours", 0),
        column("false_hidden", "false hidden", 0),
    ],
};

pub(crate) const SPEED: TableInfo = TableInfo {
    name: "planes",
    title: "[Coorg & Teller 1996, table 3] time at multiples of walking speed, ms, one thread",
    make: speed,
    columns: &[
        column("scene", "scene", 0),
        column("tests", "tests", 0),
        column("x1_ms", "1", 4),
        column("x2_ms", "2", 4),
        column("x4_ms", "4", 4),
        column("x8_ms", "8", 4),
        column("x16_ms", "16", 4),
        column("growth", "16/1", 2),
        column("paper_growth", "paper's", 2),
        column("scratch_ms", "without memory", 4),
    ],
};

pub(crate) const THREADS: TableInfo = TableInfo {
    name: "planes",
    title: "[Coorg & Teller 1996, table 4] time on several threads, ms",
    make: threads,
    columns: &[
        column("scene", "scene", 0),
        column("tests", "tests", 0),
        column("one_ms", "1", 4),
        column("two_ms", "2", 4),
        column("speedup", "speed-up", 2),
        column("paper_speedup", "paper's at 2", 2),
        column("remembering", "eye", 0),
    ],
};

/// A model with what the paper says of its own.
struct Model {
    name: &'static str,
    references: f64,
    build_ms: f64,
    first_ms: f64,
    /// Share and time, choosing occluders included, with single and with connected occluders.
    single: (f64, f64),
    connected: (f64, f64),
    growth: f64,
    two: f64,
}

const MODELS: [Model; 3] = [
    Model {
        name: "soda",
        references: 2971.0,
        build_ms: 160.0,
        first_ms: 510.0,
        single: (0.73, 24.7),
        connected: (0.75, 22.7),
        growth: 61.0 / 17.0,
        two: 1.3,
    },
    Model {
        name: "city",
        references: 4722.0,
        build_ms: 270.0,
        first_ms: 480.0,
        single: (0.35, 27.5),
        connected: (0.38, 26.5),
        growth: 76.0 / 20.0,
        two: 1.43,
    },
    Model {
        name: "tetra",
        references: 4974.0,
        build_ms: 260.0,
        first_ms: 740.0,
        single: (0.69, 36.6),
        connected: (0.69, 36.6),
        growth: 112.0 / 26.0,
        two: 1.55,
    },
];

/// Walks that are averaged over, and eyes a second.
const WALKS: u32 = 4;
const EYES_A_SECOND: f64 = 10.0;
const SECONDS: f64 = 60.0;
/// Every so manieth eye is held against the z-buffer, and of those every so manieth against the reference.
const COUNTED: usize = 20;
const EXACT: usize = 10;
/// Faces of the cube on which the z-buffer looks all around, pixels.
const FACE: u32 = 1024;
/// Thinner parts are not counted as visible by the reference, radians.
const THINNEST: f64 = 1e-7;

fn options_of() -> [(&'static str, PlanesOptions); 4] {
    let paper = PlanesOptions::paper();
    let everything = PlanesOptions { occluders: Amount::Fixed(32), ..PlanesOptions::default() };
    [
        ("single", PlanesOptions { connected: false, ..paper }),
        ("connected", paper),
        ("all", everything),
        ("all, k automatic", PlanesOptions::default()),
    ]
}

fn walk_of(name: &str, walk: u32, speed: f64) -> Result<Vec<DVec3>, String> {
    let mut scene = world(&format!("{name}?walk={walk}"))?;
    let camera = scene.find_camera("walk").ok_or("the scene has no camera walk")?;
    let eyes = (0..(SECONDS * EYES_A_SECOND / speed) as u32).map(|i| {
        scene.pose(0, f64::from(i) * speed / EYES_A_SECOND);
        scene.world_from_camera(camera).map(|pose| pose.translation)
    });
    eyes.collect::<Option<Vec<DVec3>>>().ok_or_else(|| "the camera has no pose".to_owned())
}

fn tree(table: &mut Table, options: &Options) -> Result<(), String> {
    for model in MODELS {
        let scene = world(model.name)?;
        let eye = walk_of(model.name, 1, 1.0)?[0];
        let (mut builds, mut firsts) = (Vec::new(), Vec::new());
        let mut built = None;
        for _ in 0..options.most_runs.min(9) {
            let (build, mut culler) = timed(|| PlaneCuller::new(&scene, &PlanesOptions::paper()));
            let (first, looked) = timed(|| culler.look_around(eye));
            looked.map_err(|e| e.to_string())?;
            builds.push(build);
            firsts.push(first);
            built = Some(culler);
        }
        let culler = built.ok_or("nothing was built")?;
        table.push([
            Cell::from(model.name),
            culler.model().polygons().len().into(),
            culler.tree_size().0.into(),
            model.references.into(),
            (median(&mut builds).as_secs_f64() * 1e3).into(),
            model.build_ms.into(),
            (median(&mut firsts).as_secs_f64() * 1e3).into(),
            model.first_ms.into(),
            culler.occluder_total().into(),
        ]);
    }
    table
        .notes
        .push("leaves of at most 8 polygons; building includes merging and the area-angle lists".into());
    Ok(())
}

/// For some eyes, which polygons cover a pixel of six pictures all around.
struct Pictures {
    eyes: Vec<(usize, DVec3)>,
    visible: Vec<Vec<bool>>,
}

fn pictures(scene: &Scene, polygons: &PolygonModel, eyes: &[DVec3]) -> Result<Pictures, String> {
    let index = SceneIndex::build(scene.clone(), &IndexOptions::default());
    let chosen: Vec<(usize, DVec3)> = eyes.iter().copied().enumerate().step_by(COUNTED).collect();
    let mut renderer = Renderer::new();
    let mut visible = Vec::new();
    for &(_, eye) in &chosen {
        let mut seen = vec![false; polygons.polygons().len()];
        for (to, up) in [
            (DVec3::X, DVec3::Y),
            (DVec3::NEG_X, DVec3::Y),
            (DVec3::Z, DVec3::Y),
            (DVec3::NEG_Z, DVec3::Y),
            (DVec3::Y, DVec3::X),
            (DVec3::NEG_Y, DVec3::X),
        ] {
            let lens = Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2, near: 0.01 };
            let view = View::look_at(eye, eye + to, up, lens, (FACE, FACE));
            let frame =
                renderer.render(&index, &view, &RenderOptions::default()).map_err(|e| e.to_string())?;
            for y in 0..FACE {
                for x in 0..FACE {
                    if let Some(id) = frame.id(x, y) {
                        seen[polygons.polygon_of(id.instance, id.triangle) as usize] = true;
                    }
                }
            }
            renderer.recycle(frame);
        }
        visible.push(seen);
    }
    Ok(Pictures { eyes: chosen, visible })
}

/// What was summed up over walks.
#[derive(Default)]
struct Sums {
    times: Vec<Duration>,
    occluders: usize,
    work: Work,
    culled: usize,
    hidden: usize,
    exactly_culled: usize,
    exactly_hidden: usize,
    false_hidden: usize,
}

fn culled(table: &mut Table, options: &Options) -> Result<(), String> {
    for model in MODELS {
        let mut sums: Vec<Sums> = options_of().iter().map(|_| Sums::default()).collect();
        for walk in 1..=WALKS {
            (options.progress)(&format!("planes: {}, walk {walk}", model.name));
            let scene = world(model.name)?;
            let eyes = walk_of(model.name, walk, 1.0)?;
            let polygons = PolygonModel::new(&scene);
            let pictures = pictures(&scene, &polygons, &eyes)?;
            let exact: Vec<Vec<u32>> = pictures
                .eyes
                .iter()
                .step_by(EXACT)
                .map(|&(_, eye)| {
                    let seen = sightings(&scene, eye, THINNEST);
                    let mut seen: Vec<u32> =
                        seen.iter().map(|s| polygons.polygon_of(s.instance, s.triangle)).collect();
                    seen.sort_unstable();
                    seen.dedup();
                    seen
                })
                .collect();
            for ((_, how), sums) in options_of().iter().zip(&mut sums) {
                let mut culler = PlaneCuller::new(&scene, how);
                walk_along(&mut culler, &eyes, &pictures, &exact, sums)?;
            }
        }
        for (i, ((tests, _), mut sums)) in options_of().into_iter().zip(sums).enumerate() {
            let eyes = sums.times.len() as f64;
            let (share, paper_ms) = if i == 0 { model.single } else { model.connected };
            let mean = sums.times.iter().sum::<Duration>().as_secs_f64() * 1e3 / eyes;
            sums.times.sort_unstable();
            let worst = sums.times[sums.times.len() * 99 / 100].as_secs_f64() * 1e3;
            table.push([
                Cell::from(model.name),
                tests.into(),
                (sums.occluders as f64 / eyes).into(),
                share.into(),
                (sums.culled as f64 / sums.hidden as f64).into(),
                (sums.exactly_culled as f64 / sums.exactly_hidden as f64).into(),
                ((sums.work.relations as f64) / sums.occluders as f64).into(),
                paper_ms.into(),
                mean.into(),
                worst.into(),
                (paper_ms / mean).into(),
                sums.false_hidden.into(),
            ]);
        }
    }
    table.notes.push(format!(
        "{WALKS} walks of a minute, {EYES_A_SECOND} eyes a second; time includes choosing occluders, as the paper's here"
    ));
    table.notes.push(format!(
        "share: of the polygons without a pixel in six z-buffer pictures of {FACE}x{FACE}, as the paper counts"
    ));
    table.notes.push(
        "false hidden: polygons with a pixel, or an exactly visible part, that were called hidden".into(),
    );
    Ok(())
}

fn walk_along(
    culler: &mut PlaneCuller,
    eyes: &[DVec3],
    pictures: &Pictures,
    exact: &[Vec<u32>],
    sums: &mut Sums,
) -> Result<(), String> {
    let all = culler.model().polygons().len();
    let mut next = 0;
    for (i, &eye) in eyes.iter().enumerate() {
        let (time, looked) = timed(|| culler.look_around(eye));
        let looked = looked.map_err(|e| e.to_string())?;
        sums.times.push(time);
        sums.occluders += looked.occluders;
        sums.work += looked.work;
        if pictures.eyes.get(next).is_none_or(|e| e.0 != i) {
            continue;
        }
        let mut maybe = vec![false; all];
        looked.visible.iter().for_each(|&p| maybe[p as usize] = true);
        let seen = &pictures.visible[next];
        sums.hidden += seen.iter().filter(|s| !**s).count();
        sums.culled += maybe.iter().zip(seen).filter(|(m, s)| !**m && !**s).count();
        sums.false_hidden += maybe.iter().zip(seen).filter(|(m, s)| !**m && **s).count();
        if next % EXACT == 0 {
            let seen = &exact[next / EXACT];
            sums.exactly_hidden += all - seen.len();
            sums.exactly_culled += all - looked.visible.len();
            sums.false_hidden += seen.iter().filter(|&&p| !maybe[p as usize]).count();
        }
        next += 1;
    }
    Ok(())
}

/// Mean time of an eye on walk 1; `forget` makes each the first. The best of some runs for every eye.
fn mean_ms(
    name: &str,
    how: &PlanesOptions,
    speed: f64,
    forget: bool,
    options: &Options,
) -> Result<f64, String> {
    let eyes = walk_of(name, 1, speed)?;
    let scene = world(name)?;
    let mut best = vec![Duration::MAX; eyes.len()];
    for _ in 0..options.most_runs.min(5) {
        let mut culler = PlaneCuller::new(&scene, how);
        culler.look_around(eyes[0]).map_err(|e| e.to_string())?;
        for (&eye, best) in eyes.iter().zip(&mut best) {
            if forget {
                culler.forget_nodes();
            }
            let (time, looked) = timed(|| culler.look_around(eye));
            looked.map_err(|e| e.to_string())?;
            *best = time.min(*best);
        }
    }
    Ok(best.iter().sum::<Duration>().as_secs_f64() * 1e3 / best.len() as f64)
}

fn speed(table: &mut Table, options: &Options) -> Result<(), String> {
    for model in MODELS {
        for (tests, how) in options_of().into_iter().skip(1) {
            (options.progress)(&format!("planes: {} at several speeds", model.name));
            let mut times = Vec::new();
            for speed in [1.0, 2.0, 4.0, 8.0, 16.0] {
                times.push(mean_ms(model.name, &how, speed, false, options)?);
            }
            let scratch = mean_ms(model.name, &how, 1.0, true, options)?;
            let mut row = vec![Cell::from(model.name), tests.into()];
            row.extend(times.iter().map(|&t| Cell::from(t)));
            row.extend([(times[4] / times[0]).into(), model.growth.into(), scratch.into()]);
            table.push(row);
        }
    }
    table.notes.push("without memory: every eye as if it were the first".into());
    Ok(())
}

fn threads(table: &mut Table, options: &Options) -> Result<(), String> {
    for model in MODELS {
        for (tests, how) in options_of().into_iter().skip(1) {
            for forget in [false, true] {
                (options.progress)(&format!("planes: {} on threads", model.name));
                let of = |threads| {
                    let how = PlanesOptions { threads, ..how };
                    mean_ms(model.name, &how, 1.0, forget, options)
                };
                let (one, two) = (of(1)?, of(2)?);
                table.push([
                    Cell::from(model.name),
                    tests.into(),
                    one.into(),
                    two.into(),
                    (one / two).into(),
                    model.two.into(),
                    if forget { "first" } else { "walking" }.into(),
                ]);
            }
        }
    }
    Ok(())
}
