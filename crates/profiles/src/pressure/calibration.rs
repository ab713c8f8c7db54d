//! The calibration of the transducer: from its output ratio to Pa, compensated for temperature.

/// Lower limit of the temperature for which a calibration holds, in K: -40 degC, the limit of the chip. `HOTTEST`: 125
/// degC.
const COLDEST: f32 = 233.15;
const HOTTEST: f32 = 398.15;

/// `constant + linear t + quadratic t²`, with `t` in K relative to the reference temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial {
    /// Value at the reference temperature.
    pub constant: f32,
    /// Coefficient per K.
    pub linear: f32,
    /// Coefficient per K².
    pub quadratic: f32,
}

impl Polynomial {
    /// A polynomial that does not depend on the temperature.
    #[must_use]
    pub const fn constant(constant: f32) -> Polynomial {
        Polynomial { constant, linear: 0.0, quadratic: 0.0 }
    }

    fn at(&self, t: f32) -> f32 {
        self.constant + t * (self.linear + t * self.quadratic)
    }

    /// The extreme values in an interval: at its ends or at the vertex. A straight line has no vertex.
    #[inline(never)]
    fn extremes(&self, low: f32, high: f32) -> [f32; 3] {
        let vertex = -self.linear / (2.0 * self.quadratic);
        let inside = if vertex.is_finite() { vertex.max(low).min(high) } else { low };
        [low, inside, high].map(|t| self.at(t))
    }
}

/// The characteristic of a ratiometric transducer, whose output is a ratio of its supply:
///
/// ```text
/// p = start + (end - start) * (ratio - zero(t)) / span(t),    t = T - reference
/// ```
///
/// `T` is the measured temperature, limited to -40 to 125 degC. Without a measured temperature, `t` is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureCalibration {
    /// Pressure at the start of the range in Pa.
    pub start: f32,
    /// Pressure at the end of the range in Pa.
    pub end: f32,
    /// Ratio at the start of the range.
    pub zero: Polynomial,
    /// Ratio at the end of the range minus the ratio at its start.
    pub span: Polynomial,
    /// Reference temperature of the polynomials in K.
    pub reference: f32,
    /// A ratio below this means a broken sensor or wire.
    pub break_low: f32,
    /// A ratio above this means a broken sensor or wire.
    pub break_high: f32,
}

impl Default for PressureCalibration {
    /// 10 % to 90 % of the supply are 0 to 10 bar. Below 2.5 % or above 97.5 % the sensor is broken.
    fn default() -> PressureCalibration {
        PressureCalibration {
            start: 0.0,
            end: 1_000_000.0,
            zero: Polynomial::constant(0.1),
            span: Polynomial::constant(0.8),
            reference: 298.15,
            break_low: 0.025,
            break_high: 0.975,
        }
    }
}

impl PressureCalibration {
    /// The pressure in Pa at a ratio and a temperature in K, also beyond the ends of the range.
    #[must_use]
    pub fn pressure(&self, ratio: f32, kelvin: Option<f32>) -> f32 {
        let t = kelvin.map_or(0.0, |kelvin| kelvin.clamp(COLDEST, HOTTEST) - self.reference);
        self.start + (self.end - self.start) * ((ratio - self.zero.at(t)) / self.span.at(t))
    }

    /// Bits of the status (6150h) of a pressure without a measured temperature.
    #[must_use]
    #[cold]
    #[inline(never)]
    pub fn uncompensated(&self) -> u8 {
        let Polynomial { linear, quadratic, .. } = self.zero;
        let drifts = [linear, quadratic, self.span.linear, self.span.quadratic];
        if drifts.iter().any(|drift| *drift != 0.0) { super::STATUS_UNCOMPENSATED } else { 0 }
    }

    /// The middle of the range of an intact sensor, and a little less than half of its width: a ratio that is nearer to the
    /// middle is no break, and no input at a rail, which has a ratio of 0, or of 1 and more. One comparison is quicker
    /// than four.
    #[must_use]
    pub fn intact(&self) -> (f32, f32) {
        let (low, high) = (self.break_low.max(0.0), self.break_high.min(1.0));
        (f32::midpoint(low, high), 0.499 * (high - low))
    }

    /// Whether the ratio is outside the range of an intact sensor.
    #[must_use]
    pub fn is_break(&self, ratio: f32) -> bool {
        ratio < self.break_low || ratio > self.break_high
    }

