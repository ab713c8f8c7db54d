//! Pressures as functions of time.

use std::f64::consts::TAU;

/// The time of a plot in milliseconds.
pub(crate) const LENGTH: usize = 100;
/// The time before the stimulus begins, in milliseconds.
const START: f64 = 10.0;

/// A pressure as a function of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stimulus {
    /// A step from 0 to 5 bar.
    Step,
    /// A sine around 2.5 bar with an amplitude of 2.5 bar, 20 Hz.
    Sine,
    /// A ramp from 0 bar, 5 bar in 80 ms.
    Ramp,
}

impl Stimulus {
    /// All stimuli.
    pub(crate) const ALL: [Stimulus; 3] = [Stimulus::Step, Stimulus::Sine, Stimulus::Ramp];

    /// The pressure in Pa after `ms` milliseconds.
    pub(crate) fn at(self, ms: f64) -> f64 {
        let since = (ms - START).max(0.0);
        match self {
            Stimulus::Step if ms < START => 0.0,
            Stimulus::Step => 500_000.0,
            Stimulus::Sine => 250_000.0 * (1.0 + (TAU * 0.02 * ms).sin()),
            Stimulus::Ramp => 500_000.0 * (since / 80.0).min(1.0),
        }
    }

    /// The title of a plot of the stimulus.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Stimulus::Step => "step to 5 bar",
            Stimulus::Sine => "sine, 20 Hz",
            Stimulus::Ramp => "ramp, 5 bar in 80 ms",
        }
    }
}
