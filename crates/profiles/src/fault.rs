//! Faults that a profile detects, with their appearance on the bus.

use canopen::emcy::Condition;

/// A fault of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Name for logs and tests.
    pub name: &'static str,
    /// Error code, bits of the error register, and detail of the EMCY.
    pub condition: Condition,
    /// Flag of the fault, for a dictionary with status flags.
    pub flags: Flags,
}

/// Status flags of the active faults, one bit for each, for a dictionary with status flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// Flags of the sensors.
    pub sensor: u32,
    /// Flags of the rest of the device.
    pub system: u32,
}

impl Flags {
    /// No flag.
    pub const NONE: Flags = Flags { sensor: 0, system: 0 };

    /// One flag of a sensor.
    #[must_use]
    pub const fn sensor(bit: u8) -> Flags {
        Flags { sensor: 1 << bit, system: 0 }
    }

    /// One flag of the rest of the device.
    #[must_use]
    pub const fn system(bit: u8) -> Flags {
        Flags { sensor: 0, system: 1 << bit }
    }

    /// Sets or clears flags.
    pub fn set(&mut self, flags: Flags, active: bool) {
        self.sensor = if active { self.sensor | flags.sensor } else { self.sensor & !flags.sensor };
        self.system = if active { self.system | flags.system } else { self.system & !flags.system };
    }
}

/// Number of faults in all lists.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
#[must_use]
pub const fn count(lists: &[&[Fault]]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < lists.len() {
        total += lists[i].len();
        i += 1;
    }
    total
}

/// The faults of all lists. `N` must be the result of [`count`].
///
/// # Panics
/// During compilation, if `N` is another number.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
#[must_use]
pub const fn gather<const N: usize>(lists: &[&[Fault]]) -> [Fault; N] {
    let mut all = [Fault { name: "", condition: Condition::new(0), flags: Flags::NONE }; N];
    let (mut list, mut i, mut at) = (0, 0, 0);
    while list < lists.len() {
        if i == lists[list].len() {
            (list, i) = (list + 1, 0);
            continue;
        }
        all[at] = lists[list][i];
        (i, at) = (i + 1, at + 1);
    }
    assert!(at == N, "N is not the number of faults");
    all
}
