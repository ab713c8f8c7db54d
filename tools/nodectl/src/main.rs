//! The command `nodectl`.

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser;
use nodectl::cli::{Cli, Failure, Output};
use nodectl::text::visible_lines;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    match cli.run(Output::standard(cli.options.json)) {
        Ok(()) => ExitCode::SUCCESS,
        // The reader has seen enough, as `head` does.
        Err(failure) if failure.is_closed_pipe() => ExitCode::SUCCESS,
        Err(failure) => {
            report(&failure, cli.options.json);
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Prints an error of the command line, or the help. With `--json` the error is JSON, too.
fn usage(error: &clap::Error) -> ExitCode {
    let wants_json = std::env::args_os().any(|argument| argument == "--json");
    if wants_json && error.use_stderr() {
        let text = error.to_string();
        let reason = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        report(&Failure::Usage(reason.to_owned()), true);
        return ExitCode::from(2);
    }
    error.exit()
}

fn report(failure: &Failure, json: bool) {
    // The reader may be gone: `println!` and `eprintln!` would panic.
    let _ = if json {
        writeln!(std::io::stdout(), "{}", failure.to_json())
    } else {
        writeln!(std::io::stderr(), "nodectl: {}", visible_lines(&failure.to_string()))
    };
}
