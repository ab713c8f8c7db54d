//! Everyday use: data sheets of others, several nodes, silent nodes, words, pipes.

use std::process::{Command, Stdio};

use assert_cmd::cargo::CommandCargoExt;
use canopen::{Frame, Instant, Transmit};
use node::Personality;
use nodectl::bus::Station;

use crate::commands::{failed, printed, run};
use crate::pressure::Pressure;
use crate::wire::{Fate, Wire};

const PERSONALITIES: [Personality; 4] =
    [Personality::Pressure, Personality::Encoder, Personality::Combined, Personality::Lift];

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"))
}

#[test]
fn a_data_sheet_without_a_product_name_is_a_data_sheet() {
    for device in &eds::DEVICES {
        let wire = Wire::new(Pressure::of(device.personality, 1));
        let file = path(&format!("nameless-{}", device.file_name));
        let text = device.sheet(&eds::Edition::default());
        let name = text.lines().find(|line| line.starts_with("ProductName=")).expect("a name");
        std::fs::write(&file, text.replace(name, "ProductName=")).expect("a file");
        assert!(printed(&wire, &["list", "heartbeat", "--eds", &file]).contains("1017h:0"));
        assert!(printed(&wire, &["dump", "--eds", &file]).contains("[1017]"));
        // Some data sheets have no device at all.
        let (_, objects) = text.split_once("[MandatoryObjects]").expect("objects");
        std::fs::write(&file, format!("[MandatoryObjects]{objects}")).expect("a file");
        assert!(printed(&wire, &["list", "heartbeat", "--eds", &file]).contains("1017h:0"));
        assert!(printed(&wire, &["dump", "--eds", &file]).contains("[1017]"));
    }
}

#[test]
fn lss_scan_lists_all_nodes_without_a_node_id_and_leaves_them_waiting() {
    let serials = [7, 5, 0xFFFF_FFFF];
    let nodes = || serials.iter().map(|serial| Pressure::new(None).with_serial(*serial)).collect::<Vec<_>>();
    for count in 1..=serials.len() {
        let wire = Wire::new(nodes().into_iter().take(count).collect::<Vec<_>>());
        for _ in 0..2 {
            let lines = printed(&wire, &["lss", "scan", "--step", "5"]);
            assert_eq!(lines.lines().count(), count, "{lines}");
            for serial in &serials[..count] {
                assert!(lines.contains(&format!("{serial:08X}h, no node-ID")), "{lines}");
            }
        }
        let lines = printed(&wire, &["lss", "scan", "--step", "5", "--assign", "40"]);
        assert_eq!(lines.lines().count(), count, "{lines}");
    }
}

#[test]
fn the_error_list_of_a_healthy_node_is_empty_and_no_failure() {
    for personality in PERSONALITIES {
        let wire = Wire::new(Pressure::of(personality, 1));
        let lines = printed(&wire, &["read", "1003"]);
        assert_eq!(lines.lines().count(), 1, "{personality:?}: {lines}");
        assert!(lines.ends_with("= 0\n"), "{lines}");
        assert_eq!(failed(&wire, &["read", "1003:1"]).0, 1, "an entry that is named");
    }
}

#[test]
fn several_nodes_are_read_by_one_command() {
    let wire = Wire::new(vec![Pressure::new(1), Pressure::new(3)]);
    let lines = printed(&wire, &["read", "1017", "1018:4", "-n", "1,3"]);
    let expected = "1017h:0 Producer heartbeat time = 1000 ms";
    assert_eq!(lines.lines().count(), 4, "{lines}");
    assert!(lines.contains(&format!("node 1: {expected}")) && lines.contains(&format!("node 3: {expected}")));
    let (lines, result) = run(&wire, &["read", "1017", "-n", "1-3", "--json"]);
    assert_eq!(result.unwrap_err().exit_code(), 3, "node 2 does not answer");
    let nodes: Vec<_> = lines
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON")["node"].as_u64())
        .collect();
    assert_eq!(nodes, [Some(1), Some(2), Some(3)], "{lines}");
    assert_eq!(failed(&wire, &["write", "1017", "5", "-n", "1-3"]).0, 2);
}

