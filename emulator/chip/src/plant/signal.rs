//! Quantities as functions of time.

use std::f64::consts::TAU;

use canbus::Time;

use super::table::Table;
use crate::random::mix;

/// A quantity as a function of the time since its signal was set, in seconds.
#[derive(Clone, Debug, PartialEq)]
pub enum Signal {
    /// A constant value.
    Constant(f64),
    /// A sine that starts at its offset and rises.
    Sine {
        /// Mean value.
        offset: f64,
        /// Half of peak to peak.
        amplitude: f64,
        /// Frequency.
        hertz: f64,
    },
    /// A straight line, constant after its end.
    Ramp {
        /// Value at the start.
        from: f64,
        /// Value at the end.
        to: f64,
        /// Duration.
        seconds: f64,
    },
    /// One value before an instant, another value after it.
    Step {
        /// Value before.
        from: f64,
        /// Value after.
        to: f64,
        /// Seconds until the step.
        at: f64,
    },
    /// White noise with a normal distribution. The same seed gives the same noise.
    Noise {
        /// Mean value.
        mean: f64,
        /// Standard deviation.
        sigma: f64,
        /// The seed of the noise.
        seed: u64,
    },
    /// The values of a CSV file.
    Table(Table),
}

impl Signal {
    /// The value `age` after the signal was set.
    pub fn at(&self, age: Time) -> f64 {
        let seconds = age.as_secs_f64();
        match self {
            Signal::Constant(value) => *value,
            Signal::Sine { offset, amplitude, hertz } => offset + amplitude * (TAU * hertz * seconds).sin(),
            Signal::Ramp { from, to, seconds: all } => from + (to - from) * (seconds / all).min(1.0),
            Signal::Step { from, to, at } => *if seconds < *at { from } else { to },
            Signal::Noise { mean, sigma, seed } => mean + sigma * normal(*seed, age),
            Signal::Table(table) => table.at(seconds),
        }
    }
}

impl Signal {
    /// The lowest value of the signal; noise does not count.
    pub fn lowest(&self) -> f64 {
        self.ends().0
    }

    /// The highest value of the signal; noise does not count.
    pub fn highest(&self) -> f64 {
        self.ends().1
    }

    fn ends(&self) -> (f64, f64) {
        match self {
            Signal::Constant(value) => (*value, *value),
            Signal::Sine { offset, amplitude, .. } => (offset - amplitude.abs(), offset + amplitude.abs()),
            Signal::Ramp { from, to, .. } | Signal::Step { from, to, .. } => (from.min(*to), from.max(*to)),
            Signal::Noise { mean, .. } => (*mean, *mean),
            Signal::Table(table) => table.ends(),
        }
    }
}

/// A number of the standard normal distribution that depends only on the seed and the instant (Box-Muller).
fn normal(seed: u64, age: Time) -> f64 {
    let first = mix(mix(seed) ^ age.0);
    let radius = (-2.0 * unit(first).ln()).sqrt();
    radius * (TAU * unit(mix(first))).cos()
}

/// From 2^-53 to 1, zero excluded.
fn unit(bits: u64) -> f64 {
    ((bits >> 11) + 1) as f64 / (1_u64 << 53) as f64
}

/// A signal and when it was set.
#[derive(Clone, Debug)]
pub(super) struct Stimulus {
    signal: Signal,
    since: Time,
}

impl Stimulus {
    pub(super) fn new(signal: Signal, since: Time) -> Self {
        Self { signal, since }
    }

    pub(super) fn signal(&self) -> &Signal {
        &self.signal
    }

    pub(super) fn at(&self, now: Time) -> f64 {
        self.signal.at(now.since(self.since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(signal: &Signal, millis: u64) -> f64 {
        signal.at(Time::from_millis(millis))
    }

    #[test]
    fn signals_have_their_shape() {
        let sine = Signal::Sine { offset: 10.0, amplitude: 4.0, hertz: 2.0 };
        assert!((at(&sine, 125) - 14.0).abs() < 1e-9 && (at(&sine, 375) - 6.0).abs() < 1e-9);
        let ramp = Signal::Ramp { from: 10.0, to: 0.0, seconds: 2.0 };
        assert_eq!([0, 500, 2000, 9000].map(|t| at(&ramp, t)), [10.0, 7.5, 0.0, 0.0]);
        let step = Signal::Step { from: 1.0, to: 2.0, at: 0.5 };
        assert_eq!([0, 499, 500, 501].map(|t| at(&step, t)), [1.0, 1.0, 2.0, 2.0]);
    }

    #[test]
    fn the_lowest_value_of_each() {
        let sine = Signal::Sine { offset: 10.0, amplitude: -4.0, hertz: 2.0 };
        let ramp = Signal::Ramp { from: 10.0, to: 0.0, seconds: 2.0 };
        let step = Signal::Step { from: 1.0, to: 2.0, at: 0.5 };
        let noise = Signal::Noise { mean: 3.0, sigma: 9.0, seed: 1 };
        assert_eq!([sine, ramp, step, noise].map(|signal| signal.lowest()), [6.0, 0.0, 1.0, 3.0]);
    }

    #[test]
    fn noise_is_normal_and_repeats() {
        let noise = |seed| Signal::Noise { mean: 100.0, sigma: 2.0, seed };
        let course = |seed| (0..20_000).map(|t| noise(seed).at(Time::from_micros(t))).collect::<Vec<f64>>();
        let values = course(1);
        assert_eq!(values, course(1));
        assert_ne!(values, course(2));
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        assert!((mean - 100.0).abs() < 0.05, "{mean}");
        assert!((variance.sqrt() - 2.0).abs() < 0.05, "{variance}");
    }
}
