//! Programs, libraries, tests and examples for this machine, compiled by one cargo call. With one call each crate is
//! compiled with one set of features.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::metadata::RELEASED;
use crate::setup::emulator;

/// The packages that build for the embedded target only.
pub(super) const IMAGES: [&str; 5] =
    ["firmware", "bootloader", "mechanics-images", "panic-free", "bench-images"];

/// A cargo call for all packages of this machine, including the emulated board.
pub(super) fn cargo(verb: &str) -> Result<Command> {
    let mut command = emulator::cargo_with_emulator()?;
    command.args([
        verb,
        "--workspace",
        "--profile",
        "sim",
        "--features",
        "host-tests/board",
        "--features",
        RELEASED,
    ]);
    for package in IMAGES {
        command.args(["--exclude", package]);
    }
    Ok(command)
}

/// The call that compiles all packages.
pub(super) fn build() -> Result<Command> {
    let mut command = cargo("build")?;
    command.arg("--all-targets");
    Ok(command)
}

/// A program with tests.
pub(super) struct TestProgram {
    /// The package, with the name of the test file if there is one.
    pub(super) label: String,
    pub(super) path: PathBuf,
    /// The directory in which cargo runs the tests.
    pub(super) directory: PathBuf,
}

/// Cargo's message about a compiled artifact.
#[derive(Deserialize)]
struct Message {
    reason: String,
    manifest_path: Option<PathBuf>,
    target: Option<Target>,
    profile: Option<Profile>,
    executable: Option<PathBuf>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
    kind: Vec<String>,
}

#[derive(Deserialize)]
struct Profile {
    test: bool,
}

/// Compiles the packages and lists the programs with tests.
pub(super) fn test_programs() -> Result<Vec<TestProgram>> {
    let mut command = build()?;
    command.args(["--quiet", "--message-format", "json-render-diagnostics"]);
    let mut child = command.stdout(Stdio::piped()).spawn().context("cannot start cargo")?;
    let stdout = child.stdout.take().context("cargo has no output")?;
    let mut programs = BTreeMap::new();
    for line in BufReader::new(stdout).lines() {
        let message: Message = serde_json::from_str(&line?).context("cargo says what is not understood")?;
        if let Some(program) = test_program(message) {
            let label = program.label.clone();
            ensure!(!programs.contains_key(&label), "two programs with tests are called {label}");
            programs.insert(label, program);
        }
    }
    ensure!(child.wait()?.success(), "the tests do not compile");
    Ok(programs.into_values().collect())
}

fn test_program(message: Message) -> Option<TestProgram> {
    if message.reason != "compiler-artifact" || !message.profile?.test {
        return None;
    }
    let (path, target) = (message.executable?, message.target?);
    let directory = message.manifest_path?.parent()?.to_owned();
    let package = directory.file_name().map(Path::new)?.display().to_string();
    let label = match target.kind.first().map(String::as_str) {
        Some("lib") => package,
        Some("bin") => format!("{package}/bin/{}", target.name),
        _ => format!("{package}/{}", target.name),
    };
    Some(TestProgram { label, path, directory })
}
