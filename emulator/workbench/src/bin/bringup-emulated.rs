//! The program behind `cargo xtask bringup --emulated`: the fifteen steps with an emulated board.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use bringup::chip::Chip;
use bringup::report::{self, Report};
use bringup::run::{Effort, Subject};
use bringup::steps::{self, Step};
use canopen::NodeId;
use clap::Parser;
use workbench::bringup::{EmulatedDesk, faults, world};

/// Takes an emulated board through the bring-up.
#[derive(Parser)]
#[command(name = "cargo xtask bringup --emulated", version)]
struct Cli {
    /// The directory of the ELF files
    #[arg(long, hide = true)]
    images: PathBuf,
    /// The report: JSON here, and HTML beside it
    #[arg(long, default_value = "bringup.json")]
    report: PathBuf,
    /// With this fault of the hardware, by its words; `list` prints all
    #[arg(long)]
    fault: Option<String>,
    /// The personality of the board: pressure, encoder, combined or lift
    #[arg(long, default_value = "encoder")]
    personality: String,
    /// As long as with a board
    #[arg(long)]
    full: bool,
}

fn main() -> ExitCode {
    report::exit_code(run(&Cli::parse()))
}

fn run(cli: &Cli) -> Result<report::Result> {
    if cli.fault.as_deref() == Some("list") {
        faults::ALL.iter().for_each(|fault| println!("{}: step {}", fault.name, fault.step));
        return Ok(report::Result::Green);
    }
    let fault = cli.fault.as_deref().map(|name| {
        let found = faults::ALL.iter().find(|fault| fault.name == name);
        found.with_context(|| format!("no fault is called {name:?}; `--fault list` prints all"))
    });
    let fault = fault.transpose()?;
    let world = world(&cli.images, &cli.personality, fault.map_or("", |fault| fault.flags()))?;
    let mut desk = EmulatedDesk::new(world, &cli.images)?;
    if let Some(fault) = fault {
        fault.bring(&mut desk);
    }
    let subject = Subject {
        node: NodeId::new(1).context("a node-ID")?,
        chip: Chip::named("STM32F446RETx").context("a chip")?,
        kbit: 1000,
    };
    let effort = if cli.full { Effort::FULL } else { Effort::SHORT };
    let chosen: Vec<&Step> = steps::ALL.iter().collect();
    let mut report = Report::default();
    let result = bringup::run::all(&chosen, &mut desk, subject, effort, &mut report, |step, _| {
        print!("{}", step.text());
    });
    report.write(&cli.report)?;
    println!("report: {} and {}", cli.report.display(), cli.report.with_extension("html").display());
    Ok(result)
}
