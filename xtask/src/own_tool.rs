//! Tools of the project, run by cargo or as the test command has built them.

use std::ffi::OsString;
use std::process::Command;

use anyhow::{Context, Result};

use crate::command::{self, built, root};
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
        if self == Tools::Built {
            let mut tool = Command::new(built(name));
            tool.current_dir(root());
            return Ok(tool);
        }
        let mut command = emulator::cargo_with_emulator()?;
        command.args(["run", "--quiet", "--profile", "sim", "-p", package(name), "--bin", name, "--"]);
        Ok(command)
    }
}

/// Runs a tool with flags of its own in the directory of the caller, so that relative paths keep their meaning.
pub(crate) fn run(tool: &str, arguments: &[OsString]) -> Result<()> {
    let here = std::env::current_dir().context("there is no current directory")?;
    let manifest = root().join("Cargo.toml");
    let mut command = command::cargo();
    command
        .args(["run", "--quiet", "--profile", "sim", "-p", package(tool), "--bin", tool, "--manifest-path"])
        .arg(manifest)
        .arg("--")
        .args(arguments);
    command::run(command.current_dir(here))
}

/// The package that has the program.
pub(crate) fn package(program: &str) -> &str {
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
    fn each_program_is_in_its_package() {
        let list = command::cargo()
            .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
            .current_dir(root())
            .output()
            .unwrap();
        let list: serde_json::Value = serde_json::from_slice(&list.stdout).unwrap();
        let targets = |package: &serde_json::Value| package["targets"].as_array().unwrap().clone();
        for program in
            ["flash", "protect", "sign", "bench", "bringup", "bringup-emulated", "glitch", "callgraph"]
        {
            let packages = list["packages"].as_array().unwrap();
            let own = packages.iter().find(|found| found["name"] == package(program));
            let has = own.is_some_and(|own| targets(own).iter().any(|target| target["name"] == program));
            assert!(has, "{program} in {}", package(program));
        }
    }
}
