//! Everything that can be checked, part by part. A part passes, fails, or says why it was skipped and what to
//! install; none is left out silently. The tests' own closing lines come last.

mod embree;
mod fuzz;
mod neon;
mod readers;

use crate::tidy;
use anyhow::{Context, Result};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// How a part ended.
pub enum Outcome {
    /// All was well.
    Passed,
    /// Something was wrong; it has been printed.
    Failed,
    /// It could not run; what to install so that it can.
    Skipped(String),
}

/// What the parts share.
pub struct Job<'a> {
    /// The workspace.
    pub root: &'a Path,
    /// Whether to install what is missing, system packages included, and to let nothing be skipped.
    pub require_all: bool,
    /// Closing lines of test runners, in order.
    pub results: Vec<String>,
}

type Part = fn(&mut Job) -> Result<Outcome>;

const PARTS: &[(&str, Part)] = &[
    ("tidy", |job| Ok(passed(tidy::run(job.root, false)?))),
    ("tests", |job| job.cargo_test(&["--workspace", "--no-fail-fast"])),
    ("without vector instructions", |job| job.cargo_test(WITHOUT_VECTORS)),
    ("NEON", neon::run),
    ("documentation", documentation),
    ("fuzz targets", fuzz::run),
    ("files read by others", readers::run),
    ("Embree agrees", embree::run),
];

/// One scene, all algorithms, one truth: with code that uses no vector instructions among the instruction sets.
const WITHOUT_VECTORS: &[&str] =
    &["--package=hither", "--profile=portable", "--features=portable", "--test=visibility"];

/// Runs every part and prints what became of each. Says whether all is well.
pub fn run(root: &Path, require_all: bool) -> Result<bool> {
    let mut job = Job { root, require_all, results: Vec::new() };
    let mut report = Vec::new();
    let mut all_well = true;
    for (name, part) in PARTS {
        println!("== {name}");
        let start = Instant::now();
        let outcome = part(&mut job).with_context(|| format!("part `{name}`"))?;
        let seconds = start.elapsed().as_secs_f64();
        let (word, note) = match outcome {
            Outcome::Passed => ("passed", String::new()),
            Outcome::Failed => ("FAILED", String::new()),
            Outcome::Skipped(why) if require_all => ("FAILED", format!("  could not run: {why}")),
            Outcome::Skipped(why) => ("skipped", format!("  {why}")),
        };
        all_well &= word != "FAILED";
        report.push(format!("{name:<28} {word:<8} {seconds:>6.1} s{note}"));
    }
    println!("== parts");
    for line in report.iter().chain(&job.results) {
        println!("{line}");
    }
    Ok(all_well)
}

/// The outcome of a part that ran.
pub fn passed(well: bool) -> Outcome {
    if well { Outcome::Passed } else { Outcome::Failed }
}

/// Whether a command could be run and ended well; what it prints is of no interest.
fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

impl Job<'_> {
    /// Where cargo puts what it builds.
    fn target(&self) -> PathBuf {
        let folder = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
        self.root.join(Path::new(&folder))
    }

    /// Runs `cargo test` with `arguments`; see [`Job::run_tests`].
    pub fn cargo_test(&mut self, arguments: &[&str]) -> Result<Outcome> {
        let mut command = Command::new(env!("CARGO"));
        command.arg("test").args(arguments);
        self.run_tests(command, &[])
    }

    /// Runs a `cargo test` in the workspace, showing its output and keeping its closing lines. Tests called as in `names`
    /// must be among those that ran: a filter that no test answers to fails.
    pub fn run_tests(&mut self, mut command: Command, names: &[&str]) -> Result<Outcome> {
        let mut child =
            command.current_dir(self.root).stdout(Stdio::piped()).spawn().context("cannot run cargo test")?;
        let stdout = child.stdout.take().context("cargo test has no output")?;
        let mut missing = names.to_vec();
        for line in BufReader::new(stdout).lines() {
            let line = line?;
            println!("{line}");
            if let Some(test) = line.strip_prefix("test ") {
                missing.retain(|name| !test.contains(name));
            }
            // Only the closing lines of runners that had something to run are worth repeating.
            if line.starts_with("test result:") && !line.contains(" 0 passed; 0 failed; 0 ignored;") {
                self.results.push(line);
            }
        }
        let succeeded = child.wait()?.success();
        if succeeded && !missing.is_empty() {
            println!("no test is called {}: was it renamed?", missing.join(", "));
        }
        Ok(passed(succeeded && missing.is_empty()))
    }

    /// Installs Debian packages where that is allowed and possible. What needs them finds out whether it was.
    pub fn install_packages(&self, packages: &[&str]) {
        let apt = |arguments: &[&str]| {
            let status =
                Command::new("apt-get").args(arguments).env("DEBIAN_FRONTEND", "noninteractive").status();
            status.is_ok_and(|status| status.success())
        };
        if self.require_all && apt(&["update", "-qq"]) {
            apt(&[&["install", "-y", "-qq", "--no-install-recommends"], packages].concat());
        }
    }
}

fn documentation(job: &mut Job) -> Result<Outcome> {
    let status = Command::new(env!("CARGO"))
        .args(["doc", "--workspace", "--no-deps", "--document-private-items"])
        .env("RUSTDOCFLAGS", "-D warnings")
        .current_dir(job.root)
        .status()?;
    Ok(passed(status.success()))
}
