//! Cargo commands that have to be installed.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::Result;

use crate::command::{cargo, run, target_dir};

/// The search path with this command, which is installed below the build directory if it is missing.
pub(crate) fn with(name: &str) -> Result<OsString> {
    let tools = target_dir().join("tools");
    if !tools.join("bin").join(name).exists() {
        eprintln!("installing {name} to {}", tools.display());
        run(cargo().args(["install", "--quiet", "--locked", name, "--root"]).arg(&tools))?;
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> =
        std::iter::once(tools.join("bin")).chain(std::env::split_paths(&path)).collect();
    Ok(std::env::join_paths(folders)?)
}
