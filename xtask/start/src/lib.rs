//! What this machine has of what the commands of the project need, found without any other crate: a machine that lacks something is told so
//! before anything else is compiled.

pub mod needs;
mod packages;
pub mod python;
pub mod target;

use std::ffi::OsStr;
use std::process::{Command, Stdio};

pub use needs::{Need, missing};
pub use packages::{Missing, Package, apt_names, check, describe, is_installed, runs};

/// What a program prints, without the last line end; `None` when it is missing or fails.
pub fn output(program: impl AsRef<OsStr>, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}
