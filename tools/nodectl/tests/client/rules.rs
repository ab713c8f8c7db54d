//! Tests of `nodectl rules`.

use std::fs;
use std::path::PathBuf;

use monitor::Rule;

use crate::commands::{failed, printed, run};
use crate::pressure::Pressure;
use crate::wire::Wire;

/// A file with these lines of candump, for one test.
fn log(name: &str, lines: &[&str]) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("rules-{name}.log"));
    fs::write(&path, lines.join("\n")).expect("a file");
    path
}

const START: [&str; 3] = ["(100.000000) can0 705#00", "(100.010000) can0 705#7F", "(101.010000) can0 705#7F"];

fn judged(name: &str, lines: &[&str], options: &[&str]) -> (String, Option<u8>) {
    let path = log(name, &[&START, lines].concat());
    let wire = Wire::new(Pressure::new(1));
    let line = [&["rules", "--file", path.to_str().expect("a name")], options].concat();
    let (text, result) = run(&wire, &line);
    (text, result.err().map(|failure| failure.exit_code()))
}

#[test]
fn a_log_that_keeps_the_rules_has_no_line() {
    assert_eq!(judged("clean", &["(101.500000) can0 605#4017100000000000"], &[]), (String::new(), None));
}

#[test]
fn a_breach_is_printed_with_its_frames_and_the_exit_code_is_10() {
    let (text, code) = judged("stop", &["(102.010000) can0 705#04"], &[]);
    assert!(text.starts_with("102.010000 node 5: nmt-state: Pre-operational becomes Stopped"), "{text}");
    assert!(text.trim_end().ends_with("102.010000 705h 04"), "{text}");
    assert_eq!(code, Some(10));
}

#[test]
fn a_breach_in_json_is_an_object() {
    let (text, code) = judged("json", &["(102.010000) can0 705#04"], &["--json"]);
    let value: serde_json::Value = serde_json::from_str(text.trim()).expect("JSON");
    assert_eq!((value["rule"].as_str(), value["node"].as_u64()), (Some("nmt-state"), Some(5)));
    assert_eq!(value["frames"][0]["data"], "00");
    assert_eq!(code, Some(10));
}

#[test]
fn a_rule_is_left_out_by_name_and_a_node_by_its_number() {
    let stop = ["(102.010000) can0 705#04"];
    assert_eq!(judged("without", &stop, &["--without", "nmt-state"]), (String::new(), None));
    assert_eq!(judged("of", &stop, &["--of", "1,2"]), (String::new(), None));
}

#[test]
fn the_heartbeat_time_is_that_of_the_device() {
    let late = ["(104.000000) can0 705#7F"];
    assert_eq!(judged("unknown", &late, &[]).1, None);
    let options = ["--device", "5=pressure", "--factory"];
    assert!(judged("late", &late, &options).0.contains("heartbeat-late"));
    let sheet = format!("5={}/../../eds/pressure.eds", env!("CARGO_MANIFEST_DIR"));
    assert!(judged("sheet", &late, &["--device", &sheet, "--factory"]).0.contains("heartbeat-late"));
}

#[test]
fn wrong_options_are_refused() {
    let wire = Wire::new(Pressure::new(1));
    assert_eq!(failed(&wire, &["rules", "--file", "/no/such/file"]).0, 7);
    assert_eq!(failed(&wire, &["rules", "--file", "-", "--device", "5=/no/such/sheet"]).0, 7);
    let path = log("garbage", &["nothing"]);
    let (code, text) = failed(&wire, &["rules", "--file", path.to_str().expect("a name")]);
    assert!(code == 7 && text.contains("line 1"), "{text}");
}

#[test]
fn all_rules_are_listed() {
    let text = printed(&Wire::new(Pressure::new(1)), &["rules", "--list"]);
    assert_eq!(text.lines().count(), Rule::ALL.len());
    assert!(text.contains("heartbeat-late    CiA 301, 1017h"), "{text}");
}

#[test]
fn a_live_bus_is_judged_and_nothing_is_sent() {
    let wire = Wire::new(Pressure::new(1));
    assert_eq!(printed(&wire, &["rules", "--for", "3", "--device", "1=pressure", "--factory"]), "");
}
