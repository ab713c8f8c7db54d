//! The ELF files for the Cortex-M4.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::{run, target_dir};
use crate::own_tool::Tools;
use crate::progress;
use crate::target::{TRIPLE, Toolchain};

/// Where the ELF files lie.
pub(crate) fn dir() -> PathBuf {
    target_dir().join(TRIPLE).join("release")
}

/// Compiles the firmware and the bootloader.
pub(crate) fn compile_node(toolchain: &Toolchain) -> Result<()> {
    compile(toolchain, "firmware 1/2", &["firmware", "bootloader"])
}

/// Compiles everything that the tests run on the emulated core.
pub(crate) fn compile_all(toolchain: &Toolchain) -> Result<()> {
    compile(toolchain, "images", &["firmware", "bootloader", "mechanics-images"])
}

fn compile(toolchain: &Toolchain, what: &str, packages: &[&str]) -> Result<()> {
    let mut command = toolchain.cargo("build", &["--release"]);
    progress::build(what, command.args(packages.iter().flat_map(|package| ["-p", package])))?;
    for name in ["firmware", "bootloader"] {
        ensure!(dir().join(name).exists(), "cargo built no {name} in {}", dir().display());
    }
    Ok(())
}

/// Has the tool make the image that a programmer writes and `nodectl update` takes, signed with the development key.
pub(crate) fn sign(mut tool: Command) -> Result<()> {
    run(tool.arg("image").arg(dir().join("firmware")))
}

/// Compiles and signs everything that the tests run on the emulated core.
pub(crate) fn build(tools: Tools) -> Result<()> {
    compile_all(&Toolchain::ensure()?)?;
    sign(tools.get("sign")?)
}
