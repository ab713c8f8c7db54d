//! SYNC producer (CiA 301, 7.2.5): sends a SYNC every communication cycle period.

use super::Settings;
use crate::{CanId, CobId, Frame, Span, Tick};

/// Sends SYNCs while bit 30 of 1005h is set and 1006h is not 0.
#[derive(Debug)]
pub(crate) struct Producer {
    id: CanId,
    /// Communication cycle period in us; 0 while no SYNC is produced.
    period: u32,
    /// The highest counter value; 0 for no counter.
    overflow: u8,
    counter: u8,
    due: Tick,
}

impl Producer {
    pub(crate) const fn new() -> Producer {
        Producer { id: CanId::of_service(0x080, 0), period: 0, overflow: 0, counter: 0, due: Tick::NEVER }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.due.shift(by);
    }

    /// Takes settings. Returns whether they are new: `restart` or `stop` follows.
    pub(crate) fn configure(&mut self, settings: &Settings) -> bool {
        let Settings { cob_id, period, overflow, .. } = *settings;
        let id = CobId::parse(cob_id).filter(|cob_id| cob_id.bit30).map(|cob_id| cob_id.id);
        let period = if id.is_some() { period } else { 0 };
        let id = id.unwrap_or(self.id);
        let is_new = (id, period, overflow) != (self.id, self.period, self.overflow);
        (self.id, self.period, self.overflow) = (id, period, overflow);
        is_new
    }

    /// The next SYNC is due at once, with the counter 1.
    pub(crate) fn restart(&mut self) {
        self.counter = 0;
        self.due = if self.period == 0 { Tick::NEVER } else { Tick::PAST };
    }

    /// No SYNC is produced in this NMT state.
    pub(crate) fn stop(&mut self) {
        self.due = Tick::NEVER;
    }

    /// When the next SYNC is due.
    pub(crate) fn due(&self) -> Tick {
        self.due
    }

    /// The next SYNC.
    pub(crate) fn frame(&self) -> Frame {
        match self.overflow {
            0 => Frame::data_frame(self.id, 0, [0; 8]),
            _ => Frame::data_frame(self.id, 1, [self.next_counter(), 0, 0, 0, 0, 0, 0, 0]),
        }
    }

    fn next_counter(&self) -> u8 {
        if self.counter < self.overflow { self.counter + 1 } else { 1 }
    }

    /// The SYNC has been sent. The next one is due a period after this one was, so delays do not add up.
    pub(crate) fn sent(&mut self, now: Tick) {
        self.counter = self.next_counter();
        let first = self.due == Tick::PAST;
        let next = if first { now } else { self.due }.plus_long(self.period);
        self.due = if next > now { next } else { now.plus_long(self.period) };
    }

    /// The SYNC cannot be sent before this instant.
    pub(crate) fn wait_until(&mut self, due: Tick) {
        self.due = due;
    }
}