#[test]
fn a_file_takes_the_bytes_of_one_object() {
    for personality in PERSONALITIES {
        let wire = Wire::new(vec![Pressure::of(personality, 1), Pressure::of(personality, 3)]);
        let file = path(&format!("one-object-{personality:?}"));
        let _ = std::fs::remove_file(&file);
        for objects in [&["1000", "1008"][..], &["1008", "1000"], &["1018"], &["identity"], &["1600"]] {
            for options in [&[][..], &["--block"], &["--type", "u32"]] {
                let line = [&["read", "--out", &file], objects, options].concat();
                let (code, text) = failed(&wire, &line);
                assert_eq!(code, 2, "{line:?}: {text}");
                assert!(text.contains("--out is for one object"), "{text}");
                assert!(!std::path::Path::new(&file).exists(), "{line:?}");
            }
        }
        assert_eq!(failed(&wire, &["read", "1000", "--out", &file, "-n", "1,3"]).0, 2);
        for (object, bytes) in [("1000", 4), ("1018:0", 1), ("1018:4", 4)] {
            printed(&wire, &["read", object, "--out", &file]);
            assert_eq!(std::fs::read(&file).expect("a file").len(), bytes, "{object}");
        }
    }
}

/// A node that sends and never answers.
struct Deaf(Frame, Instant);

impl Station for Deaf {
    fn receive(&mut self, _: &Frame, _: Instant, _: &mut impl Transmit) {}

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.1 {
            let _ = out.send(self.0);
            self.1 = now + canopen::Duration::from_millis(20);
        }
        self.1
    }
}

fn deaf(id: u16, data: &[u8]) -> Wire<Deaf> {
    Wire::new(Deaf(Frame::new(id, data).expect("a frame"), Instant(0)))
}

const COMMANDS: [&[&str]; 5] =
    [&["info"], &["read", "1000"], &["monitor"], &["dump"], &["write", "1017", "1"]];

#[test]
fn every_command_has_a_hint_for_a_silent_node() {
    for line in COMMANDS {
        let wire = Wire::new(vec![Pressure::new(1)]);
        let (code, text) = failed(&wire, &[line, &["-n", "9"]].concat());
        assert_eq!(code, 3);
        assert!(text.contains("node 9 is silent: is it on") && text.contains("nodectl scan"), "{text}");
    }
}

#[test]
fn every_command_recognises_a_node_that_sends_and_does_not_answer() {
    for line in COMMANDS {
        for (id, data) in [(0x709, &[5][..]), (0x189, &[1, 2]), (0x489, &[1]), (0x089, &[0; 8])] {
            let (code, text) = failed(&deaf(id, data), &[line, &["-n", "9"]].concat());
            assert_eq!(code, 3);
            assert!(text.contains("sends") && text.contains("nodectl --node 9 nmt preop"), "{text}");
        }
        let (_, text) = failed(&deaf(0x709, &[4]), &[line, &["-n", "9"]].concat());
        assert!(text.contains("the node is stopped"), "{text}");
    }
    let lines = printed(&deaf(0x709, &[5]), &["scan"]);
    assert!(lines.contains("   9  operational      -"), "{lines}");
}

#[test]
fn a_number_is_the_value_that_read_shows_with_or_without_a_point() {
    for (personality, object, digits) in
        [(Personality::Pressure, "7148:1", "6132:1"), (Personality::Combined, "7948:1", "6932:1")]
    {
        let wire = Wire::new(Pressure::of(personality, 1));
        printed(&wire, &["write", digits, "2"]);
        for text in ["2", "2.0", "2.00", "--raw 200", "0xC8"] {
            let words: Vec<&str> = ["write", object].into_iter().chain(text.split(' ')).collect();
            assert!(printed(&wire, &words).ends_with("= 2.00 bar\n"), "{text}");
        }
        let (code, text) = failed(&wire, &["write", object, "2.005"]);
        assert!(code == 2 && text.ends_with("\"2.005\" is not a number of steps of 0.01 bar"), "{text}");
    }
}

