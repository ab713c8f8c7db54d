//! The tests of every crate, and the Python clients.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use super::host::{self, TestProgram};
use super::monitored;
use super::report::{Step, last_times};
use crate::command::{built, root, run_within};
use crate::images;
use crate::own_tool::Tools;
use crate::setup::python;

/// Tests on the emulated board take the longest. They begin first when there are no times of a last run.
const LONG: &str = "/board";

/// The time after which a test, or a file of Python tests, has failed. On two busy cores the longest takes a fifth of it.
const LIMIT: Duration = Duration::from_mins(20);

/// The same with `thorough`, where the longest takes an hour.
const THOROUGH_LIMIT: Duration = Duration::from_hours(6);

/// All tests whose name contains `only`, the longest first. With `thorough`, sampling tests try everything.
pub(super) fn collect(thorough: bool, only: Option<&str>) -> Result<Vec<Step>> {
    let programs = host::test_programs()?;
    images::build(Tools::Built)?;
    let mut steps = of_python(thorough)?;
    for program in programs {
        steps.extend(of_program(&program, thorough)?);
    }
    steps.retain(|step| only.is_none_or(|only| step.name().contains(only)));
    let times = last_times();
    let unknown = |name: &str| if name.contains(LONG) { 5.0 } else { 0.5 };
    steps.sort_by(|a, b| {
        let time = |step: &Step| times.get(step.name()).copied().unwrap_or_else(|| unknown(step.name()));
        time(b).total_cmp(&time(a))
    });
    Ok(steps)
}

/// The tests of a program. Each runs by itself, so that a test that depends on another one, or ends the process, is
/// noticed. Ignored tests need more than a new machine has, and run with `thorough`.
fn of_program(program: &TestProgram, thorough: bool) -> Result<Vec<Step>> {
    let mut names = list(&program.path, &[])?;
    if !thorough {
        let ignored = list(&program.path, &["--ignored"])?;
        names.retain(|name| !ignored.contains(name));
    }
    let (path, directory) = (Arc::new(program.path.clone()), Arc::new(program.directory.clone()));
    let step = |test: String| {
        let (path, directory) = (Arc::clone(&path), Arc::clone(&directory));
        Step::new(format!("{}: {test}", program.label), move || one(&path, &directory, &test, thorough))
    };
    Ok(names.into_iter().map(step).collect())
}

/// The names of the tests of a program.
fn list(program: &Path, flags: &[&str]) -> Result<Vec<String>> {
    let list = Command::new(program).args(["--list", "--format", "terse"]).args(flags).output();
    let list = list.with_context(|| format!("cannot start {}", program.display()))?;
    ensure!(list.status.success(), "{} does not list its tests", program.display());
    let list = String::from_utf8_lossy(&list.stdout);
    Ok(list.lines().filter_map(|line| line.strip_suffix(": test")).map(str::to_owned).collect())
}

fn one(program: &Path, directory: &Path, test: &str, thorough: bool) -> Result<()> {
    let mut command = Command::new(program);
    command
        .args(["--exact", test, "--nocapture", "--include-ignored"])
        .current_dir(directory)
        .env("CARGO_MANIFEST_DIR", directory);
    run_within(limit(thorough), with_images(&mut command, thorough))
}

/// The files of Python tests, each as a step.
fn of_python(thorough: bool) -> Result<Vec<Step>> {
    let folder = root().join("host-tests/python");
    let mut files: Vec<_> = folder.read_dir()?.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("test_")));
    let step = |file: std::path::PathBuf| {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Step::new(format!("python: {name}"), move || python(&file, thorough)).that_waits()
    };
    Ok(files.into_iter().map(step).collect())
}

fn python(file: &Path, thorough: bool) -> Result<()> {
    let mut command = Command::new(python::clients()?);
    command
        .args(["-m", "pytest", "-q", "--durations=3", "-o", "faulthandler_timeout=600"])
        .arg(file)
        .current_dir(root());
    command.env("IO_MODULE_COMMAND", built("examples/io_module"));
    run_within(limit(thorough), with_images(with_programs(&mut command), thorough))
}

fn limit(thorough: bool) -> Duration {
    if thorough { THOROUGH_LIMIT } else { LIMIT }
}

/// Sets the variables by which Python finds the programs of the project.
pub(crate) fn with_programs(command: &mut Command) -> &mut Command {
    for (variable, tool) in [("SIM_COMMAND", "sim"), ("NODECTL_COMMAND", "nodectl"), ("SIGN_COMMAND", "sign")]
    {
        command.env(variable, built(tool));
    }
    command
}

/// Sets the variables by which tests find the ELF files, and the variable that makes sampling tests try everything.
pub(crate) fn with_images(command: &mut Command, thorough: bool) -> &mut Command {
    if thorough {
        command.env("THOROUGH", "1");
    }
    command.env(monitored::LOG, monitored::log());
    command.env("NODE_IMAGES", images::dir()).env("MECHANICS_IMAGES", images::dir())
}
