//! A bus of many simulated devices by its file: each way to be wrong is found, and all are configured in time.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::rc::Rc;

use nodectl::object::at;
use nodectl::simulate::Node;

use crate::commands::{failed, printed, run};
use crate::pressure::Pressure;
use crate::simulate::{corpus, device};
use crate::wire::{Fate, Wire};

const KINDS: [&str; 4] = ["plain-io.eds", "plain-drive.eds", "plain-encoder.eds", "plain-pressure.eds"];
/// Parameters of the kinds that the file sets.
const VALUES: [&str; 4] = ["'1800:5': 100", "6081: 2000", "6000: 0", "'6131:1': 0xFD4E0000"];
const DEVICE_TYPES: [u32; 4] = [0x000F_0191, 0x0002_0192, 0x0001_0196, 0x0002_0194];
const PRODUCTS: [u32; 4] = [0x101, 0x202, 0x303, 0x505];

fn kind(node: u8) -> usize {
    usize::from(node - 1) % KINDS.len()
}

/// Node 1 to `count`, each with its serial number.
fn devices(count: u8) -> Vec<Node> {
    (1..=count)
        .map(|node| {
            let mut device = device(KINDS[kind(node)], node);
            device.set(at(0x1018, 4), &(1000 + u32::from(node)).to_le_bytes());
            device
        })
        .collect()
}

/// The file of the bus, with further values and lines of a node.
fn file(
    name: &str,
    count: u8,
    values: impl Fn(u8) -> &'static str,
    more: impl Fn(u8) -> &'static str,
) -> PathBuf {
    let mut text = "start: all\nnodes:\n".to_owned();
    for node in 1..=count {
        let kind = kind(node);
        let sheet = corpus(KINDS[kind]);
        writeln!(
            text,
            "  - node: {node}\n    sheet: {}\n    identity: {{ device_type: 0x{:X}, vendor: 0x3E7, product: 0x{:X}, \
             revision: 0x10000, serial: {} }}\n    heartbeat: 200\n    save: true\n    values: {{ {}{} }}\n{}",
            sheet.display(),
            DEVICE_TYPES[kind],
            PRODUCTS[kind],
            1000 + u32::from(node),
            VALUES[kind],
            values(node),
            more(node),
        )
        .unwrap();
    }
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, text).unwrap();
    path
}

fn seconds(wire: &Wire<Vec<Node>>) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let micros = wire.network().now().0 as f64;
    micros / 1e6
}

#[test]
fn forty_nodes_are_configured_saved_and_started_within_five_seconds() {
    let wire = Wire::new(devices(40));
    let file = file("forty.yaml", 40, |_| "", |_| "");
    let file = file.to_str().unwrap();
    let (code, _) = failed(&wire, &["net", "check", file]);
    assert_eq!(code, 11);
    let before = seconds(&wire);
    let lines = printed(&wire, &["net", "apply", file]);
    let took = seconds(&wire) - before;
    println!("40 nodes: {took:.2} s at 250 kbit/s");
    assert!(took < 5.0, "{took} s");
    assert_eq!(lines.lines().filter(|line| line.ends_with("read back, saved")).count(), 40, "{lines}");
    assert_eq!(printed(&wire, &["net", "check", file]), "40 nodes are as the file says\n");
    // The nodes have saved the values, and a second run writes nothing.
    printed(&wire, &["nmt", "reset", "-n", "all"]);
    let lines = printed(&wire, &["net", "apply", file]);
    assert_eq!(lines.lines().filter(|line| line.ends_with("has it already")).count(), 40, "{lines}");
}

