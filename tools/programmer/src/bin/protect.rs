//! `cargo xtask protect`: sets the option bytes of a chip at a debug probe, and explains the consequences before.

use std::io::{BufRead, Write, stdin, stdout};
use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::Parser;
use programmer::probe::Board;
use programmer::protect::probe::{DryRun, Probe};
use programmer::protect::{OptionBytes, ReadOut, current, program};

/// Write protection of the bootloader, and read-out protection of the flash, with probe-rs. Without a choice it prints
/// the protections of the chip.
#[derive(Parser)]
#[command(name = "cargo xtask protect", version)]
struct Cli {
    /// Sectors 0 and 1 can be neither erased nor programmed
    #[arg(long)]
    bootloader: bool,
    /// Level 1: no debugger reads or programs the flash. The removal erases the flash. (Level 2 is not offered)
    #[arg(long)]
    readout: bool,
    /// The chip is held in reset below 2.7 V, which the flash needs at this clock
    #[arg(long)]
    brown_out: bool,
    /// Take the chosen protections away
    #[arg(long)]
    off: bool,
    /// Print the calls of probe-rs for a new chip, and make none
    #[arg(long)]
    dry_run: bool,
    /// Do not ask
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    board: Board,
}

impl Cli {
    fn change(&self, has: OptionBytes) -> OptionBytes {
        let wanted = if self.bootloader { has.with_bootloader(!self.off) } else { has };
        let wanted = if self.brown_out { wanted.with_brown_out(!self.off) } else { wanted };
        if self.readout { wanted.with_read_out(!self.off) } else { wanted }
    }

    /// The option bytes that a dry run assumes: those of a new chip, with the protections that are to be removed.
    fn pretended(&self) -> OptionBytes {
        let opposite = |chosen| chosen && self.off;
        let new = OptionBytes::FACTORY.with_bootloader(opposite(self.bootloader));
        let new = new.with_brown_out(opposite(self.brown_out));
        if opposite(self.readout) { new.with_read_out(true) } else { new }
    }
}

fn main() -> ExitCode {
    run(&Cli::parse()).map_or_else(
        |error| {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        },
        |()| ExitCode::SUCCESS,
    )
}

fn run(cli: &Cli) -> Result<()> {
    if !cli.dry_run {
        programmer::probe::check_version().map_err(anyhow::Error::msg)?;
    }
    let mut probe = Probe::new(cli.board.clone());
    let has = if cli.dry_run { cli.pretended() } else { current(&mut probe)? };
    println!("now   {has}");
    let wanted = cli.change(has);
    if wanted == has {
        println!("nothing is to be changed");
        return Ok(());
    }
    println!("then  {wanted}");
    consequences(has, wanted).iter().for_each(|line| println!("{line}"));
    if cli.dry_run {
        return Ok(program(&mut DryRun::new(probe, has), wanted)?);
    }
    ensure!(cli.yes || agrees()?, "nothing was changed");
    program(&mut probe, wanted)?;
    println!("done; take the power away and the probe off before the board is used");
    Ok(())
}

/// The consequences that the user has to confirm.
fn consequences(has: OptionBytes, wanted: OptionBytes) -> Vec<&'static str> {
    let closes = has.read_out() == ReadOut::Open && wanted.read_out() == ReadOut::Protected;
    let cases = [
        (
            !has.keeps_bootloader() && wanted.keeps_bootloader(),
            "No debugger and no program replaces the bootloader any more, until --off --bootloader.",
        ),
        (
            closes,
            "No debugger reads or programs the flash any more. This cannot be undone without loss: --off --readout \
             ERASES ALL OF THE FLASH, with bootloader, application, parameters and calibration.",
        ),
        (
            has.is_erased_by(wanted),
            "ALL OF THE FLASH WILL BE ERASED: bootloader, application, parameters and calibration.",
        ),
    ];
    cases.into_iter().filter_map(|(applies, line)| applies.then_some(line)).collect()
}

fn agrees() -> Result<bool> {
    print!("Type yes to go on: ");
    stdout().flush()?;
    let mut answer = String::new();
    stdin().lock().read_line(&mut answer)?;
    Ok(answer.trim() == "yes")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cli(flags: &str) -> Cli {
        Cli::parse_from(std::iter::once("protect").chain(flags.split_whitespace()))
    }

    #[test]
    fn the_flags_choose_the_changed_bytes() {
        let new = OptionBytes::FACTORY;
        let both = new.with_bootloader(true).with_read_out(true);
        assert_eq!(cli("").change(new), new);
        assert_eq!(cli("--bootloader").change(new), new.with_bootloader(true));
        assert_eq!(cli("--bootloader --readout").change(new), both);
        assert_eq!(cli("--off --bootloader").change(both), new.with_read_out(true));
        assert_eq!(cli("--off --bootloader --readout").change(both), new);
        assert_eq!(cli("--brown-out").change(new), new.with_brown_out(true));
        assert_eq!(cli("--off --brown-out").change(new.with_brown_out(true)), new);
        for flags in [
            "--brown-out",
            "--off --brown-out",
            "--bootloader",
            "--readout",
            "--off --bootloader",
            "--off --readout",
        ] {
            let cli = cli(flags);
            assert_ne!(cli.change(cli.pretended()), cli.pretended(), "a dry run shows something: {flags}");
        }
    }

    #[test]
    fn an_option_that_erases_the_flash_reports_it() {
        let new = OptionBytes::FACTORY;
        let closed = new.with_read_out(true);
        assert_eq!(consequences(new, new.with_bootloader(true)).len(), 1);
        assert!(consequences(new, closed)[0].contains("ERASES ALL"));
        assert!(consequences(closed, new)[0].contains("WILL BE ERASED"));
        assert!(
            consequences(closed, closed.with_bootloader(true)).iter().all(|line| !line.contains("ERASE"))
        );
    }
}
