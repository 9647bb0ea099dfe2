//! `hither bench`: how fast, against what?

use crate::failure::Failure;
use crate::files::Files;
use crate::options::ReportOptions;
use crate::{console, outputs};
use std::fmt::Write;

/// How fast, against what? Ratios measured in one run
#[derive(clap::Args)]
#[command(after_help = tables())]
pub struct Arguments {
    /// Which table; without a name all of them, which takes some minutes
    name: Option<String>,
    /// Also measure what takes minutes for one row
    #[arg(long)]
    slow: bool,
    #[command(flatten)]
    report: ReportOptions,
}

/// Measures, and prints a table or all of them.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (verbosity, to) = (arguments.report.verbosity(), arguments.report.json.as_deref());
    Files::default().reports(to)?;
    let spinner = verbosity.spinner("measuring".into());
    let sign = spinner.clone();
    let progress = Box::new(move |what: &str| {
        sign.set_message(what.to_string());
        sign.suspend(|| verbosity.detail(what));
    });
    let options = hither_bench::Options { slow: arguments.slow, progress, ..Default::default() };
    let report = hither_bench::run(arguments.name.as_deref(), &options);
    spinner.finish_and_clear();
    let report = report.map_err(|error| Failure::work(error.to_string()))?;
    match to {
        Some(_) => outputs::write_report(to, &report.to_json()),
        None => console::print(&report.to_string()),
    }
}

fn tables() -> String {
    let mut text = String::from("Tables:");
    for table in hither_bench::TABLES {
        let _ = write!(text, "\n  {:<10} {}", table.name, table.title);
    }
    text
}
