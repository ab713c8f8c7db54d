//! The ELF files for the Cortex-M4.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::{root, run, target_dir};
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

/// Compiles the application alone, and says where it is.
pub(crate) fn compile_application(toolchain: &Toolchain) -> Result<PathBuf> {
    progress::build("firmware", &mut toolchain.cargo("build", &["--release", "-p", "firmware"]))?;
    Ok(dir().join("firmware"))
}

/// Compiles the bootloader alone, and says where it is: that of a development board, or one that trusts nothing but this key.
pub(crate) fn compile_bootloader(toolchain: &Toolchain, key: Option<String>) -> Result<PathBuf> {
    let mut command = toolchain.cargo("build", &["--release", "-p", "bootloader"]);
    if let Some(key) = key {
        command.args(["--features", "production"]).env("UPDATE_PUBLIC_KEY", key);
    }
    progress::build("bootloader", &mut command)?;
    Ok(dir().join("bootloader"))
}

/// Compiles everything that the tests run on the emulated core.
pub(crate) fn compile_all(toolchain: &Toolchain) -> Result<()> {
    compile(toolchain, "images", &["firmware", "bootloader", "mechanics-images"])
}

/// Compiles the bootloader as its owner does, with a key that only the tests know, and puts the file beside the one of a
/// development board.
pub(crate) fn compile_owners(toolchain: &Toolchain) -> Result<PathBuf> {
    let key = std::fs::read_to_string(root().join("host-tests/tests/board/update/owner-key.hex"))?;
    let bootloader = compile_bootloader(toolchain, Some(key.trim().to_owned()))?;
    let owners = dir().join("bootloader-production");
    std::fs::copy(bootloader, &owners)?;
    Ok(owners)
}

/// The same; and without a key of the owner's there is no such bootloader.
pub(crate) fn compile_production(toolchain: &Toolchain) -> Result<()> {
    compile_owners(toolchain)?;
    let package = ["--release", "-p", "bootloader", "--features", "production"];
    let refused = toolchain.cargo("build", &package).env_remove("UPDATE_PUBLIC_KEY").output()?;
    let says = String::from_utf8_lossy(&refused.stderr);
    ensure!(
        !refused.status.success() && says.contains("needs a key of its own"),
        "a production bootloader was built with the development key:\n{says}"
    );
    Ok(())
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
