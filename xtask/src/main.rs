//! Build, run and test the project. `cargo xtask --help` lists the commands; `cargo sim` is `cargo xtask sim`.

mod bench;
mod callgraph;
mod command;
mod coverage;
mod eds;
mod fuzz;
mod images;
mod mutants;
mod native;
mod own_tool;
mod plots;
mod python;
mod sim;
mod steps;
mod target;
mod test;
mod timing;
mod tools;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Everything that needs more than `cargo test`.
#[derive(Parser)]
#[command(name = "cargo xtask", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build the firmware, the bootloader and the test images for the Cortex-M4
    Images,
    /// Build both images and run them on the emulated board (all flags go to the simulator; `cargo sim --help`)
    #[command(disable_help_flag = true)]
    Sim {
        /// Flags of the simulator
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        flags: Vec<OsString>,
    },
    /// Write eds/*.eds and docs/object-dictionary.md from the dictionary tables
    Eds,
    /// Write docs/plots/*.svg and the tables of docs/measuring.md from the measurement chain
    Plots,
    /// Make signing keys and sign images for the field update (docs/update.md; `cargo xtask sign --help`)
    #[command(disable_help_flag = true)]
    Sign {
        /// Arguments of the signing tool
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Set the write protection of the bootloader and the read-out protection of a chip at a debug probe (docs/update.md)
    #[command(disable_help_flag = true)]
    Protect {
        /// Arguments of the tool
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Let libFuzzer look for inputs that break a rule (docs/evidence.md)
    Fuzz(fuzz::Flags),
    /// Count the instructions of every operation, ours beside zencan-node and CANopenNode (docs/performance.md)
    Bench(bench::Options),
    /// Print which lines of the pure crates the tests run
    Coverage,
    /// Change the code of the pure crates and print what no test notices (docs/evidence.md)
    Mutants(mutants::Flags),
    /// Print what each task of the firmware takes at worst, and when it ends at the latest
    Timing,
    /// Print which code of the images can panic, and why it does not
    Panics,
    /// Print how deep the stack of each image can get
    Stack {
        /// Show the functions of each way
        #[arg(long)]
        paths: bool,
    },
    /// Run every check: formatting, lints, documentation, host tests, the emulated board, the Python clients
    Test {
        /// Run only the steps whose name contains this text
        #[arg(long)]
        only: Option<String>,
    },
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Images => images::build().map(|_| ExitCode::SUCCESS),
        Command::Sim { flags } => sim::run(&flags),
        Command::Eds => eds::write().map(|()| ExitCode::SUCCESS),
        Command::Plots => plots::write().map(|()| ExitCode::SUCCESS),
        Command::Sign { arguments } => own_tool::run("sign", &arguments).map(|()| ExitCode::SUCCESS),
        Command::Protect { arguments } => own_tool::run("protect", &arguments).map(|()| ExitCode::SUCCESS),
        Command::Fuzz(flags) => fuzz::run_fuzzer(&flags).map(|()| ExitCode::SUCCESS),
        Command::Bench(options) => bench::measure(&options).map(|()| ExitCode::SUCCESS),
        Command::Coverage => coverage::print().map(|()| ExitCode::SUCCESS),
        Command::Mutants(flags) => mutants::print(&flags).map(|()| ExitCode::SUCCESS),
        Command::Timing => timing::print().map(|()| ExitCode::SUCCESS),
        Command::Panics => callgraph::panics().map(|()| ExitCode::SUCCESS),
        Command::Stack { paths } => callgraph::stack(paths).map(|()| ExitCode::SUCCESS),
        Command::Test { only } => test::run_tests(only.as_deref()).map(|()| ExitCode::SUCCESS),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}
