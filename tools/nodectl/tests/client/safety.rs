//! Tests of commands that could do harm to a bus, a terminal or a file.

use canopen::{Duration, Frame, Instant, Transmit};
use nodectl::bus::Station;

use crate::commands::{failed, printed, run};
use crate::loader::Loader;
use crate::pressure::Pressure;
use crate::wire::{Answers, Fate, Wire};

fn with_serial(id: impl Into<Option<u8>>, serial: u32) -> Pressure {
    Pressure::new(id).with_serial(serial)
}

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"))
}

#[test]
fn a_node_id_is_not_given_to_more_than_one_node() {
    let lines = [
        &["lss", "set-id", "10"][..],
        &["lss", "set-rate", "500"],
        &["lss", "store"],
        &["lss", "inquire"],
        &["lss", "activate"],
    ];
    for nodes in [[Some(5), Some(6)], [Some(5), None], [None, None]] {
        let wire = Wire::new(vec![with_serial(nodes[0], 1), with_serial(nodes[1], 2)]);
        for line in lines {
            let (code, text) = failed(&wire, line);
            assert_eq!(
                (code, text.contains("more than one node is on the bus")),
                (2, true),
                "{line:?}: {text}"
            );
            for node in nodes {
                let name = node.map_or("a node without node-ID".to_owned(), |id| format!("node {id}"));
                assert!(text.contains(&name), "{text}");
            }
        }
        // No node stays in the state Configuration, and no node has a new node-ID.
        let select = |serial| format!("0:1:0x10000:{serial}");
        for (node, serial) in nodes.into_iter().zip([1, 2]) {
            let line = printed(&wire, &["lss", "inquire", "--select", &select(serial), "--json"]);
            let value: serde_json::Value = serde_json::from_str(&line).unwrap();
            assert_eq!(value["node"].as_u64(), node.map(u64::from));
        }
    }
}

#[test]
fn a_node_id_that_is_in_use_is_refused() {
    let wire = Wire::new(vec![with_serial(5, 1), with_serial(6, 2)]);
    let (code, text) = failed(&wire, &["lss", "set-id", "6", "--select", "0:1:0x10000:1"]);
    assert_eq!((code, text.as_str()), (2, "node-ID 6 is in use by another node"));
    // The node-ID of the selected node itself is accepted.
    printed(&wire, &["lss", "set-id", "6", "--select", "0:1:0x10000:2"]);
}

#[test]
fn the_only_node_needs_no_name() {
    let wire = Wire::new(vec![with_serial(None, 7)]);
    assert_eq!(printed(&wire, &["lss", "set-id", "9", "--store"]), "node-ID 9, stored\n");
    assert_eq!(printed(&wire, &["lss", "set-id", "10"]), "node-ID 10\n");
    printed(&wire, &["lss", "set-rate", "500", "--all"]);
    assert_eq!(failed(&wire, &["lss", "set-id", "11", "--all"]).0, 2);
}

#[test]
fn a_command_without_a_node_does_not_succeed() {
    let nobody = || Wire::new(Vec::<Pressure>::new());
    for line in [
        &["scan"][..],
        &["lss", "scan"],
        &["lss", "set-id", "5"],
        &["lss", "inquire"],
        &["nmt", "start", "-n", "9"],
        &["nmt", "stop", "-n", "9"],
        &["nmt", "reset", "-n", "9"],
        &["info", "-n", "9"],
        &["save", "-n", "9"],
    ] {
        assert_eq!(failed(&nobody(), line).0, 3, "{line:?}");
    }
}

#[test]
fn a_scan_numbers_all_nodes_past_those_in_use_and_lets_them_keep_it() {
    let nodes = [Some(41), None, None, None].into_iter().zip(1..);
    let wire = Wire::new(nodes.map(|(id, serial)| with_serial(id, serial)).collect::<Vec<_>>());
    let lines = printed(&wire, &["lss", "scan", "--assign", "40", "--store"]);
    let ids: Vec<&str> = lines.lines().filter_map(|line| line.rsplit(' ').next()).collect();
    assert_eq!(ids, ["40", "42", "43"], "{lines}");
    for id in ["40", "42", "43"] {
        printed(&wire, &["nmt", "reset", "-n", id]);
        assert!(printed(&wire, &["read", "1000", "-n", id]).starts_with("1000h:0 "));
    }
}

/// Answers come too late for a step of 5 ms. Slower steps then find the slaves, and the command does not say that there
/// are none.
#[test]
fn slaves_behind_a_slow_gateway_are_found() {
    struct Slow {
        node: Pressure,
        late: Vec<(Instant, Frame)>,
    }
    impl Station for Slow {
        fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
            let mut answers = Answers::default();
            self.node.receive(frame, now, &mut answers);
            self.late.extend(answers.0.into_iter().map(|frame| (now + Duration::from_millis(12), frame)));
            self.poll(now, out);
        }

        fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
            let due = self.node.poll(now, out);
            let (ready, late) = self.late.drain(..).partition(|(at, _)| *at <= now);
            self.late = late;
            let ready: Vec<(Instant, Frame)> = ready;
            ready.into_iter().for_each(|(_, frame)| out.send(frame).expect("room"));
            self.late.iter().fold(due, |due, (at, _)| due.min(*at))
        }
    }
    let wire = Wire::new(Slow { node: with_serial(None, 77), late: vec![] });
    let lines = printed(&wire, &["lss", "scan", "--step", "5"]);
    assert!(lines.contains("serial number 0000004Dh"), "{lines}");
}

const EVIL: &[u8] = b"\x1b]0;x\x07\r\nnode 9\x9b";

