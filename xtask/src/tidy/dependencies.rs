//! The engine depends on little, and the little is listed.

use super::Finding;
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const ENGINE: &str = "hither";
const ALLOWED: &[&str] =
    &["fearless_simd", "glam", "i_overlay", "i_triangle", "parry3d-f64", "rayon", "robust", "thiserror"];

/// Checks the engine's dependencies, build dependencies included; tests may use what they like.
pub fn check(root: &Path) -> Result<Vec<Finding>> {
    let packages = packages(root)?;
    let engine =
        packages.iter().find(|p| p["name"] == ENGINE).context("the workspace has no engine crate")?;
    let dependencies = engine["dependencies"].as_array().context("cargo metadata lists no dependencies")?;
    let forbidden = dependencies
        .iter()
        .filter(|d| d["kind"] != "dev")
        .filter_map(|d| d["name"].as_str())
        .filter(|name| !ALLOWED.contains(name));
    Ok(forbidden
        .map(|name| Finding {
            path: "crates/hither/Cargo.toml".into(),
            line: 0,
            message: format!(
                "the engine may not depend on `{name}`; it belongs in a crate around the engine"
            ),
        })
        .collect())
}

/// The workspace's packages as `cargo metadata` describes them.
fn packages(root: &Path) -> Result<Vec<Value>> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .current_dir(root)
        .output()
        .context("cannot run cargo metadata")?;
    ensure!(output.status.success(), "cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout)?;
    Ok(metadata["packages"].as_array().context("cargo metadata lists no packages")?.clone())
}
