//! Simulated devices out of data sheets: SDO, PDO, EMCY, storing, LSS, and `nodectl check`.

use std::path::PathBuf;

use canopen::NodeId;
use eds::Eds;
use nodectl::Catalogue;
use nodectl::bus::Station;
use nodectl::object::at;
use nodectl::simulate::{Node, Script, Table};

use crate::commands::{failed, printed, run};
use crate::wire::{Wire, client};

pub(crate) fn corpus(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../eds/tests/corpus").join(name)
}

pub(crate) fn sheet(name: &str) -> Eds {
    Eds::from_bytes(&std::fs::read(corpus(name)).expect("a file")).expect("a data sheet")
}

/// A simulated device of a data sheet of the corpus.
pub(crate) fn device(name: &str, node: u8) -> Node {
    let node = NodeId::new(node);
    Node::new(Table::new(&sheet(name), node).expect("a table"), node)
}

fn with_script(name: &str, node: u8, script: &str) -> Node {
    let script = Script::parse(script, &Catalogue::new(sheet(name))).expect("a script");
    device(name, node).with_script(script)
}

/// `--eds` and the file.
fn eds(name: &str) -> [String; 2] {
    ["--eds".to_owned(), corpus(name).to_string_lossy().into_owned()]
}

fn with_eds<S: Station + 'static>(wire: &Wire<S>, name: &str, line: &[&str]) -> String {
    let eds = eds(name);
    let line: Vec<&str> = line.iter().copied().chain(eds.iter().map(String::as_str)).collect();
    printed(wire, &line)
}

#[test]
fn every_data_sheet_of_the_corpus_makes_a_device_with_its_answers() {
    let folder = std::fs::read_dir(corpus("")).expect("the corpus");
    let mut count = 0;
    for path in folder.map(|entry| entry.expect("an entry").path()) {
        if path.extension().is_none_or(|ending| ending == "txt") {
            continue;
        }
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let sheet = sheet(&name);
        let wire = Wire::new(device(&name, 5));
        let mut network = wire.network();
        let mut node = client(&mut network, 5);
        for entry in sheet.entries().filter(|entry| entry.access.is_readable() && entry.index < 0x1003) {
            let wanted = entry.default.as_ref().map(|value| value.evaluate(NodeId::new(5).unwrap()));
            let bytes =
                node.upload(at(entry.index, entry.sub)).unwrap_or_else(|error| panic!("{name}: {error}"));
            let is = nodectl::value::Value::decode(&bytes, entry.data_type);
            if let (Some(eds::Value::Integer(wanted)), nodectl::value::Value::Integer(is)) = (wanted, is) {
                assert_eq!(is, wanted, "{name}: {:04X}h:{}", entry.index, entry.sub);
            }
        }
        count += 1;
    }
    assert!(count >= 60, "{count}");
}

#[test]
fn a_drive_is_read_written_and_stored_by_its_names() {
    let wire = Wire::new(device("plain-drive.eds", 7));
    let line = |words: &[&str]| with_eds(&wire, "plain-drive.eds", &[words, &["-n", "7"]].concat());
    assert_eq!(line(&["read", "Profile velocity"]), "6081h:0 Profile velocity = 1000 (000003E8h)\n");
    assert_eq!(line(&["write", "Profile velocity", "1500"]), "6081h:0 Profile velocity = 1500 (000005DCh)\n");
    line(&["save"]);
    line(&["nmt", "reset"]);
    assert_eq!(line(&["read", "Profile velocity"]), "6081h:0 Profile velocity = 1500 (000005DCh)\n");
    // The limits are those of the data sheet.
    let eds = eds("plain-drive.eds");
    let (_, result) = run(&wire, &["write", "6081", "60001", "-n", "7", &eds[0], &eds[1]]);
    assert_eq!(result.unwrap_err().exit_code(), 1);
}

#[test]
fn a_script_sets_values_that_come_by_tpdo_and_emcy() {
    let script = "0.5 Pressure = 1.5\n1.0 emcy 4200\n1.5 emcy 0\n2 repeat\n";
    let wire = Wire::new(with_script("plain-pressure.eds", 3, script));
    let eds = eds("plain-pressure.eds");
    printed(&wire, &["nmt", "start", "-n", "3"]);
    let lines = printed(&wire, &["trace", "--for", "3", "--kind", "pdo,emcy", &eds[0], &eds[1]]);
    assert!(lines.contains("Pressure = 1.5"), "{lines}");
    assert!(lines.contains("4200h") && lines.contains("0000h"), "{lines}");
}

#[test]
fn a_device_without_a_node_id_is_found_by_lss() {
    let sheet = sheet("plain-valve.eds");
    let mut node = Node::new(Table::new(&sheet, None).expect("a table"), None);
    node.set(at(0x1018, 4), &77_u32.to_le_bytes());
    let wire = Wire::new(node);
    let lines = printed(&wire, &["lss", "scan", "--step", "5", "--assign", "40"]);
    assert!(lines.contains("serial number 0000004Dh, node-ID 40"), "{lines}");
    assert!(printed(&wire, &["read", "1018:4", "-n", "40"]).contains("0000004Dh"));
}

/// A device that would start with node-ID 5.
fn second(wire: &Wire<Node>) -> (u8, String) {
    let eds = eds("plain-valve.eds");
    failed(wire, &["simulate", "-n", "5", "--for", "1", &eds[0], &eds[1]])
}

