//! Faults of the bus and of the application, and the reaction to an error (object 1029h).

use super::Definition;
use super::inner::Inner;
use super::{Application, Device, Next, STALE};
use crate::dictionary::Services;
use crate::emcy::{ErrorClass, Fault};
use crate::nmt::State;
use crate::pdo::RpdoFault;
use crate::{Instant, Span, Tick};

/// Error behaviour.
const ERROR_BEHAVIOUR: u16 = 0x1029;
/// Values of 1029h: 0 leads to Pre-operational, 2 to Stopped; 1 changes nothing.
const TO_PRE_OPERATIONAL: u32 = 0;
const TO_STOPPED: u32 = 2;

/// How long no event may occur before its fault ends.
const QUIET: Span = Span::from_millis(500);

/// An event that the CAN controller reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BusEvent {
    /// Received frames were lost. The fault (8110h) ends when none was lost for half a second.
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

impl<D: Definition> Device<D> {
    /// Takes an event of the CAN controller: sets and clears the faults 8110h, 8120h and 8140h, and treats bus-off as a
    /// communication error. A warning has no emergency code, because the node still works; a worse state is reported as
    /// error passive.
    pub fn on_bus(&mut self, event: BusEvent, now: Instant) -> Next {
        let now = self.tick(now);
        let inner = &mut self.inner;
        match event {
            BusEvent::Warning => (),
            BusEvent::Overrun => inner.report(Fault::Overrun, now),
            BusEvent::Passive => inner.raise(Fault::ErrorPassive, now),
            BusEvent::BusOff => {
                inner.is_bus_off = true;
                return self.error(ErrorClass::COMMUNICATION);
            }
            BusEvent::Recovered => inner.recover(now),
        }
        self.process_next()
    }

    /// Sets or clears a fault of the application, by its number in [`Application::CONDITIONS`]. A fault is signalled
    /// once, until it is cleared.
    pub fn set_condition(&mut self, number: u8, active: bool, now: Instant) -> Next {
        let now = self.tick(now);
        self.inner.set_fault(Fault::Application(number), active, now);
        self.process_next()
    }

    /// Reacts to an error as object 1029h says. A [`Condition`](crate::Condition) with a class needs no such call: its
    /// fault is the error.
    pub fn error(&mut self, class: ErrorClass) -> Next {
        self.inner.emcy.add_error(class);
        self.inner.react();
        self.silence_services();
        self.inner.services_due = STALE;
        self.process_next()
    }
}

impl<D: Definition> Inner<D> {
    /// Applies object 1029h to the errors since the last call.
    ///
    /// Stopped has no EMCY. A node that has to stop is therefore Pre-operational until its EMCYs are sent; after
    /// bus-off, that is after the recovery.
    pub(super) fn react(&mut self) {
        while let Some(class) = self.emcy.take_error() {
            self.application.error(class, self.image.as_mut());
            let ErrorClass(sub) = class;
            let behaviour = self.number(ERROR_BEHAVIOUR, sub);
            if self.state == State::Operational && matches!(behaviour, TO_PRE_OPERATIONAL | TO_STOPPED) {
                self.enter(State::PreOperational);
            }
            if self.state.has_services() && behaviour == TO_STOPPED {
                self.pending.next_state = Some(State::Stopped);
            }
        }
        let has_to_stop = self.pending.next_state == Some(State::Stopped);
        if has_to_stop && (!Self::has(Services::EMCY) || self.emcy.is_idle()) && !self.is_bus_off {
            self.pending.next_state = None;
            self.enter(State::Stopped);
        }
    }

    /// After a reset: reports the faults that are still active, and the groups that could not be loaded.
    pub(super) fn configure_faults(&mut self, now: Tick) {
        // First: a group that has been repaired is no active fault.
        self.set_stored();
        if Self::has(Services::EMCY) {
            let application = &self.application;
            self.emcy.restart(|number| application.fault_detail(number), now);
        } else {
            self.emcy.restart_silently();
        }
        self.update_error_register();
    }

    /// EMCY has been switched on: reports the active faults. Messages that have waited are older.
    pub(super) fn report_active(&mut self, now: Tick) {
        self.emcy.forget_waiting();
        let application = &self.application;
        self.emcy.repeat_singles(|number| application.fault_detail(number), now);
        for number in self.watches.lost() {
            let _ = self.emcy.repeat(Fault::Heartbeat(number), None, now);
        }
        for rpdo in self.rpdos.as_ref() {
            for kind in RpdoFault::ALL {
                if rpdo.has(kind) {
                    let _ = self.emcy.repeat(rpdo.fault(kind), None, now);
                }
            }
        }
        self.services_due = STALE;
    }

    /// Reports bus-off after the recovery: during bus-off, the node cannot send.
    fn recover(&mut self, now: Tick) {
        if core::mem::take(&mut self.is_bus_off) {
            self.raise(Fault::BusOffRecovered, now);
        }
        self.clear(Fault::ErrorPassive, now);
        self.clear(Fault::BusOffRecovered, now);
    }

    /// Reports an event: lost frames, or a multiplexed PDO that is not taken. Both faults end after a quiet time without
    /// either event, because a burst is one fault: two EMCYs for each event would flood the bus and the list of errors (1003h).
    #[inline(never)]
    pub(super) fn report(&mut self, fault: Fault, now: Tick) {
        self.raise(fault, now);
        self.quiet_at = now.plus(QUIET);
    }

    /// The quiet time is over.
    pub(super) fn end_events(&mut self, now: Tick) {
        self.quiet_at = Tick::NEVER;
        self.clear(Fault::Overrun, now);
        self.clear(Fault::MpdoNotTaken, now);
    }

    pub(super) fn raise(&mut self, fault: Fault, now: Tick) {
        self.set_fault(fault, true, now);
    }

    pub(super) fn clear(&mut self, fault: Fault, now: Tick) {
        self.set_fault(fault, false, now);
    }

    // Not inlined: many callers, none of them time-critical.
    #[inline(never)]
    pub(super) fn set_fault(&mut self, fault: Fault, active: bool, now: Tick) {
        let is_change = if Self::has(Services::EMCY) {
            let detail = match fault {
                Fault::Application(number) if active => self.application.fault_detail(number),
                _ => None,
            };
            self.emcy.set(fault, active, detail, now)
        } else {
            self.emcy.set_silently(fault, active)
        };
        if is_change {
            self.update_error_register();
            self.application.fault(fault, active, self.image.as_mut());
            self.services_due = STALE;
        }
    }

    pub(super) fn update_error_register(&mut self) {
        if let Ok(entry) = self.dictionary.find(0x1001, 0) {
            entry.field.store(self.image.as_mut(), [self.emcy.register()]);
        }
    }
}
