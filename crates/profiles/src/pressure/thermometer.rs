//! The temperature in K, by the chip's sensor or by a thermistor.

use crate::board::{ChipThermometer, RawSample};

/// Codes of a 12-bit conversion.
const CODES: u32 = 4096;

/// Source of the temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Thermometer {
    /// The sensor inside the chip.
    #[default]
    Internal,
    /// A thermistor on an input of the converter.
    Thermistor,
}

/// A thermistor (NTC) to ground with a resistor to VDDA, and its characteristic by Steinhart and Hart:
///
/// ```text
/// 1 / T = a + b ln R + c (ln R)³,    R = series * n / (4096 - n)
/// ```
///
/// A thermistor specified by its resistance R0 at T0 and its beta has a = 1/T0 - ln R0 / beta, b = 1/beta, c = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermistor {
    /// Coefficient a in 1/K.
    pub a: f32,
    /// Coefficient b in 1/K, for R in ohm.
    pub b: f32,
    /// Coefficient c in 1/K.
    pub c: f32,
    /// The resistor to VDDA in ohm.
    pub series: f32,
    /// A ratio of VDDA below this means a short circuit.
    pub break_low: f32,
    /// A ratio of VDDA above this means a broken wire.
    pub break_high: f32,
}

/// The calibration of the temperature: the measured temperature times the factor, plus the offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureCalibration {
    /// Source of the temperature.
    pub thermometer: Thermometer,
    /// Factor on the measured temperature in K.
    pub factor: f32,
    /// Added after the factor, in K.
    pub offset: f32,
    /// Used if the thermistor is the source.
    pub thermistor: Thermistor,
}

impl Default for Thermistor {
    /// 10 kohm at 25 degC, beta 3950 K, with 10 kohm: -40 degC are 97.6 % and 125 degC 3.5 % of VDDA.
    fn default() -> Thermistor {
        Thermistor {
            a: 0.001_022_29,
            b: 0.000_253_164_55,
            c: 0.0,
            series: 10_000.0,
            break_low: 0.01,
            break_high: 0.99,
        }
    }
}

impl Default for TemperatureCalibration {
    fn default() -> TemperatureCalibration {
        let (thermometer, thermistor) = (Thermometer::default(), Thermistor::default());
        TemperatureCalibration { thermometer, factor: 1.0, offset: 0.0, thermistor }
    }
}

impl TemperatureCalibration {
    /// The temperature in K; `None` if it cannot be measured: an input at a rail, a broken thermistor, a chip without a
    /// calibration, or a result that is not finite.
    #[must_use]
    pub fn temperature(&self, raw: &RawSample, chip: ChipThermometer) -> Option<f32> {
        let measured = match self.thermometer {
            Thermometer::Internal => internal(raw, chip),
            Thermometer::Thermistor => self.thermistor.temperature(raw),
        };
        measured.map(|kelvin| kelvin * self.factor + self.offset).filter(|kelvin| kelvin.is_finite())
    }

    /// Whether a warmer sensor always gives a higher finite temperature.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_rising = self.factor > 0.0 && self.factor.is_finite() && self.offset.is_finite();
        is_rising && self.thermistor.is_valid()
    }
}

impl Thermistor {
    fn temperature(&self, raw: &RawSample) -> Option<f32> {
        let full = CODES * u32::from(raw.count);
        let ratio = real(raw.thermistor) / real(full);
        if raw.is_rail(raw.thermistor) || ratio < self.break_low || ratio > self.break_high {
            return None;
        }
        let resistance = self.series * (real(raw.thermistor) / real(full.saturating_sub(raw.thermistor)));
        Some(1.0 / self.reciprocal(libm::logf(resistance))).filter(|kelvin| *kelvin > 0.0)
    }

    fn reciprocal(&self, log: f32) -> f32 {
        self.a + log * (self.b + self.c * log * log)
    }

