//! Python environments below the build directory, made from a list of packages.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use start::python::missing;

use crate::apt;
use crate::command::{root, run, target_dir};

/// The Python interpreter with the CANopen clients that test the node.
pub(crate) fn clients() -> Result<PathBuf> {
    apt::install(&missing())?;
    ensure(&target_dir().join("venv"), "host-tests/python/requirements.txt")
}

/// The interpreter of an environment with the packages of a list. The environment is made again when the list has
/// changed.
pub(crate) fn ensure(environment: &Path, list: &str) -> Result<PathBuf> {
    let python = environment.join("bin/python");
    let stamp = environment.join("requirements.txt");
    let list = root().join(list);
    let wanted = std::fs::read(&list).with_context(|| format!("cannot read {}", list.display()))?;
    if python.exists() && std::fs::read(&stamp).is_ok_and(|have| have == wanted) {
        return Ok(python);
    }
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(environment))?;
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(&list))?;
    std::fs::write(&stamp, wanted)?;
    Ok(python)
}
