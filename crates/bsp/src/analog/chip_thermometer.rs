//! The characteristic of the temperature sensor in the chip, from the manufacturer's measurements.

/// Temperatures of the manufacturer's two measurements in K (STM32F446 datasheet, 6.3.22).
const LOW: f32 = 303.15;
const HIGH: f32 = 383.15;

/// Conversions that the manufacturer made at 3.3 V and stored in system memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Calibration {
    /// Temperature sensor at 30 degC (`TS_CAL1`).
    pub temperature_30: u16,
    /// Temperature sensor at 110 degC (`TS_CAL2`).
    pub temperature_110: u16,
    /// Internal reference (`VREFINT_CAL`).
    pub reference: u16,
}

impl Calibration {
    /// `offset` and `slope` in K of `T = offset + slope * sensor / reference`, with both converted against the same
    /// supply (RM0390, 13.10). Not finite if the two points are equal.
    #[must_use]
    pub fn line(&self) -> (f32, f32) {
        let low = f32::from(self.temperature_30);
        let kelvin_per_code = (HIGH - LOW) / (f32::from(self.temperature_110) - low);
        (LOW - low * kelvin_per_code, f32::from(self.reference) * kelvin_per_code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kelvin(calibration: Calibration, sensor: f32, reference: f32) -> f32 {
        let (offset, slope) = calibration.line();
        offset + slope * sensor / reference
    }

    #[test]
    fn both_points_are_on_the_line_at_any_supply() {
        let own = Calibration { temperature_30: 940, temperature_110: 1210, reference: 1500 };
        for supply in [0.5, 1.0, 1.1] {
            assert!((kelvin(own, 940.0 / supply, 1500.0 / supply) - 303.15).abs() < 1e-3);
            assert!((kelvin(own, 1210.0 / supply, 1500.0 / supply) - 383.15).abs() < 1e-3);
        }
    }

    #[test]
    fn a_chip_without_two_points_has_no_line() {
        for code in [0, 1000, 0xFFFF] {
            let own = Calibration { temperature_30: code, temperature_110: code, reference: 1500 };
            assert!(!kelvin(own, 1000.0, 1500.0).is_finite());
        }
    }
}
