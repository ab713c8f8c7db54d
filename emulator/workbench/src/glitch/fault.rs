//! Faults of the core.

use std::fmt;

use emulator::Flag;

/// One fault of the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An instruction is skipped.
    Skip {
        /// The address of the instruction.
        at: u32,
        /// Size of the instruction in bytes.
        size: u32,
    },
    /// A condition flag is inverted when this instruction reads the flags, and stays inverted.
    Flag {
        /// The address of the instruction.
        at: u32,
        /// The flag.
        flag: Flag,
    },
    /// A bit of R0 to R14 is inverted when this instruction reads the register, and stays inverted.
    Flip {
        /// The address of the instruction.
        at: u32,
        /// The number of the register.
        register: u8,
        /// The number of the bit.
        bit: u8,
    },
}

impl Fault {
    /// Address of the first instruction with the fault.
    #[must_use]
    pub fn address(self) -> u32 {
        match self {
            Fault::Skip { at, .. } | Fault::Flag { at, .. } | Fault::Flip { at, .. } => at,
        }
    }

    /// Kind of the fault in the counts of a campaign.
    pub(crate) fn kind(self) -> &'static str {
        match self {
            Fault::Skip { .. } => "skips",
            Fault::Flag { .. } => "flags",
            Fault::Flip { .. } => "register bits",
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, text: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::Skip { .. } => write!(text, "skip"),
            Fault::Flag { flag, .. } => write!(text, "flag {flag:?}"),
            Fault::Flip { register, bit, .. } => write!(text, "bit {bit} of R{register}"),
        }
    }
}
