//! `cargo xtask fault-injection`: builds the bootloader as its owner does, and has the emulated board go wrong in its decision.

use std::ffi::OsString;

use anyhow::Result;

use crate::command::run;
use crate::images;
use crate::own_tool::Tools;
use crate::target::Toolchain;

/// Builds what is disturbed, then disturbs it as the flags say.
pub(crate) fn try_all(flags: &[OsString]) -> Result<()> {
    let bootloader = images::compile_owners(&Toolchain::ensure()?)?;
    run(Tools::ByCargo.get("glitch")?.arg("--bootloader").arg(bootloader).args(flags))
}
