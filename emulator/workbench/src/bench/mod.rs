//! `cargo xtask bench`: counts the instructions of CANopen nodes on the emulated Cortex-M4, operation by operation.
//!
//! | file | contents |
//! |---|---|
//! | `operations`, `client` | the operations that are measured, and the client that makes the node carry them out |
//! | `program`, `mailbox` | an image on the emulated core, its registers, the count |
//! | `sizes`, `modules` | flash and RAM of an image, and the code of each module |
//! | `profile` | the functions that the instructions of an operation belong to |
//! | `report`, `page` | the tables, and the page that states them |

mod client;
mod mailbox;
mod modules;
mod operations;
mod page;
mod profile;
mod program;
mod report;
mod sizes;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

use self::operations::{OPERATIONS, operational};
use self::program::Program;
use self::report::{Optimisation, Report};

/// Counts the instructions of CANopen nodes on the emulated Cortex-M4
#[derive(Parser)]
struct Cli {
    /// Where the ELF files of bench-images are
    #[arg(long)]
    images: PathBuf,
    /// Where the ELF files of our devices for a Cortex-M0+ are
    #[arg(long)]
    small: Option<PathBuf>,
    /// The images are optimised for speed: compare with what CANopenNode does with -O2
    #[arg(long)]
    speed: bool,
    /// Replace the tables in this page
    #[arg(long, value_name = "PAGE")]
    write: Option<PathBuf>,
    /// Fail when a number of ours is worse than this page states
    #[arg(long, value_name = "PAGE", conflicts_with = "write")]
    check: Option<PathBuf>,
    /// Instead of the tables, say where the instructions of the operations are whose name contains this
    #[arg(long, value_name = "OPERATION")]
    profile: Option<String>,
    /// Instead of the tables, print the bytes of each module of the library in our devices
    #[arg(long)]
    by_module: bool,
}

/// Runs the program.
#[must_use]
pub fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> Result<()> {
    if let Some(operation) = &cli.profile {
        return print_profile(&cli.images.join("ours"), operation);
    }
    if cli.by_module {
        return modules::print(&cli.images);
    }
    let optimisation = if cli.speed { Optimisation::Speed } else { Optimisation::Size };
    let report = Report::measure(&cli.images, cli.small.as_deref(), optimisation)?;
    println!("{report}");
    match (&cli.write, &cli.check) {
        (Some(path), _) => page::write(path, &report),
        (_, Some(path)) => page::check(path, &report),
        _ => Ok(()),
    }
}

fn print_profile(image: &Path, operation: &str) -> Result<()> {
    let mut client = operational(Program::start(image)?)?;
    for operation in OPERATIONS.iter().filter(|row| row.name.contains(operation)) {
        println!("{:8} {}", operation.measure(&mut client)?, operation.name);
        for (function, instructions) in profile::functions(image, &client.take_profile())? {
            println!("{instructions:8}     {function}");
        }
    }
    Ok(())
}
