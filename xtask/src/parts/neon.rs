//! The engine on NEON, from any x86-64 machine: Debian's compiler builds its tests for 64-bit ARM, and qemu runs them.
//!
//! rustup is left as it is. Debian packs a newer compiler beside its own, `rustc-web`; the standard library for ARM is
//! that of the same package for `arm64`. It is unpacked below `target/`, so that dpkg need not know of a second
//! architecture.

use super::{Job, Outcome, succeeds};
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::process::Command;

const TARGET: &str = "aarch64-unknown-linux-gnu";
const RUSTC: &str = "/usr/bin/rustc";
const LINKER: &str = "aarch64-linux-gnu-gcc";
const RUNNER: &str = "qemu-aarch64";

/// Where Debian has the C library for ARM.
const C_LIBRARY: &str = "/usr/aarch64-linux-gnu";

const STACK_BYTES: &str = "67108864";

const PACKAGES: &[&str] = &["rustc-web", "gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross", "qemu-user"];
const STANDARD_LIBRARY: &str = "libstd-rust-web-dev";

/// The digests that other machines have too, and what of the tests of visibility an emulator runs soon enough.
const TESTS: &[&str] =
    &["--package=hither", "--profile=portable", "--no-fail-fast", "--test=bits", "--test=visibility", "--"];
const NAMES: &[&str] =
    &["everywhere", "coherence_changes_nothing_while_the_eye_moves", "shared_edges_are_drawn_exactly_once"];

/// Builds and runs the tests of the engine that try what NEON does.
pub fn run(job: &mut Job) -> Result<Outcome> {
    if cfg!(target_arch = "aarch64") {
        println!("this machine has NEON: the other tests have run on it");
        return Ok(Outcome::Passed);
    }
    let folder = job.target().join("neon");
    let mut found = compiler_with_library(&folder);
    if found.is_err() {
        // What is missing, or a later version: the archive holds no library for an old one.
        job.install_packages(PACKAGES);
        found = compiler_with_library(&folder);
    }
    let sysroot = match found {
        Ok(sysroot) => sysroot,
        Err(why) => return Ok(Outcome::Skipped(why)),
    };
    let variable = |what: &str| format!("CARGO_TARGET_{}_{what}", TARGET.to_uppercase().replace('-', "_"));
    let mut command = Command::new(env!("CARGO"));
    command
        .args(["test", "--target", TARGET, "--target-dir"])
        // Of another compiler than everything else: it would only be in the way there.
        .arg(&folder)
        .args(TESTS)
        .args(NAMES)
        // Code that is not optimised keeps each vector it ever made on the stack.
        .env("RUST_MIN_STACK", STACK_BYTES)
        .env("RUSTC", RUSTC)
        .env(variable("LINKER"), LINKER)
        .env(variable("RUNNER"), format!("{RUNNER} -L {C_LIBRARY}"))
        .env("CARGO_ENCODED_RUSTFLAGS", format!("--sysroot\x1f{}", sysroot.join("usr").display()));
    job.run_tests(command, NAMES)
}

/// Where the standard library for ARM of Debian's compiler is, or what to do to have both.
fn compiler_with_library(folder: &Path) -> Result<PathBuf, String> {
    let version = compiler().ok_or_else(|| {
        format!(
            "install a compiler of Rust {} or later for ARM, its linker and qemu (Debian: apt-get install {})",
            env!("CARGO_PKG_RUST_VERSION"),
            PACKAGES.join(" ")
        )
    })?;
    let sysroot = folder.join(format!("std-{version}"));
    if sysroot.is_dir() || fetch(&folder.join("apt"), &version, &sysroot) {
        return Ok(sysroot);
    }
    Err(format!(
        "{STANDARD_LIBRARY}:arm64={version} could not be fetched; connect to the network, or upgrade rustc-web if the \
         archive has a later one"
    ))
}

/// The version of Debian's compiler, if it is new enough and all that is needed beside it is there.
fn compiler() -> Option<String> {
    let asked = Command::new("dpkg-query").args(["-W", "-f", "${Version}", "rustc-web"]).output().ok()?;
    let version = String::from_utf8(asked.stdout).ok()?;
    let suits = ["--compare-versions", &version, "ge", env!("CARGO_PKG_RUST_VERSION")];
    let runs = |program: &str| succeeds(Command::new(program).arg("--version"));
    let all = succeeds(Command::new("dpkg").args(suits))
        && [RUSTC, LINKER, RUNNER].into_iter().all(runs)
        && Path::new(C_LIBRARY).join("lib/libc.so.6").exists();
    all.then_some(version)
}

/// Unpacks the standard library for ARM of this `version` into `sysroot`: from Debian, with its signatures, by way of
/// lists of packages of our own in `apt`. Says whether it is there now.
fn fetch(apt: &Path, version: &str, sysroot: &Path) -> bool {
    let (lists, cache) = (apt.join("lists"), apt.join("cache"));
    let folders = [lists.join("partial"), cache.join("archives/partial")];
    // What an interrupted run left may be of another version.
    let _ = std::fs::remove_dir_all(apt);
    if folders.iter().any(|folder| std::fs::create_dir_all(folder).is_err()) {
        return false;
    }
    let get = |arguments: &[&str]| {
        let mut command = Command::new("apt-get");
        for option in ["APT::Architecture=arm64", "APT::Architectures=arm64", "APT::Sandbox::User=root"] {
            command.args(["-o", option]);
        }
        for (option, folder) in [("Dir::State::Lists", &lists), ("Dir::Cache", &cache)] {
            command.arg("-o").arg(format!("{option}={}", folder.display()));
        }
        succeeds(command.args(["-o", "Acquire::Languages=none", "-qq"]).args(arguments).current_dir(apt))
    };
    // Other archives than Debian's may have failed; whether what is wanted is there shows next.
    get(&["update"]);
    let unpacked = apt.join("unpacked");
    let well = get(&["download", &format!("{STANDARD_LIBRARY}:arm64={version}")])
        && package(apt)
            .is_some_and(|package| succeeds(Command::new("dpkg-deb").arg("-x").arg(package).arg(&unpacked)))
        && std::fs::rename(unpacked, sysroot).is_ok();
    let _ = std::fs::remove_dir_all(apt);
    well
}

/// The package that lies in `folder`.
fn package(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?;
    entries.flatten().map(|e| e.path()).find(|path| path.extension().is_some_and(|e| e == "deb"))
}