    /// A higher resistance must be a lower temperature over the whole range of the converter. The slope `b + 3c (ln
    /// R)²` is monotonic in the square of the logarithm, so its extremes are at an end of the range or at 1 ohm.
    fn is_valid(&self) -> bool {
        let ends = [self.series / real(CODES), 1.0, self.series * real(CODES)];
        let falls = |log: f32| self.b + 3.0 * self.c * log * log > 0.0 && self.reciprocal(log).is_finite();
        // Without a resistor, or with a negative one, there is no logarithm.
        self.break_low < self.break_high && ends.map(libm::logf).into_iter().all(falls)
    }
}

/// The temperature from the chip's sensor. Sensor and reference are converted against the same supply, so their
/// quotient does not depend on the supply. Without a reference or a characteristic the result is NaN.
fn internal(raw: &RawSample, chip: ChipThermometer) -> Option<f32> {
    if raw.is_rail(raw.temperature) {
        return None;
    }
    Some(chip.offset + chip.slope * (real(raw.temperature) / real(raw.reference)))
}

/// Exact up to 2^24, the sum of 4096 conversions.
#[allow(clippy::cast_precision_loss)]
fn real(sum: u32) -> f32 {
    sum as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{ChipThermometer, RawSample};
    const RAW: RawSample = RawSample {
        pressure: 0,
        supply: 0,
        temperature: 16 * 1000,
        reference: 16 * 1500,
        thermistor: 16 * 2048,
        count: 16,
    };
    /// 940 at 30 degC and 1210 at 110 degC, with the reference at 1500.
    const CHIP: ChipThermometer =
        ChipThermometer { offset: 303.15 - 940.0 * 80.0 / 270.0, slope: 1500.0 * 80.0 / 270.0 };

    fn thermistor(thermistor: u32) -> Option<f32> {
        let own = TemperatureCalibration { thermometer: Thermometer::Thermistor, ..Default::default() };
        own.temperature(&RawSample { thermistor, ..RAW }, CHIP)
    }

    #[test]
    fn half_of_the_supply_is_the_resistance_at_25_degrees() {
        let kelvin = thermistor(16 * 2048).unwrap();
        assert!((kelvin - 298.15).abs() < 0.001, "{kelvin}");
        // beta 3950: 32.65 kohm at 0 degC and 0.974 kohm at 85 degC, computed in double precision.
        for kelvin in [273.15, 358.15_f64] {
            let resistance = 10_000.0 * (3950.0 * (1.0 / kelvin - 1.0 / 298.15)).exp();
            let sum = 65_536.0 * resistance / (resistance + 10_000.0);
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let measured = thermistor(sum.round() as u32).unwrap();
            assert!((f64::from(measured) - kelvin).abs() < 0.01, "{measured} for {kelvin}");
        }
    }

    #[test]
    fn steinhart_and_hart_of_a_data_sheet() {
        // 10 kohm, beta(25/85) 3435 K: coefficients of a fit, R at 0 degC 27.28 kohm (1/T by the formula in double).
        let own = Thermistor { a: 1.129_148e-3, b: 2.341_25e-4, c: 8.767_41e-8, ..Thermistor::default() };
        assert!(own.is_valid());
        let resistance: f64 = 10_000.0;
        let log = resistance.ln();
        let expected = 1.0 / (1.129_148e-3 + 2.341_25e-4 * log + 8.767_41e-8 * log.powi(3));
        let kelvin = own.temperature(&RAW).unwrap();
        assert!((f64::from(kelvin) - expected).abs() < 0.001, "{kelvin} for {expected}");
        assert!((expected - 298.15).abs() < 0.01);
    }

    #[test]
    fn an_input_at_a_rail_is_no_temperature() {
        for sum in [0, 16 * 4095, 16 * 4096, u32::MAX] {
            assert_eq!(thermistor(sum), None);
            let own = TemperatureCalibration::default();
            assert_eq!(own.temperature(&RawSample { temperature: sum, ..RAW }, CHIP), None);
        }
    }

    #[test]
    fn without_a_reference_or_a_characteristic_there_is_no_temperature() {
        let own = TemperatureCalibration::default();
        assert_eq!(own.temperature(&RawSample { reference: 0, ..RAW }, CHIP), None);
        for (offset, slope) in
            [(f32::NAN, f32::NAN), (f32::NEG_INFINITY, f32::INFINITY), (0.0, f32::INFINITY)]
        {
            assert_eq!(own.temperature(&RAW, ChipThermometer { offset, slope }), None);
        }
    }

    #[test]
    fn coefficients_that_give_no_positive_temperature_give_none() {
        for own in [
            Thermistor { a: -1.0, ..Thermistor::default() },
            Thermistor { c: f32::MAX, ..Thermistor::default() },
        ] {
            assert_eq!(own.temperature(&RAW), None);
        }
    }

    #[test]
    fn a_thermistor_beyond_its_limits_is_broken() {
        // 1 % and 99 % of 16 * 4096.
        for (sum, is_intact) in [(655, false), (656, true), (64_880, true), (64_881, false)] {
            assert_eq!(thermistor(sum).is_some(), is_intact, "{sum}");
        }
        let quarters = Thermistor { break_low: 0.25, break_high: 0.75, ..Thermistor::default() };
        for (sum, is_intact) in [(16_383, false), (16_384, true), (49_152, true), (49_153, false)] {
            let raw = RawSample { thermistor: sum, ..RAW };
            assert_eq!(quarters.temperature(&raw).is_some(), is_intact, "{sum}");
        }
        let thermometer = Thermometer::Thermistor;
        let wide = Thermistor { break_low: 0.0, break_high: 1.0, ..Thermistor::default() };
        let own = TemperatureCalibration { thermometer, thermistor: wide, ..Default::default() };
        for sum in [1, 16 * 4095 - 1] {
            assert!(own.temperature(&RawSample { thermistor: sum, ..RAW }, CHIP).is_some());
        }
    }

    #[test]
    fn the_trim_comes_last() {
        let own = TemperatureCalibration { factor: 1.01, offset: -2.0, ..Default::default() };
        let plain = TemperatureCalibration::default().temperature(&RAW, CHIP).unwrap();
        assert!((own.temperature(&RAW, CHIP).unwrap() - (plain * 1.01 - 2.0)).abs() < 1e-3);
        assert!((plain - (303.15 + 60.0 * 80.0 / 270.0)).abs() < 1e-3);
    }

    #[test]
    fn a_characteristic_without_a_rising_temperature_is_invalid() {
        let good = TemperatureCalibration::default();
        assert!(good.is_valid());
        for factor in [0.0, -1.0, f32::INFINITY, f32::NAN] {
            assert!(!TemperatureCalibration { factor, ..good }.is_valid());
        }
        assert!(!TemperatureCalibration { offset: f32::NAN, ..good }.is_valid());
        let thermistor = good.thermistor;
        for bad in [
            Thermistor { b: 0.0, ..thermistor },
            Thermistor { b: -1e-4, ..thermistor },
            Thermistor { c: -1e-6, ..thermistor },
            // Wrong at the highest resistance only, 41 Mohm; at the lowest only, 2.4 uohm.
            Thermistor { c: -5e-7, ..thermistor },
            Thermistor { c: -1e-6, series: 0.01, ..thermistor },
            Thermistor { a: f32::INFINITY, ..thermistor },
            Thermistor { series: 0.0, ..thermistor },
            Thermistor { series: -1.0, ..thermistor },
            Thermistor { break_low: 0.99, ..thermistor },
            Thermistor { break_high: f32::NAN, ..thermistor },
        ] {
            assert!(!TemperatureCalibration { thermistor: bad, ..good }.is_valid());
        }
    }
}
