//! Node guarding and life guarding (CiA 301, 7.2.8.2.1): the device answers the remote frames of a master with its state,
//! and notices when they stay away.

use crate::nmt::State;
use crate::{Span, Tick};

/// The bit that alternates from answer to answer.
const TOGGLE: u8 = 0x80;

/// The answers to a guarding master, and the time until the next of its remote frames.
#[derive(Debug)]
pub(crate) struct Guarding {
    toggle: u8,
    /// Guard time (100Ch) times life time factor (100Dh) in ms; 0 for no life guarding.
    life_time: u32,
    /// The rest of the present life time after `due`, in ms: a life time can be longer than a span.
    rest: u32,
    due: Tick,
    is_lost: bool,
}

impl Guarding {
    pub(crate) const fn new() -> Guarding {
        Guarding { toggle: 0, life_time: 0, rest: 0, due: Tick::NEVER, is_lost: false }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.due.shift(by);
    }

    /// At a reset: the first answer has the toggle bit 0, and life guarding begins with it.
    pub(crate) fn restart(&mut self) {
        *self = Guarding { life_time: self.life_time, ..Guarding::new() };
    }

    /// Takes the values of 100Ch and 100Dh. Life guarding begins with the next remote frame. Returns whether the master
    /// was lost.
    pub(crate) fn configure(&mut self, guard_time: u16, factor: u8) -> bool {
        (self.life_time, self.due) = (u32::from(guard_time) * u32::from(factor), Tick::NEVER);
        core::mem::take(&mut self.is_lost)
    }

    /// Takes a remote frame. Returns the answer, and whether the master is back.
    pub(crate) fn answer(&mut self, state: State, now: Tick) -> (u8, bool) {
        let answer = state.code() | self.toggle;
        self.rest = self.life_time;
        self.due = self.next_part(now);
        (answer, core::mem::take(&mut self.is_lost))
    }

    /// An answer has been sent: the next one has the other toggle bit.
    pub(crate) fn toggle(&mut self) {
        self.toggle ^= TOGGLE;
    }

    /// The end of the next part of the life time; `NEVER` at its end.
    fn next_part(&mut self, now: Tick) -> Tick {
        let part = u16::try_from(self.rest).unwrap_or(u16::MAX);
        self.rest -= u32::from(part);
        if part == 0 { Tick::NEVER } else { now.plus(Span::from_millis(part)) }
    }

    /// When the next remote frame is missing, or a part of a long life time is over.
    pub(crate) fn due(&self) -> Tick {
        self.due
    }

    /// Whether the master is lost. Reported once.
    pub(crate) fn expire(&mut self, now: Tick) -> bool {
        while now >= self.due {
            self.due = self.next_part(self.due);
            if self.due == Tick::NEVER {
                self.is_lost = true;
                return true;
            }
        }
        false
    }
}
