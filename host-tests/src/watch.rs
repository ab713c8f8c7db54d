//! The monitor on the bus of a test: ends the test at the first breach of a rule.
//!
//! A test that provokes a breach names it ([`expects`]); a name that is not needed ends the test too.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::Write as _;

use canopen::{Frame, Instant, QueueFull, Transmit};
use monitor::{Breach, Incident, Initial, Key, Monitor, Rule, Sender, Sheet};
use node::{FAULTS, Personality};
use profiles::fault::Flags;

thread_local! {
    /// The breaches that the test of this thread provokes, and whether they were noticed.
    static EXPECTED: RefCell<BTreeMap<Rule, bool>> = const { RefCell::new(BTreeMap::new()) };
    /// The expected breaches that were noticed.
    static NOTICED: RefCell<Vec<Breach>> = const { RefCell::new(Vec::new()) };
}

/// Until this value is dropped, the test provokes breaches of these rules.
#[derive(Debug)]
#[must_use = "the breaches are expected as long as this value lives"]
pub struct Expected(Vec<Rule>);

/// Names the rules that the test breaks from now on, in all buses of this thread.
pub fn expects(rules: impl Into<Vec<Rule>>) -> Expected {
    let rules = rules.into();
    EXPECTED.with_borrow_mut(|expected| expected.extend(rules.iter().map(|rule| (*rule, false))));
    Expected(rules)
}

/// The expected breaches that were noticed since the last call.
#[must_use]
pub fn noticed() -> Vec<Breach> {
    NOTICED.take()
}

impl Drop for Expected {
    fn drop(&mut self) {
        let unused = EXPECTED.with_borrow_mut(|expected| {
            let unused = self.0.iter().filter(|rule| expected.remove(rule) == Some(false));
            unused.map(|rule| rule.name()).collect::<Vec<_>>()
        });
        assert!(std::thread::panicking() || unused.is_empty(), "expected and not noticed: {unused:?}");
    }
}

/// A monitor that enforces its rules.
#[derive(Debug)]
pub struct Watch {
    monitor: Monitor,
    /// Values are read beside the bus.
    reads: bool,
    /// The names of the expected rules, for the count of tests.
    named: Vec<&'static str>,
}

impl Watch {
    /// Watches a bus with this bit rate in bit/s.
    #[must_use]
    pub fn of_bus(bits_per_second: u32) -> Watch {
        let mut monitor = Monitor::new();
        monitor.set_bit_rate(bits_per_second);
        Watch { monitor, reads: true, named: Vec::new() }
    }

    /// Watches a node without a bus.
    #[must_use]
    pub fn without_bus() -> Watch {
        Watch { monitor: Monitor::new().without_bus(), reads: true, named: Vec::new() }
    }

    /// Reads no values beside the bus: for a test in which the SDO server must see the requests of the test only.
    pub fn read_nothing(&mut self) {
        self.reads = false;
    }

    /// Feeds the monitor.
    ///
    /// # Panics
    /// At a breach that the test does not expect.
    pub fn feed<R>(&mut self, feed: impl FnOnce(&mut Monitor) -> R) -> R {
        let result = feed(&mut self.monitor);
        self.enforce();
        result
    }

    /// The monitor, for settings.
    pub fn monitor(&mut self) -> &mut Monitor {
        &mut self.monitor
    }

    fn enforce(&mut self) {
        if self.monitor.breaches().is_empty() {
            return;
        }
        for breach in self.monitor.take_breaches() {
            let is_expected = EXPECTED.with_borrow_mut(|expected| match expected.get_mut(&breach.rule) {
                Some(is_noticed) => {
                    *is_noticed = true;
                    true
                }
                None => false,
            });
            assert!(is_expected, "the monitor reports a breach:\n{breach}");
            let name = breach.rule.name();
            if !self.named.contains(&name) {
                self.named.push(name);
            }
            NOTICED.with_borrow_mut(|noticed| noticed.push(breach));
        }
    }

    /// A frame on the bus.
    pub fn frame(&mut self, at: Instant, frame: &Frame, sender: Sender) {
        self.feed(|monitor| monitor.frame(at, frame, sender));
    }

