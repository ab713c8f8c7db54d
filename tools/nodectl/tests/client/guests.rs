//! Other SDO clients on the bus: this program waits for their transfers, and leaves them the first channel.

use canopen::{Duration, Frame, Instant, NodeId, QueueFull, Transmit};
use nodectl::bus::Station;
use nodectl::object::at;
use nodectl::sdo::Channel;

use crate::commands::{printed, run};
use crate::pressure::Pressure;
use crate::wire::{Answers, Wire, client};

fn frame(id: u16, data: [u8; 8]) -> Frame {
    Frame::new(id, &data).expect("a frame")
}

/// A node, and another client that reads an object from time to time. Each of its transfers takes a while.
struct Shared {
    node: Pressure,
    /// When the next transfer begins, and when the present one ends.
    begin: Instant,
    end: Option<Instant>,
    /// The pause between two transfers.
    pause: Duration,
    /// The request of the other client, and its answer.
    transfer: [[u8; 8]; 2],
    /// Requests of this program that came into a transfer of the other client.
    collisions: usize,
}

const TRANSFER: Duration = Duration::from_millis(40);

impl Station for Shared {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        if frame.id() == 0x601 {
            self.collisions += usize::from(self.end.is_some());
        }
        self.node.receive(frame, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        match self.end {
            Some(end) if now >= end => {
                let _ = out.send(frame(0x581, self.transfer[1]));
                (self.end, self.begin) = (None, now + self.pause);
            }
            None if now >= self.begin => {
                let _ = out.send(frame(0x601, self.transfer[0]));
                self.end = Some(now + TRANSFER);
            }
            _ => (),
        }
        self.node.poll(now, out).min(self.end.unwrap_or(self.begin))
    }
}

const DEVICE_TYPE: [[u8; 8]; 2] = [[0x40, 0x00, 0x10, 0, 0, 0, 0, 0], [0x43, 0x00, 0x10, 0, 0x94, 1, 2, 0]];
const HEARTBEAT: [[u8; 8]; 2] = [[0x40, 0x17, 0x10, 0, 0, 0, 0, 0], [0x4B, 0x17, 0x10, 0, 0xE8, 3, 0, 0]];

fn shared(pause: u64) -> Wire<Shared> {
    shared_by(pause, DEVICE_TYPE)
}

fn shared_by(pause: u64, transfer: [[u8; 8]; 2]) -> Wire<Shared> {
    let pause = Duration::from_millis(pause);
    Wire::new(Shared { node: Pressure::new(1), begin: Instant(0), end: None, pause, transfer, collisions: 0 })
}

#[test]
fn a_request_waits_for_the_transfer_of_another_client() {
    // A client that pauses, and one that never does.
    for pause in [200, 5] {
        let wire = shared(pause);
        let mut network = wire.network();
        network.pause(Duration::from_millis(5)).expect("a bus");
        for _ in 0..5 {
            let value = client(&mut network, 1).upload(at(0x1017, 0)).expect("a value");
            assert_eq!(value, 1000_u16.to_le_bytes());
        }
        assert_eq!(wire.station(|shared| shared.collisions), 0, "pause of {pause} ms");
    }
}

/// The answers to another client are no answers to the scan.
#[test]
fn a_scan_and_a_trace_beside_another_client_know_the_node() {
    for (pause, transfer) in [200, 100, 50, 20].into_iter().zip([HEARTBEAT, DEVICE_TYPE].into_iter().cycle())
    {
        let wire = shared_by(pause, transfer);
        let found = nodectl::scan::scan(&mut wire.network(), Duration::from_millis(300)).expect("a bus");
        let presence = found.get(&canopen::NodeId::new(1).expect("a node-ID")).expect("the node");
        assert_eq!(presence.device_type, Some(0x0002_0194), "pause of {pause} ms");
        printed(&wire, &["write", "6131:1", "kPa"]);
        printed(&wire, &["nmt", "start"]);
        let lines = printed(&wire, &["trace", "--for", "3", "--kind", "pdo"]);
        assert!(
            lines.contains("Pressure process value = ") && lines.contains(" kPa"),
            "pause of {pause} ms: {lines}"
        );
    }
}

