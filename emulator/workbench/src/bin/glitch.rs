//! The program behind `cargo xtask fault-injection`, which builds the bootloader first.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use workbench::glitch::{Campaign, Extent, Places, Scene, Violation, Watcher};

/// Injects faults into the bootloader's decision: skips each instruction, inverts each condition flag that it reads, and inverts bits of
/// the registers that it reads. No unsigned and no older image may start.
#[derive(Parser)]
#[command(name = "cargo xtask fault-injection", version)]
struct Cli {
    /// The ELF file of the bootloader, built for the key of the tests
    #[arg(long)]
    bootloader: PathBuf,
    /// Only scenes whose name contains this
    #[arg(long)]
    scene: Option<String>,
    /// Only functions whose name contains this; may be given more than once
    #[arg(long)]
    within: Vec<String>,
    /// Interval between sampled instructions; 1 selects each
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    every: u16,
    /// Interval between sampled instructions in the loops of hash, CRC and curve arithmetic
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    every_of_loops: u16,
    /// Number of register bits to flip at each instruction; a register has 32
    #[arg(long, default_value_t = 4)]
    flips: usize,
    /// Two skips instead of one fault: the interval between sampled instructions, for the first and for the second
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pairs: Option<u16>,
}

fn main() -> ExitCode {
    run(&Cli::parse()).map_or_else(
        |error| {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        },
        |()| ExitCode::SUCCESS,
    )
}

fn run(cli: &Cli) -> Result<()> {
    let bootloader = std::fs::read(&cli.bootloader)
        .with_context(|| format!("cannot read {}", cli.bootloader.display()))?;
    let places = Places::of(&bootloader)?;
    let boards = std::thread::available_parallelism()?.get();
    let extent = Extent {
        every: cli.every.into(),
        every_of_conditions: cli.every.into(),
        every_of_loops: cli.every_of_loops.into(),
        flips: cli.flips,
        pairs: cli.pairs.map(usize::from),
        boards,
    };
    let broken = |Violation { point, fault, after }: Violation| {
        println!("  BROKEN by {fault}, visit {}: {}", point.visit, places.name(fault.address()));
        if let Some(after) = after {
            println!("    after {after}: {}", places.name(after.address()));
        }
    };
    let takes = |address| {
        let name = places.name(address);
        cli.within.is_empty() || cli.within.iter().any(|part| name.contains(part.as_str()))
    };
    let watcher = Watcher { takes: &takes, broken: &broken };
    let mut violations = 0;
    let mut scenes = Scene::all()?;
    scenes.retain(|scene| cli.scene.as_ref().is_none_or(|name| scene.name.contains(name.as_str())));
    ensure!(!scenes.is_empty(), "no scene has this name");
    for scene in scenes {
        let begin = Instant::now();
        println!("{}: {}", scene.name, scene.what);
        let campaign = Campaign::run(&bootloader, &scene, extent, &watcher)?;
        print(&campaign, begin.elapsed().as_secs_f64());
        violations += campaign.violations.len();
    }
    ensure!(violations == 0, "{violations} faults started a forbidden image");
    println!("no unsigned and no older image has started");
    Ok(())
}

fn print(campaign: &Campaign, seconds: f64) {
    let Campaign { instructions, loops, points, .. } = campaign;
    println!("  {instructions} instructions, {loops} of them in loops of hashes, sums and points");
    println!("  {} faults at {points} points, {seconds:.0} s", campaign.faults());
    println!(
        "  {} skips, {} flags, {} of {} bits of the read registers",
        campaign.tried("skips"),
        campaign.tried("flags"),
        campaign.tried("register bits"),
        campaign.bits
    );
    if campaign.tried("pairs of skips") > 0 {
        println!("  {} pairs of skips", campaign.tried("pairs of skips"));
    }
    for ((kind, what), count) in &campaign.outcomes {
        println!("  {count:>8} {kind}: {what}");
    }
}
