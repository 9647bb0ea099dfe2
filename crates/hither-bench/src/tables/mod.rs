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
use crate::timing::median_ms;
use crate::{BenchError, Options};
use hither::conventions::View;
use hither::render::{Counters, RenderOptions, Renderer};
use hither::{IndexOptions, Scene, SceneIndex};
use std::time::Instant;

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
    let mut renderer = Renderer::new();
    let mut counters = Counters::default();
    let mut fault = None;
    let time = median_ms(options, || {
        let start = Instant::now();
        let frame = renderer.render(index, view, render);
        let time = start.elapsed();
        match frame {
            Ok(frame) => {
                counters = frame.counters;
                renderer.recycle(frame);
            }
            Err(e) => fault = Some(e.to_string()),
        }
        time
    });
    fault.map_or(Ok((time, counters)), Err)
}