#[test]
fn a_client_that_does_not_end_its_transfer_is_waited_for_and_then_passed() {
    let wire = shared(200);
    let mut network = wire.network();
    network.pause(Duration::from_millis(5)).expect("a bus");
    wire.station(|shared| shared.end = Some(Instant(u64::MAX)));
    let before = network.now();
    client(&mut network, 1).upload(at(0x1017, 0)).expect("a value");
    assert!(network.now().0 - before.0 >= 1_900_000, "two seconds after its request");
}

/// A node with a second SDO server, and the CAN-IDs of the requests that it has got.
struct Second {
    node: Pressure,
    cob_ids: [u32; 2],
    requests: Vec<(u16, u16)>,
}

impl Station for Second {
    fn receive(&mut self, received: &Frame, now: Instant, out: &mut impl Transmit) {
        let (id, data) = (received.id(), received.data());
        let Ok(data) = <[u8; 8]>::try_from(data) else { return self.node.receive(received, now, out) };
        if ![0x601, 0x641].contains(&id) {
            return self.node.receive(received, now, out);
        }
        let index = u16::from_le_bytes([data[1], data[2]]);
        self.requests.push((id, index));
        if let (0x40, 0x1201, sub @ 1..=2) = (data[0], index, data[3]) {
            let [a, b, c, d] = self.cob_ids[usize::from(sub) - 1].to_le_bytes();
            let _ = out.send(frame(id - 0x80, [0x43, 0x01, 0x12, sub, a, b, c, d]));
            return;
        }
        let mut answers = Answers::default();
        self.node.receive(&frame(0x601, data), now, &mut answers);
        for answer in answers.0 {
            let is_response = answer.id() == 0x581;
            let answer =
                if is_response { Frame::new(id - 0x80, answer.data()).expect("a frame") } else { answer };
            let _: Result<(), QueueFull> = out.send(answer);
        }
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        self.node.poll(now, out)
    }
}

fn second(cob_ids: [u32; 2]) -> Wire<Second> {
    Wire::new(Second { node: Pressure::new(1), cob_ids, requests: Vec::new() })
}

/// A data sheet with 1201h.
fn sheet() -> String {
    let path = format!("{}/second-server.eds", env!("CARGO_TARGET_TMPDIR"));
    let entry = |sub: u8, name: &str, kind: u8, access: &str| {
        format!(
            "[1201sub{sub}]\nParameterName={name}\nObjectType=0x7\nDataType=0x{kind:04X}\nAccessType={access}\n\n"
        )
    };
    let object = "\n[1201]\nParameterName=SDO server parameter\nObjectType=0x9\nSubNumber=3\n\n".to_owned()
        + &entry(0, "Highest sub-index supported", 5, "ro")
        + &entry(1, "COB-ID client to server", 7, "rw")
        + &entry(2, "COB-ID server to client", 7, "rw");
    let text = eds::DEVICES[0].sheet(&eds::Edition::default()) + &object;
    std::fs::write(&path, text).expect("a file");
    path
}

#[test]
fn the_second_sdo_server_is_used_where_enabled() {
    for (cob_ids, id) in [
        ([0x641, 0x5C1], 0x641),
        ([0x8000_0641, 0x8000_05C1], 0x601),
        ([0x641, 0x8000_05C1], 0x601),
        ([0x2000_0641, 0x5C1], 0x601),
    ] {
        let wire = second(cob_ids);
        let line = printed(&wire, &["read", "1017", "--eds", &sheet()]);
        assert!(line.contains("= 1000 ms"), "{line}");
        let requests = wire.station(|second| second.requests.clone());
        assert_eq!(requests.last(), Some(&(id, 0x1017)), "{cob_ids:X?}");
        // Its parameters are read on the channel that is always there.
        assert!(requests.iter().all(|(id, index)| *index == 0x1017 || *id == 0x601), "{requests:X?}");
    }
    // Without a data sheet that has the object, nothing is asked for it.
    let wire = second([0x641, 0x5C1]);
    printed(&wire, &["read", "1017"]);
    assert!(wire.station(|second| second.requests.iter().all(|(_, index)| *index != 0x1201)));
}

