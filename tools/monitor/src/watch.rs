//! The monitor itself: devices, senders and the breaches so far.

use std::collections::{BTreeMap, BTreeSet};

use canopen::lss::Request;
use canopen::{Duration, Frame, Instant};

use crate::bus::Bus;
use crate::device::{Device, LSS_RESPONSE};
use crate::pdo::Times;
use crate::values::Scope;
use crate::{Breach, Findings, Key, Rule, Sheet};

const LSS_REQUEST: u16 = 0x7E5;
/// Breaches that are kept.
const KEPT: usize = 1000;

/// The sender of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    /// A node, by its position on the bus.
    Node(usize),
    /// A participant that is not judged: a master, a tool, foreign traffic.
    Other,
    /// Not known: the node follows from the CAN-ID.
    Unknown,
}

/// An incident that the bus does not show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// The node is switched on, or loses its power and gets it again.
    PowerOn,
    /// The node is switched off.
    PowerOff,
    /// The caller starts the node again: the next boot-up message has a reason.
    Restart,
    /// The program has reset the chip.
    SoftwareReset,
    /// A watchdog or a fault has reset the chip.
    ChipReset,
    /// A test may have changed the board: the next reset of the chip has a reason.
    Touched,
    /// A test has injected a fault, or has changed the flash: everything may happen until the next boot-up message.
    Injected,
}

/// Judges the traffic of a bus.
#[derive(Debug)]
pub struct Monitor {
    now: Instant,
    bus: Bus,
    devices: Vec<Device>,
    /// The nodes that are judged; `None` for all.
    judged: Option<BTreeSet<u8>>,
    /// The node that has sent a CAN-ID first.
    senders: BTreeMap<u16, usize>,
    breaches: Vec<Breach>,
    frames: u64,
}

impl Default for Monitor {
    fn default() -> Monitor {
        Monitor::new()
    }
}

impl Monitor {
    /// A monitor of a bus whose bit rate it estimates from the traffic.
    #[must_use]
    pub fn new() -> Monitor {
        Monitor {
            now: Instant(0),
            bus: Bus::new(),
            devices: Vec::new(),
            judged: None,
            senders: BTreeMap::new(),
            breaches: Vec::new(),
            frames: 0,
        }
    }

    /// Sets the bit rate in bit/s.
    pub fn set_bit_rate(&mut self, bits_per_second: u32) {
        self.bus.set_bit_rate(bits_per_second);
    }

    /// There is no bus: frames take no time, and nothing delays them.
    #[must_use]
    pub fn without_bus(mut self) -> Monitor {
        self.bus.remove();
        self
    }

    /// Judges only these nodes.
    pub fn judge(&mut self, nodes: impl IntoIterator<Item = u8>) {
        self.judged = Some(nodes.into_iter().collect());
    }

    /// The data sheet of a participant. `is_new`: nothing is saved in the node.
    pub fn set_sheet(&mut self, participant: usize, sheet: Sheet, is_new: bool) {
        let device = self.participant(participant);
        self.devices[device].values.set_sheet(sheet, is_new);
    }

    /// Whether a participant has a data sheet: a change of its personality ends it.
    #[must_use]
    pub fn has_sheet(&self, participant: usize) -> bool {
        let mut devices = self.devices.iter();
        devices.any(|device| device.participant == Some(participant) && device.values.sheet().is_some())
    }

    /// The data sheet of the node with this node-ID. `is_new`: nothing is saved in the node, so it has the defaults of
    /// the data sheet; otherwise they apply after a restore only.
    pub fn set_sheet_of_node(&mut self, node: u8, sheet: Sheet, is_new: bool) {
        let device = self.device_of_node(node);
        self.devices[device].values.set_sheet(sheet, is_new);
    }

    /// The node-ID of a participant before its boot-up message.
    pub fn set_node_id(&mut self, participant: usize, node: u8) {
        let device = self.participant(participant);
        self.devices[device].set_id(node);
    }

    /// A frame that ended at `at`. Times do not decrease.
    pub fn frame(&mut self, at: Instant, frame: &Frame, sender: Sender) {
        self.advance(at);
        self.frames += 1;
        let device = self.sender(frame, sender);
        if self.bus.take(at, frame, device) {
            return;
        }
        match device {
            Some(device) => self.node_frame(device, at, frame),
            None => self.client_frame(at, frame),
        }
    }

