//! Makes the tables from the command line: `tables [NAME] [--slow]`, text on standard output.

use hither_bench::{Options, run};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name = arguments.iter().find(|a| !a.starts_with('-')).map(String::as_str);
    let slow = arguments.iter().any(|a| a == "--slow");
    let progress = Box::new(|line: &str| eprintln!("{line}"));
    match run(name, &Options { slow, progress, ..Options::default() }) {
        Ok(report) => print!("{report}"),
        Err(fault) => {
            eprintln!("error: {fault}");
            std::process::exit(1);
        }
    }
}
