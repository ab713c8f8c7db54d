//! The EMCY producer: keeps the set of active faults, sends their changes, and keeps the list of the errors sent.

use super::history::History;
use super::{Condition, ErrorClass, Fault, FaultSet, Message};
use crate::dictionary::Groups;
use crate::transmit::{Context, RETRY};
use crate::{CanId, CobId, Frame, Span, Tick, Transmit};

/// Number of messages that can wait for the transmit queue or the inhibit time. A further message replaces the newest
/// one.
const WAITING: usize = 8;

/// The error field of a fault of the application; `None` for the one of its condition.
pub(crate) type Detail = Option<[u8; 5]>;

/// Messages that wait, as frames.
#[derive(Debug)]
struct Queue {
    first: u8,
    len: u8,
    messages: [[u8; 8]; WAITING],
}

impl Queue {
    const EMPTY: Queue = Queue { first: 0, len: 0, messages: [[0; 8]; WAITING] };

    /// Adds a message. In a full queue, it replaces the newest one.
    fn push(&mut self, message: [u8; 8]) {
        self.len += u8::from(usize::from(self.len) < WAITING);
        let place = usize::from(self.first + self.len - 1) % WAITING;
        if let Some(place) = self.messages.get_mut(place) {
            *place = message;
        }
    }

    fn front(&self) -> Option<[u8; 8]> {
        self.messages.get(usize::from(self.first)).copied().filter(|_| self.len != 0)
    }

    /// Removes the oldest message of a queue that has any.
    fn pop(&mut self) {
        self.first = if usize::from(self.first) + 1 < WAITING { self.first + 1 } else { 0 };
        self.len = self.len.saturating_sub(1);
    }
}

/// The active faults, their history and the waiting messages.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Producer {
    /// Conditions of the application.
    conditions: &'static [Condition],
    /// 1014h; `None` while bit 31 disables EMCY.
    id: Option<CanId>,
    /// The bits of the error register that the device supports.
    register_bits: u8,
    /// The sub-indexes of 1029h that apply to new faults, one bit for each, until [`Producer::take_error`].
    errors: u8,
    /// 1015h, in 100 us.
    inhibit: u16,
    active: FaultSet,
    /// When the last message was sent, or `NEVER`.
    sent_at: Tick,
    due: Tick,
    waiting: Queue,
    history: History,
}

impl Producer {
    pub(crate) const fn new(conditions: &'static [Condition], register_bits: u8) -> Producer {
        Producer {
            conditions,
            register_bits,
            id: None,
            active: FaultSet::EMPTY,
            history: History::new(),
            waiting: Queue::EMPTY,
            inhibit: 0,
            sent_at: Tick::NEVER,
            due: Tick::NEVER,
            errors: 0,
        }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.sent_at.shift(by);
        self.due.shift(by);
    }

    /// Takes the COB-ID of 1014h. Bit 31 disables EMCY. Returns whether this value switches EMCY on.
    pub(crate) fn configure(&mut self, value: u32) -> bool {
        let id = CobId::enabled(value);
        let was_on = core::mem::replace(&mut self.id, id).is_some();
        id.is_some() && !was_on
    }

    /// Takes the inhibit time of 1015h. It applies to a waiting message, too.
    #[inline(never)]
    pub(crate) fn set_inhibit(&mut self, inhibit: u16, now: Tick) {
        self.inhibit = inhibit;
        if !self.is_idle() {
            self.due = self.next_due(now);
        }
    }

    /// When the next message may be sent.
    #[inline(never)]
    fn next_due(&self, now: Tick) -> Tick {
        match self.sent_at {
            Tick::NEVER => now,
            sent => sent.plus(Span::from_inhibit(self.inhibit)).max(now),
        }
    }

    /// After a reset: clears the history, and reports the faults that are still active again.
    pub(crate) fn restart(&mut self, details: impl Fn(u8) -> Detail, now: Tick) {
        self.history.clear();
        self.forget_waiting();
        self.errors = 0;
        self.raise_singles(details, now);
    }

    // Not inlined: two callers, and much code.
    #[inline(never)]
    fn raise_singles(&mut self, details: impl Fn(u8) -> Detail, now: Tick) {
        for place in 0..Fault::PLACES {
            let Some(fault) = self.active.at(place) else { continue };
            let detail = if let Fault::Application(number) = fault { details(number) } else { None };
            self.errors |= self.repeat(fault, detail, now);
        }
    }

    /// Sets or clears a fault. Returns whether this is a change. After the last active fault, code 0000h is sent.
    pub(crate) fn set(&mut self, fault: Fault, active: bool, detail: Detail, now: Tick) -> bool {
        let is_change = self.active.set(fault, active);
        if is_change && active {
            self.errors |= self.repeat(fault, detail, now);
        } else if is_change && self.active.is_empty() {
            self.report(0, [0; 5], now);
        }
        is_change
    }

