//! Why an instruction could not be carried out, and the status bits that say so (ARMv7-M ARM, B1.5.14 and B3.2.15).

use crate::exception::Exception;

/// A fault of the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A load or store of an address where nothing answers.
    DataBus {
        /// The address accessed.
        address: u32,
    },
    /// A peripheral, or the core's own registers, answered an access with an error. The CPU library tells no
    /// instruction address inside such an access, so these are imprecise: taken at the end of the basic block.
    ImpreciseBus {
        /// The address accessed; a program cannot see it.
        address: u32,
    },
    /// An instruction fetch where nothing answers.
    Fetch {
        /// The address fetched.
        address: u32,
    },
    /// An instruction fetch from a region that never holds code.
    Execute {
        /// The address fetched.
        address: u32,
    },
    /// The frame of an exception could not be pushed.
    Stacking,
    /// The frame of an exception could not be popped.
    Unstacking,
    /// An undefined instruction.
    Undefined,
    /// A branch to an address without the Thumb bit.
    InvalidState,
    /// A return with an illegal EXC_RETURN or frame.
    InvalidReturn,
    /// An FPU instruction while CPACR keeps the FPU off; noticed at the start of its basic block.
    NoCoprocessor,
    /// An unaligned access by an instruction that allows none.
    Unaligned,
    /// The vector of an exception could not be read.
    VectorTable,
    /// BKPT without a debugger.
    Breakpoint,
    /// SVC at a priority at which SVCall cannot be taken.
    SupervisorCall,
}

impl Fault {
    /// The exception that handles it when it is enabled and may preempt.
    pub(crate) fn exception(self) -> Exception {
        match self {
            Fault::DataBus { .. }
            | Fault::ImpreciseBus { .. }
            | Fault::Fetch { .. }
            | Fault::Stacking
            | Fault::Unstacking => Exception::BUS_FAULT,
            Fault::Execute { .. } => Exception::MEM_MANAGE,
            Fault::VectorTable | Fault::Breakpoint | Fault::SupervisorCall => Exception::HARD_FAULT,
            _ => Exception::USAGE_FAULT,
        }
    }

    /// Its bits in CFSR, BFARVALID included.
    pub(crate) fn cfsr(self) -> u32 {
        match self {
            Fault::Execute { .. } => 1,
            Fault::Fetch { .. } => 1 << 8,
            Fault::DataBus { .. } => 1 << 15 | 1 << 9,
            Fault::ImpreciseBus { .. } => 1 << 10,
            Fault::Unstacking => 1 << 11,
            Fault::Stacking => 1 << 12,
            Fault::Undefined => 1 << 16,
            Fault::InvalidState => 1 << 17,
            Fault::InvalidReturn => 1 << 18,
            Fault::NoCoprocessor => 1 << 19,
            Fault::Unaligned => 1 << 24,
            Fault::VectorTable | Fault::Breakpoint | Fault::SupervisorCall => 0,
        }
    }

    /// Its bits in HFSR.
    pub(crate) fn hfsr(self) -> u32 {
        match self {
            Fault::VectorTable => 1 << 1,
            Fault::Breakpoint => 1 << 31,
            _ => 0,
        }
    }
}
