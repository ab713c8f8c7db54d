//! `cargo sim`: reads the command line, runs the simulation and prints its summary.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;
use sim::app::Output;
use sim::cli::Options;

/// Exit status for an error that the user can correct: a flag, a file, a port in use.
const USAGE: u8 = 2;
/// Exit status when a program has broken a rule of its chip; the summary names the rule and the place.
const BROKEN_RULE: u8 = 1;

fn main() -> ExitCode {
    let options = match Options::try_parse() {
        Ok(options) => options,
        // Help and version are answers, not errors.
        Err(error) if !error.use_stderr() => error.exit(),
        Err(error) => {
            let json = std::env::args_os().any(|word| word == "--json");
            return refuse(&sim::cli::one_line(&error.to_string()), json);
        }
    };
    let json = options.json;
    let summary = match sim::app::run(options) {
        Ok(summary) => summary,
        // The reader has seen enough, as `head` does.
        Err(error) if error.downcast_ref().is_some_and(Output::is_closed) => return ExitCode::SUCCESS,
        Err(error) => return refuse(&format!("error: {error:#}"), json),
    };
    let text = if json { format!("{}\n", serde_json::json!(summary)) } else { summary.to_string() };
    // The reader may have closed the output.
    let _ = io::stdout().write_all(text.as_bytes());
    if summary.has_broken_rules() { ExitCode::from(BROKEN_RULE) } else { ExitCode::SUCCESS }
}

/// Reports an error like `nodectl`: with --json, as an object on the standard output.
fn refuse(line: &str, json: bool) -> ExitCode {
    // The reader may have closed the output: `println!` and `eprintln!` would panic.
    let _ = if json {
        let error = line.strip_prefix("error: ").unwrap_or(line);
        writeln!(io::stdout(), "{}", serde_json::json!({ "error": error, "exit_code": USAGE }))
    } else {
        writeln!(io::stderr(), "{line}")
    };
    ExitCode::from(USAGE)
}
