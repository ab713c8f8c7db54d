//! What happened to a machine that its user should know.

use chip::Breach;

use crate::fault::Fault;

/// A reset or a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A fault was taken.
    Fault(Fault),
    /// The program asked for a reset.
    SoftwareReset,
    /// The program broke a rule of the chip.
    Breach {
        /// The rule.
        rule: Breach,
        /// The code that did it: its block, or after [`crate::Machine::interleave`] the instruction.
        pc: u32,
    },
    /// The chip reset itself: a watchdog.
    ChipReset,
}
