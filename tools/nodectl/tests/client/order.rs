//! Configurations whose objects depend on their order (CiA 301): a service is switched off before its CAN-ID changes, 1006h
//! is 0 while 1019h changes, and 1016h has no node twice.

use std::fmt::Write as _;

use canopen::NodeId;
use eds::Eds;
use nodectl::bus::Station;
use nodectl::simulate::{Node, Table};

use crate::commands::{printed, run};
use crate::pressure::Pressure;
use crate::simulate::corpus;
use crate::wire::Wire;

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"))
}

fn write<S: Station + 'static>(wire: &Wire<S>, values: &[(&str, &str)]) {
    for (object, value) in values {
        printed(wire, &["write", object, value, "-n", "5"]);
    }
}

/// Dumps the configuration of a node, applies it to another one, which has to have it then, and back again.
fn clone_and_back<S: Station + 'static>(name: &str, from: &Wire<S>, to: &Wire<S>) {
    let (first, second) = (path(&format!("{name}-1.dcf")), path(&format!("{name}-2.dcf")));
    printed(from, &["dump", "--all", &first, "-n", "5"]);
    printed(to, &["dump", "--all", &second, "-n", "5"]);
    for (file, wire) in [(&first, to), (&second, from)] {
        let done = printed(wire, &["apply", file, "-n", "5"]);
        assert!(done.contains("read back"), "{name}: {done}");
        assert_eq!(printed(wire, &["diff", file, "-n", "5"]), "", "{name}");
    }
}

#[test]
fn sync_with_a_counter_and_a_period_is_applied() {
    let settings: [&[(&str, &str)]; 4] = [
        &[("1019", "10"), ("1006", "20000")],
        &[("1019", "20"), ("1006", "20000")],
        &[("1019", "20")],
        &[("1005", "0x90"), ("1019", "30"), ("1006", "5000")],
    ];
    for (number, first) in settings.into_iter().enumerate() {
        for second in settings {
            let (from, to) = (Wire::new(Pressure::new(5)), Wire::new(Pressure::new(5)));
            write(&from, first);
            write(&to, second);
            if first != second {
                clone_and_back(&format!("sync-{number}"), &from, &to);
            }
        }
    }
}

#[test]
fn an_emcy_with_another_can_id_is_applied() {
    let (from, to) = (Wire::new(Pressure::new(5)), Wire::new(Pressure::new(5)));
    write(&from, &[("1014", "0x80000085"), ("1014", "0x90")]);
    clone_and_back("emcy", &from, &to);
    write(&to, &[("1014", "0x80000085"), ("1014", "0x80000091")]);
    clone_and_back("emcy-off", &from, &to);
}

#[test]
fn monitored_nodes_that_exchange_their_entries_are_applied() {
    let (from, to) = (Wire::new(Pressure::new(5)), Wire::new(Pressure::new(5)));
    write(&from, &[("1016:1", "0x00060100"), ("1016:2", "0x00070100"), ("1016:3", "0x00080100")]);
    write(&to, &[("1016:1", "0x00070200"), ("1016:2", "0x00080200"), ("1016:3", "0x00060200")]);
    clone_and_back("watches", &from, &to);
}

/// The file of a network sets one object; the steps need others, which it does not set.
#[test]
fn net_apply_takes_the_steps_that_objects_outside_of_its_file_need() {
    let wire = Wire::new(Pressure::new(5));
    write(&wire, &[("1006", "20000"), ("1016:2", "0x00060100")]);
    let file = path("order.yaml");
    let text = "start: none\nnodes:\n  - node: 5\n    consumes: { 6: 500 }\n    values: { 1019: 10 }\n";
    std::fs::write(&file, text).expect("a file");
    assert_eq!(printed(&wire, &["net", "apply", &file]), "node 5: 2 changes, read back\n");
    let values = printed(&wire, &["read", "1006", "1016:2", "-n", "5"]);
    assert!(
        values.contains(" = 20000 ") && values.contains(" = 0 "),
        "the period, and one entry of node 6: {values}"
    );
    assert_eq!(printed(&wire, &["net", "check", &file]), "1 node is as the file says\n");
}

