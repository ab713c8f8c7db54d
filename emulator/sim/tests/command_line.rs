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

/// The images of the boards; `None` where they are not built.
fn images() -> Option<[String; 2]> {
    let folder = std::env::var("NODE_IMAGES").ok()?;
    let paths = ["bootloader", "firmware"].map(|name| format!("{folder}/{name}"));
    paths.iter().all(|path| std::path::Path::new(path).exists()).then_some(paths)
}

/// A simulator of two seconds with these flags and this standard output.
fn run(flags: &[&str], stdout: Stdio) -> Option<std::process::Child> {
    let [bootloader, firmware] = images()?;
    let always =
        ["--bootloader", &bootloader, "--firmware", &firmware, "--socketcand", "127.0.0.1:0", "--no-page"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_sim"));
    command.args(always).args(["--for", "2", "--speed", "max"]).args(flags);
    Some(command.stdin(Stdio::null()).stdout(stdout).stderr(Stdio::piped()).spawn().unwrap())
}

/// The exit code and the standard error of a simulator with these flags and this standard output.
fn ended(flags: &[&str], stdout: Stdio) -> Option<(Option<i32>, String)> {
    let output = run(flags, stdout)?.wait_with_output().unwrap();
    Some((output.status.code(), String::from_utf8(output.stderr).unwrap()))
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error_and_no_panic() {
    for flags in [&["--json"][..], &[]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let Some((code, stderr)) = ended(flags, full.into()) else { return };
        assert_eq!(code, Some(2), "{flags:?}: {stderr}");
        assert!(!stderr.contains("panicked"), "{flags:?}: {stderr}");
    }
}

#[test]
fn a_closed_standard_output_ends_the_run_without_a_word() {
    for flags in [&["--json"][..], &["--node", "201:pressure@auto"], &[]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let Some((code, stderr)) = ended(flags, writer.into()) else { return };
        assert_eq!(code, Some(0), "{flags:?}: {stderr}");
        assert!(!stderr.contains("rror"), "{flags:?}: {stderr}");
    }
}

/// No node has ID 201: CiA 301 has 1 to 127.
#[test]
fn the_example_uses_a_node_id_only_where_there_is_one() {
    for (nodes, expected, other) in [
        (&["--node", "201:pressure"][..], "network.lss.fast_scan()", "add_node"),
        (&["--node", "201:pressure", "--node", "9:encoder"], "network.add_node(9, ", "fast_scan"),
        (&[], "network.add_node(1, ", "fast_scan"),
    ] {
        let Some(child) = run(nodes, Stdio::piped()) else { return };
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains(expected) && !text.contains(other), "{nodes:?}: {text}");
    }
}