/// A device with control characters in its name: the owner of a device can write the name.
fn evil(serial: u32) -> Wire<Pressure> {
    let wire = Wire::new(with_serial(1, serial));
    // The answer to a read of 1008h (28 bytes in segments) becomes a text with control characters.
    let mut place = 0;
    wire.disturb(move |frame| match frame.data() {
        [0x41, 0x08, 0x10, ..] if frame.id() == 0x581 => {
            place = 0;
            Fate::Arrives
        }
        [command @ (0x00 | 0x10), ..] if frame.id() == 0x581 && place + 7 <= 14 => {
            let piece: Vec<u8> = EVIL.iter().copied().chain(*b"    ").skip(place).take(7).collect();
            place += 7;
            Fate::BecomesAnother(Frame::new(0x581, &[&[*command], &piece[..]].concat()).unwrap())
        }
        _ => Fate::Arrives,
    });
    wire
}

#[test]
fn control_characters_of_a_device_do_not_reach_the_terminal() {
    for line in [&["read", "1008"][..], &["scan"], &["info"]] {
        let text = printed(&evil(1), line);
        assert!(text.contains("\\x1b]0;x\\x07\\r\\n"), "{text:?}");
        assert!(text.chars().all(|char| char == '\n' || !char.is_control()), "{line:?}: {text:?}");
    }
    // JSON has the text unchanged, with its own escapes.
    let text = printed(&evil(1), &["read", "1008", "--json"]);
    assert!(text.contains("\\u001b") && !text.contains('\u{1b}'), "{text:?}");
}

#[test]
fn control_characters_of_a_data_sheet_do_not_reach_the_terminal() {
    let file = path("evil.eds");
    std::fs::write(&file, "[1017]\nParameterName=a\u{1b}[2Jb\nDataType=6\nAccessType=rw\n").unwrap();
    let wire = Wire::new(Pressure::new(1));
    let text = printed(&wire, &["read", "1017", "--eds", &file]);
    assert_eq!(text, "1017h:0 a\\x1b[2Jb = 1000\n");
}

#[test]
fn a_data_sheet_is_read_before_anything_is_done() {
    let wire = Wire::new(Pressure::new(1));
    let files = [
        ("binary.eds", vec![0_u8, 159, 146, 150, 255]),
        ("empty.eds", vec![]),
        ("huge.eds", vec![b'['; 5 << 20]),
    ];
    for (name, content) in files {
        std::fs::write(path(name), content).unwrap();
        let (code, text) = failed(&wire, &["read", "1017", "--eds", &path(name)]);
        assert_eq!((code, text.contains(name)), (7, true), "{text}");
    }
}

#[test]
fn a_file_stays_until_its_replacement_is_complete() {
    let file = path("kept.csv");
    std::fs::write(&file, "precious").unwrap();
    // A node that does not exist, and a node that sends nothing.
    let wire = Wire::new(Pressure::new(1));
    assert_eq!(failed(&wire, &["record", "-n", "9", "--csv", &file]).0, 3);
    let (code, text) = failed(&wire, &["record", "--for", "2", "--csv", &file]);
    assert_eq!((code, text.contains("--start starts it")), (3, true), "{text}");
    assert_eq!(failed(&wire, &["read", "1F50:1", "-n", "9", "--out", &file]).0, 3);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "precious");
    assert!(!std::path::Path::new(&format!("{file}.part")).exists());
}

#[test]
fn a_plot_that_cannot_be_written_is_reported_before_the_recording() {
    let wire = Wire::new(Pressure::new(1));
    let before = wire.network().now();
    let (code, _) = failed(&wire, &["record", "--start", "--for", "100", "--svg", "/nowhere/plot.svg"]);
    assert_eq!((code, wire.network().now() == before), (7, true));
}

#[test]
fn a_lost_bus_ends_a_recording_and_loses_nothing_of_it() {
    let (csv, svg) = (path("lost.csv"), path("lost.svg"));
    let wire = Wire::new(Pressure::new(1));
    let mut tpdos = 0;
    wire.disturb(move |frame| {
        tpdos += usize::from(frame.id() == 0x181);
        if tpdos > 3 { Fate::BreaksTheBus } else { Fate::Arrives }
    });
    let (_, result) = run(&wire, &["record", "--start", "--for", "60", "--csv", &csv, "--svg", &svg]);
    assert_eq!(result.unwrap_err().exit_code(), 4);
    assert_eq!(std::fs::read_to_string(&csv).unwrap().lines().count(), 4);
    assert!(std::fs::read_to_string(&svg).unwrap().contains("<polyline"));
}

#[test]
fn times_of_a_recording_do_not_go_backwards() {
    let csv = path("mixed.csv");
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["write", "1800:5", "7"]);
    printed(
        &wire,
        &["record", "--start", "--for", "2", "--csv", &csv, "--period", "5", "6130:1", "1001", "1008"],
    );
    let table = std::fs::read_to_string(&csv).unwrap();
    let times: Vec<f64> =
        table.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
    assert!(times.len() > 300 && times.is_sorted(), "{} rows", times.len());
}

/// The node was lost while it erased its flash: the next update waits until the node has finished.
#[test]
fn an_update_waits_for_a_node_that_is_busy() {
    let wire = Wire::new(vec![Loader::new(3, b"1.0.0\n")]);
    let file = path("busy.bin");
    std::fs::write(&file, b"1.1.0\nnew").unwrap();
    printed(&wire, &["write", "1F51:1", "0", "-n", "3", "--type", "u8", "--retries", "3"]);
    printed(&wire, &["write", "1F51:1", "3", "-n", "3", "--type", "u8"]);
    let line = printed(&wire, &["update", "--raw", &file, "-n", "3"]);
    assert!(line.contains("1.1.0"), "{line}");
}
