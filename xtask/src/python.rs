//! The Python clients (python-can, canopen) that judge the node, in an environment of their own.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Result, bail};

use crate::command::{exists, root, run, target_dir};

/// The interpreter of the environment, made on first use from host-tests/python/requirements.txt.
pub(crate) fn ensure() -> Result<PathBuf> {
    let dir = target_dir().join("venv");
    let python = dir.join("bin/python");
    let requirements = root().join("host-tests/python/requirements.txt");
    let stamp = dir.join("requirements.txt");
    let wanted = std::fs::read(&requirements)?;
    if python.exists() && std::fs::read(&stamp).is_ok_and(|have| have == wanted) {
        return Ok(python);
    }
    if !exists("python3") {
        bail!("missing: python3 (the tests run python-can and canopen against the node)");
    }
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&dir))?;
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(&requirements))?;
    std::fs::write(&stamp, wanted)?;
    Ok(python)
}
