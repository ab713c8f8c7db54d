//! RPDOs in the device: reception, deadlines, and the faults of each.

use super::{Application, Core, STALE};
use crate::dictionary::{Entry, Rule, little_endian};
use crate::emcy::Fault;
use crate::pdo::{Direction, MappedObject, Reception, Rpdo, RpdoFault};
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
        let Some((reception, data)) = rpdo.take(frame, now, late) else { return };
        self.process_due = self.process_due.min(rpdo.due());
        let has_faults = rpdo.has_faults();
        if let Some(data) = data {
            self.store_rpdo(number, data);
        }
        if let Reception::Multiplexed(addressing) = reception {
            self.on_mpdo(frame.bytes(), addressing, now);
        }
        if reception != Reception::Complete || has_faults {
            self.on_reception(number, reception, now);
        }
    }

    /// Takes the data of an RPDO into the image, and tells the application.
    pub(super) fn store_rpdo(&mut self, number: u8, data: [u8; 8]) {
        let layout = self.rpdos.get(usize::from(number)).and_then(Rpdo::layout);
        match layout {
            Some(layout) if !layout.is_checked() => layout.scatter(data, &mut self.image),
            _ => self.store_checked(number, data),
        }
        if let Some(communication) = self.dictionary.pdos(Direction::Receive).get(usize::from(number)) {
            self.application.received((communication & 0x1FF) + 1, &mut self.image);
        }
    }

    /// The same where objects have limits or rules: each value is checked as a write by SDO is, and one that is refused is
    /// left out.
    #[inline(never)]
    fn store_checked(&mut self, number: u8, data: [u8; 8]) {
        let Some(&communication) = self.dictionary.pdos(Direction::Receive).get(usize::from(number)) else {
            return;
        };
        let (mapping, mut rest) = (communication | 0x0200, data.as_slice());
        let [count, ..] = self.number(mapping, 0).to_le_bytes();
        for slot in 0..count {
            let mapped = MappedObject::parse(self.number(mapping, slot + 1));
            let entry = self.dictionary.find(mapped.index, mapped.sub);
            let size = usize::from(mapped.bits / 8);
            let Some((bytes, behind)) = rest.split_at_checked(size) else { return };
            if let Ok(entry) = entry {
                self.store_process_value(&entry, bytes);
            }
            rest = behind;
        }
    }

    /// Takes a value that a PDO brings, if the object takes it.
    pub(super) fn store_process_value(&mut self, entry: &Entry, bytes: &[u8]) {
        let is_allowed = entry.check_value(little_endian(bytes)).is_ok()
            && (entry.rule() != Rule::Application
                || self.application.write(entry, bytes, &mut self.image).is_ok());
        if !is_allowed {
            return;
        }
        entry.field.set(&mut self.image, bytes);
        if entry.rule() == Rule::Application || entry.is_parameter() {
            self.pending.parameters_changed();
            self.services_due = STALE;
        }
    }

    fn on_reception(&mut self, number: u8, reception: Reception, now: Instant) {
        self.set_rpdo_fault(number, RpdoFault::TooShort, reception == Reception::TooShort, now);
        self.set_rpdo_fault(number, RpdoFault::TooLong, reception == Reception::TooLong, now);
        if reception != Reception::TooShort {
            self.set_rpdo_fault(number, RpdoFault::Deadline, false, now);
        }
    }

    fn set_rpdo_fault(&mut self, number: u8, kind: RpdoFault, active: bool, now: Instant) {
        let Some(rpdo) = self.rpdos.get_mut(usize::from(number)) else { return };
        if !rpdo.set_fault(kind, active) {
            return;
        }
        let fault = match kind {
            RpdoFault::TooShort => Fault::RpdoTooShort(number.into()),
            RpdoFault::TooLong => Fault::RpdoTooLong(number.into()),
            RpdoFault::Deadline => Fault::RpdoDeadline(number.into()),
        };
        if active { self.raise(fault, now) } else { self.clear(fault, now) }
    }

    /// Looks for RPDOs that are missing. The next instant at which one is.
    pub(super) fn poll_rpdos(&mut self, now: Instant) -> Instant {
        let mut due = Instant::NEVER;
        for number in self.valid_rpdos.iter() {
            let Some(rpdo) = self.rpdos.get_mut(usize::from(number)) else { return due };
            if rpdo.expire(now) {
                self.set_rpdo_fault(number, RpdoFault::Deadline, true, now);
            } else {
                due = due.min(rpdo.due());
            }
        }
        due
    }

    /// A PDO that is configured anew, or that is no longer received, has no faults.
    pub(super) fn forget_rpdo_faults(&mut self, number: u8, now: Instant) {
        for kind in [RpdoFault::TooShort, RpdoFault::TooLong, RpdoFault::Deadline] {
            self.set_rpdo_fault(number, kind, false, now);
        }
    }
}

/// The bit of a CAN-ID in the filter: the lowest five bits, which in the pre-defined connection set are of the node-ID.
fn filter_bit(id: u16) -> u32 {
    1 << (id & 31)
}
