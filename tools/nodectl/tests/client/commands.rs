//! Tests of the commands in this process: their output and their exit codes.

use node::Personality;
use nodectl::cli::{Cli, Failure, Output, Paper, Session};

use crate::loader::{Loader, identification};
use crate::pressure::Pressure;
use crate::wire::{Fate, Wire};

/// Runs a command. Returns its output and its result.
pub(crate) fn run<S: nodectl::bus::Station + 'static>(
    wire: &Wire<S>,
    line: &[&str],
) -> (String, Result<(), Failure>) {
    let cli = Cli::from_words(std::iter::once(&"nodectl").chain(line)).expect("a command line");
    let paper = Paper::default();
    let output = Output::new(paper.clone(), cli.options.json);
    let result = cli.run_in(&mut Session::with(wire.network(), &cli.options, output));
    (paper.take(), result)
}

pub(crate) fn printed<S: nodectl::bus::Station + 'static>(wire: &Wire<S>, line: &[&str]) -> String {
    let (printed, result) = run(wire, line);
    result.unwrap_or_else(|failure| panic!("{line:?}: {failure}"));
    printed
}

pub(crate) fn failed<S: nodectl::bus::Station + 'static>(wire: &Wire<S>, line: &[&str]) -> (u8, String) {
    let failure = run(wire, line).1.expect_err(&format!("{line:?} fails"));
    (failure.exit_code(), failure.to_string())
}

#[test]
fn read_by_index_and_by_name() {
    let wire = Wire::new(Pressure::new(1));
    let lines = printed(&wire, &["read", "1017", "1018:4", "Manufacturer device name", "vendor-id"]);
    assert_eq!(
        lines,
        "1017h:0 Producer heartbeat time = 1000 ms\n\
         1018h:4 Identity/Serial number = 305419896 (12345678h)\n\
         1008h:0 Manufacturer device name = STM32F4 pressure transmitter\n\
         1018h:1 Identity/Vendor-ID = 0 (00000000h)\n"
    );
    assert_eq!(
        printed(&wire, &["read", "--type", "os", "1017"]),
        "1017h:0 Producer heartbeat time = E8 03\n"
    );
    // The unit is the one that the node is set to.
    printed(&wire, &["write", "6131:1", "0xFD4E0000"]);
    let line = printed(&wire, &["read", "--block", "Pressure span end"]);
    assert_eq!(line, "6149h:1 AI span end/Pressure span end = 10 mbar\n");
}

/// The node is not to blame when the connection of this program has ended.
#[test]
fn a_lost_bus_is_not_a_silent_node() {
    let wire = Wire::new(Pressure::new(1));
    wire.disturb(|frame| if frame.id() == 0x601 { Fate::BreaksTheBus } else { Fate::Arrives });
    let (code, text) = failed(&wire, &["read", "1017"]);
    assert_eq!(code, 4, "{text}");
    assert!(text.contains("the connection to socketcand://127.0.0.1:29536/vcan0 has ended"), "{text}");
    assert!(!text.contains("silent"), "{text}");
}

#[test]
fn a_silent_node_is_reported_by_each_command_of_its_program() {
    let wire = Wire::new(vec![Loader::new(1, b"1.0.0\n")]);
    for line in
        [&["confirm", "-n", "9"][..], &["rollback", "-n", "9"], &["update", "--raw", "Cargo.toml", "-n", "9"]]
    {
        let (code, text) = failed(&wire, line);
        assert_eq!((code, text.contains("node 9 is silent: is it on")), (3, true), "{text}");
    }
}

#[test]
fn read_for_scripts() {
    let wire = Wire::new(Pressure::new(1));
    let line = printed(&wire, &["--json", "read", "1017"]);
    let value: serde_json::Value = serde_json::from_str(&line).unwrap();
    let expected = serde_json::json!({
        "node": 1, "object": "1017h:0", "name": "Producer heartbeat time", "type": "UNSIGNED16", "value": 1000,
        "unit": "ms"
    });
    assert_eq!(value, expected);
}

