//! `cargo sim`: build both images and the simulator, then become the simulator.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::thread;

use anyhow::{Result, anyhow};

use crate::command::{become_program, built};
use crate::setup::{self, emulator};
use crate::target::Toolchain;
use crate::{images, progress};

/// Builds the simulator, the tool that signs images, and the program that serves the page.
fn build() -> Result<()> {
    let mut command = emulator::cargo_with_emulator()?;
    command.args(["build", "--profile", "sim", "-p", "sim", "-p", "sign", "-p", "nodectl"]);
    progress::build("emulator 2/2", &mut command)
}

/// Builds at the same time what the Cortex-M4 and what this machine runs: each of the two leaves a core idle when it links.
fn build_all() -> Result<()> {
    thread::scope(|scope| {
        let images = scope.spawn(|| images::compile_node(&Toolchain::ensure()?));
        let programs = build();
        images.join().map_err(|_| anyhow!("the build of the firmware was interrupted"))??;
        programs
    })
}

/// Runs the simulator with the user's flags in the place of this process, so that a signal to `cargo sim` reaches the
/// simulator.
pub(crate) fn run(flags: &[OsString]) -> Result<ExitCode> {
    setup::check(setup::SIM)?;
    eprintln!("images for development: the bootloader starts what nobody has signed (docs/update.md)");
    build_all()?;
    images::sign(Command::new(built("sign")))?;
    become_program(with_images(&built("sim")).args(flags))
}

/// The simulator with the two ELF files it loads, and the program that it has serve the page. That is a program of its own: the
/// simulator's licence is not that of the tools.
fn with_images(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg("--bootloader").arg(images::dir().join("bootloader"));
    command.arg("--firmware").arg(images::dir().join("firmware"));
    command.arg("--page-program").arg(built("nodectl"));
    command
}
