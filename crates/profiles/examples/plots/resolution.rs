//! The resolution of the mean of 16 conversions of 12 bits, found by simulation.

use std::f64::consts::TAU;

use profiles::board::RawSample;
use profiles::pressure::PressureCalibration;

const CODES: f64 = 4096.0;
const CONVERSIONS: u16 = 16;
/// The supply of the transducer as the converter reads it, as on the board: 3.0 V of 3.3 V.
const SUPPLY: u32 = 3724;
/// The number of pressures that are tried.
const TRIALS: u32 = 20_000;

/// The difference between the measured and the true pressure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Resolution {
    /// Root mean square in steps of a conversion.
    pub(crate) steps: f64,
    /// Root mean square in Pa.
    pub(crate) pascal: f64,
}

impl Resolution {
    /// Bits of an ideal converter with the same error. An ideal converter of `b` bits over the same range has an error
    /// of `2^-b`, divided by the square root of 12.
    pub(crate) fn bits(&self) -> f64 {
        (CODES / (self.steps * 12_f64.sqrt())).log2()
    }
}

/// Measures pressures across the range with noise of this standard deviation, in steps, on each conversion.
pub(crate) fn resolution(noise: f64) -> Resolution {
    let calibration = PressureCalibration::default();
    let mut random = fastrand::Rng::with_seed(404);
    let (mut pascal, mut steps) = (0.0, 0.0);
    for _ in 0..TRIALS {
        let code = f64::from(SUPPLY) * (0.1 + 0.8 * random.f64());
        let sum: f64 = (0..CONVERSIONS).map(|_| convert(code + noise * normal(&mut random))).sum();
        let measured = calibration.pressure(raw(sum).ratio(), None);
        let expected = 1e6 * (code / f64::from(SUPPLY) - 0.1) / 0.8;
        pascal += (f64::from(measured) - expected).powi(2);
        steps += (sum / f64::from(CONVERSIONS) - code).powi(2);
    }
    let root = |sum: f64| (sum / f64::from(TRIALS)).sqrt();
    Resolution { steps: root(steps), pascal: root(pascal) }
}

/// The converter. The first transition is at half a step.
fn convert(code: f64) -> f64 {
    code.round().clamp(0.0, CODES - 1.0)
}

/// A number of the standard normal distribution (Box-Muller).
fn normal(random: &mut fastrand::Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    radius * (TAU * random.f64()).cos()
}

fn raw(pressure: f64) -> RawSample {
    RawSample {
        pressure: pressure as u32,
        supply: SUPPLY * u32::from(CONVERSIONS),
        temperature: 0,
        reference: 0,
        thermistor: 0,
        count: CONVERSIONS,
    }
}
