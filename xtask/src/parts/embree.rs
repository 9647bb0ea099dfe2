//! The peer check of `hither-bench` against Embree, a ray caster that shares nothing with Hither.

use super::{Job, Outcome};
use anyhow::Result;
use std::process::Command;

/// Names under which the dynamic linker knows the versions that can be used.
const LIBRARIES: &[&str] = &["libembree3.so.3", "libembree4.so.4"];

const INSTALL: &str =
    "install Embree 3 or 4 (Debian: apt-get install libembree-dev), or name its library in HITHER_EMBREE";

/// Runs the peer test of `hither-bench` with its feature `embree`. Of the whole workspace, as the other tests were
/// built, so that little is built anew.
pub fn run(job: &mut Job) -> Result<Outcome> {
    if !installed() {
        job.install_packages(&["libembree-dev"]);
    }
    if !installed() {
        return Ok(Outcome::Skipped(INSTALL.into()));
    }
    job.cargo_test(&["--workspace", "--features", "hither-bench/embree", "--test", "peers"])
}

/// Without the library the tests would pass and have tested nothing.
fn installed() -> bool {
    let known = Command::new("ldconfig").arg("-p").output();
    let known = known.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    std::env::var_os("HITHER_EMBREE").is_some() || LIBRARIES.iter().any(|name| known.contains(name))
}
