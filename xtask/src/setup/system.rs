//! The system's package manager, where this user may call it.

use std::process::{Command, Stdio};
use std::sync::Mutex;

use anyhow::Result;
use start::Package;

use crate::command::run;

/// Installs packages as root on Debian; for anyone else the error holds the one command.
pub(crate) fn install(packages: &[Package]) -> Result<()> {
    /// One at a time: the package manager has a lock of its own and does not wait for it.
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
