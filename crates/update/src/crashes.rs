//! Number of crashes of the application since it last confirmed itself.

/// The count, kept in RAM that survives a reset (region `RETAINED` of memory.x).
///
/// The bootloader takes the count from RAM at every start, counts the reset, stores the count, and calls
/// [`crate::boot`]. The application [confirms](Crashes::confirmed) itself ten seconds after its start if it is then on
/// the bus and measures, else as soon as it does. A requested start (1F51h = 1) confirms too, as a new attempt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crashes(u8);

/// Why the chip was reset, in the categories that matter here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reset {
    /// Power-on: RAM has lost its content.
    Power,
    /// Requested by an NMT command, 1F51h or the debugger.
    #[default]
    Asked,
    /// A fault, a panic or the watchdog.
    Crash,
}

impl Crashes {
    /// Number of crashes without a confirmation at which the bootloader no longer starts the application.
    pub const LIMIT: u8 = 3;

    /// The count in a word of RAM; 0 if the word is invalid, for example after power-up.
    #[must_use]
    pub fn from_word(word: u32) -> Crashes {
        Crashes(unsealed(word))
    }

    /// The word to store.
    #[must_use]
    pub fn word(self) -> u32 {
        sealed(self.0)
    }

    /// The count after a reset.
    #[must_use]
    pub fn after(self, reset: Reset) -> Crashes {
        match reset {
            Reset::Power => Crashes(0),
            Reset::Asked => self,
            Reset::Crash => Crashes(self.0.saturating_add(1)),
        }
    }

    /// The count after the application has confirmed itself.
    #[must_use]
    pub fn confirmed(self) -> Crashes {
        Crashes(0)
    }

    /// Number of crashes since the last confirmation.
    #[must_use]
    pub fn count(self) -> u8 {
        self.0
    }
}

/// A count as a word of RAM: the count, and its complement in the other three bytes.
pub(crate) fn sealed(count: u8) -> u32 {
    u32::from_le_bytes([count, !count, !count, !count])
}

/// The count in a word of RAM; 0 if the word is invalid, for example after power-up.
#[inline(never)] // Little room in flash.
pub(crate) fn unsealed(word: u32) -> u8 {
    let [count, ..] = word.to_le_bytes();
    if sealed(count) == word { count } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_ram_after_power_up_counts_no_crash() {
        for word in [0, u32::MAX, 0x5555_5555, 0xFFFF_FF01, 3] {
            assert_eq!(Crashes::from_word(word).count(), 0);
        }
        for count in 0..=u8::MAX {
            assert_eq!(Crashes::from_word(Crashes(count).word()), Crashes(count));
        }
    }

    #[test]
    fn the_word_is_the_count_and_its_complement_three_times() {
        assert_eq!(Crashes(0).word(), 0xFFFF_FF00);
        assert_eq!(Crashes(0x12).word(), 0xEDED_ED12);
    }

    #[test]
    fn only_crashes_count_and_only_until_a_confirmation() {
        let crashes =
            [Reset::Crash, Reset::Asked, Reset::Crash].into_iter().fold(Crashes::default(), Crashes::after);
        assert_eq!(crashes.count(), 2);
        assert_eq!(crashes.confirmed().after(Reset::Crash).count(), 1);
        assert_eq!(crashes.after(Reset::Power).count(), 0);
        assert_eq!(Crashes(u8::MAX).after(Reset::Crash).count(), u8::MAX);
    }
}
