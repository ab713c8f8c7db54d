//! The ELF files for the Cortex-M4.

use std::path::PathBuf;

use anyhow::{Result, ensure};

use crate::command::{cargo, run, target_dir};
use crate::target::{TRIPLE, Toolchain};

/// Where the ELF files lie.
pub(crate) fn dir() -> PathBuf {
    target_dir().join(TRIPLE).join("release")
}

/// Builds the firmware and the bootloader.
pub(crate) fn build_node(toolchain: &Toolchain) -> Result<()> {
    run(&mut toolchain.cargo("build", &["--release", "-p", "firmware", "-p", "bootloader"]))?;
    for name in ["firmware", "bootloader"] {
        ensure!(dir().join(name).exists(), "cargo built no {name} in {}", dir().display());
    }
    // Signed with the development key: what a programmer writes and `nodectl update` takes.
    run(cargo().args(["run", "--quiet", "-p", "sign", "--", "image"]).arg(dir().join("firmware")))
}

/// Builds everything that the tests run on the emulated core.
pub(crate) fn build() -> Result<Toolchain> {
    let toolchain = Toolchain::ensure()?;
    build_node(&toolchain)?;
    run(&mut toolchain.cargo("build", &["--release", "-p", "mechanics-images"]))?;
    Ok(toolchain)
}
