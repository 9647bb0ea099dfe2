//! The peer check of `hither-bench` against Embree, a ray caster that shares nothing with Hither.

use super::{Job, Outcome};
use crate::tidy::packages;
use anyhow::Result;
use std::path::Path;

/// Where Debian's package and a system-wide installation put the header.
const HEADERS: &[&str] = &["/usr/include/embree3/rtcore.h", "/usr/local/include/embree3/rtcore.h"];

const INSTALL: &str = "install Embree 3 (Debian: apt-get install libembree-dev)";

/// Runs the tests of `hither-bench` with its feature `embree`.
pub fn run(job: &mut Job) -> Result<Outcome> {
    let packages = packages(job.root)?;
    let known = packages.iter().any(|p| p["name"] == "hither-bench" && p["features"].get("embree").is_some());
    if !known {
        return Ok(Outcome::Skipped("hither-bench has no feature `embree`".into()));
    }
    let installed = || HEADERS.iter().any(|header| Path::new(header).exists());
    if !installed() {
        job.install_packages(&["libembree-dev"]);
    }
    if !installed() {
        return Ok(Outcome::Skipped(INSTALL.into()));
    }
    job.cargo_test(&["-p", "hither-bench", "--features", "embree"])
}
