//! A trace of two nodes of the same kind at 250 kbit/s, which keeps all rules.

use std::collections::BTreeMap;

use canopen::{Frame, Instant};
use monitor::{Entry, Incident, Initial, Key, Kind, Sender, Sheet};

/// Node-ID of participant 0; participant 1 has the next one.
pub(crate) const NODE: u8 = 5;
/// The time of a frame of eight bytes, in us.
const FRAME: u64 = 500;

/// An input of a monitor.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    Frame(Instant, Sender, Frame),
    Incident(Instant, usize, Incident),
    Deadline(Instant, usize, Instant),
    Value(Instant, usize, Key, Vec<u8>),
}

impl Event {
    pub(crate) fn at(&self) -> Instant {
        match self {
            Event::Frame(at, ..)
            | Event::Incident(at, ..)
            | Event::Deadline(at, ..)
            | Event::Value(at, ..) => *at,
        }
    }
}

/// The data sheet of the nodes.
pub(crate) fn sheet() -> Sheet {
    let long = |value: u32| Initial::Bytes(value.to_le_bytes().to_vec());
    let word = |value: u16| Initial::Bytes(value.to_le_bytes().to_vec());
    let byte = |value: u8| Initial::Bytes(vec![value]);
    let rows: [(Key, Initial); 21] = [
        ((0x1005, 0), long(0x80)),
        ((0x1007, 0), long(5_000)),
        ((0x1014, 0), Initial::NodeId(0x80)),
        ((0x1015, 0), word(0)),
        ((0x1017, 0), word(100)),
        ((0x1029, 1), byte(0)),
        ((0x1029, 2), byte(0)),
        ((0x1800, 1), Initial::NodeId(0x4000_0180)),
        ((0x1800, 2), byte(1)),
        ((0x1800, 3), word(0)),
        ((0x1801, 1), Initial::NodeId(0x4000_0280)),
        ((0x1801, 2), byte(255)),
        ((0x1801, 3), word(500)),
        ((0x1801, 5), word(0)),
        ((0x1A00, 0), byte(1)),
        ((0x1A00, 1), long(0x6130_0120)),
        ((0x1A01, 0), byte(1)),
        ((0x1A01, 1), long(0x6150_0108)),
        ((0x1F80, 0), long(0)),
        ((0x6003, 0), long(0)),
        ((0x6006, 0), long(0)),
    ];
    let mut entries: BTreeMap<Key, Entry> = BTreeMap::new();
    for (key, initial) in rows {
        let group = if key.0 < 0x2000 { 2 } else { 3 };
        entries.insert(key, Entry { kind: Kind::Parameter, initial, group: Some(group) });
    }
    let volatile = Entry { kind: Kind::Volatile, initial: Initial::Unknown, group: None };
    entries.insert((0x2F00, 0), volatile.clone());
    entries.insert((0x6130, 1), volatile);
    Sheet {
        entries,
        communication_errors: vec![0x8130],
        device_errors: vec![0x5006],
        changes_pdos: [].into(),
        forgets_errors: true,
    }
}

/// The trace.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trace {
    pub(crate) events: Vec<Event>,
    now: u64,
}

impl Trace {
    pub(crate) fn clean() -> Trace {
        let mut trace = Trace::default();
        for participant in 0..2 {
            trace.events.push(Event::Incident(Instant(0), participant, Incident::PowerOn));
        }
        trace.boot(5_000);
        trace.node(6_000, 1, 0x706, &[0]);
        trace.heartbeats(0, 105..=305, 127);
        trace.heartbeats(1, 106..=306, 127);
        trace.transfers();
        trace.operational();
        trace.error();
        trace.heartbeats(1, 406..=1806, 5);
        trace.restarts();
        trace
    }

    fn transfers(&mut self) {
        self.now = 20_000;
        self.read(0x1017, 0, &100_u16.to_le_bytes());
        self.write(0x1017, 0, &100_u16.to_le_bytes());
        self.read(0x1017, 0, &100_u16.to_le_bytes());
        self.write(0x6003, 0, &1234_u32.to_le_bytes());
        self.read(0x6003, 0, &1234_u32.to_le_bytes());
        self.refused(0x6003, 0, &9_u32.to_le_bytes());
        self.read(0x6003, 0, &1234_u32.to_le_bytes());
        self.segments();
        self.blocks();
        self.refused_block(&[]);
        self.read(0x6003, 0, &1234_u32.to_le_bytes());
        self.write(0x1010, 1, b"save");
        self.events.push(Event::Deadline(Instant(self.now), 0, Instant(self.now + 1)));
    }

