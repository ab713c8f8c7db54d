//! The output of a build while it runs: a line now and then instead of a line for each crate, and all warnings and
//! errors.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use crate::command::say;

/// The longest time without an output.
const PERIOD: Duration = Duration::from_secs(10);

/// First words of cargo's lines that are no message of the compiler.
const ROUTINE: [&str; 12] = [
    "Adding",
    "Blocking",
    "Checking",
    "Compiling",
    "Documenting",
    "Downloaded",
    "Downloading",
    "Finished",
    "Fresh",
    "Generated",
    "Locking",
    "Updating",
];

/// Runs a cargo command to its end. While it compiles, lines that begin with `what` tell the progress.
///
/// # Errors
/// The command cannot start, or it fails. The messages of the compiler have been printed.
pub(crate) fn build(what: &str, command: &mut Command) -> Result<()> {
    let begin = Instant::now();
    let mut child = command.stderr(Stdio::piped()).spawn().context("cannot start cargo")?;
    let stderr = child.stderr.take().context("cargo has no output")?;
    let (sender, lines) = channel();
    let reader = std::thread::spawn(move || {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            let _ = sender.send(line);
        }
    });
    let crates = tell(what, begin, &lines);
    let status = child.wait()?;
    let _ = reader.join();
    ensure!(status.success(), "the build of {what} failed ({status})");
    if crates > 0 {
        eprintln!("{what}: built in {:.0} s", begin.elapsed().as_secs_f64());
    }
    Ok(())
}

/// Prints the progress until cargo has ended. Returns the number of compiled crates.
fn tell(what: &str, begin: Instant, lines: &Receiver<String>) -> u32 {
    let (mut crates, mut doing, mut told) = (0, String::from("starting"), begin);
    loop {
        let line = lines.recv_timeout(PERIOD.saturating_sub(told.elapsed()));
        match line.as_deref().map(routine) {
            Ok(Some(("Compiling", name))) => (crates, doing) = (crates + 1, format!("compiling {name}")),
            Ok(Some(("Blocking", _))) => doing = "waiting for another cargo".to_owned(),
            Ok(Some(("Downloading" | "Updating", _))) => doing = "downloading".to_owned(),
            Ok(Some(_)) => {}
            Ok(None) => say(&line.unwrap_or_default()),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return crates,
        }
        if told.elapsed() >= PERIOD {
            told = Instant::now();
            eprintln!("{what}: {crates} crates, {doing} ({:.0} s)", begin.elapsed().as_secs_f64());
        }
    }
}

/// The first word of a routine line of cargo, and the rest of the line.
fn routine(line: &str) -> Option<(&str, &str)> {
    let (word, rest) = line.trim_start().split_once(' ')?;
    ROUTINE.contains(&word).then(|| (word, rest.split(" (").next().unwrap_or(rest)))
}