#[test]
fn after_a_boot_and_after_silence_the_default_server_is_used() {
    let node = NodeId::new(1).expect("a node-ID");
    let additional = Channel::of_cob_ids(0x641, 0x5C1);
    let wire = Wire::new(Pressure::new(1));
    let mut network = wire.network();
    network.set_channel(node, additional);
    network.pause(Duration::from_millis(5)).expect("a bus");
    assert_eq!(network.channel(node), Channel::default_of(node), "the node has booted");
    network.set_channel(node, additional);
    client(&mut network, 1).upload(at(0x1017, 0)).expect_err("no such server");
    client(&mut network, 1).upload(at(0x1017, 0)).expect("the default server");
}

/// A node, and another client that asks in the moment in which this program has begun to read.
struct Crossing {
    node: Pressure,
    /// How often the other client still asks.
    left: usize,
    /// The object whose upload it interrupts.
    of: [u8; 3],
}

impl Station for Crossing {
    fn receive(&mut self, received: &Frame, now: Instant, out: &mut impl Transmit) {
        self.node.receive(received, now, out);
        let is_it = received.id() == 0x601
            && received.data().get(..4) == Some(&[0x40, self.of[0], self.of[1], self.of[2]]);
        if is_it && self.left > 0 {
            self.left -= 1;
            let request = frame(0x601, [0x40, 0x17, 0x10, 0, 0, 0, 0, 0]);
            let _: Result<(), QueueFull> = out.send(request);
            self.node.receive(&request, now, out);
        }
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        self.node.poll(now, out)
    }
}

#[test]
fn a_read_that_another_client_has_interrupted_is_tried_again() {
    for left in 1..=3 {
        let wire = crossing(left);
        let line = printed(&wire, &["read", "1008", "--type", "vs"]);
        assert!(line.contains("STM32F4 pressure transmitter"), "{line}");
        assert_eq!(wire.station(|crossing| crossing.left), 0);
        let lines = printed(&crossing(left), &["info"]);
        assert!(lines.starts_with("node 1: STM32F4 pressure transmitter\n"), "{lines}");
    }
}

fn crossing(left: usize) -> Wire<Crossing> {
    Wire::new(Crossing { node: Pressure::new(1), left, of: [0x08, 0x10, 0] })
}

/// The abort by which the server drops a transfer for another one does not say that the object is absent.
#[test]
fn an_object_that_another_client_keeps_from_being_read_is_not_absent() {
    const WORDS: &str =
        "1008h:0 \"Manufacturer device name\": another client uses the SDO server of the node";
    let (lines, result) = run(&crossing(usize::MAX), &["info"]);
    let failure = result.expect_err("a failure");
    assert!(failure.exit_code() == 3 && failure.to_string().contains(WORDS), "{failure}: {lines}");
    let (lines, result) = run(&crossing(usize::MAX), &["scan"]);
    let failure = result.expect_err("a failure");
    assert!(failure.exit_code() == 3 && failure.to_string().contains("another client uses"), "{failure}");
    assert!(lines.contains("00020194h    00000000h  00000001h  -"), "{lines}");
}

/// A node, and another client that begins a block download in the moment of the first request to the node. The node takes that
/// request for a segment.
struct Crossed {
    node: Pressure,
    /// When the block download ends.
    end: Option<Instant>,
    /// When the next segment comes, and its sequence number.
    next: Instant,
    sequence: u8,
    /// The first bytes of the requests in the block download.
    disturbing: Vec<u8>,
}

const BLOCKS: Duration = Duration::from_millis(4000);

