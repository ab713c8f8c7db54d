//! Python environments below the build directory, made from a list of packages.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use super::system::{self, Package};
use crate::command::{root, run, target_dir};

/// The interpreter with the CANopen clients that judge the node.
pub(crate) fn clients() -> Result<PathBuf> {
    system::install(&missing())?;
    ensure(&target_dir().join("venv"), "host-tests/python/requirements.txt")
}

/// What only the package manager can bring.
pub(super) fn missing() -> Vec<Package> {
    if makes_environments() { Vec::new() } else { vec![Package::Python] }
}

/// Whether there is a Python that can make environments: Debian has the part that does in a package of its own.
pub(super) fn makes_environments() -> bool {
    let mut command = Command::new("python3");
    command.args(["-c", "import venv, ensurepip"]).stdin(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// The interpreter of an environment with the packages of a list; made anew when the list has changed.
pub(super) fn ensure(environment: &Path, list: &str) -> Result<PathBuf> {
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
