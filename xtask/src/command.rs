//! Running other programs.

use std::cell::RefCell;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, bail};

thread_local! {
    /// Where the programs that this thread runs print to; the terminal when there is none.
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

/// The cargo that runs xtask.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// Lets everything that `action` runs on this thread print into a file.
pub(crate) fn with_log<T>(log: File, action: impl FnOnce() -> T) -> T {
    LOG.set(Some(log));
    let result = action();
    LOG.set(None);
    result
}

/// A line for the log, or the terminal where there is none.
pub(crate) fn say(line: &str) {
    LOG.with_borrow_mut(|log| match log {
        // A full disk ends the program that is run; a line about the program may be lost before.
        Some(log) => drop(writeln!(log, "{line}")),
        None => eprintln!("{line}"),
    });
}

/// Runs to the end; an error names the program when it cannot start or fails.
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

/// Goes on as another program, so that a signal to `cargo xtask` reaches that one.
pub(crate) fn become_program(command: &mut Command) -> Result<ExitCode> {
    start::become_program(command)
        .with_context(|| format!("cannot start {}", command.get_program().display()))
}

fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let mut text = program.file_name().unwrap_or_default().to_string_lossy().into_owned();
    for arg in command.get_args() {
        text.push(' ');
        text.push_str(&arg.to_string_lossy());
    }
    text
}
