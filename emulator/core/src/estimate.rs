//! Three estimates of cycle counts. The manuals give ranges where a count depends on details that are not modelled: the
//! pipeline, the edge of a slower clock, the content of the buffers.
//!
//! Sources: Cortex-M4 technical reference manual, tables 3-1 and 7-1 and section 3.9; AMBA 3 APB, 2.1; RM0390, 3.4.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// The end of the published range that is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimate {
    /// The fewest cycles of each instruction, and a flash that never lets the core wait.
    Best,
    /// The most likely cycles of each instruction, and a flash that never lets the core wait.
    #[default]
    Modelled,
    /// The most cycles of each instruction, and waits for the flash at each miss of its caches.
    Worst,
}

impl Estimate {
    /// The figure for this estimate.
    #[inline]
    pub(crate) fn of(self, best: u32, modelled: u32, worst: u32) -> u32 {
        match self {
            Estimate::Best => best,
            Estimate::Modelled => modelled,
            Estimate::Worst => worst,
        }
    }

    /// Cycles to refill the pipeline after a jump.
    pub(crate) fn refill(self) -> u32 {
        self.of(1, 2, 3)
    }

    /// Extra cycles of an access to a peripheral, compared to RAM: two cycles of the bus for the transfer, up to two
    /// for the previous buffered transfer, and up to one for the edge. `divider` is HCLK divided by the clock of the
    /// APB bus; AHB has none.
    pub(crate) fn peripheral(self, divider: Option<u32>, load: bool) -> u32 {
        match divider {
            Some(divider) if load => self.of(2 * divider - 1, 3 * divider, 5 * divider),
            Some(divider) => self.of(0, 2 * divider, 5 * divider),
            None => self.of(0, 0, 2),
        }
    }

    /// Cycles of an exception entry. In the worst case, the handler also saves the floating-point registers for which
    /// the frame has space.
    pub(crate) fn entry(self, floats: bool) -> u32 {
        12 + self.of(0, 0, if floats { FLOATS_OF_FRAME } else { 0 })
    }

    /// Cycles of an exception return to the program.
    pub(crate) fn exit(self, floats: bool) -> u32 {
        self.of(10, 12, 12 + if floats { FLOATS_OF_FRAME } else { 0 })
    }
}

/// Cycles from one handler to the next.
pub(crate) const TAIL_CHAIN: u32 = 6;

/// Cycles to save S0 to S15 and FPSCR: one each.
const FLOATS_OF_FRAME: u32 = 17;

/// The text names none of the three estimates.
#[derive(Debug, Error)]
#[error("cycles are best, modelled or worst")]
pub struct NoEstimate;

impl FromStr for Estimate {
    type Err = NoEstimate;

    fn from_str(text: &str) -> Result<Estimate, NoEstimate> {
        let all = [Estimate::Best, Estimate::Modelled, Estimate::Worst];
        all.into_iter().find(|estimate| estimate.to_string() == text).ok_or(NoEstimate)
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Estimate::Best => "best",
            Estimate::Modelled => "modelled",
            Estimate::Worst => "worst",
        })
    }
}
