//! The system's package manager, for users who may call it.

use std::process::{Command, Stdio};
use std::sync::Mutex;

use anyhow::Result;
use start::Package;

use crate::command::run;

/// Installs packages as root on Debian; for other users the error contains the command.
pub(crate) fn install(packages: &[Package]) -> Result<()> {
    /// Serialises the calls, because the package manager fails instead of waiting for its lock.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    if packages.is_empty() {
        return Ok(());
    }
    start::check(packages)?;
    let names = start::apt_names(packages);
    eprintln!("installing {}", names.join(" "));
    let _guard = ONE_AT_A_TIME.lock();
    run(apt_get().arg("update"))?;
    run(apt_get().args(["install", "-y", "--no-install-recommends"]).args(names))
}

fn apt_get() -> Command {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive").arg("-qq").stdin(Stdio::null()).stdout(Stdio::null());
    command
}
