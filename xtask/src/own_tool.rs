//! Tools of the project, run by cargo or as the test command has built them.

use std::ffi::OsString;
use std::process::{Command, ExitCode};

use anyhow::Result;

use crate::command::{self, become_program, built, root};
use crate::progress;
use crate::setup::emulator;

/// The way to run a tool of the project.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tools {
    /// Cargo builds the tool first.
    ByCargo,
    /// The test command has built all tools. Cargo would compile some crates again, with the features that one tool
    /// alone needs.
    Built,
}

impl Tools {
    /// The call of a tool, without its arguments.
    pub(crate) fn get(self, name: &str) -> Result<Command> {
        let mut tool = if self == Tools::Built { Command::new(built(name)) } else { build(name)? };
        tool.current_dir(root());
        Ok(tool)
    }
}

/// The packages of `cargo sim`.
const OF_SIM: [&str; 3] = ["sim", "programmer", "nodectl"];

/// Builds the simulator, the tools that sign images, and the program that serves the page. With one call cargo compiles
/// their crates with one set of features.
pub(crate) fn build_simulator(what: &str) -> Result<()> {
    let mut cargo = emulator::cargo_with_emulator()?;
    cargo.args(["build", "--profile", "sim"]).args(OF_SIM.iter().flat_map(|package| ["-p", package]));
    progress::build(what, &mut cargo)
}

/// Whether cargo builds a program together with the simulator. Alone, cargo would compile some crates again, with the
/// features that one package needs; without a simulator, the program needs no emulator.
fn is_built_with_simulator(program: &str, there_is_one: bool) -> bool {
    there_is_one && OF_SIM.contains(&package(program))
}

/// Builds a program. Returns its call in the directory of the caller.
pub(crate) fn build(program: &str) -> Result<Command> {
    let own = package(program);
    if is_built_with_simulator(program, built("sim").exists()) {
        build_simulator("tools")?;
    } else {
        let mut cargo = if own == "workbench" { emulator::cargo_with_emulator()? } else { command::cargo() };
        cargo.args(["build", "--profile", "sim", "-p", own, "--bin", program]);
        progress::build("tools", &mut cargo)?;
    }
    Ok(Command::new(built(program)))
}

/// Builds a program, then becomes it.
pub(crate) fn run(program: &str, arguments: &[OsString]) -> Result<ExitCode> {
    become_program(build(program)?.args(arguments))
}

/// The package that has the program.
fn package(program: &str) -> &str {
    match program {
        "flash" | "protect" | "sign" => "programmer",
        "bench" | "bringup-emulated" | "glitch" => "workbench",
        same => same,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_of_the_simulator_are_built_with_it() {
        let is_with = |program| is_built_with_simulator(program, true);
        assert!(["nodectl", "sign", "flash", "protect"].into_iter().all(is_with));
        assert!(!["bench", "glitch", "callgraph", "bringup"].into_iter().any(is_with));
        assert!(!is_built_with_simulator("nodectl", false));
    }

    #[test]
    fn each_program_is_in_its_package() {
        let list = command::cargo()
            .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
            .current_dir(root())
            .output()
            .unwrap();
        let list: serde_json::Value = serde_json::from_slice(&list.stdout).unwrap();
        let targets = |package: &serde_json::Value| package["targets"].as_array().unwrap().clone();
        for program in [
            "flash",
            "protect",
            "sign",
            "nodectl",
            "bench",
            "bringup",
            "bringup-emulated",
            "glitch",
            "callgraph",
        ] {
            let packages = list["packages"].as_array().unwrap();
            let own = packages.iter().find(|found| found["name"] == package(program));
            let has = own.is_some_and(|own| targets(own).iter().any(|target| target["name"] == program));
            assert!(has, "{program} in {}", package(program));
        }
    }
}
