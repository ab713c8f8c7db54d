//! Faults in the device: those of the bus and of the application, and what follows from an error (object 1029h).

use super::{Application, Core, Device, ErrorClass, Next, STALE};
use crate::Instant;
use crate::emcy::Fault;
use crate::nmt::State;

/// Error behaviour.
const ERROR_BEHAVIOUR: u16 = 0x1029;
/// What 1029h says: to Pre-operational, no change, to Stopped.
const TO_PRE_OPERATIONAL: u32 = 0;
const TO_STOPPED: u32 = 2;

/// What the CAN controller reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BusEvent {
    /// A received frame was lost.
    Overrun,
    /// An error counter reached 96.
    Warning,
    /// An error counter went above 127: error passive.
    Passive,
    /// The transmit error counter went above 255: off the bus.
    BusOff,
    /// Error active again, from passive or from bus-off.
    Recovered,
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Device<A, N, T, R, W, M>
{
    /// Takes what the CAN controller reports: sets and clears the faults 8110h, 8120h and 8140h, and treats bus-off as a
    /// communication error. A warning has no emergency code: the node works, and error passive would follow.
    pub fn on_bus(&mut self, event: BusEvent, now: Instant) -> Next {
        match event {
            BusEvent::Warning => (),
            BusEvent::Overrun => {
                self.core.raise(Fault::Overrun, now);
                self.core.clear(Fault::Overrun, now);
            }
            BusEvent::Passive => self.core.raise(Fault::ErrorPassive, now),
            BusEvent::BusOff => {
                self.core.is_bus_off = true;
                self.apply_error(ErrorClass::COMMUNICATION);
            }
            BusEvent::Recovered => self.core.recover(now),
        }
        self.process_next()
    }

    /// Sets or clears a fault of the application, by its number in [`Application::CONDITIONS`]. It is signalled once, until
    /// it is cleared.
    pub fn set_condition(&mut self, number: u8, active: bool, now: Instant) -> Next {
        self.core.set_fault(Fault::Application(number), active, now);
        self.process_next()
    }

    /// Reacts to an error of the application as object 1029h says.
    pub fn error(&mut self, class: ErrorClass) -> Next {
        self.apply_error(class);
        self.process_next()
    }

    pub(super) fn apply_error(&mut self, class: ErrorClass) {
        self.core.application.error(class, &mut self.core.image);
        let ErrorClass(sub) = class;
        match self.core.number(ERROR_BEHAVIOUR, sub) {
            TO_PRE_OPERATIONAL if self.core.state == State::Operational => {
                self.core.enter(State::PreOperational);
            }
            TO_STOPPED if self.core.state.has_services() => self.core.enter(State::Stopped),
            _ => (),
        }
        self.silence_services();
    }
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Core<A, N, T, R, W, M>
{
    /// That the node was off the bus can only be said afterwards.
    fn recover(&mut self, now: Instant) {
        if core::mem::take(&mut self.is_bus_off) {
            self.raise(Fault::BusOffRecovered, now);
        }
        self.clear(Fault::ErrorPassive, now);
        self.clear(Fault::BusOffRecovered, now);
    }

    // Called from many places that are in no hurry.
    #[inline(never)]
    pub(super) fn raise(&mut self, fault: Fault, now: Instant) {
        if self.emcy.raise(fault, now) {
            self.fault_changed(fault, true);
        }
    }

    #[inline(never)]
    pub(super) fn clear(&mut self, fault: Fault, now: Instant) {
        if self.emcy.clear(fault, now) {
            self.fault_changed(fault, false);
        }
    }

    pub(super) fn set_fault(&mut self, fault: Fault, active: bool, now: Instant) {
        if active { self.raise(fault, now) } else { self.clear(fault, now) }
    }

    fn fault_changed(&mut self, fault: Fault, active: bool) {
        self.update_error_register();
        self.application.fault(fault, active, &mut self.image);
        self.services_due = STALE;
    }

    pub(super) fn update_error_register(&mut self) {
        if let Ok(entry) = self.dictionary.find(0x1001, 0) {
            entry.field.store(&mut self.image, [self.emcy.register()]);
        }
    }
}
