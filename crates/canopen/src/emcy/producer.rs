//! The EMCY producer: keeps the set of active faults and sends their changes.

use super::history::History;
use super::{Condition, Fault, FaultSet, Message};
use crate::sdo::Abort;
use crate::transmit::{Context, RETRY};
use crate::{CobId, Duration, Frame, Instant, Transmit};
use heapless::Deque;

/// Number of messages that can wait for the transmit queue or the inhibit time. A further message replaces the newest
/// one.
const WAITING: usize = 8;

/// The COB-ID (1014h) of a device without EMCY: bit 31 is set.
pub(crate) const OFF: u32 = 1 << 31;

/// The active faults, their history and the waiting messages.
#[derive(Debug)]
pub(crate) struct Producer {
    /// Conditions of the application.
    conditions: &'static [Condition],
    /// The bits of the error register that the device supports.
    register_bits: u8,
    /// 1014h; `None` while bit 31 disables EMCY.
    id: Option<CobId>,
    active: FaultSet,
    history: History,
    waiting: Deque<Message, WAITING>,
    /// 1015h, in 100 us.
    inhibit: u16,
    /// The end of the inhibit time after the last message.
    inhibited_until: Instant,
    due: Instant,
}

impl Producer {
    pub(crate) const fn new(conditions: &'static [Condition], register_bits: u8) -> Producer {
        Producer {
            conditions,
            register_bits,
            id: None,
            active: FaultSet::EMPTY,
            history: History::new(),
            waiting: Deque::new(),
            inhibit: 0,
            inhibited_until: Instant(0),
            due: Instant::NEVER,
        }
    }

    /// Takes the COB-ID of 1014h. Bit 31 disables EMCY.
    pub(crate) fn configure(&mut self, value: u32) {
        self.id = CobId::parse(value).filter(|cob_id| !cob_id.bit31);
    }

    /// Takes the inhibit time of 1015h, from the next message on.
    pub(crate) fn set_inhibit(&mut self, inhibit: u16) {
        self.inhibit = inhibit;
    }

    /// After a reset: clears the history, and reports the faults that are still active again.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.history.clear();
        self.waiting.clear();
        self.due = Instant::NEVER;
        let active = core::mem::take(&mut self.active);
        for fault in active.singles() {
            self.raise(fault, now);
        }
    }

    /// Sets a fault. Returns whether the fault is new.
    pub(crate) fn raise(&mut self, fault: Fault, now: Instant) -> bool {
        let is_new = self.active.insert(fault);
        if is_new {
            let Condition { code, detail, .. } = fault.condition(self.conditions);
            self.history.push(code);
            self.report(code, detail, now);
        }
        is_new
    }

    /// Clears a fault. Returns whether the fault was active. After the last active fault, code 0000h is sent.
    pub(crate) fn clear(&mut self, fault: Fault, now: Instant) -> bool {
        let was_active = self.active.remove(fault);
        if was_active && self.active.is_empty() {
            self.report(0, [0; 5], now);
        }
        was_active
    }

    fn report(&mut self, code: u16, detail: [u8; 5], now: Instant) {
        let message = Message { code, register: self.register(), detail };
        // In a full queue, the message replaces the newest one. The older messages tell how the trouble began; this
        // message tells the present state.
        if self.waiting.push_back(message).is_err()
            && let Some(newest) = self.waiting.back_mut()
        {
            *newest = message;
        }
        self.due = self.due.min(self.inhibited_until.max(now));
    }

    /// The error register, object 1001h.
    #[inline(never)]
    pub(crate) fn register(&self) -> u8 {
        self.active.register(self.conditions) & self.register_bits
    }

    pub(crate) fn history(&self) -> &History {
        &self.history
    }

    pub(crate) fn clear_history(&mut self) {
        self.history.clear();
    }

    /// The next instant at which a message is due.
    pub(crate) fn due(&self) -> Instant {
        self.due
    }

    /// Sends the waiting messages. Must be called only in NMT states with EMCY; in other states, messages keep waiting.
    pub(crate) fn poll(&mut self, context: &mut Context<'_, impl Transmit>) {
        if context.now < self.due {
            return;
        }
        let Some(cob_id) = self.id else {
            self.waiting.clear();
            self.due = Instant::NEVER;
            return;
        };
        while let Some(message) = self.waiting.front() {
            if !context.send(Frame::data_frame(cob_id.id, 8, message.encode())) {
                self.due = context.now + RETRY;
                return;
            }
            let _ = self.waiting.pop_front();
            if self.inhibit != 0 {
                self.inhibited_until = context.now + Duration::from_inhibit(self.inhibit);
                self.due = if self.waiting.is_empty() { Instant::NEVER } else { self.inhibited_until };
                return;
            }
        }
        self.due = Instant::NEVER;
    }
}

/// Checks a new value of 1014h: the CAN-ID must be configurable, and can change only while EMCY is disabled (bit 31).
pub(crate) fn check_cob_id(old: u32, new: u32) -> Result<(), Abort> {
    let new = CobId::parse(new).filter(|cob_id| !cob_id.bit30).ok_or(Abort::InvalidValue)?;
    let old = CobId::parse(old).ok_or(Abort::InvalidValue)?;
    let stays = !old.bit31 && !new.bit31;
    let moves = stays && old.id != new.id;
    if moves || new.id.is_restricted() { Err(Abort::InvalidValue) } else { Ok(()) }
}
