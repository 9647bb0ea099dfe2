//! Project chores: `cargo xtask tidy` checks how the sources are laid out, `cargo xtask test` checks everything.
#![forbid(unsafe_code)]

mod parts;
mod tidy;

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask tidy [--lower-ratchet]
       cargo xtask test [--require-all]

tidy   rooms' import rules, a //! line in every file, lengths, dependencies, rustfmt, clippy
       --lower-ratchet  write the present lengths of long functions where they shrank
test   tidy, all tests, the documentation, and the checks that need other software
       --require-all    install what those need, and fail if one of them cannot run";

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<bool> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let root = workspace_root()?;
    match words[..] {
        ["tidy"] => tidy::run(&root, false),
        ["tidy", "--lower-ratchet"] => tidy::run(&root, true),
        ["test"] => parts::run(&root, false),
        ["test", "--require-all"] => parts::run(&root, true),
        ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            Ok(true)
        }
        _ => bail!("not a chore: `{}`\n{USAGE}", words.join(" ")),
    }
}

fn workspace_root() -> Result<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("xtask lies outside a workspace")?;
    Ok(root.to_path_buf())
}
