//! Why the chip was reset, from the flags of `RCC_CSR` (RM0390, 6.3.21).

/// The cause. The flags add up until they are cleared; the most telling one counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The independent watchdog was not fed.
    IndependentWatchdog,
    /// The window watchdog.
    WindowWatchdog,
    /// Forbidden entry into standby or stop.
    LowPower,
    /// The program asked for it: NMT reset node, a crash, the debugger.
    Software,
    /// Power was switched on.
    PowerOn,
    /// The supply fell below the brown-out level.
    BrownOut,
    /// The reset pin, which every other cause pulls as well.
    Pin,
    /// No flag is set: they were read and cleared before.
    Unknown,
}

/// Flags and what they mean, the most telling first: power-on sets the brown-out flag too, and all set the pin's.
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
    /// The cause that a value of `RCC_CSR` tells.
    #[must_use]
    pub fn from_csr(csr: u32) -> ResetCause {
        let told = FLAGS.iter().find(|(flag, _)| csr & flag != 0);
        told.map_or(ResetCause::Unknown, |&(_, cause)| cause)
    }

    /// Whether nobody asked for it: a watchdog, or a power-down mode that the images do not use.
    #[must_use]
    pub fn is_unexpected(self) -> bool {
        matches!(self, ResetCause::IndependentWatchdog | ResetCause::WindowWatchdog | ResetCause::LowPower)
    }

    /// Whether the main supply was gone.
    #[must_use]
    pub fn is_power_loss(self) -> bool {
        matches!(self, ResetCause::PowerOn | ResetCause::BrownOut)
    }

    /// For the log.
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
