//! Samples that may have been taken with older parameters.

/// Counts the samples that may have been taken before a write: the sample of this millisecond may have been taken, and
/// the next one may have begun, before the new parameters arrive at the measurement.
#[derive(Clone, Copy, Debug)]
pub struct OlderSamples(u8);

impl OlderSamples {
    /// No sample is older than the parameters.
    pub const NONE: OlderSamples = OlderSamples(0);

    /// Parameters have been written.
    pub const BEGIN: OlderSamples = OlderSamples(3);

    /// A sample has been taken. Returns whether it is the last one that may have been taken with older parameters.
    pub fn take(&mut self) -> bool {
        let is_last = self.0 == 1;
        self.0 = self.0.saturating_sub(1);
        is_last
    }

    /// Whether the next sample may have been taken with older parameters.
    #[must_use]
    pub fn are_left(self) -> bool {
        self.0 > 0
    }
}
