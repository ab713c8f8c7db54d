//! `cargo xtask panics` and `cargo xtask stack`: what tools/callgraph reads in the images.

use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::run;
use crate::images;
use crate::own_tool::Tools;
use crate::target::Toolchain;

/// Prints which code of the images can panic; fails when some of it is not known.
pub(crate) fn panics(tools: Tools) -> Result<()> {
    images::compile_node(&Toolchain::ensure()?, images::CHIP)?;
    run(tool(tools)?.arg("panics"))
}

/// The same, and shows that it can fail.
pub(crate) fn check_panics() -> Result<()> {
    panics(Tools::Built)?;
    let forgetful = tool(Tools::Built)?.args(["panics", "--forget", "defmt_rtt"]).output()?;
    let says = String::from_utf8_lossy(&forgetful.stderr);
    ensure!(
        !forgetful.status.success() && says.contains("defmt_rtt"),
        "a panic that is not known was not found:\n{says}"
    );
    Ok(())
}

/// Prints how deep the stack of each image can get; fails when that is more than is reserved for it.
pub(crate) fn stack(paths: bool, tools: Tools) -> Result<()> {
    images::compile_node(&Toolchain::ensure()?, images::CHIP)?;
    let paths = if paths { &["--paths"][..] } else { &[] };
    run(tool(tools)?.arg("stack").args(paths))
}

fn tool(tools: Tools) -> Result<Command> {
    let mut command = tools.get("callgraph")?;
    command.arg("--images").arg(images::dir());
    Ok(command)
}
