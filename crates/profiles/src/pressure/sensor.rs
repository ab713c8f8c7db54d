//! From converter readings to field values in Pa and K, and what the readings say about the sensor.

use super::RawSample;

/// Largest reading of a 12-bit conversion.
const FULL_SCALE: u32 = 4095;
/// Temperatures at which the chip's maker took `TS_CAL1` and `TS_CAL2`, in K.
const TS_CAL1_KELVIN: f32 = 303.15;
const TS_CAL2_KELVIN: f32 = 383.15;

/// The characteristic of a ratiometric transducer: output divided by supply, and the pressure it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Ratio at the start of the range.
    pub low_ratio: f32,
    /// Ratio at the end of the range.
    pub high_ratio: f32,
    /// Pressure at the start of the range in Pa.
    pub low_pascal: f32,
    /// Pressure at the end of the range in Pa.
    pub high_pascal: f32,
    /// A ratio below this means a broken sensor or wire.
    pub break_low: f32,
    /// A ratio above this means a broken sensor or wire.
    pub break_high: f32,
}

impl Default for Calibration {
    /// 10 % to 90 % of the supply are 0 to 10 bar; below 2.5 % or above 97.5 % the sensor is broken.
    fn default() -> Calibration {
        Calibration {
            low_ratio: 0.1,
            high_ratio: 0.9,
            low_pascal: 0.0,
            high_pascal: 1_000_000.0,
            break_low: 0.025,
            break_high: 0.975,
        }
    }
}

impl Calibration {
    /// The pressure in Pa at a ratio, beyond the ends of the range too.
    #[must_use]
    pub fn pressure(&self, ratio: f32) -> f32 {
        let slope = (self.high_pascal - self.low_pascal) / (self.high_ratio - self.low_ratio);
        self.low_pascal + (ratio - self.low_ratio) * slope
    }

    /// Whether no intact sensor gives this ratio.
    #[must_use]
    pub fn is_break(&self, ratio: f32) -> bool {
        ratio < self.break_low || ratio > self.break_high
    }
}

impl RawSample {
    /// Transducer output divided by transducer supply; 0 without a supply, which counts as a break.
    #[must_use]
    pub fn ratio(&self) -> f32 {
        if self.supply == 0 { 0.0 } else { real(self.pressure) / real(self.supply) }
    }

    /// Temperature of the chip in K.
    ///
    /// Sensor and reference are read against the same VDDA, so their quotient times the reference's reading at 3.3 V is the
    /// sensor's reading at 3.3 V (RM0390, 13.10), for which the factory's two points hold. `None` without them.
    #[must_use]
    pub fn temperature(&self) -> Option<f32> {
        let points = self.factory;
        if self.vrefint == 0 || points.ts_cal1 == points.ts_cal2 {
            return None;
        }
        let at_3300_mv = real(self.temperature) / real(self.vrefint) * f32::from(points.vrefint_cal);
        let (low, high) = (f32::from(points.ts_cal1), f32::from(points.ts_cal2));
        Some(TS_CAL1_KELVIN + (at_3300_mv - low) * (TS_CAL2_KELVIN - TS_CAL1_KELVIN) / (high - low))
    }

    /// Whether every conversion of a sum was at an end of the converter's range.
    #[must_use]
    pub fn is_rail(&self, sum: u32) -> bool {
        sum == 0 || sum >= FULL_SCALE * u32::from(self.count)
    }
}

/// Exact up to 2^24: sums of 4096 conversions.
#[allow(clippy::cast_precision_loss)]
fn real(sum: u32) -> f32 {
    sum as f32
}
