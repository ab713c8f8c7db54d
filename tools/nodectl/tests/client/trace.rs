//! Tests of the lines of `nodectl trace`.

use std::fs;

use canopen::{Frame, Instant, NodeId};
use nodectl::Catalogue;
use nodectl::trace::{Decoder, Kind, Knowledge, Line};

use crate::commands::{failed, printed};
use crate::pressure::Pressure;
use crate::wire::Wire;

/// Decodes frames a millisecond apart. Node 5 is a pressure transmitter as delivered.
fn decoded(frames: &[(u16, &[u8])]) -> Vec<Line> {
    let mut decoder = Decoder::default();
    let sheet = Catalogue::of_file("pressure.eds").expect("a data sheet");
    decoder.know(NodeId::new(5).expect("a node-ID"), Knowledge::new(sheet));
    let frames = frames.iter().enumerate();
    let line = |(time, (id, data)): (usize, &(u16, &[u8]))| {
        decoder.on_frame(&Frame::new(*id, data).expect("a frame"), Instant(1000 * time as u64))
    };
    frames.flat_map(line).collect()
}

fn texts(frames: &[(u16, &[u8])]) -> Vec<String> {
    decoded(frames).into_iter().map(|line| line.text).collect()
}

/// CiA 417 fixes the CAN-ID of the car position. It is not that of TPDO 1 of node 12.
#[test]
fn a_pdo_of_a_lift_has_no_node() {
    let mut decoder = Decoder::default();
    let position = Frame::new(0x18C, &[0; 4]).expect("a frame");
    let node = |decoder: &mut Decoder| decoder.on_frame(&position, Instant(0))[0].node.map(NodeId::get);
    assert_eq!(node(&mut decoder), Some(12));
    let sheet = Catalogue::of_file("lift.eds").expect("a data sheet");
    decoder.know(NodeId::new(33).expect("a node-ID"), Knowledge::new(sheet));
    assert_eq!(node(&mut decoder), None);
}

#[test]
fn services_in_words() {
    let cases: [(u16, &[u8], Kind, &str); 21] = [
        (0x000, &[1, 0], Kind::Nmt, "start all nodes"),
        (0x000, &[0x81, 5], Kind::Nmt, "reset node 5"),
        (0x000, &[9, 5], Kind::Nmt, "unknown command 09h for node 5"),
        (0x000, &[1], Kind::Nmt, "no NMT command: 01"),
        (0x080, &[], Kind::Sync, "SYNC"),
        (0x080, &[7], Kind::Sync, "SYNC 7"),
        (0x100, &[0, 0, 0, 0, 1, 0], Kind::Time, "00:00:00.000, 1 days after 1984-01-01"),
        (
            0x085,
            &[0x30, 0x81, 0x11, 0, 0, 0, 0, 0],
            Kind::Emcy,
            "8130h heartbeat of a watched node is missing, error register 11h (generic, communication)",
        ),
        (
            0x085,
            &[0, 0, 0, 1, 0, 0, 0, 2],
            Kind::Emcy,
            "0000h no fault is left, error register 00h, manufacturer 01 00 00 00 02",
        ),
        (0x705, &[0], Kind::Heartbeat, "boot-up"),
        (0x705, &[0x7F], Kind::Heartbeat, "pre-operational"),
        (0x705, &[0x42], Kind::Heartbeat, "unknown state: 42"),
        (0x7E5, &[0x11, 9, 0, 0, 0, 0, 0, 0], Kind::Lss, "configure node-ID 9"),
        (0x7E5, &[0x13, 0, 2, 0, 0, 0, 0, 0], Kind::Lss, "configure 500 kbit/s"),
        (0x7E4, &[0x11, 1, 0, 0, 0, 0, 0, 0], Kind::Lss, "configure node-ID: refused, error code 1"),
        (0x7E4, &[0xEE; 8], Kind::Lss, "unknown LSS message: EE EE EE EE EE EE EE EE"),
        (0x183, &[1, 2], Kind::Pdo, "TPDO 1: 01 02"),
        (0x503, &[1, 2], Kind::Pdo, "RPDO 4: 01 02"),
        (0x483, &[], Kind::Pdo, "TPDO 4: "),
        (0x071, &[1], Kind::Other, "01"),
        (0x7FF, &[], Kind::Other, ""),
    ];
    for (id, data, kind, text) in cases {
        let lines = decoded(&[(id, data)]);
        assert_eq!(lines.len(), 1, "{id:03X}h {data:02X?}");
        assert_eq!((lines[0].kind, lines[0].text.as_str()), (kind, text), "{id:03X}h {data:02X?}");
    }
}

#[test]
fn a_heartbeat_is_printed_when_its_state_is_new() {
    let beats: Vec<(u16, &[u8])> = vec![
        (0x705, &[0]),
        (0x705, &[0x7F]),
        (0x705, &[0x7F]),
        (0x706, &[0x7F]),
        (0x705, &[5]),
        (0x705, &[5]),
    ];
    assert_eq!(texts(&beats), ["boot-up", "pre-operational", "pre-operational", "operational"]);
}