    /// A segmented download and upload of ten bytes.
    fn segments(&mut self) {
        let [a, b] = [[0x00, 1, 2, 3, 4, 5, 6, 7], [0x19, 8, 9, 10, 0, 0, 0, 0]];
        self.ask(&[0x21, 0x00, 0x2F, 0, 10, 0, 0, 0], &[0x60, 0x00, 0x2F, 0, 0, 0, 0, 0]);
        self.ask(&a, &[0x20, 0, 0, 0, 0, 0, 0, 0]);
        self.ask(&b, &[0x30, 0, 0, 0, 0, 0, 0, 0]);
        self.ask(&[0x40, 0x00, 0x2F, 0, 0, 0, 0, 0], &[0x41, 0x00, 0x2F, 0, 10, 0, 0, 0]);
        self.ask(&[0x60, 0, 0, 0, 0, 0, 0, 0], &a);
        self.ask(&[0x70, 0, 0, 0, 0, 0, 0, 0], &b);
    }

    /// A block download and upload of ten bytes.
    fn blocks(&mut self) {
        let [a, b] = [[0x01, 1, 2, 3, 4, 5, 6, 7], [0x82, 8, 9, 10, 0, 0, 0, 0]];
        let [low, high] = CRC.to_le_bytes();
        self.ask(&[0xC6, 0x00, 0x2F, 0, 10, 0, 0, 0], &[0xA4, 0x00, 0x2F, 0, 127, 0, 0, 0]);
        self.ask(&a, &[]);
        self.ask(&b, &[0xA2, 2, 127, 0, 0, 0, 0, 0]);
        self.ask(&[0xC1 | 4 << 2, low, high, 0, 0, 0, 0, 0], &[0xA1, 0, 0, 0, 0, 0, 0, 0]);
        self.ask(&[0xA4, 0x00, 0x2F, 0, 127, 0, 0, 0], &[0xC6, 0x00, 0x2F, 0, 10, 0, 0, 0]);
        self.ask(&[0xA3, 0, 0, 0, 0, 0, 0, 0], &a);
        self.answer(&b);
        self.ask(&[0xA2, 2, 127, 0, 0, 0, 0, 0], &[0xC1 | 4 << 2, low, high, 0, 0, 0, 0, 0]);
        self.ask(&[0xA1, 0, 0, 0, 0, 0, 0, 0], &[]);
    }

    /// A block download that node 5 aborts within the block. Two more segments were on their way; the second one looks like
    /// an upload of 1001h, and has this answer.
    pub(crate) fn refused_block(&mut self, answer: &[u8]) {
        self.ask(&[0xC4, 0x00, 0x2F, 0, 0, 0, 0, 0], &[0xA4, 0x00, 0x2F, 0, 127, 0, 0, 0]);
        for sequence in 0x01..0x3F {
            self.ask(&[sequence, 1, 2, 3, 4, 5, 6, 7], &[]);
        }
        self.ask(&[0x3F, 1, 2, 3, 4, 5, 6, 7], &[0x80, 0x00, 0x2F, 0, 0, 0, 6, 6]);
        self.ask(&[0x40, 1, 0x10, 0, 0, 0, 0, 0], answer);
        self.ask(&[0x41, 1, 0x10, 0, 0, 0, 0, 0], &[]);
    }

    /// A block download of 63 segments that node 5 aborts after a pause of 300 ms, and an upload of 6003h.
    pub(crate) fn refused_block_with_a_pause(&mut self) {
        self.ask(&[0xC4, 0x00, 0x2F, 0, 0, 0, 0, 0], &[0xA4, 0x00, 0x2F, 0, 127, 0, 0, 0]);
        for sequence in 0x01..=0x3F {
            self.ask(&[sequence, 1, 2, 3, 4, 5, 6, 7], &[]);
        }
        self.now += 300_000;
        self.answer(&[0x80, 0x00, 0x2F, 0, 0, 0, 6, 6]);
        self.read(0x6003, 0, &0_u32.to_le_bytes());
    }

