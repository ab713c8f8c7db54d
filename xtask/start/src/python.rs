//! The Python of this machine.

use std::process::{Command, Stdio};

use crate::packages::Package;

/// The missing packages that only the package manager can install.
pub fn missing() -> Vec<Package> {
    if makes_environments() { Vec::new() } else { vec![Package::Python] }
}

/// Whether there is a Python that can make environments. On Debian this needs a package of its own.
pub fn makes_environments() -> bool {
    let mut command = Command::new("python3");
    command.args(["-c", "import venv, ensurepip"]).stdin(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
