//! One node: the rules that need more than one service.

use canopen::nmt::State;
use canopen::{Duration, Frame, Instant};

use crate::boot::Boot;
use crate::bus::Bus;
use crate::errors::Errors;
use crate::heartbeat::Heartbeat;
use crate::nmt::Nmt;
use crate::pdo::{self, Pdos, Times};
use crate::sdo::{Channel, Event};
use crate::sheet::PERSONALITY;
use crate::values::{Scope, Values};
use crate::{Findings, Key, Rule};

/// NMT commands that restart a node.
const RESET_NODE: u8 = 129;
const RESET_COMMUNICATION: u8 = 130;
/// The response of an LSS slave.
pub(crate) const LSS_RESPONSE: u16 = 0x7E4;
/// Objects that start and stop programs (CiA 302-3), and object 2002h of this project, which ends a trial.
const PROGRAM: [u16; 5] = [0x1F50, 0x1F51, 0x1F56, 0x1F57, 0x2002];

/// A node.
#[derive(Debug)]
pub(crate) struct Device {
    /// Position among the participants of the bus; `None` if the sender of a frame is not known.
    pub(crate) participant: Option<usize>,
    pub(crate) id: Option<u8>,
    /// Faults are injected: the rules about time and resets are off until the next boot-up message.
    is_injected: bool,
    /// A test may have changed the board since its last reset.
    is_touched: bool,
    pub(crate) values: Values,
    nmt: Nmt,
    heartbeat: Heartbeat,
    boot: Boot,
    errors: Errors,
    pdos: Pdos,
    channel: Channel,
    /// The requests before the boot-up message.
    early: Vec<(u8, [u8; 8])>,
    /// A value may be to be confirmed.
    is_wishful: bool,
    /// The node changes its bit rate, and is silent until then. It may have left this bus.
    retunes_until: Option<Instant>,
}

impl Device {
    pub(crate) fn new(participant: Option<usize>) -> Device {
        Device {
            participant,
            id: None,
            is_injected: false,
            is_touched: false,
            values: Values::default(),
            nmt: Nmt::default(),
            heartbeat: Heartbeat::default(),
            boot: Boot::default(),
            errors: Errors::default(),
            pdos: Pdos::default(),
            channel: Channel::new(),
            early: Vec::new(),
            is_wishful: false,
            retunes_until: None,
        }
    }

    pub(crate) fn set_id(&mut self, id: u8) {
        self.id = Some(id);
        self.values.set_node_id(id);
    }

    /// Takes a command of the NMT master.
    pub(crate) fn command(&mut self, command: u8, now: Instant) {
        match command {
            RESET_NODE => self.restart(Scope::All, now),
            RESET_COMMUNICATION => self.restart(Scope::Communication, now),
            _ => {
                self.nmt.command(command, now);
                self.pdos.restart();
            }
        }
    }

    /// The node restarts by a command, by its power supply, or by a reset of its chip.
    pub(crate) fn restart(&mut self, scope: Scope, now: Instant) {
        self.boot.restarts(now);
        self.values.reset(scope);
        self.nmt.restart();
        self.heartbeat.pause();
        self.errors.forget();
        self.pdos.restart();
        self.channel.give_up();
    }

    /// The caller starts the node again.
    pub(crate) fn may_restart(&mut self) {
        self.boot.may_restart();
    }

    /// A test may change the board.
    pub(crate) fn touch(&mut self) {
        self.is_touched = true;
    }

    /// The chip is reset by a watchdog or a fault. Returns whether a test may have changed the board before.
    pub(crate) fn chip_reset(&mut self, now: Instant) -> bool {
        self.restart(Scope::All, now);
        std::mem::take(&mut self.is_touched)
    }

    /// LSS may change the node-ID or the bit rate.
    pub(crate) fn lss(&mut self) {
        self.boot.may_restart();
    }

    /// The bit rate changes: the node is silent until then, and no rule applies before its next frame.
    pub(crate) fn retunes(&mut self, until: Instant) {
        self.boot.may_restart();
        self.heartbeat.pause();
        self.channel.give_up();
        self.retunes_until = Some(until);
    }