/// A device with the COB-IDs that the nodes of this project do not have.
fn device() -> Node {
    let mut text = std::fs::read_to_string(corpus("plain-encoder.eds")).expect("a data sheet");
    for (index, subs, default) in [
        (0x1005, 0..=0, "0x80"),
        (0x1006, 0..=0, "0"),
        (0x1012, 0..=0, "0x80000100"),
        (0x1028, 1..=6, "0x80000000"),
        (0x1201, 1..=3, "0x80000000"),
        (0x1280, 1..=3, "0x80000000"),
    ] {
        if *subs.end() == 0 {
            writeln!(
                text,
                "\n[{index:X}]\nParameterName=T\nDataType=7\nAccessType=rw\nDefaultValue={default}"
            )
            .unwrap();
            continue;
        }
        writeln!(text, "\n[{index:X}]\nParameterName=T\nObjectType=9\nSubNumber={}", subs.end() + 1).unwrap();
        writeln!(
            text,
            "\n[{index:X}sub0]\nParameterName=N\nDataType=5\nAccessType=const\nDefaultValue={}",
            subs.end()
        )
        .unwrap();
        for sub in subs {
            let (kind, default) = if sub == 3 && index >= 0x1200 { (5, "0") } else { (7, default) };
            writeln!(
                text,
                "\n[{index:X}sub{sub}]\nParameterName=S\nDataType={kind}\nAccessType=rw\nDefaultValue={default}"
            )
            .unwrap();
        }
    }
    let node = NodeId::new(5);
    let sheet = Eds::parse(&text).expect("a data sheet");
    std::fs::write(path("order.eds"), &text).expect("a file");
    Node::new(Table::new(&sheet, node).expect("a table"), node)
}

#[test]
fn every_cob_id_of_a_service_is_applied() {
    for (object, off, first, second) in [
        ("1005", "0x00000080", "0x40000080", "0x40000090"),
        ("1012", "0x00000100", "0x80000100", "0x800001A0"),
        ("1012", "0x00000100", "0x40000100", "0x400001A1"),
        ("1014", "0x80000085", "0x00000085", "0x00000090"),
        ("1028:6", "0x80000086", "0x00000086", "0x00000096"),
        ("1201:1", "0x80000000", "0x000006A0", "0x000006A1"),
        ("1201:2", "0x80000000", "0x000004A0", "0x000004A1"),
        ("1280:1", "0x80000000", "0x00000607", "0x00000608"),
        ("1800:1", "0x80000185", "0x00000185", "0x000001A0"),
    ] {
        let (from, to) = (Wire::new(device()), Wire::new(device()));
        let eds = path("order.eds");
        for (wire, value) in [(&from, first), (&to, second)] {
            let is_off = |value: &str| printed(wire, &["write", object, value, "-n", "5", "--eds", &eds]);
            is_off(off);
            // The CAN-ID of 1012h changes while both bits are 0.
            let id = u32::from_str_radix(&value[2..], 16).unwrap() & 0x7FF;
            if object == "1012" {
                is_off(&format!("{id:#X}"));
            }
            is_off(value);
        }
        let file = path("cob-id.dcf");
        printed(&from, &["dump", "--all", &file, "-n", "5", "--eds", &eds]);
        let (lines, result) = run(&to, &["apply", &file, "-n", "5"]);
        assert!(result.is_ok(), "{object}: {}", result.unwrap_err());
        assert_eq!(lines, "node 5: 1 change, read back\n", "{object}");
    }
}

/// The description of a sensor is checked against the scaling (6000h to 6002h), and the scaling against the description.
#[test]
fn encoders_with_other_sensors_and_a_scaling_are_applied() {
    let settings: [&[(&str, &str)]; 4] = [
        &[
            ("2100:1", "2"),
            ("2103:1", "12"),
            ("2103:2", "13"),
            ("6001", "3600"),
            ("6002", "36000"),
            ("6000", "4"),
        ],
        &[("2100:1", "1"), ("2103:1", "0"), ("2103:2", "8"), ("6001", "256"), ("6002", "256"), ("6000", "4")],
        &[
            ("2100:1", "2"),
            ("2103:1", "4"),
            ("2103:2", "20"),
            ("6001", "1000000"),
            ("6002", "16000000"),
            ("6000", "5"),
        ],
        &[
            ("2100:1", "5"),
            ("2101:1", "400"),
            ("2102:1", "100"),
            ("6001", "400"),
            ("6002", "40000"),
            ("6000", "4"),
        ],
    ];
    for (number, first) in settings.into_iter().enumerate() {
        for second in settings.into_iter().filter(|second| *second != first) {
            let node = || Wire::new(Pressure::of(node::Personality::Encoder, 5));
            let (from, to) = (node(), node());
            for (wire, values) in [(&from, first), (&to, second)] {
                write(wire, values);
                printed(wire, &["save", "-n", "5"]);
                printed(wire, &["nmt", "reset", "-n", "5"]);
            }
            clone_and_back(&format!("scaling-{number}"), &from, &to);
        }
    }
}
