//! RPDOs in the device: reception, deadlines, and the faults of each.

use super::{Application, Core};
use crate::emcy::Fault;
use crate::pdo::{Reception, Rpdo};
use crate::{Frame, Instant};

impl<A: Application, const N: usize> Core<A, N> {
    /// Takes a data frame that may be one of the RPDOs. A good one clears the faults of its PDO.
    pub(super) fn on_rpdo(&mut self, frame: &Frame, now: Instant) {
        let late = self.sync.is_window_over(now);
        for number in 0..RPDOS {
            let Some(rpdo) = self.rpdos.get_mut(usize::from(number)) else { return };
            let Some(reception) = rpdo.take(frame, &mut self.image, now, late) else { continue };
            self.process_due = self.process_due.min(rpdo.due());
            if reception != Reception::Complete || self.rpdo_faults & 1 << number != 0 {
                self.on_reception(number, reception, now);
            }
        }
    }

    fn on_reception(&mut self, number: u8, reception: Reception, now: Instant) {
        self.set_rpdo_fault(Fault::RpdoTooShort(number), reception == Reception::TooShort, now);
        self.set_rpdo_fault(Fault::RpdoTooLong(number), reception == Reception::TooLong, now);
        if reception != Reception::TooShort {
            self.clear(Fault::RpdoDeadline(number), now);
        }
        let is_faulty = reception != Reception::Complete;
        self.note_rpdo_fault(number, is_faulty);
    }

    fn set_rpdo_fault(&mut self, fault: Fault, active: bool, now: Instant) {
        if active { self.raise(fault, now) } else { self.clear(fault, now) }
    }

    /// Remembers which RPDOs have faults, so that a good reception of the others costs nothing.
    fn note_rpdo_fault(&mut self, number: u8, active: bool) {
        let bit = 1 << number;
        self.rpdo_faults = if active { self.rpdo_faults | bit } else { self.rpdo_faults & !bit };
    }

    /// Looks for RPDOs that are missing.
    pub(super) fn poll_rpdos(&mut self, now: Instant) {
        for number in 0..RPDOS {
            if self.rpdos.get_mut(usize::from(number)).is_some_and(|rpdo| rpdo.expire(now)) {
                self.raise(Fault::RpdoDeadline(number), now);
                self.note_rpdo_fault(number, true);
            }
        }
    }

    /// A PDO that is configured anew, or that is no longer received, has no faults.
    pub(super) fn forget_rpdo_faults(&mut self, number: u8, now: Instant) {
        for fault in [Fault::RpdoTooShort(number), Fault::RpdoTooLong(number), Fault::RpdoDeadline(number)] {
            self.clear(fault, now);
        }
        self.note_rpdo_fault(number, false);
    }

    pub(super) fn next_rpdo(&self) -> Instant {
        self.rpdos.iter().map(Rpdo::due).min().unwrap_or(Instant::NEVER)
    }
}

/// How many RPDOs a device can have; which of them it has, the dictionary says.
pub(super) const RPDOS: u8 = 8;
