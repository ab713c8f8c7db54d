//! `nodectl check` on the emulated boards: the firmware in every personality, and the bootloader.

use std::cell::RefCell;
use std::rc::Rc;

use clap::Parser;
use host_tests::thorough::is_thorough;
use nodectl::cli::{Cli, Failure};
use serde_json::Value;

use crate::adapter::{Shared, run};
use crate::support::{SECOND, world};
use crate::update::HEADER;

/// Limit of the virtual time for a device.
const LIMIT: f64 = 180.0;

/// Runs a command; returns its JSON output and its result.
fn json(world: &Shared, line: &[&str]) -> (String, Result<(), Failure>) {
    let line = ["nodectl", "--bus", "socketcan:emulated", "--json"].iter().chain(line);
    run(world, &Cli::try_parse_from(line).unwrap(), |_| ())
}

fn command(world: &Shared, line: &[&str]) -> String {
    let (printed, result) = json(world, line);
    result.unwrap_or_else(|failure| panic!("{failure}: {printed}"));
    printed
}

/// Checks the node, and returns the report.
fn check(world: &Shared, more: &[&str]) -> Value {
    let start = world.borrow().now();
    let (printed, result) = json(world, &[&["check", "--yes"], more].concat());
    let report: Value = serde_json::from_str(printed.lines().last().unwrap_or_default())
        .unwrap_or_else(|error| panic!("{error}: {printed} {result:?}"));
    let took = (world.borrow().now() - start).as_secs_f64();
    let told: Vec<String> = report["checks"].as_array().unwrap().iter().filter_map(told).collect();
    println!("{took:.1} s: {} passed, {} skipped\n{}", report["passed"], report["skipped"], told.join("\n"));
    assert_eq!(
        (&report["failed"], &report["left_behind"]),
        (&0.into(), &Value::Array(vec![])),
        "{}",
        told.join("\n")
    );
    assert!(result.is_ok(), "{result:?}");
    assert!(took < LIMIT, "{took} s");
    report
}

/// A check that did not pass, as text.
fn told(check: &Value) -> Option<String> {
    let text = |key: &str| check[key].as_str().unwrap_or_default().to_owned();
    match check["verdict"].as_str()? {
        "passed" => None,
        "skipped" => Some(format!("{} skipped: {}", text("id"), text("reason"))),
        word => Some(format!("{} {word}: expected {}, seen {}", text("id"), text("expected"), text("seen"))),
    }
}

fn board(personality: &str) -> Shared {
    let world = Rc::new(RefCell::new(world(&format!("--bitrate 1000 --node 1:{personality}"))));
    world.borrow_mut().run_until(SECOND);
    world
}

#[test]
fn a_pressure_transmitter_conforms() {
    let report = check(&board("pressure"), &["--profile", "404"]);
    assert!(report["passed"].as_u64() > Some(280), "{}", report["passed"]);
}

#[test]
fn the_bootloader_conforms() {
    let world = board("pressure");
    command(&world, &["write", "1F51:1", "0"]);
    // With a valid program, the bootloader would start it after each restart.
    world.borrow_mut().machine(0).write(HEADER, &[0; 1024]).unwrap();
    let report = check(&world, &[]);
    assert!(report["passed"].as_u64() > Some(100), "{}", report["passed"]);
    let bytes = command(&world, &["read", "--type", "u32", "1000"]);
    assert!(bytes.contains(&u32::from_be_bytes(*b"BOOT").to_string()), "{bytes}");
}

/// The firmware in every personality on the board. The same checks run on the node in process in every test run.
#[test]
fn every_personality_conforms() {
    if is_thorough() {
        check(&board("encoder"), &["--profile", "406"]);
        check(&board("combined"), &["--profile", "406"]);
        let lift = board("lift");
        command(&lift, &["write", "2305", "15"]);
        command(&lift, &["save"]);
        check(&lift, &["--profile", "417"]);
    }
}
