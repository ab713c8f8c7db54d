//! Build, run and test the project. `cargo xtask --help` lists the commands; `cargo sim` is `cargo xtask sim`, and
//! `cargo nodectl` is `cargo xtask nodectl`.

mod apt;
mod bench;
mod bringup;
mod callgraph;
mod command;
mod coverage;
mod eds;
mod fault_injection;
mod flash;
mod fuzz;
mod hal_examples;
mod images;
mod matrix;
mod metadata;
mod mutants;
mod own_tool;
mod packages;
mod pictures;
mod plots;
mod progress;
mod regressions;
mod release;
mod reproducible;
mod sbom;
mod setup;
mod sim;
mod site;
mod target;
mod test;
mod timing;
mod tools;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::Result;
use clap::{CommandFactory as _, Parser, Subcommand};
use own_tool::Tools;
use target::Toolchain;

/// Everything that needs more than `cargo test`.
#[derive(Parser)]
#[command(name = "cargo xtask", version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Build the firmware and the bootloader for the Cortex-M4 (with the keys in UPDATE_RELEASE_KEY, UPDATE_ROOT_KEY and UPDATE_RECOVERY_KEY)
    Images {
        /// For a board on a desk: the bootloader starts unsigned images and trusts the development key, which is
        /// published in the repository; the firmware is signed with this key. Also builds the images for the tests
        #[arg(long)]
        development: bool,
    },
    /// Build both images and run them on the emulated board (all flags go to the simulator; `cargo sim --help`)
    #[command(disable_help_flag = true)]
    Sim {
        /// Flags of the simulator
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        flags: Vec<OsString>,
    },
    /// Run `nodectl`, built with the simulator (all arguments go to nodectl; `cargo nodectl --help`)
    #[command(disable_help_flag = true)]
    Nodectl {
        /// Arguments of nodectl
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Skip instructions and flip flags and bits of registers while the bootloader decides what may start (docs/evidence.md)
    #[command(disable_help_flag = true)]
    FaultInjection {
        /// Flags of the tool
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        flags: Vec<OsString>,
    },
    /// Put bootloader and signed application on a board at a debug probe, and print the log (docs/board.md)
    Flash(flash::Flags),
    /// Take a new board at a debug probe and a CAN adapter through fifteen steps, and write a report (docs/board.md); --emulated: the emulated board
    #[command(disable_help_flag = true)]
    Bringup {
        /// Flags of the tool
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        flags: Vec<OsString>,
    },
    /// Write eds/*.eds, docs/object-dictionary.md and docs/data-sheet.md from the dictionary tables
    Eds,
    /// Write docs/plots/*.svg and the tables of docs/measuring.md from the measurement chain
    Plots,
    /// Build the documents as one site with search, and the documentation of the library beside it
    Docs,
    /// Take the pictures of the page and of the simulator's screen for docs/page.md and README
    Pictures,
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
    /// Change the code of the pure crates and print the changes that no test notices (docs/evidence.md)
    Mutants(mutants::Flags),
    /// Bring each mended fault back into a copy of the sources, and expect the monitor to report it (docs/evidence.md)
    Regressions(regressions::Flags),
    /// Run the tests of the matrix in full and write their table into docs/evidence.md
    Matrix,
    /// Print the worst execution time of each task of the firmware, and the latest end of each
    Timing,
    /// Print which code of the images can panic, and why it does not
    Panics,
    /// Print how deep the stack of each image can get
    Stack {
        /// Show the functions of each way
        #[arg(long)]
        paths: bool,
    },
    /// Write the software bill of materials of each product (CycloneDX): packages, checksums, licences, compiler
    Sbom(sbom::Flags),
    /// Check the sources and make the files of a release (docs/release.md)
    Release(release::Flags),
    /// Build the images in two folders, and compare what is flashed
    Reproducible,
    /// Install what the other commands need: compilers, cmake, libclang, Python packages, tshark, a browser
    Setup {
        /// Only say what is missing, and how to install it
        #[arg(long)]
        dry_run: bool,
    },
    /// Run every check: formatting, lints, documentation, host tests, the emulated board, the Python clients
    Test(test::Flags),
    /// Whether the build of the emulator will find a libclang that works; `setup` asks in a process of its own
    #[command(hide = true)]
    ProbeLibclang,
}

fn main() -> ExitCode {
    let result = Cli::parse().command.map_or_else(list, run);
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}

/// Runs the command. Some commands become another program, which has an exit status of its own.
fn run(command: Command) -> Result<ExitCode> {
    match command {
        Command::Sim { flags } => return sim::run(&flags),
        Command::Nodectl { arguments } => return own_tool::run("nodectl", &arguments),
        Command::Sign { arguments } => return own_tool::run("sign", &arguments),
        Command::Protect { arguments } => return own_tool::run("protect", &arguments),
        Command::Flash(flags) => return flash::run(&flags),
        Command::Bringup { flags } => return bringup::run(&flags),
        Command::Images { development: true } => images::build(Tools::ByCargo)?,
        Command::Images { development: false } => images::build_for_owner()?,
        Command::FaultInjection { flags } => fault_injection::try_all(&flags)?,
        Command::Eds => eds::write()?,
        Command::Plots => plots::write()?,
        Command::Docs => site::build()?,
        Command::Pictures => pictures::take()?,
        Command::Fuzz(flags) => fuzz::run_fuzzer(&flags)?,
        Command::Bench(options) => bench::measure(&options, Tools::ByCargo)?,
        Command::Coverage => coverage::print()?,
        Command::Mutants(flags) => mutants::print(&flags)?,
        Command::Regressions(flags) => regressions::run(&flags)?,
        Command::Matrix => matrix::write()?,
        Command::Timing => timing::print()?,
        Command::Panics => callgraph::panics(Tools::ByCargo)?,
        Command::Stack { paths } => callgraph::stack(paths, Tools::ByCargo)?,
        Command::Reproducible => reproducible::check(&Toolchain::ensure()?)?,
        Command::Release(flags) => release::make(&flags)?,
        Command::Sbom(flags) => sbom::write(&flags)?,
        Command::Setup { dry_run } => setup::run(dry_run)?,
        Command::Test(flags) => test::run(&flags)?,
        Command::ProbeLibclang => setup::probe()?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The commands, a line each.
fn list() -> Result<ExitCode> {
    for command in Cli::command().get_subcommands().filter(|command| !command.is_hide_set()) {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        println!("cargo xtask {:<15} {}", command.get_name(), about.split(" (").next().unwrap_or_default());
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines of a workflow of .github that call `cargo xtask`.
    fn calls(workflow: &str) -> impl Iterator<Item = &str> {
        workflow.lines().filter_map(|line| Some(&line[line.find("cargo xtask ")? + "cargo ".len()..]))
    }

    #[test]
    fn each_command_of_the_workflows_exists() {
        let mut count = 0;
        for file in std::fs::read_dir(command::root().join(".github/workflows")).unwrap() {
            let path = file.unwrap().path();
            for call in calls(&std::fs::read_to_string(&path).unwrap()) {
                let result = Cli::try_parse_from(call.split_whitespace());
                assert!(result.is_ok(), "{}: {call}: {}", path.display(), result.err().unwrap());
                count += 1;
            }
        }
        assert!(count >= 10, "{count} commands");
    }
}
