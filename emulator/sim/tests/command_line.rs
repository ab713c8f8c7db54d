//! Errors of the user are reported in one line on the standard error output, with exit status 2.

use std::net::TcpListener;
use std::process::{Command, Stdio};

/// Runs the simulator with invalid flags and returns the line on the standard error output.
fn refused(flags: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_sim")).args(flags).stdin(Stdio::null()).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{flags:?}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{flags:?}: {stderr}");
    assert!(output.stdout.is_empty());
    stderr
}

#[test]
fn flags_that_make_no_sense() {
    for flags in [["--node", "200:pressure"], ["--for", "-1"], ["--fault", "plague@1"], ["--wings", "2"]] {
        let line = refused(&[&["--firmware", "x"], &flags[..]].concat());
        assert!(line.starts_with("error: ") && line.contains(flags[0]), "{line}");
    }
    assert!(refused(&[]).contains("--firmware"));
}

#[test]
fn files_that_are_no_images() {
    let free = ["--socketcand", "127.0.0.1:0", "--firmware"];
    assert!(refused(&[&free[..], &["/nowhere/firmware"]].concat()).contains("/nowhere/firmware"));
    let own = env!("CARGO_BIN_EXE_sim");
    assert!(refused(&[&free[..], &[own]].concat()).contains("is not an image for the board"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    assert!(refused(&[&free[..], &[script]].concat()).contains("is not an ELF file"));
}

#[test]
fn a_port_in_use() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let line = refused(&["--firmware", "x", "--socketcand", &address]);
    assert!(line.contains(&format!("cannot listen on {address}")), "{line}");
}

#[test]
fn with_json_an_error_is_json_too() {
    for flags in [
        &["--json", "--wings"][..],
        &["--json", "--firmware", "/nowhere/firmware", "--socketcand", "127.0.0.1:0"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_sim")).args(flags).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let error: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(error["exit_code"], 2);
        assert!(!error["error"].as_str().unwrap().is_empty() && output.stderr.is_empty());
    }
}

#[test]
fn help_is_no_error() {
    let output = Command::new(env!("CARGO_BIN_EXE_sim")).arg("--help").output().unwrap();
    assert!(output.status.success());
    assert!(String::from_utf8(output.stdout).unwrap().contains("cargo sim [OPTIONS]"));
}