    /// Whether the calibration gives one finite pressure for each ratio, rising with the ratio, at every temperature.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let (low, high) = (COLDEST - self.reference, HOTTEST - self.reference);
        let range = self.end - self.start;
        let slopes = self.span.extremes(low, high).map(|span| range / span);
        let has_span = slopes.iter().all(|slope| *slope > 0.0 && slope.is_finite());
        let has_zero = self.zero.extremes(low, high).iter().all(|zero| zero.is_finite());
        range > 0.0 && has_span && has_zero && low <= 0.0 && high >= 0.0 && self.break_low < self.break_high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIFTING: PressureCalibration = PressureCalibration {
        start: -100_000.0,
        end: 900_000.0,
        zero: Polynomial { constant: 0.1, linear: 2e-5, quadratic: -1e-7 },
        span: Polynomial { constant: 0.8, linear: -1e-4, quadratic: 3e-7 },
        reference: 298.15,
        break_low: 0.025,
        break_high: 0.975,
    };

    #[test]
    fn the_drift_is_taken_out() {
        // At 338.15 K: zero 0.1 + 8e-4 - 1.6e-4, span 0.8 - 4e-3 + 4.8e-4.
        for (kelvin, zero, span) in
            [(298.15, 0.1, 0.8), (338.15, 0.10064, 0.79648), (258.15, 0.09904, 0.80448)]
        {
            for share in [0.0, 0.25, 1.0] {
                let pressure = DRIFTING.pressure(zero + share * span, Some(kelvin));
                let expected = -100_000.0 + share * 1_000_000.0;
                assert!((pressure - expected).abs() < 1.0, "{kelvin} K, {share}: {pressure}");
            }
        }
    }

    #[test]
    fn without_a_temperature_the_reference_is_used() {
        assert_eq!(DRIFTING.pressure(0.3, None).to_bits(), DRIFTING.pressure(0.3, Some(298.15)).to_bits());
    }

    #[test]
    fn beyond_its_limits_the_compensation_is_held() {
        assert_eq!(
            DRIFTING.pressure(0.3, Some(0.0)).to_bits(),
            DRIFTING.pressure(0.3, Some(233.15)).to_bits()
        );
        assert_eq!(
            DRIFTING.pressure(0.3, Some(1e9)).to_bits(),
            DRIFTING.pressure(0.3, Some(398.15)).to_bits()
        );
    }

    #[test]
    fn a_ratio_beyond_its_limits_is_a_break() {
        for (ratio, is_break) in
            [(0.0, true), (0.024, true), (0.025, false), (0.5, false), (0.975, false), (0.976, true)]
        {
            assert_eq!(DRIFTING.is_break(ratio), is_break, "{ratio}");
        }
    }

    #[test]
    fn a_characteristic_without_a_rising_pressure_is_invalid() {
        let good = PressureCalibration::default();
        assert!(good.is_valid() && DRIFTING.is_valid());
        let no_span = PressureCalibration { span: Polynomial::constant(0.0), ..good };
        let falling_span = PressureCalibration { span: Polynomial::constant(-0.8), ..good };
        // 0 at the vertex, 50 K above the reference, and positive at both ends.
        let touching = Polynomial { constant: 0.25, linear: -0.01, quadratic: 1e-4 };
        let vertex = PressureCalibration { span: touching, ..good };
        let hot = PressureCalibration { span: Polynomial { linear: -0.009, ..good.span }, ..good };
        let falling = PressureCalibration { start: 2e6, ..good };
        let falling_twice = PressureCalibration { start: 2e6, ..falling_span };
        let flat = PressureCalibration { start: 1e6, ..good };
        let not_finite = PressureCalibration { zero: Polynomial::constant(f32::NAN), ..good };
        let no_slope = PressureCalibration { span: Polynomial::constant(f32::INFINITY), ..good };
        let too_steep = PressureCalibration { span: Polynomial::constant(1e-38), ..good };
        let too_wide = PressureCalibration { start: f32::MIN, end: f32::MAX, ..good };
        let elsewhere = PressureCalibration { reference: 0.0, ..good };
        let hotter = PressureCalibration { reference: 400.0, ..good };
        let always_broken = PressureCalibration { break_low: 0.975, ..good };
        let bad = [
            no_span,
            falling_span,
            vertex,
            hot,
            falling,
            falling_twice,
            flat,
            not_finite,
            no_slope,
            too_steep,
            too_wide,
            elsewhere,
            hotter,
            always_broken,
        ];
        assert!(bad.iter().all(|calibration| !calibration.is_valid()));
    }
}
