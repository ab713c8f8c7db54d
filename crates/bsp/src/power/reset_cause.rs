//! Why the chip was reset, from the flags of `RCC_CSR` (RM0390, 6.3.21).

/// The cause of a reset. The flags accumulate until they are cleared; the order of `FLAGS` decides.
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

/// Flags and causes, the first that is set counts. A loss of power comes first: its flags mean that the supply was off
/// since the flags were last cleared, whatever else has reset the chip since then, for example the watchdog while the
/// clock was late. Power-on also sets the brown-out flag, and all causes set the flag of the pin.
const FLAGS: [(u32, ResetCause); 7] = [
    (1 << 27, ResetCause::PowerOn),
    (1 << 25, ResetCause::BrownOut),
    (1 << 29, ResetCause::IndependentWatchdog),
    (1 << 30, ResetCause::WindowWatchdog),
    (1 << 31, ResetCause::LowPower),
    (1 << 28, ResetCause::Software),
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
    fn the_first_flag_of_the_order_counts() {
        assert_eq!(ResetCause::from_csr(0x0E00_0000), ResetCause::PowerOn);
        assert_eq!(ResetCause::from_csr(0x2400_0003), ResetCause::IndependentWatchdog);
        assert_eq!(ResetCause::from_csr(0x1400_0000), ResetCause::Software);
        assert_eq!(ResetCause::from_csr(0x0400_0000), ResetCause::Pin);
        assert_eq!(ResetCause::from_csr(0x0000_0003), ResetCause::Unknown);
    }

    /// A cold start whose clock came late: the watchdog has reset the chip before anything cleared the flags.
    #[test]
    fn a_loss_of_power_counts_whatever_else_is_set() {
        for other in 0..1 << 7 {
            let flags = other << 25;
            let cause = ResetCause::from_csr(flags);
            let was_off = flags & (1 << 27 | 1 << 25) != 0;
            assert_eq!(cause.is_power_loss(), was_off, "{flags:08X}h");
            assert!(!(was_off && cause.is_unexpected()), "{flags:08X}h");
        }
    }
}