#[test]
fn a_node_id_that_is_in_use_is_not_simulated() {
    let wire = Wire::new(device("plain-valve.eds", 5));
    printed(&wire, &["nmt", "start", "-n", "5"]);
    let (code, words) = second(&wire);
    assert_eq!((code, words.contains("node-ID 5 is in use by another node")), (2, true), "{words}");
    wire.station(|node| assert_eq!(node.state(), canopen::nmt::State::Operational, "no second boot-up"));
    let eds = eds("plain-valve.eds");
    let lines = printed(&wire, &["simulate", "-n", "6", "--for", "1", &eds[0], &eds[1]]);
    assert!(lines.starts_with("node 6: "), "{lines}");
    printed(&wire, &["simulate", "--unconfigured", "-n", "5", "--for", "1", &eds[0], &eds[1]]);
}

/// A stopped node answers no request.
#[test]
fn a_node_id_is_in_use_by_a_stopped_node_with_a_heartbeat() {
    let wire = Wire::new(device("plain-valve.eds", 5));
    printed(&wire, &["write", "1017", "1000", "-n", "5"]);
    printed(&wire, &["nmt", "stop", "-n", "5"]);
    let (code, words) = second(&wire);
    assert_eq!((code, words.contains("node-ID 5 is in use")), (2, true), "{words}");
}

/// A reset communication after a new node-ID: the node boots with another one.
#[test]
fn reset_communication_finds_the_node_under_its_new_node_id() {
    let wire = Wire::new(device("plain-valve.eds", 5));
    printed(&wire, &["lss", "set-id", "11"]);
    assert_eq!(printed(&wire, &["nmt", "reset-comm", "-n", "5"]), "node 5: booted as node 11\n");
}

#[test]
fn simulated_devices_pass_the_check_of_nodectl() {
    for name in ["plain-io.eds", "plain-drive.eds", "plain-encoder.eds", "plain-pump.eds"] {
        let wire = Wire::new(device(name, 5));
        let eds = eds(name);
        let (lines, result) = run(&wire, &["check", "-n", "5", &eds[0], &eds[1]]);
        assert!(result.is_ok(), "{name}: {lines}");
    }
}

#[test]
fn a_dbc_file_has_one_message_for_each_can_id() {
    let wire = Wire::new(vec![device("plain-io.eds", 1), device("plain-io.eds", 2)]);
    let eds = corpus("plain-io.eds");
    let eds = ["--eds", eds.to_str().unwrap()];
    for cob_id in ["0x80000181", "0x181"] {
        printed(&wire, &["write", "1800:1", cob_id, "-n", "2", eds[0], eds[1]]);
    }
    let (code, words) = failed(&wire, &["map", "--dbc", "-", "-n", "1,2", eds[0], eds[1]]);
    let expected = "-: nothing was written: Node1_TPDO1 and Node2_TPDO1 have one CAN-ID, 181h";
    assert_eq!((code, words.as_str()), (7, expected));
}

#[test]
fn a_dbc_file_has_the_nodes_that_answer() {
    let wire = Wire::new(vec![device("plain-drive.eds", 1), device("plain-drive.eds", 2)]);
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("incomplete.dbc");
    let (eds, path) = (eds("plain-drive.eds"), file.to_str().unwrap());
    let _ = std::fs::remove_file(&file);
    let (code, words) = failed(&wire, &["map", "--dbc", path, "-n", "1,2,9", &eds[0], &eds[1]]);
    assert_eq!((code, words.as_str()), (3, "1 of 3 nodes is not in the file"));
    let text = std::fs::read_to_string(&file).expect("a file");
    assert!(text.contains("\nBU_: Node1 Node2\n") && text.contains(" Node2_TPDO1: "), "{text}");
    let (lines, _) = run(&wire, &["map", "--json", "--dbc", path, "-n", "2,9", &eds[0], &eds[1]]);
    let line: serde_json::Value = serde_json::from_str(lines.trim()).expect("the node that is left out");
    assert_eq!((&line["node"], &line["exit_code"]), (&9.into(), &3.into()));
    // Without any node the file is unchanged.
    let before = std::fs::read(&file).unwrap();
    assert_eq!(failed(&wire, &["map", "--dbc", path, "-n", "8,9", &eds[0], &eds[1]]).0, 3);
    assert_eq!(std::fs::read(&file).unwrap(), before);
}

#[test]
fn a_default_of_64_bits_is_that_of_the_data_sheet() {
    for (data_type, default, expected) in [
        (0x1B, "0xFFFFFFFFFFFFFFFF", u64::MAX),
        (0x1B, "0x8000000000000000", 1 << 63),
        (0x1B, "0x7FFFFFFFFFFFFFFF", u64::MAX >> 1),
        (0x15, "-9223372036854775808", 1 << 63),
        (0x15, "-1", u64::MAX),
    ] {
        let text = std::fs::read_to_string(corpus("plain-io.eds")).expect("a data sheet");
        let text = format!(
            "{text}\n[2F00]\nParameterName=Long\nDataType={data_type}\nAccessType=rw\nDefaultValue={default}\n"
        );
        let node = NodeId::new(5);
        let table = Table::new(&Eds::parse(&text).expect("a data sheet"), node).expect("a table");
        let wire = Wire::new(Node::new(table, node));
        let bytes = client(&mut wire.network(), 5).upload(at(0x2F00, 0)).expect("a value");
        assert_eq!(bytes, expected.to_le_bytes(), "{data_type:X}h {default}");
    }
}
