//! What happened to a machine that its user should know.

use crate::fault::Fault;

/// A reset or a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A fault was taken.
    Fault(Fault),
    /// The program asked for a reset.
    SoftwareReset,
    /// The chip reset itself: a watchdog.
    ChipReset,
}
