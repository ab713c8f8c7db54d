//! RPDOs in the device: reception, deadlines and faults.

use super::Definition;
use super::inner::Inner;
use super::{Application, STALE};
use crate::dictionary::{Entry, Rule, Services, little_endian};
use crate::pdo::{Chain, MappedObject, Reception, RpdoFault};
use crate::{Frame, Tick};

impl<D: Definition> Inner<D> {
    /// Takes a data frame that may be an RPDO. A valid frame clears the faults of its RPDO.
    pub(super) fn on_rpdo(&mut self, frame: &Frame, now: Tick) {
        if self.rpdo_filter & filter_bit(frame.id()) == 0 {
            return;
        }
        let (mut links, mut is_own) = (self.first_rpdos, false);
        while let Some(rpdo) = self.rpdos.as_ref().get(links.next(Chain::Valid)) {
            let place = links.next(Chain::Valid);
            links = rpdo.links;
            if rpdo.is_of(frame) {
                is_own = true;
                self.take_rpdo(place, frame, now);
            }
        }
        // A frame that has no RPDO of its own goes to the RPDO for all nodes, if it can be a multiplexed PDO.
        if Self::has(Services::MULTIPLEXED_RPDO)
            && let Some((id, place)) = self.all_nodes
            && !is_own
            && id.is_of_same_service(frame.id())
            && self.is_mpdo(frame)
        {
            self.take_rpdo(place.into(), frame, now);
        }
    }

    fn take_rpdo(&mut self, place: usize, frame: &Frame, now: Tick) {
        let Some(rpdo) = self.rpdos.as_mut().get_mut(place) else { return };
        let late = Self::has(Services::SYNC) && rpdo.is_synchronous() && self.sync.is_window_over(now);
        let (reception, is_valid) = rpdo.take(frame, now, late);
        self.process_due = self.process_due.min(rpdo.due());
        let (has_faults, number) = (rpdo.has_faults(), rpdo.number());
        if is_valid {
            self.store_rpdo(place, frame.bytes());
        }
        if Self::has(Services::MULTIPLEXED_RPDO)
            && let Reception::Multiplexed(addressing) = reception
            && self.on_mpdo(frame.bytes(), addressing, now)
        {
            self.application.received(number, self.image.as_mut());
        }
        if reception != Reception::Complete || has_faults {
            self.on_reception(place, reception, now);
        }
    }

    /// Writes the data of an RPDO to the image, and notifies the application.
    pub(super) fn store_rpdo(&mut self, place: usize, data: [u8; 8]) {
        let Some(rpdo) = self.rpdos.as_ref().get(place) else { return };
        let (index, number) = (rpdo.index, rpdo.number());
        match rpdo.layout() {
            Some(layout) if !layout.is_checked() => layout.scatter(data, self.image.as_mut()),
            _ => self.store_checked(index, data),
        }
        self.application.received(number, self.image.as_mut());
    }

    /// Writes the data of an RPDO whose objects have limits or rules. Each value is checked as in an SDO download; a
    /// refused value is left out.
    #[inline(never)]
    fn store_checked(&mut self, communication: u16, data: [u8; 8]) {
        let (mapping, mut rest) = (communication | 0x0200, data.as_slice());
        let [count, ..] = self.number(mapping, 0).to_le_bytes();
        for slot in 0..count {
            let mapped = MappedObject::parse(self.number(mapping, slot + 1));
            let entry = self.dictionary.find(mapped.index, mapped.sub);
            let size = usize::from(mapped.bits / 8);
            let Some((bytes, behind)) = rest.split_at_checked(size) else { return };
            if let Ok(entry) = entry {
                let _ = self.store_process_value(&entry, bytes);
            }
            rest = behind;
        }
    }

    /// Writes a value from a PDO, if the object accepts it. Returns whether it does.
    pub(super) fn store_process_value(&mut self, entry: &Entry, bytes: &[u8]) -> bool {
        let Ok(job) = self.job_of(entry) else { return false };
        let is_allowed = entry.check_value(little_endian(bytes)).is_ok()
            && (entry.rule() != Rule::Application
                || self.application.write(entry, bytes, self.image.as_mut()).is_ok());
        if !is_allowed {
            return false;
        }
        entry.field.set(self.image.as_mut(), bytes);
        if entry.rule() == Rule::Application || entry.is_parameter() {
            self.pending.parameters_changed();
            self.services_due = STALE;
        }
        self.begin_checked(job);
        true
    }

    #[inline(never)]
    fn on_reception(&mut self, place: usize, reception: Reception, now: Tick) {
        self.set_rpdo_fault(place, RpdoFault::TooShort, reception == Reception::TooShort, now);
        self.set_rpdo_fault(place, RpdoFault::TooLong, reception == Reception::TooLong, now);
        if reception != Reception::TooShort {
            self.set_rpdo_fault(place, RpdoFault::Deadline, false, now);
        }
    }

    #[inline(never)]
    fn set_rpdo_fault(&mut self, place: usize, kind: RpdoFault, active: bool, now: Tick) {
        let Some(rpdo) = self.rpdos.as_mut().get_mut(place) else { return };
        if !rpdo.set_fault(kind, active) {
            return;
        }
        let fault = rpdo.fault(kind);
        self.set_fault(fault, active, now);
    }

    /// Detects missing RPDOs. Returns the next deadline.
    pub(super) fn poll_rpdos(&mut self, now: Tick) -> Tick {
        let (mut due, mut links) = (Tick::NEVER, self.first_rpdos);
        while let Some(rpdo) = self.rpdos.as_mut().get_mut(links.next(Chain::Valid)) {
            let place = links.next(Chain::Valid);
            links = rpdo.links;
            if rpdo.expire(now) {
                self.set_rpdo_fault(place, RpdoFault::Deadline, true, now);
            } else {
                due = due.min(rpdo.due());
            }
        }
        due
    }

    /// Whether an RPDO has not arrived in time.
    pub(super) fn misses_rpdo(&self) -> bool {
        self.rpdos.as_ref().iter().any(|rpdo| rpdo.has(RpdoFault::Deadline))
    }

    /// Clears the faults of a PDO that is reconfigured.
    pub(super) fn forget_rpdo_faults(&mut self, place: u16, now: Tick) {
        for kind in RpdoFault::ALL {
            self.set_rpdo_fault(place.into(), kind, false, now);
        }
    }
}

/// The bit of a CAN-ID in the filter, from its lowest five bits: in the pre-defined connection set, a part of the
/// node-ID.
pub(super) fn filter_bit(id: u16) -> u32 {
    1 << (id & 31)
}
