//! One analogue input channel of CiA 404: from the field value to the process value in three formats, and its status.

use super::precise::Precise;
use super::{Filter, Recovery, Unit};

/// 6150h bit 0: clipped or not measured.
pub const STATUS_INVALID: u8 = 0x01;
/// 6150h bit 1: a process value is above its span.
pub const STATUS_ABOVE: u8 = 0x02;
/// 6150h bit 2: a process value is below its span.
pub const STATUS_BELOW: u8 = 0x04;

/// 6150h bit 3: measured without the compensation for temperature that the calibration has.
pub const STATUS_UNCOMPENSATED: u8 = 0x08;

/// The span of a process value: outside of these limits the value is too low or too high.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span<T> {
    /// Start (6148h, 7148h, 9148h).
    pub start: T,
    /// End (6149h, 7149h, 9149h).
    pub end: T,
}

impl<T: PartialOrd + Copy> Span<T> {
    fn status(&self, value: T) -> u8 {
        let above = if value > self.end { STATUS_ABOVE } else { 0 };
        if value < self.start { above | STATUS_BELOW } else { above }
    }
}

/// All parameters of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelParameters {
    /// 61A0h, type of the filter.
    pub filter_type: u8,
    /// 61A1h, constant of the filter.
    pub filter_constant: u8,
    /// 6126h, factor on the filtered field value.
    pub scaling_factor: f32,
    /// 6127h, added after the factor, in Pa or K.
    pub scaling_offset: f32,
    /// 6131h, unit of the process value.
    pub unit: Unit,
    /// 6124h, added to the process value in its unit.
    pub offset: f32,
    /// 2210h, subtracted from the process value.
    pub tare: f32,
    /// 6132h, decimal digits of the integer formats.
    pub digits: u8,
    /// Span of the REAL32 process value.
    pub span: Span<f32>,
    /// Span of the INTEGER16 process value.
    pub span16: Span<i16>,
    /// Span of the INTEGER32 process value.
    pub span32: Span<i32>,
}

impl ChannelParameters {
    /// Default values of a channel, with its unit and its span.
    #[must_use]
    pub const fn new(unit: Unit, span: Span<f32>) -> ChannelParameters {
        ChannelParameters {
            filter_type: 0,
            filter_constant: 1,
            scaling_factor: 1.0,
            scaling_offset: 0.0,
            unit,
            offset: 0.0,
            tare: 0.0,
            digits: 0,
            span,
            span16: Span { start: i16::MIN, end: i16::MAX },
            span32: Span { start: i32::MIN, end: i32::MAX },
        }
    }
}

/// Output of a channel for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChannelValues {
    /// 6100h, measured field value in Pa or K.
    pub field_value: f32,
    /// 6130h, process value in the unit of 6131h.
    pub process_value: f32,
    /// 7130h, process value times 10 to the power of its decimal digits.
    pub process_value16: i16,
    /// 9130h, the same value with 32 bits.
    pub process_value32: i32,
    /// 6150h, status.
    pub status: u8,
    /// The process value without its offset, if it comes from an intact sensor and fits a REAL32, whether or not the
    /// integer formats can show it.
    pub measured: Option<f32>,
}

/// A channel: its parameters and the state of its filter.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    parameters: ChannelParameters,
    filter: Filter,
    recovery: Recovery,
    /// 10 to the power of the decimal digits.
    shift: f32,
}

impl Channel {
    /// A channel that has not measured yet.
    #[must_use]
    pub fn new(parameters: &ChannelParameters) -> Channel {
        let filter = Filter::new(parameters.filter_type, parameters.filter_constant);
        let recovery = Recovery::default();
        Channel { parameters: *parameters, filter, recovery, shift: shift(parameters.digits) }
    }

    /// Takes over parameters. The filter restarts only if its own parameters have changed.
    pub fn apply(&mut self, parameters: &ChannelParameters) {
        let fresh = Channel::new(parameters);
        let filter = if fresh.filter.is_like(&self.filter) { self.filter } else { fresh.filter };
        *self = Channel { filter, recovery: self.recovery, ..fresh };
    }

