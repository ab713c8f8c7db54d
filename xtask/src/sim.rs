//! `cargo sim`: builds both images and the simulator, then becomes the simulator.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::thread;

use anyhow::{Result, anyhow};

use crate::command::{become_program, built};
use crate::setup;
use crate::target::Toolchain;
use crate::{images, own_tool};

/// Builds the programs for the Cortex-M4 and for this machine at the same time, because each build leaves a core idle
/// while it links.
fn build_all(chip: &str) -> Result<PathBuf> {
    thread::scope(|scope| {
        let images = scope.spawn(|| images::compile_node(&Toolchain::ensure()?, chip));
        own_tool::build_simulator("emulator 2/2")?;
        images.join().map_err(|_| anyhow!("the build of the firmware was interrupted"))?
    })
}

/// The stimuli of a call without flags: a slow pressure and a slower temperature, so that the values of the first look move.
const MOVING: [&str; 4] = ["--pressure", "sine:250000,100000,0.05", "--temperature", "sine:298.15,5,0.02"];

/// The chip that the flags name. The simulator itself refuses an unknown name.
fn chip(flags: &[OsString]) -> &str {
    let mut flags = flags.iter().filter_map(|flag| flag.to_str());
    let found = flags.find_map(|flag| match flag.strip_prefix("--chip") {
        Some("") => Some(None),
        Some(rest) => rest.strip_prefix('=').map(Some),
        None => None,
    });
    let named = found.and_then(|name| name.or_else(|| flags.next()));
    named.filter(|name| images::other_board(name).is_some()).unwrap_or(images::CHIP)
}

/// Replaces this process by the simulator with the user's flags, so that a signal to `cargo sim` reaches the simulator.
pub(crate) fn run(flags: &[OsString]) -> Result<ExitCode> {
    setup::check(setup::SIM)?;
    eprintln!("development images: the bootloader accepts unsigned applications (docs/update.md)");
    let images = build_all(chip(flags))?;
    images::sign(Command::new(built("sign")), &images)?;
    let mut simulator = with_images(&built("sim"), &images);
    if flags.is_empty() {
        eprintln!("pressure and temperature move slowly; `cargo sim --pressure const:250000` holds them");
        simulator.args(MOVING);
    }
    become_program(simulator.args(flags))
}

/// The call of the simulator with the two ELF files and the program that serves the page. The page has a program of its
/// own, because the simulator has another licence than the tools.
fn with_images(program: &Path, images: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg("--bootloader").arg(images.join("bootloader"));
    command.arg("--firmware").arg(images.join("firmware"));
    command.arg("--page-program").arg(built("nodectl"));
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chip_of_the_flags() {
        for (flags, expected) in [
            ("", "stm32f446"),
            ("--chip stm32f405", "stm32f405"),
            ("--for 5 --chip=stm32f407 --json", "stm32f407"),
            ("--chip", "stm32f446"),
            ("--chip stm32h7", "stm32f446"),
            ("--chips stm32f405", "stm32f446"),
        ] {
            let flags: Vec<OsString> = flags.split_whitespace().map(OsString::from).collect();
            assert_eq!(chip(&flags), expected, "{flags:?}");
        }
    }
}
