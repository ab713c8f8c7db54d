//! Faults reported by the profile, the bus and the firmware.

use canopen::{BusEvent, Instant};
use profiles::Snapshot;
use profiles::fault::Fault;

use crate::{Next, Protocol, fault};

/// Milliseconds for which a fault of the profile must be absent before its end is reported. A loose contact that fails
/// many times a second is one fault and fills neither the bus nor 1003h.
const HOLD: u8 = 100;

/// The faults of the profile that are reported: one bit for each, in the order of the profile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shown {
    faults: u32,
    /// Milliseconds until the end of a fault is reported, for each bit.
    left: [u8; 32],
}

impl Shown {
    /// Takes the faults of a millisecond. Returns the faults whose report changes.
    pub(crate) fn update(&mut self, present: u32) -> u32 {
        if present | self.faults == 0 {
            return 0;
        }
        let mut faults = 0;
        for (bit, left) in (0..).zip(&mut self.left) {
            *left = if present >> bit & 1 != 0 { HOLD } else { left.saturating_sub(1) };
            faults |= u32::from(*left > 0) << bit;
        }
        faults ^ core::mem::replace(&mut self.faults, faults)
    }
}

/// The faults that the values of a millisecond show, one bit for each.
pub(crate) fn present(snapshot: &Snapshot) -> u32 {
    let (mut present, mut bit) = (0, 1_u32);
    snapshot.faults(&mut |_, active| {
        present |= if active { bit } else { 0 };
        bit <<= 1;
    });
    present
}

impl Protocol {
    /// Takes note of an event on the bus.
    pub fn bus_event(&mut self, event: BusEvent, now: Instant) -> Next {
        let next = self.device.on_bus(event, now);
        self.note(next)
    }

    /// Sets or clears a fault of the [list](crate::FAULTS): in the flags of 3000h if the profile has them, in the error
    /// register, and with an EMCY. Object 1029h:2 applies to a fault with a flag. A fault that is set before the start is
    /// reported after the boot-up message.
    pub fn set_fault(&mut self, fault: &Fault, active: bool, now: Instant) -> Next {
        // A fault that is not in the list has no bit and is not signalled.
        let number = fault::number(fault).unwrap_or(u8::MAX);
        self.device.application_mut().flags.set(fault.flags, active);
        self.device.show(|application, image| application.show_flags(image));
        self.device.set_condition(number, active, now)
    }

    /// Sets and clears these faults of the profile. The services task sends the EMCYs.
    pub(crate) fn follow_faults(&mut self, changed: u32, now: Instant) {
        let snapshot = self.device.application().snapshot;
        let Shown { faults, .. } = self.shown;
        let mut bit = 1_u32;
        snapshot.faults(&mut |fault, _| {
            if changed & bit != 0 {
                let _ = self.set_fault(fault, faults & bit != 0, now);
            }
            bit <<= 1;
        });
    }
}
