//! `cargo xtask fault-injection`: builds the bootloader in the configuration for an owner, and lets the emulated board
//! skip its instructions.

use std::ffi::OsString;

use anyhow::Result;

use crate::command::run;
use crate::images;
use crate::own_tool::Tools;
use crate::target::Toolchain;

/// Builds the programs, then runs the fault injection with the flags.
pub(crate) fn try_all(flags: &[OsString]) -> Result<()> {
    let bootloader = images::compile_owners(&Toolchain::ensure()?)?;
    run(Tools::ByCargo.get("glitch")?.arg("--bootloader").arg(bootloader).args(flags))
}
