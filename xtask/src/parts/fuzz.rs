//! The fuzz targets build, and their seeds find no fault. Searching for faults needs a nightly compiler and time, and
//! is started by hand (`fuzz/README.md`).

use super::{Job, Outcome, succeeds};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds all targets with the workspace's own compiler, and runs each over its seeds.
pub fn run(job: &mut Job) -> Result<Outcome> {
    let compiles = || succeeds(Command::new("c++").arg("--version"));
    if !compiles() {
        job.install_packages(&["g++"]);
    }
    if !compiles() {
        return Ok(Outcome::Skipped(
            "install a C++ compiler, for libFuzzer (Debian: apt-get install g++)".into(),
        ));
    }
    let fuzz = job.root.join("fuzz");
    let cargo = |command: &str| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.arg(command).arg("--manifest-path").arg(fuzz.join("Cargo.toml"));
        cargo
    };
    if !succeeds(&mut cargo("fetch")) {
        return Ok(Outcome::Skipped(
            "crates.io could not be reached for libfuzzer-sys; connect to the network".into(),
        ));
    }
    let target = job.target().join("fuzz");
    let built = cargo("build").args(["--quiet", "--bins", "--target-dir"]).arg(&target).status()?;
    if !built.success() {
        return Ok(Outcome::Failed);
    }
    for seeds in files(&fuzz.join("seeds"))?.into_iter().filter(|path| path.is_dir()) {
        let name = seeds.file_name().context("a folder of seeds has a name")?;
        let seeds = files(&seeds)?;
        // Without any it would search, and not end.
        ensure!(!seeds.is_empty(), "fuzz/seeds/{} is empty", name.display());
        let program = target.join("debug").join(name);
        let run = Command::new(&program).args(&seeds).output();
        let output = run.with_context(|| format!("cannot run {}", program.display()))?;
        println!("{}: {} seeds", name.display(), seeds.len());
        if !output.status.success() {
            println!("{}", String::from_utf8_lossy(&output.stderr));
            return Ok(Outcome::Failed);
        }
    }
    Ok(Outcome::Passed)
}

/// What is in a folder, in the order of its names.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = folder.read_dir().with_context(|| format!("cannot read {}", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}