#[test]
fn values_of_a_pdo_have_names_and_units_and_follow_the_mapping() {
    let value: &[u8] = &[0, 0, 0x20, 0x40, 0, 0, 0xC8, 0x41];
    let lines = decoded(&[(0x185, value)]);
    assert_eq!(
        lines[0].text,
        "TPDO 1: Pressure process value = 2.5 bar, Temperature process value = 25 \u{b0}C"
    );
    assert_eq!(lines[0].values.len(), 2);
    // A master maps the status of the first channel instead, in the steps of CiA 301.
    let write = |command: u8, index: u16, sub: u8, data: u32| {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), data.to_le_bytes());
        [command, low, high, sub, a, b, c, d]
    };
    let answer = |index: u16, sub: u8| write(0x60, index, sub, 0);
    let writes = [
        (write(0x23, 0x1800, 1, 0x8000_0185), answer(0x1800, 1)),
        (write(0x2F, 0x1A00, 0, 0), answer(0x1A00, 0)),
        (write(0x23, 0x1A00, 1, 0x6150_0108), answer(0x1A00, 1)),
        (write(0x2F, 0x1A00, 0, 1), answer(0x1A00, 0)),
        (write(0x23, 0x1800, 1, 0x185), answer(0x1800, 1)),
    ];
    let mut frames: Vec<(u16, &[u8])> = Vec::new();
    for (request, response) in &writes[..1] {
        frames.extend([(0x605, &request[..]), (0x585, &response[..])]);
    }
    frames.push((0x185, &[1]));
    for (request, response) in &writes[1..] {
        frames.extend([(0x605, &request[..]), (0x585, &response[..])]);
    }
    frames.push((0x185, &[1]));
    let texts = texts(&frames);
    // While the PDO is off, the frame belongs to no PDO of a known node.
    assert_eq!(texts[1], "TPDO 1: 01");
    assert_eq!(texts.last().map(String::as_str), Some("TPDO 1: Pressure status = 1 [not valid]"));
}

#[test]
fn a_transfer_is_one_line() {
    let segments = texts(&[
        (0x605, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]),
        (0x585, &[0x41, 0x08, 0x10, 0, 9, 0, 0, 0]),
        (0x605, &[0x60, 0, 0, 0, 0, 0, 0, 0]),
        (0x585, b"\0Pressur"),
        (0x605, &[0x70, 0, 0, 0, 0, 0, 0, 0]),
        (0x585, b"\x1be!\0\0\0\0\0"),
    ]);
    assert_eq!(segments, ["read 1008h:0 Manufacturer device name = Pressure! (segments, 5.000 ms)"]);
    let refused = decoded(&[
        (0x605, &[0x2B, 0x17, 0x10, 0, 0xF4, 1, 0, 0]),
        (0x585, &[0x80, 0x17, 0x10, 0, 0x30, 0, 9, 6]),
    ]);
    assert_eq!(refused[0].abort, Some(0x0609_0030));
    assert!(refused[0].text.starts_with("write 1017h:0 Producer heartbeat time: refused, 0609 0030h, "));
    let twice: Vec<(u16, &[u8])> =
        vec![(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), (0x605, &[0x40, 0x17, 0x10, 0, 0, 0, 0, 0])];
    assert_eq!(texts(&twice), ["read 1000h:0 Device type: no answer"]);
}

/// A block download with a lost segment that is repeated: 20 bytes in three segments.
#[test]
fn blocks_are_folded_and_repeated_segments_count_once() {
    let segment = |number: u8| {
        let mut segment = [number; 8];
        segment[0] = number;
        segment
    };
    let frames: Vec<(u16, Vec<u8>)> = vec![
        (0x605, vec![0xC6, 0x50, 0x1F, 1, 20, 0, 0, 0]),
        (0x585, vec![0xA4, 0x50, 0x1F, 1, 127, 0, 0, 0]),
        (0x605, segment(1).to_vec()),
        (0x605, segment(3 | 0x80).to_vec()),
        (0x585, vec![0xA2, 1, 127, 0, 0, 0, 0, 0]),
        (0x605, segment(1).to_vec()),
        (0x605, segment(2 | 0x80).to_vec()),
        (0x585, vec![0xA2, 2, 127, 0, 0, 0, 0, 0]),
        (0x605, vec![0xC5, 0, 0, 0, 0, 0, 0, 0]),
        (0x585, vec![0xA1, 0, 0, 0, 0, 0, 0, 0]),
    ];
    let frames: Vec<(u16, &[u8])> = frames.iter().map(|(id, data)| (*id, &data[..])).collect();
    let lines = decoded(&frames);
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(
        lines[0].text.contains("(blocks, 9.000 ms)") && lines[0].text.starts_with("write 1F50h:1 "),
        "{lines:?}"
    );
    // A segment with the first byte of an abort would have number 0, which does not exist.
    let given_up: Vec<(u16, &[u8])> = vec![
        (0x605, &[0xC6, 0x50, 0x1F, 1, 20, 0, 0, 0]),
        (0x585, &[0xA4, 0x50, 0x1F, 1, 127, 0, 0, 0]),
        (0x605, &[0x80, 0x50, 0x1F, 1, 0, 0, 0, 8]),
    ];
    let lines = decoded(&given_up);
    assert_eq!(lines[0].abort, Some(0x0800_0000));
    assert!(lines[0].text.contains("given up, 0800 0000h"), "{lines:?}");
}

