//! Tests of the first step on faked machines. The programs of a machine are scripts on a search path of its own.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A machine with these programs. Each program notes the arguments of its calls.
fn machine(name: &str, programs: &[(&str, &str)]) -> PathBuf {
    let root = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    // Remove the files of an earlier run.
    let _ = fs::remove_dir_all(&root);
    fs::create_dir_all(root.join("bin")).unwrap();
    for (program, does) in programs {
        let path = root.join("bin").join(program);
        let calls = root.join("calls").display().to_string();
        fs::write(&path, format!("#!/bin/sh\necho \"{program} $*\" >> {calls}\n{does}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    root
}

fn start(machine: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_start"));
    command.args(arguments).env_clear().env("PATH", machine.join("bin"));
    command.output().unwrap()
}

fn was_called(machine: &Path, program: &str) -> Vec<String> {
    let calls = fs::read_to_string(machine.join("calls")).unwrap_or_default();
    calls.lines().filter(|call| call.split(' ').next() == Some(program)).map(str::to_owned).collect()
}

#[test]
fn missing_packages_are_named_before_cargo_compiles() {
    let programs = [("apt-get", "exit 0"), ("id", "echo 1000"), ("cargo", "exit 0"), ("rustup", "exit 0")];
    let machine = machine("bare", &programs);
    for (arguments, packages) in [
        (&["sim", "--for", "5"][..], "sudo apt-get install -y build-essential python3-venv\n"),
        (&["test"], "sudo apt-get install -y build-essential python3-venv tshark chromium chromium-driver\n"),
    ] {
        let output = start(&machine, arguments);
        let says = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{says}");
        assert!(says.contains(packages), "{says}");
    }
    assert_eq!(was_called(&machine, "cargo"), [""; 0]);
}

#[test]
fn without_missing_packages_xtask_runs_with_the_arguments() {
    let all = ["cc", "make", "cmake", "rustup"].map(|program| (program, "exit 0"));
    let root = [("apt-get", "exit 0"), ("id", "echo 0"), ("rustup", "exit 0")];
    for (name, programs) in [("complete", &all[..]), ("root", &root)] {
        let programs: Vec<_> = programs.iter().copied().chain([("cargo", "exit 7")]).collect();
        let machine = machine(name, &programs);
        let output = start(&machine, &["sim", "--for", "5"]);
        assert_eq!(output.status.code(), Some(7), "the status is that of xtask");
        let calls = was_called(&machine, "cargo");
        assert_eq!(calls.len(), 1, "{calls:?}");
        assert!(calls[0].contains("--package xtask") && calls[0].ends_with("-- sim --for 5"), "{calls:?}");
    }
}

#[test]
fn help_needs_nothing() {
    let machine = machine("help", &[("cargo", "exit 0"), ("id", "echo 1000")]);
    assert_eq!(start(&machine, &["sim", "--help"]).status.code(), Some(0));
    assert_eq!(was_called(&machine, "cargo").len(), 1);
}