impl Station for Crossed {
    fn receive(&mut self, received: &Frame, now: Instant, out: &mut impl Transmit) {
        let is_request = received.id() == 0x601;
        if is_request && self.end.is_none() {
            let _ = out.send(frame(0x601, [0xC6, 0x50, 0x1F, 1, 0, 0, 1, 0]));
            let _ = out.send(frame(0x581, [0xA4, 0x50, 0x1F, 1, 127, 0, 0, 0]));
            (self.end, self.next) = (Some(now + BLOCKS), now);
        }
        if is_request && self.end > Some(now) {
            self.disturbing.push(received.data()[0]);
        } else {
            self.node.receive(received, now, out);
        }
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if self.next <= now {
            let _ = out.send(frame(0x601, [self.sequence, 0, 0, 0, 0, 0, 0, 0]));
            if self.sequence == 127 {
                let _ = out.send(frame(0x581, [0xA2, 127, 127, 0, 0, 0, 0, 0]));
            }
            self.sequence = self.sequence % 127 + 1;
            self.next = now + Duration::from_millis(2);
            if self.end <= Some(now) && self.sequence == 1 {
                let _ = out.send(frame(0x601, [0xC1, 0, 0, 0, 0, 0, 0, 0]));
                let _ = out.send(frame(0x581, [0xA1, 0, 0, 0, 0, 0, 0, 0]));
                self.next = Instant::NEVER;
            }
        }
        self.node.poll(now, out).min(self.next)
    }
}

#[test]
fn a_request_in_the_moment_of_another_clients_block_download_does_not_abort_it() {
    let node = Pressure::new(1);
    let crossed = Crossed { node, end: None, next: Instant::NEVER, sequence: 1, disturbing: Vec::new() };
    let wire = Wire::new(crossed);
    let mut network = wire.network();
    network.pause(Duration::from_millis(5)).expect("a bus");
    let value = client(&mut network, 1).upload(at(0x1017, 0)).expect("a value");
    assert_eq!(value, 1000_u16.to_le_bytes());
    assert_eq!(wire.station(|crossed| crossed.disturbing.clone()), [0x40], "once, and no abort message");
}

/// A node, and frames of another client at their times.
struct Scripted {
    node: Pressure,
    frames: Vec<(Instant, Frame)>,
}

impl Station for Scripted {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.node.receive(frame, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        while self.frames.first().is_some_and(|(at, _)| *at <= now) {
            let (_, frame) = self.frames.remove(0);
            let _ = out.send(frame);
            self.node.receive(&frame, now, out);
        }
        let next = self.frames.first().map_or(Instant::NEVER, |(at, _)| *at);
        self.node.poll(now, out).min(next)
    }
}

/// Another client that writes an object six seconds after the start.
fn writes(index: u16, value: u32) -> Wire<Scripted> {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = value.to_le_bytes();
    let write = frame(0x601, [0x23, low, high, 1, a, b, c, d]);
    Wire::new(Scripted { node: Pressure::new(1), frames: vec![(Instant(6_000_000), write)] })
}

const KILOPASCAL: u32 = 0x0322_0000;

#[test]
fn the_monitor_follows_a_unit_that_another_client_writes() {
    let wire = writes(0x6131, KILOPASCAL);
    let lines = printed(&wire, &["monitor", "--start", "--count", "24"]);
    let units: Vec<&str> = lines
        .lines()
        .filter(|line| line.contains("Pressure process value"))
        .filter_map(|line| line.split_whitespace().last())
        .collect();
    assert!(units.first() == Some(&"bar") && units.last() == Some(&"kPa"), "{lines}");
    assert!(units.is_sorted(), "{lines}");
}

/// A client with `--changes` gets the same number in a new unit, too.
#[test]
fn a_new_unit_is_a_change() {
    let lines = printed(&writes(0x6131, KILOPASCAL), &["monitor", "--start", "--changes", "--count", "3"]);
    assert!(lines.contains("= 0 bar") && lines.contains("= 0 kPa"), "{lines}");
}