    /// Takes note of whether the next field value comes from a faulty sensor. Returns whether the values still count as
    /// faulty: a fault lasts until the filter is full of good samples.
    pub fn is_faulty(&mut self, is_faulty: bool) -> bool {
        self.recovery.next(is_faulty, &mut self.filter)
    }

    /// Processes one field value in Pa or K. `valid` is false when it does not come from an intact sensor.
    pub fn sample(&mut self, field_value: f32, valid: bool) -> ChannelValues {
        let p = &self.parameters;
        let valid = valid && field_value.is_finite();
        let field_value = finite(field_value);
        let scaled = self.filter.next(field_value) * p.scaling_factor + p.scaling_offset;
        let in_unit = p.unit.of(scaled);
        let process_value = finite(in_unit + p.offset - p.tare);
        // In single precision on purpose: the nearest single to 0.29 times 100 is 29, while the same product in double
        // precision is 28.999999 and would be cut to 28.
        let shifted = process_value * self.shift;
        let process_value32 = truncated(shifted);
        let process_value16 = clipped(process_value32);
        let is_exact = !shifted.is_nan() && i32::from(process_value16) == process_value32;
        let spans = p.span.status(process_value)
            | p.span16.status(process_value16)
            | p.span32.status(process_value32);
        let status = spans | if valid && is_exact { 0 } else { STATUS_INVALID };
        ChannelValues {
            field_value,
            process_value,
            process_value16,
            process_value32,
            status,
            measured: Some(in_unit).filter(|value| valid && value.is_finite()),
        }
    }
}

/// The nearest finite number, and 0 for NaN, because a channel must give finite values only.
fn finite(value: f32) -> f32 {
    match value {
        finite if finite.is_finite() => finite,
        f32::INFINITY => f32::MAX,
        f32::NEG_INFINITY => f32::MIN,
        _ => 0.0,
    }
}

/// Rounds towards zero. A value out of range gives the nearest limit, and NaN gives 0, as defined for `as`.
#[allow(clippy::cast_possible_truncation)]
fn truncated(value: f32) -> i32 {
    value as i32
}

/// The same number in 16 bits. A number out of range gives the nearest limit.
#[allow(clippy::cast_possible_truncation)]
fn clipped(value: i32) -> i16 {
    value.clamp(i16::MIN.into(), i16::MAX.into()) as i16
}

