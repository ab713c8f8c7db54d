//! `cargo sim`: reads the command line, runs the simulation and prints its summary.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;
use sim::cli::Options;

/// Something that the user can put right: a flag, a file, a port in use.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let options = match Options::try_parse() {
        Ok(options) => options,
        // Help and version are answers, not errors.
        Err(error) if !error.use_stderr() => error.exit(),
        Err(error) => return refuse(&sim::cli::one_line(&error.to_string())),
    };
    let json = options.json;
    let summary = match sim::app::run(options) {
        Ok(summary) if json => format!("{}\n", serde_json::json!(summary)),
        Ok(summary) => summary.to_string(),
        Err(error) => return refuse(&format!("error: {error:#}")),
    };
    // Nobody may be reading any more.
    let _ = io::stdout().write_all(summary.as_bytes());
    ExitCode::SUCCESS
}

fn refuse(line: &str) -> ExitCode {
    eprintln!("{line}");
    ExitCode::from(USAGE)
}
