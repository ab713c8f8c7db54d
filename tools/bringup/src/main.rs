//! The program behind `cargo xtask bringup`. The xtask builds the images before.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use bringup::chip::Chip;
use bringup::real::RealDesk;
use bringup::report::{self, Report, StepReport};
use bringup::run::{Effort, Subject};
use bringup::steps::{self, Step};
use canopen::NodeId;
use clap::Parser;
use nodectl::Network;
use nodectl::bus::Address;
use nodectl::update::Image;
use programmer::flash::Content;
use programmer::probe::Board;

/// Takes a board with the images of `cargo xtask flash` through fifteen steps, and writes a report.
///
/// The run stops at the first failure with the remedy. The next run continues there.
#[derive(Parser)]
#[command(name = "cargo xtask bringup", version)]
struct Cli {
    /// The ELF file of the bootloader
    #[arg(long, hide = true)]
    bootloader: PathBuf,
    /// The ELF file of the application
    #[arg(long, hide = true)]
    application: PathBuf,
    /// The CAN adapter
    #[arg(long, default_value = "socketcan:can0")]
    bus: Address,
    /// The bit rate of the bus in kbit/s
    #[arg(long, default_value_t = 250)]
    bit_rate: u16,
    /// The node-ID
    #[arg(long, default_value = "1", value_parser = node)]
    node: NodeId,
    /// Only this step, by name or number; may be given several times
    #[arg(long, value_parser = step)]
    step: Vec<&'static Step>,
    /// The report: JSON here, and HTML beside it
    #[arg(long, default_value = "bringup.json")]
    report: PathBuf,
    /// Begin again, also with steps that the report has as green
    #[arg(long)]
    again: bool,
    /// Measure for seconds instead of minutes
    #[arg(long)]
    short: bool,
    #[command(flatten)]
    board: Board,
}

fn node(text: &str) -> Result<NodeId, String> {
    let node = text.parse().ok().and_then(NodeId::new);
    node.ok_or_else(|| "a node-ID is a number from 1 to 127".to_owned())
}

fn step(text: &str) -> Result<&'static Step, String> {
    let names: Vec<_> = steps::ALL.iter().map(|step| step.name).collect();
    steps::named(text).ok_or_else(|| format!("no step; there are 1 to 15 and {}", names.join(", ")))
}

fn main() -> ExitCode {
    report::exit_code(run(&Cli::parse()))
}

fn run(cli: &Cli) -> Result<report::Result> {
    let chip =
        Chip::named(&cli.board.chip).with_context(|| format!("no images exist for {}", cli.board.chip))?;
    let mut report = if cli.again { Report::default() } else { Report::read(&cli.report)? };
    programmer::probe::check_version().map_err(anyhow::Error::msg)?;
    let mut desk = desk(cli)?;
    let subject = Subject { node: cli.node, chip, kbit: cli.bit_rate };
    let effort = if cli.short { Effort::SHORT } else { Effort::FULL };
    let chosen: Vec<&Step> = if cli.step.is_empty() { steps::ALL.iter().collect() } else { cli.step.clone() };
    if !cli.step.is_empty() {
        report.steps.retain(|step| chosen.iter().all(|chosen| chosen.number != step.number));
    }
    let mut written = Ok(());
    let result = bringup::run::all(&chosen, &mut desk, subject, effort, &mut report, |step, report| {
        print(step);
        if written.is_ok() {
            written = report.write(&cli.report);
        }
    });
    written?;
    println!("report: {} and {}", cli.report.display(), cli.report.with_extension("html").display());
    Ok(result)
}

fn desk(cli: &Cli) -> Result<RealDesk> {
    let read =
        |path: &PathBuf| std::fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let key = programmer::sign::key::development();
    let content = Content::new(&read(&cli.bootloader)?, &read(&cli.application)?, key, Vec::new())?;
    let (address, bit_rate) = (cli.bus.clone(), cli.bit_rate);
    let network = Network::open(move || address.open(bit_rate))?;
    Ok(RealDesk {
        board: cli.board.clone(),
        application: cli.application.clone(),
        address: cli.bus.clone(),
        network,
        programs: content.parts().collect(),
        image: Image::parse(content.image().to_bytes())?,
    })
}

fn print(step: &StepReport) {
    print!("{}", step.text());
}
