//! Calls of other programs.

use std::cell::RefCell;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, bail};

thread_local! {
    /// The file that the programs of this thread print to; without one, they print to the terminal.
    static LOG: RefCell<Option<File>> = const { RefCell::new(None) };
}

/// The root of the workspace.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the workspace")
}

/// The build directory that cargo uses for this workspace.
pub(crate) fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// A program of this machine that cargo has built with the profile `sim`.
pub(crate) fn built(name: &str) -> PathBuf {
    target_dir().join("sim").join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// The cargo that has started xtask.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// Runs `action`. The output of all programs that it runs on this thread goes into a file.
pub(crate) fn with_log<T>(log: File, action: impl FnOnce() -> T) -> T {
    LOG.set(Some(log));
    let result = action();
    LOG.set(None);
    result
}

/// Prints a line to the log; without a log, to the terminal.
pub(crate) fn say(line: &str) {
    LOG.with_borrow_mut(|log| match log {
        // A full disk makes the program fail that is run; a lost line before does not matter.
        Some(log) => drop(writeln!(log, "{line}")),
        None => eprintln!("{line}"),
    });
}

/// Runs a program to its end. The error names the program when it cannot start or fails.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let name = line(command);
    if let Some((out, err)) = streams()? {
        command.stdin(Stdio::null()).stdout(out).stderr(err);
    }
    let status = command.status().with_context(|| format!("cannot start `{name}`"))?;
    if !status.success() {
        bail!("`{name}` failed ({status})");
    }
    Ok(())
}

fn streams() -> Result<Option<(File, File)>> {
    LOG.with_borrow(|log| match log {
        Some(log) => Ok(Some((log.try_clone()?, log.try_clone()?))),
        None => Ok(None),
    })
}

/// Replaces this process by another program, so that a signal to `cargo xtask` reaches the program.
pub(crate) fn become_program(command: &mut Command) -> Result<ExitCode> {
    start::become_program(command)
        .with_context(|| format!("cannot start {}", command.get_program().display()))
}

pub(crate) fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let mut text = program.file_name().unwrap_or_default().to_string_lossy().into_owned();
    for arg in command.get_args() {
        text.push(' ');
        text.push_str(&arg.to_string_lossy());
    }
    text
}