/// Ten to the power of `digits`. Beyond the 38 digits of single precision, no value fits any format.
fn shift(digits: u8) -> f32 {
    match i8::try_from(digits) {
        Ok(digits) if digits <= 38 => Precise::ONE.shifted(digits).rounded(),
        _ => f32::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: u8 = STATUS_ABOVE | STATUS_BELOW;
    const ANY: Span<f32> = Span { start: f32::MIN, end: f32::MAX };

    /// Field value and process value are the same number.
    fn plain() -> ChannelParameters {
        ChannelParameters::new(Unit::pressure(0x0022_0000).unwrap(), ANY)
    }

    fn sample(parameters: &ChannelParameters, field_value: f32) -> ChannelValues {
        Channel::new(parameters).sample(field_value, true)
    }

    #[test]
    fn a_field_value_is_scaled_in_pascal_and_offset_in_the_unit() {
        let (scaling_factor, scaling_offset) = (2.0, 50_000.0);
        let own = ChannelParameters { scaling_factor, scaling_offset, offset: 0.25, digits: 2, ..plain() };
        let bar = ChannelParameters { unit: Unit::BAR, ..own };
        // 2 * 1 bar + 0.5 bar, + 0.25 bar, with two digits.
        let expected = ChannelValues {
            field_value: 100_000.0,
            process_value: 2.75,
            process_value16: 275,
            process_value32: 275,
            status: 0,
            measured: Some(2.5),
        };
        assert_eq!(sample(&bar, 100_000.0), expected);
    }

    #[test]
    fn integers_are_cut_towards_zero_and_clipped_beyond_16_bits() {
        for (value, cut16, cut32, status) in [
            (1.9, 1, 1, 0),
            (-1.9, -1, -1, 0),
            (32_767.99, 32_767, 32_767, 0),
            (32_768.0, 32_767, 32_768, STATUS_INVALID),
            (-32_768.99, -32_768, -32_768, 0),
            (-32_769.0, -32_768, -32_769, STATUS_INVALID),
            (1e10, i16::MAX, i32::MAX, STATUS_INVALID),
            (-1e10, i16::MIN, i32::MIN, STATUS_INVALID),
        ] {
            let values = sample(&plain(), value);
            let got = (values.process_value16, values.process_value32, values.status);
            assert_eq!(got, (cut16, cut32, status), "{value}");
        }
    }

    #[test]
    fn an_impossible_measurement_is_invalid_and_finite() {
        for (value, is_from_an_intact_sensor, number) in [
            (5.0, false, 5.0),
            (f32::NAN, true, 0.0),
            (f32::INFINITY, true, f32::MAX),
            (f32::NEG_INFINITY, true, f32::MIN),
        ] {
            let values = Channel::new(&plain()).sample(value, is_from_an_intact_sensor);
            assert_eq!((values.field_value, values.process_value), (number, number));
            assert_eq!(values.status, STATUS_INVALID, "{value}");
        }
        let overflowing = ChannelParameters { scaling_factor: 10.0, ..plain() };
        let values = sample(&overflowing, f32::MAX);
        assert_eq!((values.process_value, values.status), (f32::MAX, STATUS_INVALID));
    }

    #[test]
    fn a_value_at_the_limit_is_inside() {
        let own = ChannelParameters { span: Span { start: -10.0, end: 10.0 }, ..plain() };
        for (value, status) in [(-10.5, STATUS_BELOW), (-10.0, 0), (0.0, 0), (10.0, 0), (10.5, STATUS_ABOVE)]
        {
            assert_eq!(sample(&own, value).status, status, "{value}");
        }
        let upside_down = ChannelParameters { span: Span { start: 10.0, end: -10.0 }, ..plain() };
        assert_eq!(sample(&upside_down, 0.0).status, BOTH);
    }

    #[test]
    fn every_format_has_a_span_and_one_is_enough() {
        let (low, high) = (Span { start: -3.0, end: -1.0 }, Span { start: 1.0, end: 3.0 });
        let (low16, high16) = (Span { start: -3, end: -1 }, Span { start: 1, end: 3 });
        let (low32, high32) = (Span { start: -3, end: -1 }, Span { start: 1, end: 3 });
        for (span, span16, span32, status) in [
            (low, plain().span16, plain().span32, STATUS_ABOVE),
            (plain().span, low16, plain().span32, STATUS_ABOVE),
            (plain().span, plain().span16, low32, STATUS_ABOVE),
            (low, low16, plain().span32, STATUS_ABOVE),
            (low, plain().span16, low32, STATUS_ABOVE),
            (plain().span, high16, high32, STATUS_BELOW),
            (high, low16, plain().span32, BOTH),
            (plain().span, low16, high32, BOTH),
        ] {
            let own = ChannelParameters { span, span16, span32, ..plain() };
            assert_eq!(sample(&own, 0.0).status, status, "{own:?}");
        }
    }

    #[test]
    fn new_parameters_act_from_the_next_sample_and_the_filter_continues() {
        let average = |constant| ChannelParameters { filter_type: 1, filter_constant: constant, ..plain() };
        let mut channel = Channel::new(&average(4));
        channel.sample(0.0, true);
        channel.apply(&ChannelParameters { offset: 100.0, ..average(4) });
        assert_eq!(channel.sample(8.0, true).process_value32, 102, "a quarter of the way");
        channel.apply(&average(8));
        assert_eq!(channel.sample(16.0, true).process_value32, 16, "another filter starts afresh");
    }

    #[test]
    #[allow(clippy::cast_possible_truncation)]
    fn digits_shift_by_powers_of_ten() {
        for digits in 0..=u8::MAX {
            assert_eq!(shift(digits).to_bits(), (10_f64.powi(digits.into()) as f32).to_bits(), "{digits}");
        }
    }
}
