//! What this machine has of Python.

use std::process::{Command, Stdio};

use crate::packages::Package;

/// What only the package manager can bring.
pub fn missing() -> Vec<Package> {
    if makes_environments() { Vec::new() } else { vec![Package::Python] }
}

/// Whether there is a Python that can make environments: Debian has the part that does in a package of its own.
pub fn makes_environments() -> bool {
    let mut command = Command::new("python3");
    command.args(["-c", "import venv, ensurepip"]).stdin(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
