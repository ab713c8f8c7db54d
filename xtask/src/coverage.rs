//! `cargo xtask coverage`: the lines of the pure crates that the tests run, by cargo-llvm-cov.
//!
//! A line counts as run when it runs in any test program. `llvm-cov` itself keeps a single record of each function over
//! all programs: where the first program does not use a function, the function counts as not run in any.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use start::{Package, is_installed, output};

use crate::apt;
use crate::command::{cargo, root, run, target_dir};
use crate::tools;

/// The measured crates, and below them the crates whose tests run as well.
const PURE: [&str; 5] = ["canopen-device", "profiles", "storage", "update", "node"];
const TESTS: [&str; 3] = ["host-tests", "fuzz", "nodectl"];

/// Excluded files: files outside of the five crates, mocks, and the tables of objects with the code that makes
/// dictionaries of them. The compiler evaluates these tables and counts no lines there; the results are compared with
/// `host-tests/tables`.
const IGNORED: &str = "(tests?|mock|host-tests|emulator|bsp|tools)(/|\\.rs)\
    |dictionary/(compile|filling|object)\\.rs\
    |canopen/src/(objects(\\.rs|/)|sdo/abort\\.rs)\
    |profiles/src/((table|fault)\\.rs|(communication|combined)/)\
    |profiles/src/[a-z]+/objects/(device_profile|application_profile|manufacturer)\\.rs\
    |profiles/src/pressure/objects/pdos\\.rs";

/// Debian's LLVM tools, in the version of this compiler.
const DEBIAN_LLVM: &str = "/usr/lib/llvm-22/bin";

/// How often each line runs, by file.
type Lines = BTreeMap<String, BTreeMap<u32, u64>>;

/// Prints a line for each file, and the total.
pub(crate) fn print() -> Result<()> {
    let llvm = llvm()?;
    let profile = run_tests(&llvm)?;
    let mut lines = Lines::new();
    for program in programs()? {
        add(&mut lines, &export(&llvm, &profile, &program)?);
    }
    ensure!(!lines.is_empty(), "no line was measured");
    println!("{:>7} {:>7} {:>7}  file", "lines", "not run", "run");
    for (file, counts) in &lines {
        println!("{}  {file}", row(counts.values()));
    }
    println!("{}  in all", row(lines.values().flat_map(BTreeMap::values)));
    Ok(())
}

/// The directory of the LLVM tools in the version of the compiler. Missing tools are installed.
fn llvm() -> Result<PathBuf> {
    if start::target::is_closed() {
        if !is_installed(Package::DebianLlvm) {
            apt::install(&[Package::DebianLlvm])?;
        }
        return Ok(DEBIAN_LLVM.into());
    }
    run(Command::new("rustup").args(["component", "add", "llvm-tools"]).current_dir(root()))
        .context("llvm-cov is missing; with rustup: rustup component add llvm-tools")?;
    let libraries =
        output("rustc", &["--print", "target-libdir"]).context("rustc does not name its libraries")?;
    Ok(Path::new(&libraries).with_file_name("bin"))
}

/// Runs the tests. Returns the file with the counts of all programs.
fn run_tests(llvm: &Path) -> Result<PathBuf> {
    let folder = folder();
    let mut command = cargo();
    command.args(["llvm-cov", "test", "--quiet", "--profile", "sim", "--lcov", "--output-path"]);
    command.arg(folder.with_extension("lcov"));
    for package in PURE.iter().chain(&TESTS) {
        command.args(["-p", package]);
    }
    command.env("PATH", tools::with("cargo-llvm-cov")?);
    command.env("LLVM_COV", llvm.join("llvm-cov")).env("LLVM_PROFDATA", llvm.join("llvm-profdata"));
    run(&mut command)?;
    let files = folder.read_dir()?.flatten().map(|entry| entry.path());
    let profile = files.into_iter().find(|path| path.extension().is_some_and(|kind| kind == "profdata"));
    profile.with_context(|| format!("no counts in {}", folder.display()))
}

/// Where cargo-llvm-cov builds.
fn folder() -> PathBuf {
    target_dir().join("llvm-cov-target")
}

/// The test programs that were built.
fn programs() -> Result<Vec<PathBuf>> {
    let files = folder().join("sim/deps").read_dir()?.flatten().map(|entry| entry.path());
    Ok(files.filter(|path| path.is_file() && path.extension().is_none_or(|kind| kind == "exe")).collect())
}

/// The counts of one program, in the format of lcov.
fn export(llvm: &Path, profile: &Path, program: &Path) -> Result<String> {
    let mut command = Command::new(llvm.join("llvm-cov"));
    command.args(["export", "--format=lcov", "--ignore-filename-regex", IGNORED]).arg("--instr-profile");
    let done = command.arg(profile).arg(program).output().context("llvm-cov does not run")?;
    ensure!(done.status.success(), "llvm-cov: {}", String::from_utf8_lossy(&done.stderr));
    Ok(String::from_utf8_lossy(&done.stdout).into_owned())
}

/// Adds the counts of a program. Only files of the measured crates count.
fn add(lines: &mut Lines, lcov: &str) {
    let mut file = None;
    for line in lcov.lines() {
        match line.split_once(':') {
            Some(("SF", path)) => file = measured(path),
            Some(("DA", counted)) => {
                let Some((file, (line, count))) = file.as_ref().zip(counted.split_once(',')) else {
                    continue;
                };
                let Some((line, count)) = line.parse().ok().zip(count.parse::<u64>().ok()) else { continue };
                let sum = lines.entry(file.clone()).or_default().entry(line).or_default();
                *sum = sum.saturating_add(count);
            }
            _ => {}
        }
    }
}

/// The path of a measured file below the folder of the crates.
fn measured(path: &str) -> Option<String> {
    let below = Path::new(path).strip_prefix(root().join("crates")).ok()?;
    Some(below.to_string_lossy().replace('\\', "/"))
}

/// The number of lines, of those that did not run, and the share of those that ran.
fn row<'a>(counts: impl Iterator<Item = &'a u64>) -> String {
    let counts: Vec<u64> = counts.copied().collect();
    let missed = counts.iter().filter(|count| **count == 0).count();
    let share = (counts.len() - missed) as f64 * 100.0 / counts.len() as f64;
    format!("{:>7} {missed:>7} {share:>6.1}%", counts.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_counts_as_run_when_any_program_has_run_it() {
        let file = root().join("crates/canopen/src/frame.rs");
        let mut lines = Lines::new();
        for counts in ["DA:1,0\nDA:2,3\nDA:3,0", "DA:1,5\nDA:2,0\nDA:3,0"] {
            add(
                &mut lines,
                &format!("SF:/elsewhere.rs\nDA:9,9\nSF:{}\n{counts}\nend_of_record\n", file.display()),
            );
        }
        assert_eq!(lines.keys().collect::<Vec<_>>(), ["canopen/src/frame.rs"]);
        let counts = &lines["canopen/src/frame.rs"];
        assert_eq!(counts, &BTreeMap::from([(1, 5), (2, 3), (3, 0)]));
        assert_eq!(row(counts.values()), "      3       1   66.7%");
    }
}