    /// A fault is injected: everything may happen until the node boots again.
    pub(crate) fn inject(&mut self) {
        self.is_injected = true;
        self.boot.may_restart();
        self.heartbeat.pause();
        self.channel.give_up();
    }

    pub(crate) fn is_injected(&self) -> bool {
        self.is_injected
    }

    pub(crate) fn resume(&mut self, now: Instant) {
        self.heartbeat.resume(now);
        self.channel.resume(now);
        self.errors.resume(now);
    }

    /// The objects whose values decide a rule; empty while the SDO server is busy.
    pub(crate) fn wishes(&mut self) -> Vec<Key> {
        let is_served = self.nmt.state().is_some_and(State::has_services) && !self.boot.is_waiting();
        if !is_served || !self.is_wishful {
            return Vec::new();
        }
        if !self.channel.is_idle() {
            return Vec::new();
        }
        self.is_wishful = false;
        let class = self.nmt.demands().filter(|class| self.values.sure_number(0x1029, *class).is_none());
        self.values.unconfirmed().chain(class.map(|class| (0x1029, class))).collect()
    }

    /// Whether the value of an object before a download decides a rule, and the SDO server is free.
    pub(crate) fn is_wanted_before(&self, key: Key) -> bool {
        self.values.holds_value(key)
            && self.channel.is_idle()
            && self.nmt.state().is_some_and(State::has_services)
            && !self.boot.is_waiting()
    }

    /// Checks what should have happened by now.
    pub(crate) fn advance(&mut self, own: usize, now: Instant, bus: &Bus, findings: &mut Findings) {
        if self.is_injected {
            return;
        }
        let inhibit = self.emcy_inhibit();
        self.errors.advance(inhibit, now, findings);
        let Some(id) = self.id.filter(|_| self.retunes_until.is_none()) else { return };
        let period = Duration::from_millis(self.values.sure_number(0x1017, 0).unwrap_or(0).into());
        if let Some((from, to)) = self.heartbeat.overdue(period, now)
            && (!bus.is_real() || bus.has_room(own, 0x700 + u16::from(id), from, to))
        {
            let room = bus.room(own, 0x700 + u16::from(id), from, to) / 1000.0;
            let text = format!("none in 1.5 of {} ms", period.0 / 1000);
            let text = if bus.is_real() { format!("{text}, {room:.1} ms were free") } else { text };
            findings.push((Rule::HeartbeatLate, text));
        }
        if let Some(((index, sub), since)) = self.channel.overdue(now) {
            self.channel.give_up();
            let is_served = self.nmt.state().is_some_and(State::has_services) && !self.boot.is_waiting();
            let acts = PROGRAM.contains(&index);
            let id = 0x580 + u16::from(id);
            if is_served && !acts && (!bus.is_real() || bus.has_room(own, id, since, now)) {
                findings.push((Rule::SdoSilent, format!("{index:04X}h:{sub} is not answered in 1 s")));
            }
        }
    }

    /// The end of the traffic.
    pub(crate) fn end(&mut self, now: Instant, findings: &mut Findings) {
        let inhibit = self.emcy_inhibit();
        self.errors.advance(inhibit, now, findings);
    }

    /// The SDO request of a client to the node with this node-ID. Before a boot-up message, the node may miss it, or
    /// answer after the message.
    pub(crate) fn request(&mut self, node: u8, data: &[u8], now: Instant) {
        if self.id.is_some_and(|id| id != node) || self.retunes_until.is_some() {
            return;
        }
        let is_running = self.id.is_some() && !self.boot.is_waiting();
        if is_running {
            self.take_request(data, now);
        }
        if !is_running || self.boot.may_be_starting() {
            self.early.extend(data.try_into().ok().map(|data| (node, data)));
        }
    }

    fn take_request(&mut self, data: &[u8], now: Instant) {
        self.is_wishful = true;
        if let Some(Event::Begins(key, value)) = self.channel.request(data, now) {
            self.values.begins(key, value.as_deref());
            if PROGRAM.contains(&key.0) {
                self.boot.may_restart();
                self.boot.is_updated();
                self.heartbeat.pause();
            }
        }
    }

