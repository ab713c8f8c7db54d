//! `cargo xtask panics` and `cargo xtask stack`: checks of the images by tools/callgraph.

use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::run;
use crate::images;
use crate::own_tool::Tools;
use crate::target::Toolchain;

/// Prints the code of the images that can panic; fails when some of it is not known.
pub(crate) fn panics(tools: Tools) -> Result<()> {
    images::compile_node(&Toolchain::ensure()?, images::CHIP)?;
    run(tool(tools)?.arg("panics"))
}

/// The check of the test command, which also shows that the check can fail.
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

/// Prints the bound of each image's stack; fails when the bound exceeds the reserved size.
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
