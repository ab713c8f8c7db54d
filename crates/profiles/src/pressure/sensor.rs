//! What the converter readings say of the sensor before any calibration.

use super::RawSample;

/// Largest reading of a 12-bit conversion.
const FULL_SCALE: u32 = 4095;

impl RawSample {
    /// Transducer output divided by transducer supply; 0 without a supply, which counts as a break.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Exact up to 2^24: sums of 4096 conversions.
    pub fn ratio(&self) -> f32 {
        if self.supply == 0 { 0.0 } else { self.pressure as f32 / self.supply as f32 }
    }

    /// Whether every conversion of a sum was at an end of the converter's range.
    #[must_use]
    pub fn is_rail(&self, sum: u32) -> bool {
        sum == 0 || sum >= FULL_SCALE * u32::from(self.count)
    }
}
