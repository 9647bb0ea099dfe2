//! `hither world`: a generated world as a glTF file, or the list of worlds.

use super::report;
use crate::failure::Failure;
use crate::files::Files;
use crate::numbers::{count, grouped};
use crate::options::ReportOptions;
use crate::{console, outputs, source};
use std::fmt::Write;
use std::path::PathBuf;

/// Write a generated world as animated glTF; without a name, list the worlds
#[derive(clap::Args)]
pub struct Arguments {
    /// Which world, as in `office?n=3`
    #[arg(requires = "output")]
    name: Option<String>,
    /// The .glb file to write
    #[arg(short, value_name = "FILE.glb", requires = "name")]
    output: Option<PathBuf>,
    #[command(flatten)]
    report: ReportOptions,
}

/// Writes a world, or lists them.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (Some(name), Some(output)) = (&arguments.name, &arguments.output) else {
        if arguments.report.json.is_some() {
            return Err(Failure::usage("--json goes with a world to write: NAME -o FILE.glb"));
        }
        return console::print(&list());
    };
    if !outputs::has_extension(output, "glb") {
        return Err(Failure::usage(format!("-o {}: give the file the extension .glb", output.display())));
    }
    let (verbosity, to) = (arguments.report.verbosity(), arguments.report.json.as_deref());
    let mut files = Files::default();
    files.writes("-o", Some(output), None)?;
    files.reports(to)?;
    let scene = source::generate(name, verbosity)?;
    let spinner = verbosity.spinner(format!("writing {}", output.display()));
    let written = hither_io::write_glb(&scene, output);
    spinner.finish_and_clear();
    written?;
    let (triangles, instances) = (scene.instanced_triangle_count(), scene.instance_count());
    verbosity.note(&format!(
        "wrote {}: {} triangles in {}",
        output.display(),
        grouped(triangles),
        count(instances, "instance")
    ));
    let mut json = report::opening("world");
    json.insert("world".into(), scene.name.as_str().into());
    json.insert("file".into(), output.display().to_string().into());
    json.insert("triangles".into(), triangles.into());
    json.insert("instances".into(), instances.into());
    outputs::write_report(to, &json.into())
}

fn list() -> String {
    let mut text = String::from("Worlds, written NAME?key=value&key=value:\n");
    for world in hither_worlds::list() {
        let _ = writeln!(text, "  {:<10} {}", world.name, world.description);
        for key in world.keys {
            let _ = writeln!(text, "  {:<10}   {key}: {}", "", key.description);
        }
    }
    text
}
