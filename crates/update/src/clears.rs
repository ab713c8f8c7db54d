//! The budget of clears (1F51h = 3), which limits how fast a master can wear the flash out.

/// The clears that the budget has to make up for: [`BURST`](Clears::BURST) are allowed at once, and one more every
/// [`INTERVAL_SECONDS`](Clears::INTERVAL_SECONDS) of operation.
///
/// The number is kept in RAM that survives a reset (region `RETAINED` of memory.x). A loss of power restores the budget.
/// The bootloader spends the budget with [`crate::Updater::clear_within`]; the application [refills](Clears::refill) it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clears(u8);

impl Clears {
    /// Clears allowed at once.
    pub const BURST: u8 = 50;
    /// Time until one more clear is allowed.
    pub const INTERVAL_SECONDS: u64 = (1 << Self::INTERVAL) / 1_000_000;

    /// The interval is this power of two of microseconds, 17.9 minutes.
    const INTERVAL: u32 = 30;

    /// The number of intervals that have passed at this time in microseconds since the start.
    #[must_use]
    pub fn intervals(now: u64) -> u8 {
        (now >> Self::INTERVAL & 0xFF) as u8
    }

    /// The number in a word of RAM; 0 if the word is invalid, for example after power-up.
    #[must_use]
    pub fn from_word(word: u32) -> Clears {
        Clears(crate::crashes::unsealed(word))
    }

    /// The word to store.
    #[must_use]
    pub fn word(self) -> u32 {
        crate::crashes::sealed(self.0)
    }

    /// The budget after this number of intervals of operation.
    #[must_use]
    pub fn refill(self, intervals: u8) -> Clears {
        Clears(self.0.saturating_sub(intervals))
    }

    /// Number of clears allowed now.
    #[must_use]
    pub fn left(self) -> u8 {
        Self::BURST.saturating_sub(self.0)
    }

    /// The budget after a clear.
    #[must_use]
    pub(crate) fn spent(self) -> Clears {
        Clears(self.0.saturating_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_allows_a_burst_and_then_one_clear_an_interval() {
        let mut clears = Clears::from_word(0x5555_5555);
        assert_eq!(clears.left(), 50, "after a loss of power");
        for left in (0..50).rev() {
            clears = Clears::from_word(clears.spent().word());
            assert_eq!(clears.left(), left);
        }
        assert_eq!(clears.refill(1).left(), 1);
        assert_eq!(clears.refill(200).left(), 50, "no more than the burst");
        assert_eq!((Clears::intervals(1073 * 1_000_000), Clears::intervals(1074 * 1_000_000)), (0, 1));
    }
}
