//! Incidents of a machine: faults, resets, and broken rules.

use chip::Breach;

use crate::fault::Fault;

/// An incident.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A fault was taken.
    Fault(Fault),
    /// The program requested a reset.
    SoftwareReset,
    /// The program broke a rule of the chip.
    Breach {
        /// The rule.
        rule: Breach,
        /// The code that broke the rule: the block or, after [`crate::Machine::interleave`], the instruction.
        pc: u32,
    },
    /// The chip reset itself through a watchdog.
    ChipReset,
}
