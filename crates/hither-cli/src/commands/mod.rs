//! The commands: each reads its options, lets the engine work, and says what came out.

mod bench;
mod cull;
mod demo;
mod info;
mod render;
mod report;
mod world;

use crate::failure::Failure;
use clap::Subcommand;

/// A question to answer.
#[derive(Subcommand)]
pub enum Command {
    /// What is in this file?
    Info(info::Arguments),
    /// Write a generated world as animated glTF; without a name, list the worlds
    World(world::Arguments),
    /// What does it look like?
    Render(Box<render::Arguments>),
    /// What could be seen?
    Cull(Box<cull::Arguments>),
    /// How fast, against what?
    Bench(bench::Arguments),
}

/// Runs `command`, or the demonstration.
pub fn run(command: Option<Command>) -> Result<(), Failure> {
    match command {
        Some(Command::Info(arguments)) => info::run(&arguments),
        Some(Command::World(arguments)) => world::run(&arguments),
        Some(Command::Render(arguments)) => render::run(&arguments),
        Some(Command::Cull(arguments)) => cull::run(&arguments),
        Some(Command::Bench(arguments)) => bench::run(&arguments),
        None => demo::run(),
    }
}
