//! Measurements of Hither, as ratios against a plain z-buffer and against today's ray casters in one run.
//!
//! Nothing here is a test of speed that can fail: a table says what was measured, on which machine, beside
//! what the papers measured on theirs. [`run`] makes one table or all of them; [`Report`] prints as text and
//! as JSON (`hither.bench/1`).
//!
//! With feature `embree` the ray caster Embree is measured too, if its library (Debian: `libembree-dev`) is
//! on the machine.

pub mod peers;
mod report;
mod tables;
mod timing;

pub use report::{Cell, Column, Report, Table};
pub use tables::{TABLES, TableInfo};

use hither::render::RenderOptions;

/// What may be chosen about a run.
pub struct Options {
    /// A measurement is repeated until this much time has gone by, seconds …
    pub budget_s: f64,
    /// … or this many times; the median counts.
    pub most_runs: usize,
    /// Also measure what takes minutes: the reference z-buffer on scenes of many instances.
    pub slow: bool,
    /// Called with a line on what is being measured.
    pub progress: Box<dyn Fn(&str)>,
}

impl Default for Options {
    fn default() -> Self {
        Options { budget_s: 1.0, most_runs: 25, slow: false, progress: Box::new(|_| {}) }
    }
}

/// Why there is no report.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BenchError {
    /// There is no such table.
    #[error("there is no benchmark \"{name}\"; there are {known}")]
    UnknownTable {
        /// The name that was asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The machine did not let a table be made.
    #[error("benchmark {table}: {fault}")]
    Failed {
        /// The table.
        table: &'static str,
        /// What went wrong.
        fault: String,
    },
}

/// Makes the table called `name` and those called `name-…`, or all of them.
pub fn run(name: Option<&str>, options: &Options) -> Result<Report, BenchError> {
    let wanted: Vec<&TableInfo> = TABLES.iter().filter(|t| name.is_none_or(|n| t.answers_to(n))).collect();
    if let (Some(name), true) = (name, wanted.is_empty()) {
        let mut known: Vec<&str> = TABLES.iter().map(|t| t.name).collect();
        known.dedup();
        return Err(BenchError::UnknownTable { name: name.to_owned(), known: known.join(", ") });
    }
    let level = format!("{:?}", RenderOptions::default().level);
    // The name alone, and not what is inside.
    let mut report = Report::of_this_machine(level.split('(').next().unwrap_or(&level).to_owned());
    for table in wanted {
        (options.progress)(table.name);
        report.tables.push(table.make(options)?);
    }
    Ok(report)
}
