//! Node guarding and life guarding (CiA 301, 7.2.8.2.1): the device answers the remote frames of a master with its state,
//! and notices when they stay away.

use crate::nmt::State;
use crate::{Duration, Instant};

/// The bit that alternates from answer to answer.
const TOGGLE: u8 = 0x80;

/// The answers to a guarding master, and the time until the next of its remote frames.
#[derive(Debug)]
pub(crate) struct Guarding {
    toggle: u8,
    /// Guard time (100Ch) times life time factor (100Dh) in ms; 0 for no life guarding.
    life_time: u32,
    due: Instant,
    is_lost: bool,
}

impl Guarding {
    pub(crate) const fn new() -> Guarding {
        Guarding { toggle: 0, life_time: 0, due: Instant::NEVER, is_lost: false }
    }

    /// At a reset: the first answer has the toggle bit 0, and life guarding begins with it.
    pub(crate) fn restart(&mut self) {
        *self = Guarding { life_time: self.life_time, ..Guarding::new() };
    }

    /// Takes the values of 100Ch and 100Dh. Life guarding begins with the next remote frame. Returns whether the master
    /// was lost.
    pub(crate) fn configure(&mut self, guard_time: u16, factor: u8) -> bool {
        (self.life_time, self.due) = (u32::from(guard_time) * u32::from(factor), Instant::NEVER);
        core::mem::take(&mut self.is_lost)
    }

    /// Takes a remote frame. Returns the answer, and whether the master is back.
    pub(crate) fn answer(&mut self, state: State, now: Instant) -> (u8, bool) {
        let answer = state.code() | self.toggle;
        self.toggle ^= TOGGLE;
        let life_time = Duration::from_millis(self.life_time.into());
        self.due = if life_time.is_zero() { Instant::NEVER } else { now.plus(life_time) };
        (answer, core::mem::take(&mut self.is_lost))
    }

    /// When the next remote frame is missing.
    pub(crate) fn due(&self) -> Instant {
        self.due
    }

    /// Whether the master is lost. Reported once.
    pub(crate) fn expire(&mut self, now: Instant) -> bool {
        let is_lost = now >= self.due;
        if is_lost {
            (self.due, self.is_lost) = (Instant::NEVER, true);
        }
        is_lost
    }
}
