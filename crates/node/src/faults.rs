//! Faults reported by the profile, the bus and the firmware.

use canopen::{BusEvent, ErrorClass, Instant};
use profiles::Snapshot;
use profiles::fault::{Fault, Flags};

use crate::{Next, Protocol, fault};

/// The profile's faults that the values of a millisecond show: one bit for each, in the order of the profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Shown(u32);

impl Shown {
    pub(crate) fn of(snapshot: &Snapshot) -> Shown {
        let (mut shown, mut bit) = (0, 1_u32);
        snapshot.faults(&mut |_, active| {
            shown |= if active { bit } else { 0 };
            bit <<= 1;
        });
        Shown(shown)
    }
}

impl Protocol {
    /// Takes note of an event on the bus.
    pub fn bus_event(&mut self, event: BusEvent, now: Instant) -> Next {
        let next = self.device.on_bus(event, now);
        self.note(next)
    }

    /// Sets or clears a fault of the [list](crate::FAULTS): in the flags of 3000h if the profile has them, in the error
    /// register, and with an EMCY.
    pub fn set_fault(&mut self, fault: &Fault, active: bool, now: Instant) -> Next {
        // A fault that is not in the list has no bit and is not signalled.
        let number = fault::number(fault).unwrap_or(u8::MAX);
        self.device.application_mut().flags.set(fault.flags, active);
        self.device.show(|application, image| application.show_flags(image));
        let next = self.device.set_condition(number, active, now);
        let is_error = active && fault.flags != Flags::NONE;
        if is_error { self.device.error(ErrorClass::DEVICE) } else { next }
    }

    /// Sets and clears the profile's faults that have changed. The services task sends the EMCYs.
    pub(crate) fn follow_faults(&mut self, Shown(shown): Shown, now: Instant) {
        let snapshot = self.device.application().snapshot;
        let Shown(before) = core::mem::replace(&mut self.shown, Shown(shown));
        let mut bit = 1_u32;
        snapshot.faults(&mut |fault, active| {
            if (shown ^ before) & bit != 0 {
                let _ = self.set_fault(fault, active, now);
            }
            bit <<= 1;
        });
    }
}
