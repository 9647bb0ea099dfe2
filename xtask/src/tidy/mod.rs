//! What the compiler does not check about the sources. Every finding says where and what to do; all are
//! printed before the run fails.

mod dependencies;
mod engine;
mod lengths;
mod modules;
mod rooms;

use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

/// One thing to mend.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Finding {
    /// Path relative to the workspace.
    pub path: String,
    /// Line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// What is wrong and what to do.
    pub message: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.path, self.message),
            line => write!(f, "{}:{line}: {}", self.path, self.message),
        }
    }
}

/// A parsed source file of the workspace.
pub struct Source {
    /// Path relative to the workspace, with `/`.
    pub path: String,
    /// The text as it is on disk.
    pub text: String,
    /// The text as Rust.
    pub syntax: syn::File,
}

/// Runs every check, prints the findings, and says whether there were none.
pub fn run(root: &Path, lower_ratchet: bool) -> Result<bool> {
    let sources = read_sources(root)?;
    let mut findings = Vec::new();
    findings.extend(lengths::check_files(&sources));
    findings.extend(lengths::check_functions(root, &sources, lower_ratchet)?);
    findings.extend(rooms::check(root, &sources)?);
    findings.extend(engine::check(&sources));
    findings.extend(dependencies::check(root)?);
    findings.sort();
    for finding in &findings {
        println!("tidy: {finding}");
    }
    println!("tidy: {} files looked at, {} findings", sources.len(), findings.len());
    let formatted = cargo(root, &["fmt", "--all", "--check"])?;
    let linted = cargo(root, &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"])?;
    Ok(findings.is_empty() && formatted && linted)
}

fn cargo(root: &Path, arguments: &[&str]) -> Result<bool> {
    println!("tidy: cargo {}", arguments.join(" "));
    let status = Command::new(env!("CARGO")).args(arguments).current_dir(root).status()?;
    Ok(status.success())
}

/// Every `.rs` file below the workspace's crates, `xtask` and `fuzz`, in the order of their paths.
fn read_sources(root: &Path) -> Result<Vec<Source>> {
    let mut paths = Vec::new();
    for top in ["crates", "xtask", "fuzz"] {
        let top = root.join(top);
        if top.is_dir() {
            collect(&top, &mut paths)?;
        }
    }
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let text =
                std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
            let syntax = syn::parse_file(&text).with_context(|| format!("{}", path.display()))?;
            let path = path.strip_prefix(root)?.to_string_lossy().replace('\\', "/");
            Ok(Source { path, text, syntax })
        })
        .collect()
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            if name != "target" && !name.starts_with('.') {
                collect(&path, found)?;
            }
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
    Ok(())
}
