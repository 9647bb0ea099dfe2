//! The tables, one file each.

mod box_tests;
mod coherence;
mod cull;
mod drawing_inputs;
mod exact;
mod greene;
mod growth;
mod lines;
mod load;
mod order;
mod planes;
mod scaling;
mod simple;
mod trees;

use crate::report::{Column, Table};
use crate::timing::{Sample, medians_ms, timed};
use crate::{BenchError, Options};
use hither::conventions::View;
use hither::render::{Counters, RenderOptions, Renderer};
use hither::{IndexOptions, Scene, SceneIndex};
use std::time::Duration;

/// A table that can be asked for.
#[derive(Clone, Copy, Debug)]
pub struct TableInfo {
    /// Its name.
    pub name: &'static str,
    /// What it shows, in a line.
    pub title: &'static str,
    make: fn(&mut Table, &Options) -> Result<(), String>,
    columns: &'static [Column],
}

impl TableInfo {
    /// Whether `name` is its name or that of its family, which ends where a hyphen follows.
    pub(crate) fn answers_to(&self, name: &str) -> bool {
        self.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
    }

    pub(crate) fn make(&self, options: &Options) -> Result<Table, BenchError> {
        let mut table = Table::new(self.name, self.title, self.columns);
        (self.make)(&mut table, options).map_err(|fault| BenchError::Failed { table: self.name, fault })?;
        Ok(table)
    }
}

/// All tables, in the order in which they are made.
pub static TABLES: &[TableInfo] = &[
    exact::INFO,
    greene::INFO,
    growth::INFO,
    simple::INFO,
    scaling::THREADS,
    scaling::WINDOWS,
    coherence::INFO,
    box_tests::INFO,
    trees::INFO,
    load::INFO,
    lines::INFO,
    lines::GROWTH,
    order::OBJECTS,
    order::BUILD,
    order::COHERENCE,
    order::EXTENTS,
    order::STATISTICS,
    order::CANYON,
    order::RIVALS,
    cull::INFO,
    cull::OF_SCENES,
    planes::TREE,
    planes::CULLED,
    planes::SPEED,
    planes::THREADS,
    planes::FUTURE,
];

const fn column(key: &'static str, title: &'static str, digits: usize) -> Column {
    Column { key, title, digits }
}

/// The two sizes that everything is measured at.
const SIZES: [(u32, u32); 2] = [(512, 512), (1920, 1080)];

fn world(spec: &str) -> Result<Scene, String> {
    hither_worlds::generate(spec).map_err(|e| e.to_string())
}

fn index(spec: &str) -> Result<SceneIndex, String> {
    Ok(SceneIndex::build(world(spec)?, &IndexOptions::default()))
}

fn view(scene: &Scene, camera: &str, size: (u32, u32)) -> Result<View, String> {
    let view = scene.find_camera(camera).and_then(|c| scene.view(c, size));
    view.ok_or_else(|| format!("the scene has no camera {camera}"))
}

/// Median time of a frame from scratch, and what it did.
fn frame_ms(
    index: &SceneIndex,
    view: &View,
    render: &RenderOptions,
    options: &Options,
) -> Result<(f64, Counters), String> {
    let [measured] = frames_ms(index, view, [render], options)?;
    Ok(measured)
}

/// As [`frame_ms`] for several ways of rendering, measured in turns.
fn frames_ms<const N: usize>(
    index: &SceneIndex,
    view: &View,
    ways: [&RenderOptions; N],
    options: &Options,
) -> Result<[(f64, Counters); N], String> {
    let mut frames = ways.map(|how| Frames::new(index, view, how));
    let mut samples = frames.each_mut().map(|frames| || frames.sample());
    let times = medians_ms(options, samples.each_mut().map(|sample| sample as Sample));
    let mut measured = times.map(|time| (time, Counters::default()));
    for ((_, counters), frames) in measured.iter_mut().zip(frames) {
        *counters = frames.counters()?;
    }
    Ok(measured)
}

/// Frames of a view, each from scratch, one way.
struct Frames<'a> {
    index: &'a SceneIndex,
    view: &'a View,
    how: &'a RenderOptions,
    renderer: Renderer,
    last: Result<Counters, String>,
}

impl<'a> Frames<'a> {
    fn new(index: &'a SceneIndex, view: &'a View, how: &'a RenderOptions) -> Frames<'a> {
        Frames { index, view, how, renderer: Renderer::new(), last: Ok(Counters::default()) }
    }

    /// Draws one; how long that took.
    fn sample(&mut self) -> Duration {
        let (time, frame) = timed(|| self.renderer.render(self.index, self.view, self.how));
        self.last = frame.map_err(|e| e.to_string()).map(|frame| {
            let counters = frame.counters;
            self.renderer.recycle(frame);
            counters
        });
        time
    }

    /// What the last one did.
    fn counters(self) -> Result<Counters, String> {
        self.last
    }
}