#[test]
fn words_are_written_for_units_and_signatures() {
    for (personality, shift) in [(Personality::Pressure, 0), (Personality::Combined, 0x800)] {
        let wire = Wire::new(Pressure::of(personality, 1));
        let unit = format!("{:04X}:1", 0x6131 + shift);
        for word in ["mbar", "kPa", "psi", "bar"] {
            assert!(printed(&wire, &["write", &unit, word]).contains(&format!("[{word}]")), "{word}");
        }
        assert_eq!(failed(&wire, &["write", &unit, "fathom"]).0, 2);
        printed(&wire, &["write", "1010:1", "save"]);
        let (code, text) = failed(&wire, &["write", "2200:1", "5"]);
        assert!(code == 1 && text.contains("the calibration is locked; `nodectl write 2203 cali`"), "{text}");
        printed(&wire, &["write", "2203", "cali"]);
        printed(&wire, &["write", "2200:1", "5"]);
        let zero = format!("{:04X}:1", 0x6125 + shift);
        // Before its first measurement, the node has no value to set to zero.
        let (code, text) = failed(&wire, &["write", &zero, "zero"]);
        assert!(code == 1 && text.contains("the process value is not valid"), "{text}");
        // As a node answers whose process value is not valid.
        wire.disturb(|frame| match (frame.id(), frame.data()) {
            (0x581, &[0x60, low, high, sub, ..]) => {
                let abort = Frame::new(0x581, &[0x80, low, high, sub, 0x22, 0, 0, 0x08]);
                Fate::BecomesAnother(abort.expect("a frame"))
            }
            _ => Fate::Arrives,
        });
        let (code, text) = failed(&wire, &["write", &zero, "zero"]);
        assert!(code == 1 && text.contains(&format!("see the status, {:04X}h:1", 0x6150 + shift)), "{text}");
    }
}

#[test]
fn words_of_a_lift_are_written_as_bytes() {
    let wire = Wire::new(Pressure::of(Personality::Lift, 1));
    printed(&wire, &["write", "2320:1", "05 04 01 00 01 00"]);
    assert!(printed(&wire, &["read", "2320:1"]).contains("= 4295033861 "));
    let (code, text) = failed(&wire, &["write", "2320:1", "050401000100"]);
    assert!(code == 2 && text.contains("or 6 bytes with spaces between them"), "{text}");
    assert_eq!(failed(&wire, &["write", "2320:1", "05 04 01"]).0, 2);
}

#[test]
fn a_closed_pipe_ends_a_command_without_a_word() {
    for json in [&[][..], &["--json"]] {
        let mut child = Command::cargo_bin("nodectl")
            .expect("the program")
            .args(["diff", "../../eds/pressure.eds", "../../eds/encoder.eds"])
            .args(json)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a process");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("an end");
        assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
        // The reader is gone.
        let mut child = Command::cargo_bin("nodectl")
            .expect("the program")
            .args(["--bus", "socketcand://127.0.0.1:1/vcan0", "scan"])
            .args(json)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a process");
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().expect("an end").code(), Some(4));
    }
}

/// `record --csv -` writes to the standard output and leaves no file.
#[test]
fn the_standard_output_is_a_file_of_a_recording() {
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["record", "--start", "--for", "1.5", "--csv", "-"]);
    assert!(!std::path::Path::new("-").exists());
    let (code, text) = failed(&wire, &["record", "--for", "1", "--csv", "-", "--arrow", "-"]);
    assert_eq!((code, text.as_str()), (2, "the standard output takes one of the files"));
}

/// A folder of data sheets is for many kinds of nodes: each gets the one of its identity.
#[test]
fn each_node_gets_the_data_sheet_of_its_identity() {
    let folder = path("sheets");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let (code, text) = failed(&Wire::new(Pressure::new(1)), &["read", "1000", "--eds", &folder]);
    assert!(code == 7 && text.ends_with("there is no data sheet in this folder"), "{text}");
    for device in &eds::DEVICES {
        let text = device.sheet(&eds::Edition::default());
        let other = text.replace(
            "ParameterName=Producer heartbeat time",
            &format!("ParameterName=Beat of {}", device.file_name),
        );
        std::fs::write(format!("{folder}/{}", device.file_name), other).expect("a file");
    }
    std::fs::write(format!("{folder}/broken.eds"), "[1000]\nObjectType=9999\n").expect("a file");
    for device in &eds::DEVICES {
        let wire = Wire::new(Pressure::of(device.personality, 1));
        let lines = printed(&wire, &["read", "1017", "--eds", &folder]);
        assert!(lines.contains(&format!("Beat of {}", device.file_name)), "{lines}");
    }
}