    /// A block download of ten bytes whose client pauses within the block. The rest of the block follows the acknowledge, and the
    /// next block begins before the server has acknowledged nothing of that rest.
    pub(crate) fn blocks_that_cross(&mut self) {
        let [low, high] = CRC.to_le_bytes();
        self.ask(&[0xC6, 0x00, 0x2F, 0, 10, 0, 0, 0], &[0xA4, 0x00, 0x2F, 0, 127, 0, 0, 0]);
        self.ask(&[0x01, 1, 2, 3, 4, 5, 6, 7], &[]);
        self.now += 300_000;
        self.answer(&[0xA2, 1, 127, 0, 0, 0, 0, 0]);
        self.ask(&[0x82, 8, 9, 10, 0, 0, 0, 0], &[]);
        self.ask(&[0x81, 8, 9, 10, 0, 0, 0, 0], &[]);
        self.answer(&[0xA2, 0, 127, 0, 0, 0, 0, 0]);
        self.answer(&[0xA2, 1, 127, 0, 0, 0, 0, 0]);
        self.ask(&[0xC1 | 4 << 2, low, high, 0, 0, 0, 0, 0], &[0xA1, 0, 0, 0, 0, 0, 0, 0]);
    }

    /// SYNC every 20 ms, and two events of TPDO 2.
    fn operational(&mut self) {
        self.client(310_000, 0x000, &[1, 0]);
        for n in 0..9 {
            let at = 320_000 + n * 20_000;
            self.client(at, 0x080, &[]);
            self.node(at + FRAME, 0, 0x185, &[1, 2, 3, n as u8]);
            self.node(at + 2 * FRAME, 1, 0x186, &[4, 3, 2, n as u8]);
        }
        for at in [331_000, 391_000, 451_000] {
            self.node(at, 0, 0x285, &[0]);
        }
        self.heartbeats(0, 405..=405, 5);
    }

    /// A device error in Operational: 1029h:2 is 0, so the node becomes Pre-operational. Then Stopped by a command.
    fn error(&mut self) {
        self.node(500_000, 0, 0x085, &[0x06, 0x50, 1, 0, 0, 0, 0, 0]);
        self.heartbeats(0, 505..=605, 127);
        self.now = 510_000;
        self.read(0x1001, 0, &[1]);
        self.read(0x1003, 0, &[1]);
        self.read(0x1003, 1, &0x5006_u32.to_le_bytes());
        self.node(630_000, 0, 0x085, &[0; 8]);
        self.now = 635_000;
        self.read(0x1001, 0, &[0]);
        self.client(650_000, 0x000, &[2, NODE]);
        self.heartbeats(0, 705..=805, 4);
    }

    fn restarts(&mut self) {
        self.client(900_000, 0x000, &[129, NODE]);
        self.boot(950_000);
        self.heartbeats(0, 1050..=1250, 127);
        self.now = 1_100_000;
        self.read(0x1017, 0, &100_u16.to_le_bytes());
        self.read(0x6003, 0, &1234_u32.to_le_bytes());
        self.write(0x1011, 1, b"load");
        self.client(1_300_000, 0x000, &[129, NODE]);
        self.boot(1_350_000);
        self.heartbeats(0, 1450..=1750, 127);
        self.now = 1_400_000;
        self.read(0x6003, 0, &0_u32.to_le_bytes());
        self.events.push(Event::Value(Instant(1_500_000), 0, (0x6003, 0), vec![0; 4]));
    }

    fn boot(&mut self, at: u64) {
        self.node(at, 0, 0x700 + u16::from(NODE), &[0]);
    }

    fn heartbeats(&mut self, participant: usize, ms: std::ops::RangeInclusive<u64>, state: u8) {
        let id = 0x700 + u16::from(NODE) + participant as u16;
        for at in ms.step_by(100) {
            self.node(at * 1000 + 250, participant, id, &[state]);
        }
    }

    /// A frame of a node.
    pub(crate) fn node(&mut self, at: u64, participant: usize, id: u16, data: &[u8]) {
        self.push(at, Sender::Node(participant), id, data);
    }

