//! The device: the library's own, with the table of a data sheet.

use std::collections::BTreeMap;

use canopen::dictionary::{Dictionary, Entry, Group, Services, Sizes, is_packed};
use canopen::sdo::{Abort, Multiplexer};
use canopen::{
    Action, Application, Condition, Device, Frame, Instant, Job, Next, NodeId, Part, Reset, Soundness,
    Stored, Transmit,
};

use super::rows::Table;
use super::script::{Deed, Script};
use crate::bus::Station;

/// The room of a simulated device.
pub(super) const ROOM: Sizes = Sizes {
    image: 1 << 15,
    tpdos: 64,
    rpdos: 64,
    watches: 64,
    scanned: 0,
    servers: 8,
    services: Services::ALL,
};

/// The longest content of a domain.
const LONGEST: usize = 1 << 20;

/// The EMCY codes that a script can set, with their bits of the error register: the classes of CiA 301, table 26.
const CONDITIONS: [Condition; 22] = [
    of(0x1000, 0),
    of(0x2000, 1),
    of(0x2100, 1),
    of(0x2200, 1),
    of(0x2300, 1),
    of(0x3000, 2),
    of(0x3100, 2),
    of(0x3200, 2),
    of(0x3300, 2),
    of(0x4000, 3),
    of(0x4100, 3),
    of(0x4200, 3),
    of(0x5000, 0),
    of(0x6000, 0),
    of(0x6100, 0),
    of(0x6200, 0),
    of(0x6300, 0),
    of(0x7000, 0),
    of(0x8000, 0),
    of(0x9000, 0),
    of(0xF000, 0),
    of(0xFF00, 7),
];

const fn of(code: u16, bit: u8) -> Condition {
    Condition { register: 1 << bit, ..Condition::new(code) }
}

/// The number of the condition with a code.
pub(super) fn condition(code: u16) -> Option<u8> {
    CONDITIONS.iter().position(|condition| condition.code == code)?.try_into().ok()
}

/// The memory of the device.
struct App {
    dictionary: &'static Dictionary,
    /// Values that the rows do not have as defaults.
    values: Vec<((u16, u8), Vec<u8>)>,
    stored: [Vec<u8>; Group::ALL.len()],
    domains: BTreeMap<(u16, u8), Vec<u8>>,
}

impl App {
    fn set(&self, (index, sub): (u16, u8), bytes: &[u8], image: &mut [u8]) {
        if let Ok(entry) = self.dictionary.find(index, sub) {
            entry.field().set(image, bytes);
        }
    }
}

impl Application for App {
    const CONDITIONS: &'static [Condition] = &CONDITIONS;

    /// Values that a client has stored, or that the reset leaves alone, stay.
    fn initialise(&mut self, reset: Reset, image: &mut [u8]) {
        let is_kept = |(index, sub)| {
            reset == Reset::Communication && index >= 0x2000
                || self.stored.iter().any(|packed| is_packed(packed, index, sub))
        };
        let values = self.values.iter().filter(|(key, _)| !is_kept(*key));
        values.for_each(|(key, bytes)| self.set(*key, bytes, image));
    }

    fn stored(&self, group: Group) -> Stored<'_> {
        let packed = self.stored.get(group as usize).map_or(&[][..], Vec::as_slice);
        Stored { packed, soundness: Soundness::Whole }
    }

    fn read_domain(&self, at: Multiplexer) -> Result<&[u8], Abort> {
        Ok(self.domains.get(&(at.index, at.sub)).map_or(&[], Vec::as_slice))
    }

    fn write_domain(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        let content = self.domains.entry((at.index, at.sub)).or_default();
        match part {
            Part::Begin(_) => content.clear(),
            Part::Data(_, bytes) if content.len() + bytes.len() > LONGEST => return Err(Abort::OutOfMemory),
            Part::Data(_, bytes) => content.extend_from_slice(bytes),
            Part::End(_) => (),
        }
        Ok(())
    }

    fn admits(&self, entry: &Entry) -> Result<(), Abort> {
        // There is no program to stop.
        if entry.index() == 0x1F51 { Err(Abort::DeviceState) } else { Ok(()) }
    }
}

/// A simulated device on a bus.
pub struct Node {
    device: Box<canopen::device!(App, room: ROOM)>,
    script: Script,
    /// The start of the script; `None` before the first call.
    begin: Option<Instant>,
}

impl Node {
    /// A device that has not started. Without a node-ID it waits for LSS.
    #[must_use]
    pub fn new(table: Table, node: Option<NodeId>) -> Node {
        let Table { dictionary, values, .. } = table;
        let (stored, domains) = (<[Vec<u8>; Group::ALL.len()]>::default(), BTreeMap::new());
        let app = App { dictionary, values, stored, domains };
        let device = Box::new(Device::new(dictionary, node, app));
        Node { device, script: Script::default(), begin: None }
    }

