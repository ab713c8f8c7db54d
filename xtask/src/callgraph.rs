//! `cargo xtask panics` and `cargo xtask stack`: what tools/callgraph reads in the images.

use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::{cargo, run};
use crate::images;
use crate::target::Toolchain;

/// Prints which code of the images can panic; fails when some of it is not known.
pub(crate) fn panics() -> Result<()> {
    images::build_node(&Toolchain::ensure()?)?;
    run(tool().arg("panics"))
}

/// The same, and shows that it can fail.
pub(crate) fn check_panics() -> Result<()> {
    panics()?;
    let forgetful = tool().args(["panics", "--forget", "defmt_rtt"]).output()?;
    let says = String::from_utf8_lossy(&forgetful.stderr);
    ensure!(
        !forgetful.status.success() && says.contains("defmt_rtt"),
        "a panic that is not known was not found:\n{says}"
    );
    Ok(())
}

/// Prints how deep the stack of each image can get; fails when that is more than is reserved for it.
pub(crate) fn stack(paths: bool) -> Result<()> {
    images::build_node(&Toolchain::ensure()?)?;
    let paths = if paths { &["--paths"][..] } else { &[] };
    run(tool().arg("stack").args(paths))
}

fn tool() -> Command {
    let mut command = cargo();
    command
        .args(["run", "--quiet", "--profile", "sim", "-p", "callgraph", "--", "--images"])
        .arg(images::dir());
    command
}