    pub(crate) fn sync(&mut self, id: u16, now: Instant) {
        if self.values.number(0x1005, 0).unwrap_or(0x80) & 0x7FF == id.into() {
            self.pdos.sync(&self.values, now);
        }
    }

    /// A value that was read without the bus.
    pub(crate) fn known(&mut self, key: Key, bytes: &[u8], now: Instant, findings: &mut Findings) {
        self.on_event(Event::Read(key, bytes.to_vec()), now, findings);
    }

    fn on_event(&mut self, event: Event, now: Instant, findings: &mut Findings) {
        match event {
            Event::Read((0x1001, 0), bytes) => {
                if let Some(register) = bytes.first() {
                    self.errors.read_register(*register, now);
                }
            }
            Event::Read((0x1003, sub), bytes) => {
                let value = bytes.iter().rev().fold(0_u32, |value, byte| value << 8 | u32::from(*byte));
                self.errors.read_list(sub, value, now);
            }
            Event::Read(key, bytes) => self.values.read(key, &bytes, findings),
            Event::Written((0x1003, 0), _) => self.errors.cleared(),
            Event::Written(key, bytes) => {
                let was_off =
                    self.values.number(key.0, 1).is_none_or(|cob_id| cob_id & 1 << 31 != 0) && key.1 == 1;
                self.values.written(key, &bytes);
                match key.0 {
                    0x1017 => self.heartbeat.begin(now),
                    0x1800..=0x19FF => self.pdos.configured(key.0, key.1, was_off),
                    // Another data sheet applies after the next reset.
                    PERSONALITY => self.values.forget_sheet(),
                    _ => (),
                }
            }
            Event::Aborted(key, tried) => self.values.aborted(key, &tried),
            Event::Begins(..) => (),
        }
    }

    /// A frame of the node.
    pub(crate) fn frame(&mut self, frame: &Frame, times: Times, findings: &mut Findings) {
        let (id, at) = (frame.id(), times.at);
        // A frame from before the change may have been in a mailbox.
        self.retunes_until.take_if(|until| at > *until);
        let node = self.id.map(u16::from);
        let is_boot_up = node.is_some_and(|node| id == 0x700 + node) && frame.data() == [0];
        if is_boot_up {
            return self.boot_up(at, findings);
        }
        if !self.is_injected && id != LSS_RESPONSE {
            let start = Instant(times.start.max(0.0) as u64);
            self.boot.other_frame(start, Duration(times.frame as u64), findings);
        }
        let Some(node) = node.filter(|_| !frame.is_remote()) else { return };
        if id == 0x700 + node {
            self.on_heartbeat(frame.data(), at, findings);
        } else if id == 0x580 + node {
            self.early.clear();
            self.nmt.sdo(findings);
            if let Some(event) = self.channel.response(frame.data(), findings) {
                self.on_event(event, at, findings);
            }
        } else if self.emcy_id() == Some(id) {
            self.emcy(frame.data(), times, findings);
        } else if let Some(known) = pdo::with_id(&self.values, id) {
            self.nmt.pdo(at, findings);
            self.pdos.frame(known, &self.values, frame, times, findings);
        }
    }

    fn boot_up(&mut self, at: Instant, findings: &mut Findings) {
        if self.boot.boot_up(self.is_injected, findings) && self.nmt.state().is_some() {
            // A restart without a command that the monitor has seen.
            self.values.reset(Scope::All);
            self.pdos.restart();
            self.nmt.restart();
        }
        self.is_injected = false;
        self.channel.reset();
        let id = self.id;
        let early = self.early.drain(..).filter(|(node, _)| Some(*node) == id);
        let early: Vec<_> = early.filter(|(_, request)| !self.channel.is_stray(request[0])).collect();
        match early.as_slice() {
            [] => (),
            // The answer has no deadline.
            [(_, request)] => self.take_request(request, Instant::NEVER),
            _ => self.channel.give_up(),
        }
        self.is_wishful = true;
        let starts_itself = self.values.sure_number(0x1F80, 0).is_none_or(|start| start != 0);
        self.nmt.boot_up(starts_itself);
        self.errors.boot_up(self.values.sheet().is_some_and(|sheet| sheet.forgets_errors));
        if self.boot.is_updating() {
            self.heartbeat.pause();
        } else {
            self.heartbeat.begin(at);
        }
    }