    /// Runs a script from the start of the device on.
    #[must_use]
    pub fn with_script(mut self, script: Script) -> Node {
        self.script = script;
        self
    }

    /// Sets a value as the device itself does, whatever the access. It is there after each reset.
    pub fn set(&mut self, at: Multiplexer, bytes: &[u8]) {
        self.device.show(|app, image| {
            app.values.retain(|(key, _)| *key != (at.index, at.sub));
            app.values.push(((at.index, at.sub), bytes.to_vec()));
            app.set((at.index, at.sub), bytes, image);
        });
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> canopen::nmt::State {
        self.device.state()
    }

    /// The node-ID in use.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        self.device.node_id()
    }

    /// Switches the device off and on: it boots at its next call.
    pub fn restart(&mut self) {
        self.begin = None;
    }

    /// Carries out the actions of the device, and returns its next deadline.
    fn follow(&mut self, mut next: Next, now: Instant, out: &mut impl Transmit) -> Instant {
        while let Some(action) = next.action {
            next = match action {
                Action::ResetNode | Action::ResetCommunication => self.boot(now, out),
                Action::Store(job) => {
                    self.store(job);
                    let _ = self.device.finish(Ok(()), now, out);
                    self.device.poll(now, out)
                }
                Action::Identifiers | Action::BitRate(_) | Action::Bootloader => self.device.poll(now, out),
            };
        }
        next.due()
    }

    fn boot(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let _ = self.device.start(now, out);
        let _ = self.device.publish(now, out, |_, _| ());
        self.device.poll(now, out)
    }

    fn store(&mut self, job: Job) {
        let (groups, keeps) = match job {
            Job::Store(groups) => (groups, true),
            Job::Restore(groups) => (groups, false),
            Job::Configure(_) | Job::Setting(_) => return,
        };
        let (node, mut buffer) = (self.device.node_id(), vec![0; 2 * ROOM.image]);
        for group in groups.iter() {
            let dictionary = self.device.application().dictionary;
            let len = dictionary.pack(group, node, self.device.image(), &mut buffer).unwrap_or(0);
            let packed = if keeps { buffer[..len].to_vec() } else { Vec::new() };
            if let Some(stored) = self.device.application_mut().stored.get_mut(group as usize) {
                *stored = packed;
            }
        }
    }

    /// Does what the script has for this time. Returns the time of its next line.
    fn play(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let begin = *self.begin.get_or_insert(now);
        while let Some(deed) = self.script.due(now, begin) {
            match deed {
                Deed::Value(at, bytes) => {
                    let _ = self
                        .device
                        .publish(now, out, |app, image| app.set((at.index, at.sub), &bytes, image));
                    self.send_by_timer(at, now, out);
                }
                Deed::Fault(condition) => {
                    let _ = self.device.set_condition(condition, true, now);
                }
                Deed::NoFault => {
                    for condition in 0..CONDITIONS.len() {
                        let condition = u8::try_from(condition).unwrap_or(u8::MAX);
                        let _ = self.device.set_condition(condition, false, now);
                    }
                }
            }
        }
        self.script.next(begin)
    }

    /// Sends the TPDOs of type 254 that carry a changed value: the library leaves their events to the device.
    fn send_by_timer(&mut self, at: Multiplexer, now: Instant, out: &mut impl Transmit) {
        for pdo in 0x1800..0x1A00_u16 {
            let (dictionary, image) = (self.device.application().dictionary, self.device.image());
            let number = |index, sub| {
                let entry = dictionary.find(index, sub).ok()?;
                Some(
                    entry
                        .field()
                        .get(image)
                        .iter()
                        .rev()
                        .fold(0_u32, |sum, byte| sum << 8 | u32::from(*byte)),
                )
            };
            let carries = |slot: u8| number(pdo | 0x200, slot).is_some_and(|value| value >> 8 == key(at));
            let count = number(pdo | 0x200, 0).unwrap_or(0);
            if number(pdo, 2) == Some(254) && (1..=64).any(|slot| u32::from(slot) <= count && carries(slot)) {
                let _ = self.device.send_tpdo(pdo - 0x1800 + 1, now, out);
            }
        }
    }
}

/// Index and sub-index as a mapping entry has them.
fn key(at: Multiplexer) -> u32 {
    u32::from(at.index) << 8 | u32::from(at.sub)
}

impl Station for Node {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let next = self.device.on_frame(frame, now, out);
        self.follow(next, now, out);
        let next = self.device.publish(now, out, |_, _| ());
        self.follow(next, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if self.begin.is_none() {
            self.begin = Some(now);
            let next = self.boot(now, out);
            self.follow(next, now, out);
        }
        let script = self.play(now, out);
        let next = self.device.poll(now, out);
        self.follow(next, now, out).min(script)
    }
}
