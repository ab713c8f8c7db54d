//! `cargo sim`: build both images, then hand over to the simulator.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};

use crate::command::{cargo, run as run_command, target_dir};
use crate::target::Toolchain;
use crate::{images, native};

/// Builds the simulator and returns its path.
pub(crate) fn build() -> Result<PathBuf> {
    native::ensure_emulator_tools()?;
    run_command(cargo().args(["build", "--quiet", "--profile", "sim", "-p", "sim"]))?;
    Ok(target_dir().join("sim").join(format!("sim{}", std::env::consts::EXE_SUFFIX)))
}

/// Runs the simulator with the user's flags; its exit status becomes ours.
pub(crate) fn run(flags: &[OsString]) -> Result<ExitCode> {
    images::build_node(&Toolchain::ensure()?)?;
    let program = build()?;
    let status = with_images(&program).args(flags).status();
    let status = status.with_context(|| format!("cannot start {}", program.display()))?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}

/// The simulator with the two ELF files it loads.
fn with_images(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg("--bootloader").arg(images::dir().join("bootloader"));
    command.arg("--firmware").arg(images::dir().join("firmware"));
    command
}
