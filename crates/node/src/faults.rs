//! Faults reported by the profile, the bus and the firmware.

use canopen::{BusEvent, Instant};
use profiles::Snapshot;
use profiles::fault::Fault;

use crate::{Next, Protocol, fault};

/// Milliseconds for which a fault of the profile must be absent before its end is reported. A loose contact that fails
/// many times a second is one fault and fills neither the bus nor 1003h.
const HOLD: u16 = 100;
/// The same for a fault that has come back: a contact that fails a few times a second is one fault as well.
const LONG_HOLD: u16 = 1000;
/// Milliseconds after the reported end in which a fault returns.
const MEMORY: u16 = 2000;

/// The faults of the profile that are reported: one bit for each, in the order of the profile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shown {
    faults: u32,
    /// The faults that have come back.
    repeated: u32,
    /// Milliseconds until a fault is forgotten, for each bit. Above `MEMORY`, its end is not reported yet.
    left: [u16; 32],
    /// Whether a fault is not forgotten.
    is_counting: bool,
}

impl Shown {
    /// Takes the faults of a millisecond. Returns the faults whose report changes.
    pub(crate) fn update(&mut self, present: u32) -> u32 {
        if present == 0 && !self.is_counting {
            return 0;
        }
        let (mut faults, mut counting) = (0, 0);
        for (place, left) in (0..).zip(&mut self.left) {
            let bit = 1 << place;
            if present & bit != 0 {
                if (1..=MEMORY).contains(left) {
                    self.repeated |= bit;
                }
                *left = MEMORY + if self.repeated & bit != 0 { LONG_HOLD } else { HOLD };
            } else {
                *left = left.saturating_sub(1);
            }
            faults |= if *left > MEMORY { bit } else { 0 };
            counting |= if *left > 0 { bit } else { 0 };
        }
        self.repeated &= counting;
        self.is_counting = counting != 0;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of reports in 20 s of a fault that lasts 10 ms and returns after each period.
    fn reports(period: u32) -> u32 {
        let mut shown = Shown::default();
        (0..20_000).map(|ms| shown.update(u32::from(ms % period < 10)).count_ones()).sum()
    }

    #[test]
    fn a_loose_contact_sends_no_stream_of_reports() {
        // More often than ten times a second it is one fault.
        assert_eq!(reports(20), 1);
        // The first end, and then one fault.
        for period in [120, 200, 500, 990] {
            assert_eq!(reports(period), 3, "every {period} ms");
        }
        assert_eq!(reports(1500), 2 * 14 - 1, "every 1.5 s; the last end is later");
    }

    #[test]
    fn a_fault_after_a_long_time_ends_soon() {
        let mut shown = Shown::default();
        for _ in 0..3 {
            assert_eq!(shown.update(1), 1);
            let end = (1..=MEMORY).find(|_| shown.update(0) == 1);
            assert_eq!(end, Some(HOLD));
            assert!((0..MEMORY).all(|_| shown.update(0) == 0));
        }
    }

    #[test]
    fn a_repeated_fault_is_forgotten_in_the_end() {
        let mut shown = Shown::default();
        let ends_after = |shown: &mut Shown| (1..=LONG_HOLD).find(|_| shown.update(0) == 1);
        for expected in [HOLD, LONG_HOLD] {
            assert_eq!(shown.update(1), 1);
            assert_eq!(ends_after(&mut shown), Some(expected));
        }
        assert!((0..MEMORY).all(|_| shown.update(0) == 0));
        assert_eq!((shown.update(1), ends_after(&mut shown)), (1, Some(HOLD)));
    }
}
