//! What happened that a program or its author should know: faults and resets.

use canbus::Time;

use crate::exception::Exception;
use crate::fault::Fault;

/// A fault or a reset after power-on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A fault was raised.
    Fault(FaultReport),
    /// The program asked for a reset.
    SoftwareReset,
    /// The chip reset itself: a watchdog.
    ChipReset,
}

/// A fault and the registers at that moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultReport {
    /// What.
    pub fault: Fault,
    /// The exception that handles it: HardFault when it was escalated.
    pub handler: Exception,
    /// Where: the address of the instruction, or of the next block for what is noticed later.
    pub pc: u32,
    /// LR.
    pub lr: u32,
    /// SP.
    pub sp: u32,
    /// CFSR with the bits of this fault.
    pub status: u32,
}

/// Incidents since the machine was made: the first of them, as many as are worth keeping.
#[derive(Clone, Debug, Default)]
pub(crate) struct Incidents(Vec<(Time, Incident)>);

/// A program that faults in a loop must not fill the host's memory.
const KEPT: usize = 1000;

impl Incidents {
    pub(crate) fn add(&mut self, at: Time, incident: Incident) {
        if self.0.len() < KEPT {
            self.0.push((at, incident));
        }
    }

    pub(crate) fn all(&self) -> &[(Time, Incident)] {
        &self.0
    }
}
