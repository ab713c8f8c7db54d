//! The command `nodectl`.

use std::io::Write as _;
use std::process::ExitCode;

use nodectl::cli::{Cli, Failure, Output};
use nodectl::text::visible_lines;

fn main() -> ExitCode {
    let cli = match Cli::from_words(std::env::args_os()) {
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
        report(&Failure::Usage(reason(&error.to_string())), true);
        return ExitCode::from(2);
    }
    error.exit()
}

/// The error in one line: the lines before the hints and the usage, some of which name the arguments.
fn reason(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}

fn report(failure: &Failure, json: bool) {
    // The reader may be gone: `println!` and `eprintln!` would panic.
    let _ = if json {
        writeln!(std::io::stdout(), "{}", failure.to_json())
    } else {
        writeln!(std::io::stderr(), "nodectl: {}", visible_lines(&failure.to_string()))
    };
}
