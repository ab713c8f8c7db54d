//! Calls of other programs.

use std::cell::RefCell;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use wait_timeout::ChildExt as _;

/// The time that an interrupted program has to say where it stood.
const LAST_WORDS: Duration = Duration::from_secs(30);

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
    succeeded(&name, start(command)?.wait()?)
}

/// Runs a program as [`run`] does, but no longer than a limit. A program that still runs then is interrupted, so that
/// pytest prints where it stood, and is killed if it goes on.
pub(crate) fn run_within(limit: Duration, command: &mut Command) -> Result<()> {
    let name = line(command);
    let mut child = start(command)?;
    if let Some(status) = child.wait_timeout(limit)? {
        return succeeded(&name, status);
    }
    interrupt(&mut child)?;
    if child.wait_timeout(LAST_WORDS)?.is_none() {
        child.kill()?;
        child.wait()?;
    }
    bail!("`{name}` had not ended after {} s", limit.as_secs());
}

fn start(command: &mut Command) -> Result<Child> {
    if let Some((out, err)) = streams()? {
        command.stdin(Stdio::null()).stdout(out).stderr(err);
    }
    command.spawn().with_context(|| format!("cannot start `{}`", line(command)))
}

fn succeeded(name: &str, status: ExitStatus) -> Result<()> {
    if !status.success() {
        bail!("`{name}` failed ({status})");
    }
    Ok(())
}

/// Ends a program as Ctrl-C does. Elsewhere than on Linux it is killed.
fn interrupt(child: &mut Child) -> Result<()> {
    #[cfg(target_os = "linux")]
    rustix::process::kill_process(rustix::process::Pid::from_child(child), rustix::process::Signal::INT)?;
    #[cfg(not(target_os = "linux"))]
    child.kill()?;
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_does_not_end_is_ended() {
        let error = run_within(Duration::ZERO, Command::new("sleep").arg("1000")).unwrap_err();
        assert_eq!(error.to_string(), "`sleep 1000` had not ended after 0 s");
    }

    #[test]
    fn a_program_that_ends_has_its_result() {
        run_within(Duration::MAX, &mut Command::new("true")).unwrap();
        let error = run_within(Duration::MAX, &mut Command::new("false")).unwrap_err();
        assert_eq!(error.to_string(), "`false` failed (exit status: 1)");
    }
}