#[test]
fn each_way_to_be_wrong_is_found() {
    let wire = Wire::new(devices(40));
    let right = file("right.yaml", 40, |_| "", |_| "");
    printed(&wire, &["net", "apply", right.to_str().unwrap()]);
    wire.station(|nodes| {
        let mut set = |node: usize, index, sub, value: u32| {
            nodes[node - 1].set(at(index, sub), &value.to_le_bytes());
        };
        set(1, 0x1000, 0, 0x0001_0191);
        set(2, 0x1018, 1, 0x3E8);
        set(3, 0x1018, 2, 0x304);
        set(4, 0x1018, 3, 0x2_0000);
        set(5, 0x1018, 4, 9);
        nodes[5] = device("plain-pump.eds", 6);
        nodes[5].set(at(0x1017, 0), &200_u16.to_le_bytes());
        nodes.push(device("plain-pump.eds", 99));
        nodes.retain(|node| !matches!(node.node_id().map(canopen::NodeId::get), Some(10 | 12)));
    });
    printed(&wire, &["write", "1017", "0", "-n", "11"]);
    printed(&wire, &["write", "1017", "250", "-n", "9"]);
    printed(&wire, &["nmt", "preop", "-n", "13"]);
    let wrong = file(
        "wrong.yaml",
        40,
        |node| if node == 14 { ", '1800:1': 0x18F" } else { "" },
        |node| match node {
            7 => "    software: '2.0'\n    hardware: B\n",
            8 => "    date: 2026-11-24 10:30\n",
            12 => "    optional: true\n",
            _ => "",
        },
    );
    let (lines, result) = run(&wire, &["net", "check", "--json", wrong.to_str().unwrap()]);
    assert_eq!(result.unwrap_err().exit_code(), 11);
    let mut found: BTreeMap<u64, Vec<String>> = BTreeMap::new();
    for line in lines.lines() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        let what = line["what"].as_str().unwrap().to_owned();
        found.entry(line["node"].as_u64().unwrap_or(0)).or_default().push(what);
    }
    let expected: [(u64, &[&str]); 16] = [
        (0, &["can-id"]),
        (1, &["device-type"]),
        (2, &["vendor", "sheet"]),
        (3, &["product", "sheet"]),
        (4, &["revision"]),
        (5, &["serial"]),
        (6, &["device-type", "product", "sheet", "serial", "state"]),
        (7, &["hardware", "software"]),
        (8, &["date"]),
        (9, &["value"]),
        (10, &["missing"]),
        (11, &["value", "heartbeat"]),
        (13, &["state"]),
        (14, &["value"]),
        (99, &["unexpected"]),
        (100, &[]),
    ];
    for (node, whats) in expected {
        assert_eq!(found.remove(&node).unwrap_or_default(), whats, "node {node}: {lines}");
    }
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn a_node_that_is_another_or_refuses_a_value_is_reported_and_nothing_is_started() {
    let wire = Wire::new(devices(3));
    let refused = file("refused.yaml", 3, |node| if node == 2 { ", 6060: 300" } else { "" }, |_| "");
    let (code, text) = failed(&wire, &["net", "apply", refused.to_str().unwrap()]);
    assert_eq!((code, text.contains("\"300\" is not a whole number")), (7, true), "{text}");
    let refused = file("refused.yaml", 3, |node| if node == 3 { ", '1800:2': 245" } else { "" }, |_| "");
    wire.station(|nodes| nodes[0] = device("plain-pump.eds", 1));
    let (lines, result) = run(&wire, &["net", "apply", refused.to_str().unwrap()]);
    assert_eq!(result.unwrap_err().exit_code(), 11);
    assert!(lines.contains("node 1: sheet: "), "{lines}");
    assert!(lines.contains("node 2: 2 changes, read back, saved\n"), "{lines}");
    assert!(lines.contains("node 3: refused: "), "{lines}");
    wire.station(|nodes| {
        assert!(nodes.iter().all(|node| node.state() == canopen::nmt::State::PreOperational));
    });
}