#[test]
fn write_is_checked_here_and_there() {
    let wire = Wire::new(Pressure::new(1));
    assert_eq!(printed(&wire, &["write", "1017", "0x1F4"]), "1017h:0 Producer heartbeat time = 500 ms\n");
    assert_eq!(
        printed(&wire, &["write", "Pressure offset", "-1.5"]),
        "6124h:1 AI input offset/Pressure offset = -1.5 bar\n"
    );
    let wrong = failed(&wire, &["write", "1017", "70000"]);
    assert_eq!(wrong, (2, "1017h:0: \"70000\" is not a whole number from 0 to 65535".to_owned()));
    let wrong = failed(&wire, &["write", "2999", "1"]);
    assert_eq!(wrong, (2, "no data sheet states the type of 2999h:0: give it with --type".to_owned()));
    let refused = failed(&wire, &["write", "1019", "250"]);
    assert_eq!(
        refused,
        (
            1,
            "node 1, 1019h:0 \"Synchronous counter overflow value\": 0609 0031h, value too high; it takes 0 to 240"
                .to_owned()
        )
    );
}

#[test]
fn failures_and_their_exit_codes() {
    let wire = Wire::new(Pressure::new(1));
    let (code, text) = failed(&wire, &["read", "1000", "-n", "9"]);
    assert_eq!((code, text.starts_with("node 9, 1018h:1: no answer; ")), (3, true), "{text}");
    assert_eq!(failed(&wire, &["list", "-n", "1-3"]), (2, "this command is for one node".to_owned()));
    assert_eq!(failed(&wire, &["read", "no such thing"]).0, 2);
    let (code, text) = failed(&wire, &["read", "1000", "--eds", "/nowhere.eds"]);
    assert_eq!((code, text.starts_with("/nowhere.eds: ")), (7, true), "{text}");
    assert_eq!(
        failed(&wire, &["lss", "inquire", "--select", "1:2:3:4"]),
        (3, "LSS select: no answer".to_owned())
    );
    assert_eq!(failed(&wire, &["lss", "set-id", "200"]).0, 2);
}

#[test]
fn scan_finds_answering_nodes() {
    let wire = Wire::new(vec![Pressure::new(1), Pressure::new(77)]);
    let lines = printed(&wire, &["scan"]);
    let rows: Vec<&str> = lines.lines().collect();
    assert_eq!(rows.len(), 3, "{lines}");
    assert!(
        rows[1].starts_with("   1  pre-operational  00020194h    00000000h  00000001h  STM32F4"),
        "{lines}"
    );
    assert!(rows[2].starts_with("  77  "), "{lines}");
}

#[test]
fn info_shows_the_identity_of_a_node() {
    let wire = Wire::new(Pressure::new(1));
    let value: serde_json::Value = serde_json::from_str(&printed(&wire, &["info", "--json"])).unwrap();
    assert_eq!(value["software_version"], "1.2.3");
    assert_eq!(value["state"], "pre-operational");
    assert_eq!(value["serial"], 0x1234_5678);
    assert_eq!(value["program"]["identification"], 0x0BAD_CAFE);
    assert!(printed(&wire, &["info"]).contains("program           running, identification 0BADCAFEh"));
}

#[test]
fn nmt_waits_for_the_requested_state() {
    let wire = Wire::new(Pressure::new(1));
    assert_eq!(printed(&wire, &["nmt", "start"]), "node 1: operational\n");
    assert_eq!(printed(&wire, &["nmt", "stop"]), "node 1: stopped\n");
    assert_eq!(printed(&wire, &["nmt", "reset"]), "node 1: booted\n");
    assert_eq!(printed(&wire, &["nmt", "preop", "-n", "all"]), "");
    assert_eq!(failed(&wire, &["nmt", "reset", "-n", "2"]), (3, "node 2: no boot-up message".to_owned()));
}

