//! Checks which needs of the project's commands this machine lacks. The crate has no dependencies, so that a user is
//! told of missing things before anything else is compiled.

pub mod needs;
mod packages;
pub mod python;
pub mod target;

use std::ffi::OsStr;
use std::io;
use std::process::{Command, ExitCode, Stdio};

pub use needs::{Need, missing};
pub use packages::{Missing, Package, apt_names, check, describe, is_installed, runs};

/// The output of a program without the last line end; `None` when the program is missing or fails.
pub fn output(program: impl AsRef<OsStr>, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}

/// Replaces this process by another program, so that a signal to this process reaches the program.
///
/// # Errors
/// The program cannot be started.
#[cfg(unix)]
pub fn become_program(command: &mut Command) -> io::Result<ExitCode> {
    use std::os::unix::process::CommandExt as _;
    Err(command.exec())
}

/// Without `exec` the program is a child process, and its exit status becomes ours.
///
/// # Errors
/// The program cannot be started.
#[cfg(not(unix))]
pub fn become_program(command: &mut Command) -> io::Result<ExitCode> {
    let code = command.status()?.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}