/// The data sheet of node 3 is known only by its identity. Its mistake is found before another node is changed.
#[test]
fn a_mistake_at_the_last_node_changes_no_node() {
    let wire = Wire::new(devices(3));
    printed(&wire, &["nmt", "start", "-n", "all"]);
    let path = file("by-identity.yaml", 3, |node| if node == 3 { ", 6FFF: 1" } else { "" }, |_| "");
    let text = fs::read_to_string(&path).unwrap();
    let (first, last) = text.split_at(text.rfind("    sheet:").unwrap());
    fs::write(&path, first.to_owned() + last.split_once('\n').unwrap().1).unwrap();
    let folder = corpus("");
    let line = ["net", "apply", path.to_str().unwrap(), "--eds", folder.to_str().unwrap()];
    let (code, text) = failed(&wire, &line);
    assert_eq!(
        (code, text.contains("node 3: 6FFFh:0 is no object that the data sheet lets write")),
        (7, true),
        "{text}"
    );
    wire.station(|nodes| {
        assert!(nodes.iter().all(|node| node.state() == canopen::nmt::State::Operational));
    });
}

/// The command line is right: the file has the mistake, also where the identity of the node decides on its data sheet.
#[test]
fn a_mistake_of_the_file_is_7_in_every_command() {
    let wire = Wire::new(Pressure::new(1));
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("mistake.yaml");
    for (lines, words) in [
        ("heartbeat: 500\n    values: { 1017: 600 }", "the file sets it twice"),
        ("values: { 5FFF: 1 }", "5FFFh:0 is no object"),
        ("values: { 1017: 1000.5 }", "is not a whole number"),
    ] {
        fs::write(&file, format!("nodes:\n  - node: 1\n    {lines}\n")).unwrap();
        for command in ["check", "apply"] {
            let (code, text) = failed(&wire, &["net", command, file.to_str().unwrap()]);
            let is_named = text.contains("mistake.yaml: node 1: ") && text.contains(words);
            assert_eq!((code, is_named), (7, true), "{command}: {text}");
        }
    }
}

#[test]
fn an_object_is_set_once() {
    let wire = Wire::new(devices(1));
    let twice = file("twice.yaml", 1, |_| ", 1017: 500", |_| "");
    let (code, text) = failed(&wire, &["net", "apply", twice.to_str().unwrap()]);
    let words = "node 1: 1017h:0 is to be 200 and 500: the file sets it twice";
    assert_eq!((code, text.contains(words)), (7, true), "{text}");
    let same = file("same.yaml", 1, |_| ", 1017: 200", |_| "");
    printed(&wire, &["net", "apply", same.to_str().unwrap()]);
}

#[test]
fn a_truncated_configuration_file_changes_no_node() {
    let wire = Wire::new(devices(2));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let text = fs::read_to_string(corpus("dcf.dcf")).unwrap();
    fs::write(folder.join("cut.dcf"), text.split_once("\n[1018]").unwrap().0).unwrap();
    let file = folder.join("cut.yaml");
    fs::write(&file, "nodes:\n  - node: 1\n  - node: 2\n    configuration: cut.dcf\n").unwrap();
    let (code, text) = failed(&wire, &["net", "apply", file.to_str().unwrap()]);
    assert_eq!((code, text.contains("1018h is listed and has no section")), (7, true), "{text}");
}

/// The identity of the node is that of the data sheet, and the values would be those of another device.
#[test]
fn a_configuration_file_for_another_device_than_the_data_sheet_is_refused() {
    let wire = Wire::new(devices(1));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let text = fs::read_to_string(corpus("plain-io.eds")).unwrap();
    let sheet = corpus("plain-io.eds");
    for (number, is_same) in [("0x101", true), ("0x102", false)] {
        fs::write(
            folder.join("other.dcf"),
            text.replace("ProductNumber=0x101", &format!("ProductNumber={number}")),
        )
        .unwrap();
        let file = folder.join("other.yaml");
        let lines = format!(
            "start: none\nnodes:\n  - node: 1\n    sheet: {}\n    configuration: other.dcf\n",
            sheet.display()
        );
        fs::write(&file, lines).unwrap();
        let (_, result) = run(&wire, &["net", "apply", file.to_str().unwrap()]);
        let text = result.map_or_else(|failure| failure.to_string(), |()| String::new());
        let words = "node 1: the configuration file is for vendor 000003E7h, product 00000102h";
        assert_eq!(text.contains(words), !is_same, "{text}");
        assert_eq!(text.is_empty(), is_same, "{text}");
    }
}

