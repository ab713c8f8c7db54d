//! The sampling half: one raw sample in, one snapshot out, a thousand times a second.

use profiles::pressure::{self, RawSample, Transmitter};

/// All parameters of the measurement, as one consistent set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Of the pressure and temperature channels.
    pub pressure: pressure::Parameters,
}

/// All measured values of one millisecond, as one consistent set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Of the pressure and temperature channels.
    pub pressure: pressure::Snapshot,
}

/// The measurement chain and its state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measurement {
    pressure: Transmitter,
}

impl Measurement {
    /// A chain with the default parameters.
    #[must_use]
    pub fn new() -> Measurement {
        Measurement::default()
    }

    /// Takes over new parameters, from the next sample on.
    pub fn apply(&mut self, parameters: &Parameters) {
        self.pressure.apply(&parameters.pressure);
    }

    /// Processes the sums of one millisecond.
    pub fn sample(&mut self, raw: &RawSample) -> Snapshot {
        Snapshot { pressure: self.pressure.sample(raw) }
    }
}