    /// A frame of a client.
    pub(crate) fn client(&mut self, at: u64, id: u16, data: &[u8]) {
        self.push(at, Sender::Other, id, data);
    }

    fn push(&mut self, at: u64, sender: Sender, id: u16, data: &[u8]) {
        self.events.push(Event::Frame(Instant(at), sender, Frame::new(id, data).expect("a frame")));
    }

    /// The LSS master lets all nodes use their new bit rate, and ends the frames of the nodes.
    pub(crate) fn activate_bit_timing(&mut self, at: u64, delay: u16) {
        let [low, high] = delay.to_le_bytes();
        self.client(at, 0x7E5, &[21, low, high, 0, 0, 0, 0, 0]);
        self.events.retain(|event| {
            let is_of_node = matches!(event, Event::Frame(_, Sender::Node(_), _));
            !is_of_node || event.at().0 <= at
        });
    }

    /// A request of the client and the answer of node 5, one frame later each; an empty answer means no answer.
    pub(crate) fn ask(&mut self, request: &[u8], answer: &[u8]) {
        self.now += FRAME;
        self.client(self.now, 0x605, request);
        if !answer.is_empty() {
            self.answer(answer);
        }
    }

    pub(crate) fn answer(&mut self, answer: &[u8]) {
        self.now += FRAME;
        self.node(self.now, 0, 0x585, answer);
    }

    /// Sets the time of the next exchange.
    pub(crate) fn at(&mut self, now: u64) -> &mut Trace {
        self.now = now;
        self
    }

    pub(crate) fn read(&mut self, index: u16, sub: u8, value: &[u8]) {
        let [low, high] = index.to_le_bytes();
        let command = 0x43 | (4 - value.len() as u8) << 2;
        let mut answer = vec![command, low, high, sub];
        answer.extend(value);
        answer.resize(8, 0);
        self.ask(&[0x40, low, high, sub, 0, 0, 0, 0], &answer);
    }

    pub(crate) fn write(&mut self, index: u16, sub: u8, value: &[u8]) {
        let [low, high] = index.to_le_bytes();
        let request = download(index, sub, value);
        self.ask(&request, &[0x60, low, high, sub, 0, 0, 0, 0]);
    }

    pub(crate) fn refused(&mut self, index: u16, sub: u8, value: &[u8]) {
        let [low, high] = index.to_le_bytes();
        let request = download(index, sub, value);
        self.ask(&request, &[0x80, low, high, sub, 0x30, 0x00, 0x09, 0x06]);
    }

    /// Changes the data of the frames of an identifier that `is_meant` accepts, from `from` us on; `None` removes them.
    pub(crate) fn edit(
        &mut self,
        from: u64,
        id: u16,
        is_meant: impl Fn(&[u8]) -> bool,
        change: impl Fn(&[u8]) -> Option<Vec<u8>>,
    ) {
        let mut edited = 0;
        self.events.retain_mut(|event| {
            let Event::Frame(at, _, frame) = event else { return true };
            if at.0 < from || frame.id() != id || !is_meant(frame.data()) || edited > 0 {
                return true;
            }
            edited += 1;
            let Some(data) = change(frame.data()) else { return false };
            *frame = Frame::new(id, &data).expect("a frame");
            true
        });
        assert_eq!(edited, 1, "{id:03X}h from {from} us");
    }

    /// Removes all frames of an identifier in a span.
    pub(crate) fn remove(&mut self, span: std::ops::Range<u64>, id: u16) {
        self.events.retain(
            |event| !matches!(event, Event::Frame(at, _, frame) if span.contains(&at.0) && frame.id() == id),
        );
    }

    pub(crate) fn in_order(&self) -> Vec<&Event> {
        let mut events: Vec<&Event> = self.events.iter().collect();
        events.sort_by_key(|event| event.at());
        events
    }
}

/// CRC of the bytes 1 to 10.
const CRC: u16 = 0xCD4B;

fn download(index: u16, sub: u8, value: &[u8]) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let mut request = vec![0x23 | (4 - value.len() as u8) << 2, low, high, sub];
    request.extend(value);
    request.resize(8, 0);
    request
}