#[test]
fn a_date_spares_the_comparison_and_is_written_last() {
    let mut text = fs::read_to_string(corpus("plain-encoder.eds")).unwrap();
    text += "\n[1020]\nParameterName=Verify configuration\nObjectType=0x8\nSubNumber=3\n";
    for (sub, data_type) in [(0, 5), (1, 7), (2, 7)] {
        let access = if sub == 0 { "const\nDefaultValue=2" } else { "rw" };
        write!(
            text,
            "\n[1020sub{sub}]\nParameterName=Sub {sub}\nDataType={data_type}\nAccessType={access}\n"
        )
        .unwrap();
    }
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (sheet, file) = (folder.join("dated.eds"), folder.join("dated.yaml"));
    fs::write(&sheet, &text).unwrap();
    fs::write(
        &file,
        "nodes:\n  - node: 5\n    name: arm\n    sheet: dated.eds\n    date: 2026-11-24 10:30\n    save: true\n    values: { 6000: 0 }\n",
    )
    .unwrap();
    let eds = eds::Eds::parse(&text).unwrap();
    let node = canopen::NodeId::new(5);
    let wire = Wire::new(Node::new(nodectl::simulate::Table::new(&eds, node).unwrap(), node));
    let file = file.to_str().unwrap();
    assert_eq!(printed(&wire, &["net", "apply", file]), "node 5: 3 changes, read back, saved\n");
    assert_eq!(printed(&wire, &["net", "apply", file]), "node 5: has the configuration of this date\n");
    assert_eq!(printed(&wire, &["net", "check", file]), "1 node is as the file says\n");
    assert_eq!(
        printed(&wire, &["read", "1020:1", "-n", "5"]).split(" = ").nth(1),
        Some("15668 (00003D34h)\n")
    );
}

/// The identity is read before the first node is changed, and not again when the node is configured.
#[test]
fn apply_reads_the_identity_of_a_node_once() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("once.yaml");
    let identity = "{ device_type: 0x20194, vendor: 0, product: 1, revision: 0x10000, serial: 0x12345678 }";
    fs::write(&path, format!("nodes:\n  - node: 5\n    identity: {identity}\n    heartbeat: 500\n")).unwrap();
    let wire = Wire::new(Pressure::new(5));
    let reads = Rc::new(RefCell::new(BTreeMap::new()));
    let counted = Rc::clone(&reads);
    wire.disturb(move |frame| {
        if let (0x605, &[0x40, 0x18, 0x10, sub, ..]) = (frame.id(), frame.data()) {
            *counted.borrow_mut().entry(sub).or_insert(0) += 1;
        }
        Fate::Arrives
    });
    assert_eq!(printed(&wire, &["net", "apply", path.to_str().unwrap()]), "node 5: 1 change, read back\n");
    assert_eq!(*reads.borrow(), BTreeMap::from([(1, 1), (2, 1), (3, 1), (4, 1)]));
}

#[test]
fn the_watch_configures_and_starts_a_node_that_returns() {
    let wire = Wire::new(devices(3));
    let file = file("watched.yaml", 3, |_| "", |_| "");
    printed(&wire, &["net", "apply", file.to_str().unwrap()]);
    // Node 2 is replaced by a new device, which boots while the watch begins.
    wire.station(|nodes| {
        nodes[1] = devices(2).remove(1);
    });
    let lines = printed(&wire, &["net", "apply", file.to_str().unwrap(), "--watch", "--for", "3"]);
    assert!(lines.contains("node 2: 2 changes, read back, saved"), "{lines}");
    wire.station(|nodes| assert_eq!(nodes[1].state(), canopen::nmt::State::Operational));
}