    /// An incident of a board.
    pub fn incident(&mut self, at: Instant, participant: usize, incident: Incident) {
        self.feed(|monitor| monitor.incident(at, participant, incident));
    }

    /// Reads the object of a download before the node gets its request.
    pub fn probe_before(
        &mut self,
        at: Instant,
        participant: usize,
        request: &Frame,
        mut ask: impl FnMut(&Frame, &mut Answers),
    ) {
        let &[command, low, high, sub, ..] = request.data() else { return };
        let key = (u16::from_le_bytes([low, high]), sub);
        let is_download = command >> 5 == 1 || command & 0xE1 == 0xC0;
        let Some(node) = self.monitor.node_id(participant) else { return };
        let is_request = is_download && request.id() == 0x600 + u16::from(node);
        if !is_request || !self.reads || !self.monitor.is_wanted_before(participant, key) {
            return;
        }
        if let Some(value) = read(node, key, &mut ask) {
            self.feed(|monitor| monitor.value(at, participant, key, &value));
        }
    }

    /// Reads the values that decide a rule from the SDO server of a node, beside the bus: `ask` passes a request to
    /// the server and its answers to the queue.
    pub fn probe(&mut self, at: Instant, participant: usize, mut ask: impl FnMut(&Frame, &mut Answers)) {
        let wishes = if self.reads { self.monitor.wishes(participant) } else { Vec::new() };
        for key in wishes {
            let Some(node) = self.monitor.node_id(participant) else { return };
            if let Some(value) = read(node, key, &mut ask) {
                self.feed(|monitor| monitor.value(at, participant, key, &value));
            }
        }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.monitor.end();
            self.enforce();
        }
        if let Some(path) = std::env::var_os("MONITOR_LOG") {
            let test = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
            let test = test.or_else(|| Some(std::thread::current().name()?.to_owned())).unwrap_or_default();
            let line = format!("{test}\t{}\t{}\n", self.monitor.frames(), self.named.join(","));
            let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
            // The count is a by-product: a test does not fail for it.
            let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
        }
    }
}

/// The answers of an SDO server beside the bus.
#[derive(Debug, Default)]
pub struct Answers(Vec<Frame>);

impl Transmit for Answers {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

/// Reads a value of at most four bytes; `None` for any other.
fn read(node: u8, (index, sub): Key, ask: &mut impl FnMut(&Frame, &mut Answers)) -> Option<Vec<u8>> {
    let [low, high] = index.to_le_bytes();
    let node = u16::from(node);
    let mut request = |command: u8| {
        let mut answers = Answers::default();
        let data = [command, low, high, sub, 0, 0, 0, 0];
        ask(&Frame::new(0x600 + node, &data).expect("a frame"), &mut answers);
        answers.0.into_iter().find(|frame| frame.id() == 0x580 + node)
    };
    let answer = request(0x40)?;
    let &[command, _, _, _, ref value @ ..] = answer.data() else { return None };
    if command & 0xF3 == 0x43 {
        return Some(value[..4 - usize::from(command >> 2 & 3)].to_vec());
    }
    if command >> 5 == 2 {
        request(0x80);
    }
    None
}

/// The data sheet of a personality.
#[must_use]
pub fn sheet(personality: Personality) -> Sheet {
    let mut sheet = Sheet::of_node(personality.rows());
    // The choice of virtual devices of a lift switches on PDOs that are off by default.
    let is_off = |initial: &Initial| matches!(initial, Initial::Bytes(bytes) if bytes.last() >= Some(&0x80));
    let pdos = sheet.entries.range_mut((0x1800, 0)..(0x1A00, 0)).filter(|(key, _)| key.1 == 1);
    for (_, entry) in pdos.filter(|(_, entry)| personality == Personality::Lift && is_off(&entry.initial)) {
        entry.initial = Initial::Unknown;
    }
    sheet.communication_errors = vec![0x8130, 0x8140];
    // The flags of 3000h, and stored data that could not be loaded.
    let flagged = FAULTS.iter().filter(|fault| fault.flags != Flags::NONE);
    sheet.device_errors = flagged.map(|fault| fault.condition.code).chain([0x6300, 0x6302, 0x6303]).collect();
    sheet
}
