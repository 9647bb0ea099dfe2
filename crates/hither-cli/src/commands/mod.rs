//! The commands: each reads its options, lets the engine work, and says what came out.

mod bench;
mod cull;
mod demo;
mod info;
mod layers;
mod lines;
mod order;
mod render;
mod report;
mod sorting;
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
    /// As a drawing
    Lines(Box<lines::Arguments>),
    /// In what order?
    Order(Box<order::Arguments>),
    /// As separate images?
    Layers(Box<layers::Arguments>),
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
        Some(Command::Lines(arguments)) => lines::run(&arguments),
        Some(Command::Order(arguments)) => order::run(&arguments),
        Some(Command::Layers(arguments)) => layers::run(&arguments),
        Some(Command::Cull(arguments)) => cull::run(&arguments),
        Some(Command::Bench(arguments)) => bench::run(&arguments),
        None => demo::run(),
    }
}