    /// Sets the faults of the storage groups, of which [`Producer::restart`] sends the EMCYs. Returns the changes.
    pub(crate) fn set_stored(&mut self, lost: Groups, older: Groups) -> FaultSet {
        self.active.set_stored(lost, older)
    }

    /// Sets or clears a fault of a device without EMCY: no message waits. Returns whether this is a change.
    pub(crate) fn set_silently(&mut self, fault: Fault, active: bool) -> bool {
        let is_change = self.active.set(fault, active);
        if is_change && active {
            self.errors |= self.class_of(fault);
        }
        is_change
    }

    /// The bit of the class of a fault.
    #[inline(never)]
    fn class_of(&self, fault: Fault) -> u8 {
        fault.condition(self.conditions).class.map_or(0, error_bit)
    }

    /// As [`Producer::restart`], for a device without EMCY.
    pub(crate) fn restart_silently(&mut self) {
        self.errors = 0;
        for place in 0..Fault::PLACES {
            let Some(fault) = self.active.at(place) else { continue };
            self.errors |= self.class_of(fault);
        }
    }

    /// Reports an active fault, and returns the bit of its class.
    #[inline(never)]
    pub(crate) fn repeat(&mut self, fault: Fault, own: Detail, now: Tick) -> u8 {
        let Condition { code, detail, class, .. } = fault.condition(self.conditions);
        self.report(code, own.unwrap_or(detail), now);
        class.map_or(0, error_bit)
    }

    /// Reports the active faults again, without those of heartbeats and RPDOs. They are no new errors.
    pub(crate) fn repeat_singles(&mut self, details: impl Fn(u8) -> Detail, now: Tick) {
        let errors = self.errors;
        self.raise_singles(details, now);
        self.errors = errors;
    }

    /// Object 1029h is to be applied for an error of this class.
    pub(crate) fn add_error(&mut self, class: ErrorClass) {
        self.errors |= error_bit(class);
    }

    /// The class of an error that has occurred since the last call, if there is one.
    pub(crate) fn take_error(&mut self) -> Option<ErrorClass> {
        if self.errors == 0 {
            return None;
        }
        #[allow(clippy::cast_possible_truncation)] // Below 8.
        let lowest = self.errors.trailing_zeros() as u8;
        self.errors &= self.errors - 1;
        Some(ErrorClass(lowest))
    }

    /// Discards the waiting messages.
    pub(crate) fn forget_waiting(&mut self) {
        self.waiting.len = 0;
        self.due = Tick::NEVER;
    }

    /// Whether no message waits.
    pub(crate) fn is_idle(&self) -> bool {
        self.waiting.len == 0
    }

    fn report(&mut self, code: u16, detail: [u8; 5], now: Tick) {
        let message = Message { code, register: self.register(), detail };
        // In a full queue, the message replaces the newest one. The older messages report the first faults; this
        // message reports the present state.
        self.waiting.push(message.encode());
        self.due = self.due.min(self.next_due(now));
    }

    /// The error register, object 1001h.
    #[inline(never)]
    pub(crate) fn register(&self) -> u8 {
        self.active.register(self.conditions) & self.register_bits
    }

    /// Whether a fault is active that can be active only once.
    pub(crate) fn has(&self, fault: Fault) -> bool {
        self.active.has(fault)
    }

    /// Whether stored values could not be loaded.
    pub(crate) fn has_stored_data(&self) -> bool {
        self.active.has_stored_data()
    }

    pub(crate) fn history(&self) -> &History {
        &self.history
    }

    /// Takes the number of entries of 1003h.
    pub(crate) fn set_history_depth(&mut self, depth: u8) {
        self.history.set_depth(depth);
    }

    pub(crate) fn clear_history(&mut self) {
        self.history.clear();
    }

    /// The next instant at which a message is due.
    pub(crate) fn due(&self) -> Tick {
        self.due
    }

    /// Sends the waiting messages. Must be called only in NMT states with EMCY; in other states, messages keep waiting.
    /// `lists_detail`: whether the list of errors has the start of the error field.
    pub(crate) fn poll(&mut self, lists_detail: bool, context: &mut Context<'_, impl Transmit>) {
        if context.now < self.due {
            return;
        }
        let Some(id) = self.id else { return self.forget_waiting() };
        while let Some(message) = self.waiting.front() {
            if !context.send(Frame::data_frame(id, 8, message)) {
                self.due = context.now.plus(RETRY);
                return;
            }
            let [low, high, _, first, second, ..] = message;
            if [low, high] != [0; 2] {
                let detail = if lists_detail { [first, second] } else { [0; 2] };
                self.history.push([low, high, detail[0], detail[1]]);
            }
            self.waiting.pop();
            self.sent_at = context.now;
            if self.inhibit != 0 && self.waiting.len != 0 {
                self.due = self.next_due(context.now);
                return;
            }
        }
        self.due = Tick::NEVER;
    }
}

/// The bit of a class in a set of eight; 0 for a number that is no class.
fn error_bit(ErrorClass(sub): ErrorClass) -> u8 {
    1_u8.checked_shl(sub.into()).unwrap_or(0) & !1
}
