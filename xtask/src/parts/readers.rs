//! Files that Hither writes, read by software that shares nothing with it: glTF by trimesh, EXR by the OpenEXR
//! library, PNG by Pillow, all from PyPI into an environment of their own below `target/`.

use super::{Job, Outcome, passed, succeeds};
use anyhow::Result;
use std::path::PathBuf;
use std::process::Command;

const PACKAGES: &[&str] = &["trimesh", "numpy", "OpenEXR", "pillow"];
const SCRIPT: &str = "xtask/src/parts/read_back.py";

/// Writes worlds and pictures with the binary, and has `read_back.py` compare them with the binary's reports.
pub fn run(job: &mut Job) -> Result<Outcome> {
    let python = match environment(job) {
        Ok(python) => python,
        Err(why) => return Ok(Outcome::Skipped(why)),
    };
    // The binary that the tests have made: by itself it would be built anew, with all that it depends on.
    let arguments = ["test", "--workspace", "--no-run", "--quiet"];
    let built = Command::new(env!("CARGO")).args(arguments).current_dir(job.root).status()?;
    if !built.success() {
        return Ok(Outcome::Failed);
    }
    let folder = job.target().join("read-back");
    std::fs::create_dir_all(&folder)?;
    let hither = job.target().join("debug").join("hither");
    let status = Command::new(python).arg(job.root.join(SCRIPT)).arg(hither).arg(folder).status()?;
    Ok(passed(status.success()))
}

/// The Python of the environment with all packages, or what to install.
fn environment(job: &Job) -> Result<PathBuf, String> {
    let folder = job.target().join("read-back-python");
    let python = folder.join("bin/python");
    if succeeds(Command::new(&python).args(["-c", "import trimesh, numpy, OpenEXR, PIL"])) {
        return Ok(python);
    }
    let make = || succeeds(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder));
    if !make() {
        job.install_packages(&["python3", "python3-venv"]);
        if !make() {
            return Err("install Python 3 with venv (Debian: apt-get install python3-venv)".into());
        }
    }
    let quiet = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    if succeeds(Command::new(&python).args(quiet).args(PACKAGES)) {
        Ok(python)
    } else {
        Err(format!("PyPI could not be reached for {}; connect to the network", PACKAGES.join(", ")))
    }
}
