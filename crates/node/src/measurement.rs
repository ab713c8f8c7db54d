//! The sampling half: one raw sample in, one snapshot out, a thousand times a second.

use profiles::pressure::RawSample;

/// All parameters of the measurement, as one consistent set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {}

/// All measured values of one millisecond, as one consistent set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {}

/// The measurement chain and its state.
#[derive(Debug, Default)]
pub struct Measurement {}

impl Measurement {
    /// A chain with the default parameters.
    #[must_use]
    pub fn new() -> Measurement {
        Measurement::default()
    }

    /// Takes over new parameters, from the next sample on.
    pub fn apply(&mut self, parameters: &Parameters) {
        let _ = parameters;
    }

    /// Processes the sums of one millisecond.
    pub fn sample(&mut self, raw: &RawSample) -> Snapshot {
        let _ = raw;
        Snapshot::default()
    }
}