    fn on_heartbeat(&mut self, data: &[u8], at: Instant, findings: &mut Findings) {
        self.heartbeat.begin(at);
        let &[code] = data else {
            findings.push((Rule::NmtState, format!("a heartbeat of {} bytes", data.len())));
            return;
        };
        let Some(state) = State::from_code(code & 0x7F) else {
            findings.push((Rule::NmtState, format!("a heartbeat with the reserved state {code:02X}h")));
            return;
        };
        let is_on = self.emcy_id().is_some() && self.knows(0x1014) && self.knows(0x1015);
        let inhibited = self.emcy_inhibit().zip(self.errors.last());
        let is_inhibited = inhibited.is_some_and(|(inhibit, last)| at.0 < last.0 + inhibit.0 + 1000);
        let behaviour = self.nmt.demands().and_then(|class| self.values.sure_number(0x1029, class));
        self.nmt.heartbeat(state, behaviour, is_on && !is_inhibited, at, findings);
    }

    fn emcy(&mut self, data: &[u8], times: Times, findings: &mut Findings) {
        let wait = if times.is_real { times.wait + times.frame + 500.0 } else { 0.0 };
        let inhibit = self.emcy_inhibit();
        let code = self.errors.emcy(data, inhibit, Duration(wait as u64), times.at, findings);
        if let Some(code) = code.filter(|code| *code != 0) {
            let class = self.values.sheet().and_then(|sheet| {
                if sheet.communication_errors.contains(&code) {
                    Some(1)
                } else {
                    sheet.device_errors.contains(&code).then_some(2)
                }
            });
            self.nmt.error(code, class);
            self.is_wishful = true;
        }
    }

    /// Whether the value of an object is known, or no data sheet has the object.
    fn knows(&self, index: u16) -> bool {
        let is_in = self.values.sheet().is_some_and(|sheet| sheet.entries.contains_key(&(index, 0)));
        !is_in || self.values.sure_number(index, 0).is_some()
    }

    /// The CAN-ID of EMCY (1014h); `None` while EMCY is off.
    fn emcy_id(&self) -> Option<u16> {
        let node = u32::from(self.id?);
        let cob_id = self.values.number(0x1014, 0).unwrap_or(0x80 + node);
        (cob_id & 1 << 31 == 0).then_some((cob_id & 0x7FF) as u16)
    }

    /// 1015h; `None` while it is 0 or not known.
    fn emcy_inhibit(&self) -> Option<Duration> {
        let inhibit = self.values.sure_number(0x1015, 0).filter(|inhibit| *inhibit > 0)?;
        Some(Duration::from_inhibit(inhibit as u16))
    }

    /// Whether the node may send with this CAN-ID. `None`: not known.
    pub(crate) fn owns(&self, id: u16) -> Option<bool> {
        let Some(node) = self.id.map(u16::from) else { return Some(id == LSS_RESPONSE) };
        if [0x700 + node, 0x580 + node, LSS_RESPONSE].contains(&id) || self.emcy_id() == Some(id) {
            return Some(true);
        }
        if pdo::with_id(&self.values, id).is_some() {
            return Some(true);
        }
        let is_known = self.values.sheet().is_some()
            && pdo::are_known(&self.values)
            && self.values.sure_number(0x1014, 0).is_some();
        is_known.then_some(false)
    }

    /// Whether a frame of an unknown sender is of this node, by its CAN-ID.
    pub(crate) fn is_sender(&self, id: u16) -> bool {
        let Some(node) = self.id.map(u16::from) else { return false };
        [0x700 + node, 0x580 + node].contains(&id)
            || self.emcy_id() == Some(id)
            || pdo::with_id(&self.values, id).is_some()
    }
}