/// The decoder accepts any frames. The same frames give the same lines.
#[test]
fn any_frames_are_taken() {
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let sheet = Catalogue::of_file("combined.eds").expect("a data sheet");
    let mut decoder = Decoder::default();
    decoder.know(NodeId::new(5).expect("a node-ID"), Knowledge::new(sheet));
    for time in 0..20_000 {
        let ids = [0x585, 0x605, 0x185, 0x705, 0x085, 0x7E4, 0x7E5, 0x000, 0x080, 0x100];
        let id = if next() % 8 == 0 { (next() % 0x800) as u16 } else { ids[(next() % 10) as usize] };
        let data = next().to_le_bytes();
        let length = if next() % 4 == 0 { (next() % 9) as usize } else { 8 };
        let frame = Frame::new(id, &data[..length]).expect("a frame");
        for line in decoder.on_frame(&frame, Instant(time)) {
            assert!(line.text.len() < 2000, "{line:?}");
        }
    }
}

#[test]
fn a_file_of_candump_needs_no_bus() {
    let path = std::env::temp_dir().join(format!("nodectl-trace-{}.log", std::process::id()));
    fs::write(&path, "(1.000000) can0 701#00\n\n(1.500000) can0 00000701#00\n(2.000000) can0 000#0100\n")
        .unwrap();
    let file = path.to_str().expect("a path");
    let wire = Wire::new(Pressure::new(1));
    assert_eq!(
        printed(&wire, &["trace", "--file", file]),
        "  0.000000 701h heartbeat   1  boot-up\n  0.500000 701h other       -  29-bit identifier: 00\n  1.000000 000h nmt         -  start all nodes\n"
    );
    let only = printed(&wire, &["trace", "--file", file, "--kind", "nmt", "--json"]);
    let only: serde_json::Value = serde_json::from_str(&only).expect("JSON");
    assert_eq!((&only["kind"], &only["data"], &only["time"]), (&"nmt".into(), &"0100".into(), &1.0.into()));
    assert_eq!(printed(&wire, &["trace", "--file", file, "--without", "nmt", "--of", "2"]), "");
    fs::write(&path, "(1.000000) can0 701#00\nnonsense\n").unwrap();
    let (code, error) = failed(&wire, &["trace", "--file", file]);
    assert!(code == 7 && error.contains("line 2: no record of candump"), "{error}");
    fs::remove_file(&path).unwrap();
    assert_eq!(failed(&wire, &["trace", "--file", file]).0, 7);
}

/// A log that begins within a block download: its first segment is shown, and the next transfer is whole.
#[test]
fn a_transfer_without_its_begin_is_one_line() {
    let lines = texts(&[
        (0x605, &[2, 1, 2, 3, 4, 5, 6, 7]),
        (0x605, &[0x83, 1, 2, 3, 4, 5, 6, 7]),
        (0x585, &[0xA2, 3, 127, 0, 0, 0, 0, 0]),
        (0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]),
        (0x585, &[0x43, 0x00, 0x10, 0, 0x94, 1, 2, 0]),
    ]);
    assert_eq!(lines[0], "transfer without its begin: 02 01 02 03 04 05 06 07");
    assert!(lines.len() == 2 && lines[1].starts_with("read 1000h"), "{lines:?}");
}

/// The same boot-up message and command in the logs of three programs.
#[test]
fn logs_of_other_programs_are_read() {
    let logs = [
        "# a comment\n(2026-11-25 12:00:00.000000)  can0  RX - -  701   [1]  00\n(2026-11-25 12:00:01.000000)  can0  000   [2]  01 00\n",
        "base hex  timestamps absolute\n 5.000000 1 701 Rx d 1 00\n 6.000000 1 000 Tx d 2 01 00\n",
        ";$FILEVERSION=1.1\n 1) 1000.0 Rx 0701 1 00\n 2) 2000.0 Tx 0000 2 01 00\n",
    ];
    let wire = Wire::new(Pressure::new(1));
    for (number, log) in logs.iter().enumerate() {
        let path = std::env::temp_dir().join(format!("nodectl-log-{}-{number}.log", std::process::id()));
        fs::write(&path, log).unwrap();
        assert_eq!(
            printed(&wire, &["trace", "--file", path.to_str().expect("a path")]),
            "  0.000000 701h heartbeat   1  boot-up\n  1.000000 000h nmt         -  start all nodes\n",
            "{log}"
        );
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn a_node_is_asked_for_its_pdos_unless_the_trace_is_silent() {
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["nmt", "start", "--no-wait"]);
    let line = printed(&wire, &["trace", "--kind", "pdo", "--count", "1"]);
    assert!(line.contains(" 181h pdo         1  TPDO 1: Pressure process value = "), "{line}");
    let line = printed(&wire, &["trace", "--kind", "pdo", "--count", "1", "--silent"]);
    assert!(line.contains("  TPDO 1: ") && !line.contains("process"), "{line}");
}
