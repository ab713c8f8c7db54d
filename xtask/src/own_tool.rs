//! Tools of the project that have flags of their own, run from wherever `cargo xtask` is called.

use std::ffi::OsString;

use anyhow::{Context, Result};

use crate::command::{self, cargo, root};

/// Runs the tool in the directory of the caller, so that paths mean what they say.
pub(crate) fn run(tool: &str, arguments: &[OsString]) -> Result<()> {
    let here = std::env::current_dir().context("there is no current directory")?;
    let manifest = root().join("Cargo.toml");
    let mut command = cargo();
    command.args(["run", "--quiet", "-p", tool, "--manifest-path"]).arg(manifest).arg("--").args(arguments);
    command::run(command.current_dir(here))
}
