//! The command `nodectl`.

use std::process::ExitCode;

use clap::Parser;
use nodectl::cli::{Cli, Failure, Output};
use nodectl::text::visible_lines;

fn main() -> ExitCode {
    let cli = Cli::parse();
    match cli.run(Output::standard(cli.options.json)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            report(&failure, cli.options.json);
            ExitCode::from(failure.exit_code())
        }
    }
}

fn report(failure: &Failure, json: bool) {
    if json {
        println!("{}", serde_json::json!({ "error": failure.to_string(), "exit_code": failure.exit_code() }));
    } else {
        eprintln!("nodectl: {}", visible_lines(&failure.to_string()));
    }
}
