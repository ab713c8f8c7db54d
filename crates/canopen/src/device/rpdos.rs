//! RPDOs in the device: reception, deadlines, and the faults of each.

use super::{Application, Core};
use crate::emcy::Fault;
use crate::pdo::{Reception, Rpdo};
use crate::{Frame, Instant};

impl<A: Application, const N: usize> Core<A, N> {
    /// Takes a data frame that may be one of the RPDOs. A good one clears the faults of its PDO.
    pub(super) fn on_rpdo(&mut self, frame: &Frame, now: Instant) {
        if self.rpdo_filter & filter_bit(frame.id()) == 0 {
            return;
        }
        for number in self.valid_rpdos.iter() {
            self.take_rpdo(number, frame, now);
        }
    }

    /// After a change of their settings.
    pub(super) fn update_rpdo_filter(&mut self) {
        let ids = self.rpdos.iter().filter_map(Rpdo::id);
        self.rpdo_filter = ids.fold(0, |filter, id| filter | filter_bit(id.get()));
    }

    fn take_rpdo(&mut self, number: u8, frame: &Frame, now: Instant) {
        let late = self.sync.is_window_over(now);
        let Some(rpdo) = self.rpdos.get_mut(usize::from(number)) else { return };
        let Some(reception) = rpdo.take(frame, &mut self.image, now, late) else { return };
        self.process_due = self.process_due.min(rpdo.due());
        if let Reception::Multiplexed(addressing) = reception {
            self.on_mpdo(frame.bytes(), addressing, now);
        }
        if reception != Reception::Complete || self.faulty_rpdos.contains(number) {
            self.on_reception(number, reception, now);
        }
    }

    fn on_reception(&mut self, number: u8, reception: Reception, now: Instant) {
        self.set_rpdo_fault(Fault::RpdoTooShort(number), reception == Reception::TooShort, now);
        self.set_rpdo_fault(Fault::RpdoTooLong(number), reception == Reception::TooLong, now);
        if reception != Reception::TooShort {
            self.clear(Fault::RpdoDeadline(number), now);
        }
        let is_faulty = matches!(reception, Reception::TooShort | Reception::TooLong);
        self.faulty_rpdos.set(number, is_faulty);
    }

    fn set_rpdo_fault(&mut self, fault: Fault, active: bool, now: Instant) {
        if active { self.raise(fault, now) } else { self.clear(fault, now) }
    }

    /// Looks for RPDOs that are missing. The next instant at which one is.
    pub(super) fn poll_rpdos(&mut self, now: Instant) -> Instant {
        let mut due = Instant::NEVER;
        for number in self.valid_rpdos.iter() {
            let Some(rpdo) = self.rpdos.get_mut(usize::from(number)) else { return due };
            if rpdo.expire(now) {
                self.raise(Fault::RpdoDeadline(number), now);
                self.faulty_rpdos.set(number, true);
            } else {
                due = due.min(rpdo.due());
            }
        }
        due
    }

    /// A PDO that is configured anew, or that is no longer received, has no faults.
    pub(super) fn forget_rpdo_faults(&mut self, number: u8, now: Instant) {
        for fault in [Fault::RpdoTooShort(number), Fault::RpdoTooLong(number), Fault::RpdoDeadline(number)] {
            self.clear(fault, now);
        }
        self.faulty_rpdos.set(number, false);
    }
}

/// The bit of a CAN-ID in the filter: the lowest five bits, which in the pre-defined connection set are of the node-ID.
fn filter_bit(id: u16) -> u32 {
    1 << (id & 31)
}
