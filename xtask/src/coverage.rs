//! `cargo xtask coverage`: the lines of the pure crates that the tests run, by cargo-llvm-cov.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use start::{Package, is_installed};

use crate::apt;
use crate::command::{cargo, root, run};
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

/// Prints a line for each file, and the total.
pub(crate) fn print() -> Result<()> {
    let mut command = cargo();
    command.args(["llvm-cov", "test", "--quiet", "--profile", "sim", "--summary-only"]);
    for package in PURE.iter().chain(&TESTS) {
        command.args(["-p", package]);
    }
    command.args(["--ignore-filename-regex", IGNORED]).env("PATH", tools::with("cargo-llvm-cov")?);
    if start::target::is_closed() {
        if !is_installed(Package::DebianLlvm) {
            apt::install(&[Package::DebianLlvm])?;
        }
        let tool = |name: &str| Path::new(DEBIAN_LLVM).join(name);
        command.env("LLVM_COV", tool("llvm-cov")).env("LLVM_PROFDATA", tool("llvm-profdata"));
    } else {
        run(Command::new("rustup").args(["component", "add", "llvm-tools"]).current_dir(root()))
            .context("llvm-cov is missing; with rustup: rustup component add llvm-tools")?;
    }
    run(&mut command)
}