#[test]
fn a_dump_of_a_bus_is_a_file_that_fits_it() {
    let wire = Wire::new(devices(4));
    printed(&wire, &["write", "1017", "300", "-n", "2"]);
    printed(&wire, &["nmt", "start", "-n", "all"]);
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("dumped.yaml");
    let (file, folder) = (file.to_str().unwrap(), corpus(""));
    let folder = folder.to_str().unwrap();
    let line = printed(&wire, &["net", "dump", file, "--eds", folder]);
    assert!(line.ends_with("4 nodes, 4 with a configuration file\n"), "{line}");
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains("product: 0x202, revision: 0x10000, serial: 0x3EA"), "{text}");
    assert_eq!(printed(&wire, &["net", "check", file]), "4 nodes are as the file says\n");
    printed(&wire, &["write", "1017", "350", "-n", "2"]);
    let (lines, _) = run(&wire, &["net", "check", file]);
    assert_eq!(lines, "node 2: value: 1017h:0 Producer heartbeat time is 350 instead of 300\n");
}

#[test]
fn two_nodes_that_send_with_one_can_id_are_named() {
    let wire = Wire::new(devices(3));
    let file = file("shared.yaml", 3, |_| "", |_| "");
    let file = file.to_str().unwrap();
    printed(&wire, &["net", "apply", file]);
    let set = |cob_id: &str| printed(&wire, &["write", "1800:1", cob_id, "-n", "2"]);
    set("0x80000181");
    assert_eq!(
        printed(&wire, &["net", "check", file]),
        "3 nodes are as the file says\n",
        "it is switched off"
    );
    set("0x181");
    let (lines, result) = run(&wire, &["net", "check", file]);
    assert_eq!(result.unwrap_err().exit_code(), 11);
    assert_eq!(lines, "can-id: TPDOs of nodes 1, 2 are sent with 181h\n");
}

#[test]
fn a_monitored_node_is_shown_with_its_time() {
    let wire = Wire::new(Pressure::new(1));
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("monitored.yaml");
    fs::write(&file, "nodes:\n  - node: 1\n    consumes: { 5: 1000 }\n").unwrap();
    let (lines, _) = run(&wire, &["net", "check", file.to_str().unwrap()]);
    assert!(lines.starts_with("node 1: value: 1016h:1 "), "{lines}");
    assert!(lines.ends_with(" is off instead of node 5, 1000 ms\n"), "{lines}");
}

/// 1016h monitors nothing with such a node-ID (CiA 301, 7.5.2.19), and a node does not receive its own heartbeat.
#[test]
fn a_node_that_cannot_be_monitored_is_refused() {
    let wire = Wire::new(Pressure::new(1));
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("consumes.yaml");
    for (consumes, words) in [
        ("0: 1000", "node 1: consumes: 0 is no node-ID, 1 to 127"),
        ("5: 500, 128: 1000", "node 1: consumes: 128 is no node-ID, 1 to 127"),
        ("255: 1000", "node 1: consumes: 255 is no node-ID, 1 to 127"),
        ("1: 1000", "node 1: consumes: 1 is the node itself"),
    ] {
        fs::write(&file, format!("nodes:\n  - node: 1\n    consumes: {{ {consumes} }}\n")).unwrap();
        for command in ["apply", "check"] {
            let (code, text) = failed(&wire, &["net", command, file.to_str().unwrap()]);
            assert_eq!((code, text.contains(words)), (7, true), "{text}");
        }
    }
    assert!(printed(&wire, &["read", "1016:1"]).contains(" = 0 "));
}

/// Two values with one meaning are shown as numbers.
#[test]
fn an_entry_of_1016h_that_is_off_differs_from_another_one_by_its_number() {
    let wire = Wire::new(Pressure::new(1));
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("off.yaml");
    fs::write(&file, "nodes:\n  - node: 1\n    consumes: { 5: 0 }\n").unwrap();
    let (lines, _) = run(&wire, &["net", "check", file.to_str().unwrap()]);
    assert!(lines.contains(" is 0 instead of 327680\n"), "{lines}");
}