#[test]
fn saved_parameters_survive_a_reset_and_restored_ones_come_back() {
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["write", "1017", "321"]);
    assert_eq!(printed(&wire, &["save"]), "node 1: all parameters saved\n");
    printed(&wire, &["nmt", "reset"]);
    assert!(printed(&wire, &["read", "1017"]).ends_with("= 321 ms\n"));
    printed(&wire, &["restore", "communication"]);
    printed(&wire, &["nmt", "reset"]);
    assert!(printed(&wire, &["read", "1017"]).ends_with("= 1000 ms\n"));
}

#[test]
fn lss_gives_a_node_id() {
    let wire = Wire::new(vec![Pressure::new(None).with_serial(5)]);
    let lines = printed(&wire, &["lss", "scan", "--step", "5", "--assign", "40"]);
    let identity = "vendor 00000000h, product 00000001h, revision 00010000h, serial number 00000005h";
    assert_eq!(lines, format!("{identity}, node-ID 40\n"));
    let line = ["lss", "inquire", "--select", "0:1:0x10000:5"];
    assert_eq!(printed(&wire, &line), format!("{identity}, node-ID 40\n"));
    assert_eq!(printed(&wire, &["lss", "set-id", "41", "--store"]), "node-ID 41, stored\n");
    assert!(printed(&wire, &["read", "1018:4", "-n", "40"]).contains("00000005h"));
}

#[test]
fn monitor_takes_pdos_and_reads_the_rest() {
    let wire = Wire::new(Pressure::new(1));
    let lines = printed(
        &wire,
        &["monitor", "--start", "--count", "4", "6130:2", "1001", "--period", "300", "--json"],
    );
    let objects: Vec<String> = lines
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["object"].to_string())
        .collect();
    assert!(
        objects.contains(&"\"6130h:2\"".to_owned()) && objects.contains(&"\"1001h:0\"".to_owned()),
        "{lines}"
    );
}

#[test]
fn monitor_prints_the_meaning_of_a_status() {
    let wire = Wire::new(Pressure::new(1));
    let line = printed(&wire, &["monitor", "--count", "1", "6150:1"]);
    assert!(line.contains("6150h:1") && line.trim_end().ends_with(" [valid]"), "{line}");
    let line = printed(&wire, &["--json", "monitor", "--count", "1", "6150:1"]);
    assert!(line.contains("\"meaning\":\"valid\""), "{line}");
}

/// A new lift unit has no virtual device and sends nothing. This command gives it all virtual devices. No measurement
/// is made in the test, so the unit knows of no button.
const ALL_DEVICES: &[&str] = &["write", "--node", "16", "2305", "15"];

#[test]
fn monitor_knows_the_pdos_of_a_lift_without_asking_anybody() {
    let wire = Wire::new(Pressure::of(Personality::Lift, 16));
    printed(&wire, ALL_DEVICES);
    printed(&wire, &["nmt", "start", "--node", "16", "--no-wait"]);
    let lines = printed(&wire, &["monitor", "--lift", "--count", "4"]);
    for expected in [
        "188h load measuring unit: load signals = 0",
        "188h load measuring unit: load = 0",
        "18Ch car position 1: position 1 = 0",
        "510h multiplexed PDO of node 16: Position unit states/Position unit 1 state = 8",
    ] {
        assert!(lines.contains(expected), "{expected}: {lines}");
    }
    // Some values are sent at a start only, until they change. So the second part needs another node.
    let wire = Wire::new(Pressure::of(Personality::Lift, 16));
    printed(&wire, ALL_DEVICES);
    printed(&wire, &["nmt", "start", "--node", "16", "--no-wait"]);
    let line = printed(&wire, &["--json", "monitor", "--lift", "--count", "1"]);
    let value: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!((value["can_id"].as_u64(), value["producer"].as_u64()), (Some(0x188), None), "{line}");
    assert!(run(&wire, &["monitor", "--lift", "--count", "0"]).1.is_ok());
}

