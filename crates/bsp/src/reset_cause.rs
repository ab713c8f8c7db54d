//! Why the chip was reset, from the flags of `RCC_CSR` (RM0390, 6.3.21).

/// The cause of a reset. The flags accumulate until they are cleared; the most specific one counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The independent watchdog was not fed.
    IndependentWatchdog,
    /// The window watchdog was not fed in time.
    WindowWatchdog,
    /// Forbidden entry into standby or stop.
    LowPower,
    /// Requested by the program: NMT reset node, a crash, the debugger.
    Software,
    /// Power was switched on.
    PowerOn,
    /// The supply fell below the brown-out level.
    BrownOut,
    /// The reset pin, which every other cause pulls too.
    Pin,
    /// No flag is set: the flags were read and cleared before.
    Unknown,
}

/// Flags and causes, the most specific first: power-on also sets the brown-out flag, and all causes set the flag of the
/// pin.
const FLAGS: [(u32, ResetCause); 7] = [
    (1 << 29, ResetCause::IndependentWatchdog),
    (1 << 30, ResetCause::WindowWatchdog),
    (1 << 31, ResetCause::LowPower),
    (1 << 28, ResetCause::Software),
    (1 << 27, ResetCause::PowerOn),
    (1 << 25, ResetCause::BrownOut),
    (1 << 26, ResetCause::Pin),
];

impl ResetCause {
    /// The cause in a value of `RCC_CSR`.
    #[must_use]
    pub fn from_csr(csr: u32) -> ResetCause {
        let told = FLAGS.iter().find(|(flag, _)| csr & flag != 0);
        told.map_or(ResetCause::Unknown, |&(_, cause)| cause)
    }

    /// Whether the reset was not requested: a watchdog, or a power-down mode that the images do not use.
    #[must_use]
    pub fn is_unexpected(self) -> bool {
        matches!(self, ResetCause::IndependentWatchdog | ResetCause::WindowWatchdog | ResetCause::LowPower)
    }

    /// Whether the main supply was off.
    #[must_use]
    pub fn is_power_loss(self) -> bool {
        matches!(self, ResetCause::PowerOn | ResetCause::BrownOut)
    }

    /// Name for the log.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            ResetCause::IndependentWatchdog => "independent watchdog",
            ResetCause::WindowWatchdog => "window watchdog",
            ResetCause::LowPower => "low power",
            ResetCause::Software => "software",
            ResetCause::PowerOn => "power on",
            ResetCause::BrownOut => "brown-out",
            ResetCause::Pin => "reset pin",
            ResetCause::Unknown => "unknown",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_telling_flag_counts() {
        assert_eq!(ResetCause::from_csr(0x0E00_0000), ResetCause::PowerOn);
        assert_eq!(ResetCause::from_csr(0x2400_0003), ResetCause::IndependentWatchdog);
        assert_eq!(ResetCause::from_csr(0x1400_0000), ResetCause::Software);
        assert_eq!(ResetCause::from_csr(0x0400_0000), ResetCause::Pin);
        assert_eq!(ResetCause::from_csr(0x0000_0003), ResetCause::Unknown);
    }
}