#[test]
fn a_column_of_a_recording_has_one_unit() {
    let wire = writes(0x6131, KILOPASCAL);
    let rows = printed_to_file(&wire, "units", &["--start", "--for", "12"]);
    let (head, rows) = rows.split_once('\n').expect("a table");
    assert!(head.contains("6130h:1 Pressure process value [bar]"), "{head}");
    let cells: Vec<Vec<&str>> = rows.lines().map(|row| row.split(',').collect()).collect();
    assert!(cells.len() > 8 && cells[0][1] == "0" && cells.iter().all(|row| row[2] == "0"), "{rows}");
    assert!(cells.iter().rev().take(3).all(|row| row[1].is_empty()), "{rows}");
}

fn printed_to_file<S: Station + 'static>(wire: &Wire<S>, name: &str, flags: &[&str]) -> String {
    let path = std::env::temp_dir().join(format!("nodectl-{name}-{}.csv", std::process::id()));
    let line = [&["record", "--csv", path.to_str().expect("text")][..], flags].concat();
    printed(wire, &line);
    let text = std::fs::read_to_string(&path).expect("a table");
    std::fs::remove_file(path).expect("a file");
    text
}

/// A unit that is not saved is lost with a restart of the node.
#[test]
fn the_monitor_reads_the_unit_again_after_a_restart() {
    let nmt = |command| Frame::new(0x000, &[command, 1]).expect("a frame");
    let frames = vec![(Instant(6_000_000), nmt(0x81)), (Instant(7_500_000), nmt(0x01))];
    let wire = Wire::new(Scripted { node: Pressure::new(1), frames });
    printed(&wire, &["write", "6131:1", "kPa"]);
    let lines = printed(&wire, &["monitor", "--start", "--count", "24"]);
    assert!(lines.lines().next().is_some_and(|line| line.contains("kPa")), "{lines}");
    assert!(lines.lines().rev().take(2).any(|line| line.ends_with(" bar")), "{lines}");
}

/// Another client that puts the status before the pressure in TPDO 1, six seconds after the start.
fn remaps() -> Wire<Scripted> {
    let writes: [(u16, u8, u32); 6] = [
        (0x1800, 1, 0x8000_0181),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x6150_0108),
        (0x1A00, 2, 0x6130_0120),
        (0x1A00, 0, 2),
        (0x1800, 1, 0x0000_0181),
    ];
    let frame_of = |(index, sub, value): (u16, u8, u32)| {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = if (index, sub) == (0x1A00, 0) { 0x2F } else { 0x23 };
        frame(0x601, [command, low, high, sub, a, b, c, d])
    };
    let at = |number: usize| Instant(6_000_000 + 20_000 * number as u64);
    let mut frames: Vec<_> =
        writes.into_iter().enumerate().map(|(number, write)| (at(number), frame_of(write))).collect();
    // The status 1 and 1 bar, right after the change and later.
    let tpdo = Frame::new(0x181, &[1, 0, 0, 0x80, 0x3F]).expect("a frame");
    frames.extend([6_130_000, 8_000_000].map(|at| (Instant(at), tpdo)));
    Wire::new(Scripted { node: Pressure::new(1), frames })
}

#[test]
fn a_mapping_that_another_client_writes_is_followed() {
    let lines = printed(&remaps(), &["monitor", "--start", "--count", "40"]);
    let values: Vec<&str> = lines.lines().filter(|line| line.contains("6130h:1")).collect();
    let is_whole = |line: &&&str| line.contains("= 0 bar") || line.contains("= 1 bar");
    assert!(values.iter().all(|line| is_whole(&line)), "bytes of another object: {lines}");
    assert_eq!(values.iter().filter(|line| line.contains("= 1 bar")).count(), 1, "{lines}");
    let rows = printed_to_file(&remaps(), "mapping", &["--start", "--for", "12"]);
    let cells: Vec<&str> = rows.lines().skip(1).filter_map(|row| row.split(',').nth(1)).collect();
    assert!(cells.iter().all(|cell| ["", "0", "1"].contains(cell)), "{rows}");
    assert!(cells.contains(&"1"), "{rows}");
}