/// The data sheet tells where TPDO 258 and 263 are.
#[test]
fn monitor_finds_the_tpdos_of_a_lift_node() {
    let wire = Wire::new(Pressure::of(Personality::Lift, 16));
    printed(&wire, ALL_DEVICES);
    let lines = printed(&wire, &["monitor", "--node", "16", "--start", "--count", "3"]);
    for expected in ["6482h:1", "6480h:1", "6383h:1"] {
        assert!(lines.contains(expected), "{expected}: {lines}");
    }
}

#[test]
fn a_recording_is_a_table_and_a_plot() {
    let wire = Wire::new(Pressure::new(1));
    let file = |name: &str| format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"));
    let (csv, svg) = (file("record.csv"), file("record.svg"));
    printed(&wire, &["record", "--start", "--for", "3.5", "--csv", &csv, "--svg", &svg]);
    let table = std::fs::read_to_string(csv).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    let titles = "time s,6130h:1 Pressure process value [bar],6130h:2 Temperature process value [\u{b0}C]";
    assert_eq!(rows[0], titles);
    // One TPDO at the start and one each second.
    assert_eq!(rows.len(), 5, "{table}");
    assert!(rows[1].starts_with("0.000000,") && rows[4].starts_with("3.00"), "{table}");
    let plot = std::fs::read_to_string(svg).unwrap();
    assert!(plot.starts_with("<svg") && plot.contains("bar") && plot.matches("<polyline").count() >= 2);
}

/// Without the feature, the command says how to get it, and makes no file.
#[cfg(not(feature = "arrow"))]
#[test]
fn a_recording_as_a_stream_of_arrow_names_the_feature_that_is_missing() {
    let file = format!("{}/without.arrows", env!("CARGO_TARGET_TMPDIR"));
    let (code, text) =
        failed(&Wire::new(Pressure::new(1)), &["record", "--for", "1", "--arrow", &file, "6130:1"]);
    assert_eq!((code, text.contains("--features arrow")), (2, true), "{text}");
    assert!(!std::path::Path::new(&file).exists());
}

#[test]
fn update_reports_the_old_and_the_new_program() {
    let wire = Wire::new(vec![Loader::new(3, b"1.0.0\n"), Loader::new(4, b"1.0.0\n")]);
    let path = format!("{}/program.bin", env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(&path, b"1.1.0\nnew").unwrap();
    let (old, new) = (identification(b"1.0.0\n"), identification(b"1.1.0\nnew"));
    let expected = |node| format!("node {node}: 1.0.0 ({old:08X}h) -> 1.1.0 ({new:08X}h)\n");
    assert_eq!(printed(&wire, &["update", "--raw", &path, "-n", "3,4"]), expected(3) + &expected(4));
    // Without --raw the file must be an image of this project.
    let (code, text) = failed(&wire, &["update", &path, "-n", "3"]);
    assert_eq!((code, text.contains("it has 9 bytes")), (7, true), "{text}");
    wire.station(|loaders| loaders[1].flash().verdict = 0x000E);
    let (lines, result) = run(&wire, &["update", "--raw", &path, "-n", "3,4"]);
    let failure = result.unwrap_err();
    assert_eq!((failure.exit_code(), failure.to_string()), (5, "1 of 2 nodes were not updated".to_owned()));
    assert!(
        lines.contains("node 4, 1F57h:1 \"Flash status identification\": the flash is secured"),
        "{lines}"
    );
}

#[test]
fn of_a_value_that_stays_there_is_one_line() {
    let wire = Wire::new(Pressure::new(1));
    let line = ["watch", "1017", "1001", "--period", "10", "--changes", "--count", "2"];
    let lines = printed(&wire, &line);
    let told: Vec<&str> = lines.lines().filter_map(|line| line.split_whitespace().nth(1)).collect();
    assert_eq!(told, ["1017h:0", "1001h:0"], "{lines}");
}