    /// A frame that began at `start` has failed for its sender, which sends it again. Others may have received it, and get
    /// it twice then.
    pub fn failed(&mut self, start: Instant, frame: &Frame, sender: Sender) {
        if let Some(device) = self.sender(frame, sender) {
            self.bus.failed(start, frame, device);
        }
    }

    /// Time passes.
    pub fn advance(&mut self, now: Instant) {
        self.now = self.now.max(now);
        for own in 0..self.devices.len() {
            let mut findings = Findings::new();
            self.devices[own].advance(own, self.now, &self.bus, &mut findings);
            self.report(own, findings);
        }
    }

    /// An incident of a participant.
    pub fn incident(&mut self, at: Instant, participant: usize, incident: Incident) {
        self.advance(at);
        let own = self.participant(participant);
        let device = &mut self.devices[own];
        let was_injected = device.is_injected();
        self.bus.forget_failed(own);
        match incident {
            Incident::Restart => device.may_restart(),
            Incident::Touched => device.touch(),
            Incident::PowerOn | Incident::PowerOff | Incident::SoftwareReset => {
                device.restart(Scope::All, at);
            }
            Incident::ChipReset => {
                let was_touched = device.chip_reset(at);
                if !was_injected && !was_touched {
                    let text = "the chip was reset by a watchdog or a fault".to_owned();
                    self.report(own, vec![(Rule::UnexpectedReset, text)]);
                }
            }
            Incident::Injected => {
                device.values.forget_saved();
                device.inject();
            }
        }
    }

    /// The next deadline that a participant has returned at `now`.
    pub fn deadline(&mut self, now: Instant, participant: usize, next: Instant) {
        if next <= now {
            let own = self.participant(participant);
            let text = format!("the next deadline is {} us, the time is {} us", next.0, now.0);
            self.now = self.now.max(now);
            self.report(own, vec![(Rule::Deadline, text)]);
        }
    }

    /// A value of a participant that was read without the bus.
    pub fn value(&mut self, at: Instant, participant: usize, key: Key, bytes: &[u8]) {
        let own = self.participant(participant);
        let mut findings = Findings::new();
        self.now = self.now.max(at);
        self.devices[own].known(key, bytes, at, &mut findings);
        self.report(own, findings);
    }

    /// The caller has not served the nodes until now: the rules about time restart.
    pub fn resume(&mut self, now: Instant) {
        self.now = self.now.max(now);
        self.devices.iter_mut().for_each(|device| device.resume(now));
    }

    /// Whether the value of an object before a download decides a rule, and the SDO server of the participant is free: to
    /// be asked before the download is passed to the monitor.
    #[must_use]
    pub fn is_wanted_before(&self, participant: usize, key: Key) -> bool {
        let device = self.devices.iter().find(|device| device.participant == Some(participant));
        device.is_some_and(|device| device.is_wanted_before(key))
    }

    /// The objects of a participant whose values decide a rule. A caller that can read them without the bus passes them
    /// to [`value`](Monitor::value). Empty while the SDO server is busy.
    pub fn wishes(&mut self, participant: usize) -> Vec<Key> {
        let own = self.participant(participant);
        self.devices[own].wishes()
    }

    /// The node-ID of a participant, once it is known.
    #[must_use]
    pub fn node_id(&self, participant: usize) -> Option<u8> {
        self.devices.iter().find(|device| device.participant == Some(participant))?.id
    }

    /// The breaches so far.
    #[must_use]
    pub fn breaches(&self) -> &[Breach] {
        &self.breaches
    }

    /// Takes the breaches out of the monitor.
    pub fn take_breaches(&mut self) -> Vec<Breach> {
        std::mem::take(&mut self.breaches)
    }

