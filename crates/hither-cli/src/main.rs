//! The `hither` binary: arguments, progress, printing. It holds no algorithm.
//!
//! It ends with 0 when the work is done, with 1 when the input or the work failed, and with 2 when the command
//! line is wrong. A failure is one line, `error: what and where; what to do`, on standard error; that holds for
//! a panic too. A reader that closes the pipe early is no failure.
#![forbid(unsafe_code)]

mod commands;
mod console;
mod eye;
mod failure;
mod files;
mod numbers;
mod options;
mod outputs;
mod source;
mod timeline;

use clap::Parser;
use clap::error::ErrorKind;
use commands::Command;
use failure::Failure;
use std::process::ExitCode;

/// Visibility: what can be seen, in what order, and how it looks.
///
/// Without a command, a demonstration: a walk through 539 million triangles, with pictures in `hither-demo/`.
#[derive(Parser)]
#[command(name = "hither", version, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| console::error(&failure::of_panic(panic))));
    let result = std::panic::catch_unwind(|| match Cli::try_parse() {
        Ok(cli) => commands::run(cli.command),
        Err(refusal) => usage(&refusal),
    });
    match result {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(failure)) => {
            console::error(&failure.line);
            ExitCode::from(failure.exit_code)
        }
        // The hook has said what happened.
        Err(_) => ExitCode::from(failure::WORK),
    }
}

/// Help and version as clap prints them; anything wrong in a line or two instead of its paragraphs.
fn usage(refusal: &clap::Error) -> Result<(), Failure> {
    if matches!(refusal.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return console::print(&refusal.render().to_string());
    }
    let text = refusal.render().to_string();
    // clap says what is wrong in its first paragraph; tips and the usage line follow.
    let what = text.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ");
    let what = what.split_whitespace().collect::<Vec<_>>().join(" ");
    let tip = text.lines().find_map(|line| line.trim().strip_prefix("tip: "));
    let tip = tip.map(|tip| format!("; {tip}")).unwrap_or_default();
    Err(Failure::usage(format!("{what}{tip}; `hither --help` and `hither COMMAND --help` say what there is")))
}