    /// Number of frames so far.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The node-IDs of the nodes that were seen.
    pub fn nodes(&self) -> impl Iterator<Item = u8> + '_ {
        self.devices.iter().filter_map(|device| device.id)
    }

    fn participant(&mut self, participant: usize) -> usize {
        let found = self.devices.iter().position(|device| device.participant == Some(participant));
        found.unwrap_or_else(|| {
            self.devices.push(Device::new(Some(participant)));
            self.devices.len() - 1
        })
    }

    fn device_of_node(&mut self, node: u8) -> usize {
        self.devices.iter().position(|device| device.id == Some(node)).unwrap_or_else(|| {
            let mut device = Device::new(None);
            device.set_id(node);
            self.devices.push(device);
            self.devices.len() - 1
        })
    }

    /// The device that has sent a frame; `None` for a client.
    fn sender(&mut self, frame: &Frame, sender: Sender) -> Option<usize> {
        match sender {
            Sender::Other => None,
            Sender::Node(participant) => {
                let own = self.participant(participant);
                let (id, device) = (frame.id(), &mut self.devices[own]);
                if (0x701..0x780).contains(&id) && frame.data() == [0] {
                    device.set_id((id - 0x700) as u8);
                }
                Some(own)
            }
            Sender::Unknown => self.sender_by_id(frame),
        }
    }

    fn sender_by_id(&mut self, frame: &Frame) -> Option<usize> {
        let id = frame.id();
        if frame.is_remote() {
            return None;
        }
        let known = self.devices.iter().position(|device| device.is_sender(id));
        let node = (id & 0x7F) as u8;
        known.or_else(|| {
            let is_own = matches!(id & 0x780, 0x080 | 0x580 | 0x700) && node != 0;
            (is_own && self.is_judged(node)).then(|| self.device_of_node(node))
        })
    }

    fn is_judged(&self, node: u8) -> bool {
        self.judged.as_ref().is_none_or(|judged| judged.contains(&node))
    }

    fn node_frame(&mut self, own: usize, at: Instant, frame: &Frame) {
        let start = self.bus.recent.back().map_or(0.0, |passed| passed.start);
        let times = Times {
            at,
            start,
            wait: self.bus.wait(),
            is_real: self.bus.is_real(),
            frame: self.bus.longest(),
        };
        let mut findings = Findings::new();
        self.devices[own].frame(frame, times, &mut findings);
        self.check_id(own, frame.id(), &mut findings);
        self.report(own, findings);
        // A node may produce SYNC.
        self.others(at, frame);
    }

    /// The CAN-ID is the node's, and no other node sends it.
    fn check_id(&mut self, own: usize, id: u16, findings: &mut Findings) {
        let device = &self.devices[own];
        if device.participant.is_none() || device.is_injected() {
            return;
        }
        if device.owns(id) == Some(false) {
            findings.push((Rule::CanId, format!("{id:03X}h is none of its CAN-IDs")));
            return;
        }
        let first = *self.senders.entry(id).or_insert(own);
        let is_shared = first != own && id != LSS_RESPONSE && self.devices[first].owns(id) != Some(false);
        if is_shared {
            let other = self.devices[first].id.unwrap_or(0);
            findings.push((Rule::CanId, format!("{id:03X}h is sent by node {other} too")));
        } else {
            self.senders.insert(id, own);
        }
    }

    fn client_frame(&mut self, at: Instant, frame: &Frame) {
        let (id, data) = (frame.id(), frame.data());
        match id {
            0 => {
                if let [command, node] = *data {
                    let all = self.devices.iter_mut();
                    all.filter(|device| node == 0 || device.id.is_none_or(|id| id == node))
                        .for_each(|device| device.command(command, at));
                }
            }
            LSS_REQUEST => match data.try_into().ok().and_then(Request::parse) {
                Some(Request::Activate { delay }) => {
                    // The delay passes before and after the change.
                    let until = at + Duration::from_millis(2 * u64::from(delay));
                    self.devices.iter_mut().for_each(|device| device.retunes(until));
                }
                _ => self.devices.iter_mut().for_each(Device::lss),
            },
            0x601..=0x67F if !frame.is_remote() => {
                let node = (id - 0x600) as u8;
                self.devices.iter_mut().for_each(|device| device.request(node, data, at));
            }
            _ => self.others(at, frame),
        }
    }

    /// SYNC.
    fn others(&mut self, at: Instant, frame: &Frame) {
        if !frame.is_remote() && frame.len() <= 1 {
            self.devices.iter_mut().for_each(|device| device.sync(frame.id(), at));
        }
    }

    fn report(&mut self, own: usize, findings: Findings) {
        let device = &self.devices[own];
        let is_judged = device.id.is_none_or(|node| self.is_judged(node));
        if findings.is_empty() || !is_judged {
            return;
        }
        let frames = self.bus.frames_of(own, device.id);
        for (rule, text) in findings {
            if self.breaches.len() < KEPT {
                let frames = frames.clone();
                self.breaches.push(Breach { rule, node: device.id, at: self.now, text, frames });
            }
        }
    }

    /// The end of the traffic: reads that no EMCY has explained are reported.
    pub fn end(&mut self) {
        let end = self.now + Duration::from_millis(200);
        for own in 0..self.devices.len() {
            let mut findings = Findings::new();
            self.devices[own].end(end, &mut findings);
            self.report(own, findings);
        }
    }
}
