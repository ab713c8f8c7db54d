//! One analogue input channel of CiA 404: from the field value to the process value in three formats, and its status.

use super::precise::Precise;
use super::{Filter, Unit};

/// 6150h bit 0: clipped or not measured.
pub const STATUS_INVALID: u8 = 0x01;
/// 6150h bit 1: a process value is above its span.
pub const STATUS_ABOVE: u8 = 0x02;
/// 6150h bit 2: a process value is below its span.
pub const STATUS_BELOW: u8 = 0x04;

/// The limits between which a process value is neither too high nor too low.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span<T> {
    /// 6148h, 7148h, 9148h.
    pub start: T,
    /// 6149h, 7149h, 9149h.
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
    /// 6131h.
    pub unit: Unit,
    /// 6124h, added to the process value in its unit.
    pub offset: f32,
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
    /// The values of a fresh device, with the unit and the span of its channel.
    #[must_use]
    pub const fn new(unit: Unit, span: Span<f32>) -> ChannelParameters {
        ChannelParameters {
            filter_type: 0,
            filter_constant: 1,
            scaling_factor: 1.0,
            scaling_offset: 0.0,
            unit,
            offset: 0.0,
            digits: 0,
            span,
            span16: Span { start: i16::MIN, end: i16::MAX },
            span32: Span { start: i32::MIN, end: i32::MAX },
        }
    }
}

/// What a channel gives for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChannelValues {
    /// 6100h, field value in Pa or K, as measured.
    pub field_value: f32,
    /// 6130h, process value in the unit of 6131h.
    pub process_value: f32,
    /// 7130h, process value with its decimal digits shifted before the point.
    pub process_value16: i16,
    /// 9130h, the same with 32 bits.
    pub process_value32: i32,
    /// 6150h.
    pub status: u8,
}

/// A channel: its parameters and the state of its filter.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    parameters: ChannelParameters,
    filter: Filter,
    /// 10 to the power of the decimal digits.
    shift: f32,
}

impl Channel {
    /// A channel that has not measured yet.
    #[must_use]
    pub fn new(parameters: &ChannelParameters) -> Channel {
        let filter = Filter::new(parameters.filter_type, parameters.filter_constant);
        Channel { parameters: *parameters, filter, shift: shift(parameters.digits) }
    }

    /// Takes over parameters. The filter only starts afresh when it is another one.
    pub fn apply(&mut self, parameters: &ChannelParameters) {
        let fresh = Channel::new(parameters);
        let filter = if fresh.filter.is_like(&self.filter) { self.filter } else { fresh.filter };
        *self = Channel { filter, ..fresh };
    }

    /// Processes one field value in Pa or K. `valid` is false when it does not come from an intact sensor.
    pub fn sample(&mut self, field_value: f32, valid: bool) -> ChannelValues {
        let p = &self.parameters;
        let valid = valid && field_value.is_finite();
        let field_value = finite(field_value);
        let scaled = self.filter.next(field_value) * p.scaling_factor + p.scaling_offset;
        let exact = p.unit.of(scaled) + p.offset;
        let valid = valid && exact.is_finite();
        let process_value = finite(exact);
        // In single precision on purpose: the nearest single to 0.29 times 100 is 29, while the same product in double
        // precision is 28.999999 and would be cut to 28.
        let shifted = process_value * self.shift;
        let (process_value16, process_value32) = (truncate16(shifted), truncate32(shifted));
        let spans = p.span.status(process_value)
            | p.span16.status(process_value16)
            | p.span32.status(process_value32);
        let status = spans | if valid && fits16(shifted) { 0 } else { STATUS_INVALID };
        ChannelValues { field_value, process_value, process_value16, process_value32, status }
    }
}

/// The nearest finite number, and 0 for what is none: nothing else ever leaves the channel.
fn finite(value: f32) -> f32 {
    match value {
        finite if finite.is_finite() => finite,
        f32::INFINITY => f32::MAX,
        f32::NEG_INFINITY => f32::MIN,
        _ => 0.0,
    }
}

/// Towards zero, to the nearest limit when out of range, 0 for what is not a number: what `as` is defined to do.
#[allow(clippy::cast_possible_truncation)]
fn truncate16(value: f32) -> i16 {
    value as i16
}

#[allow(clippy::cast_possible_truncation)]
fn truncate32(value: f32) -> i32 {
    value as i32
}

/// Whether no integer format is clipped; what fits 16 bits fits 32. Not a number fits nothing.
fn fits16(value: f32) -> bool {
    value > f32::from(i16::MIN) - 1.0 && value < f32::from(i16::MAX) + 1.0
}

/// Ten to the power of so many digits; beyond the 38 of single precision nothing fits any format.
fn shift(digits: u8) -> f32 {
    match i8::try_from(digits) {
        Ok(digits) if digits <= 38 => Precise::ONE.shifted(digits).rounded(),
        _ => f32::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::cast_possible_truncation)]
    fn digits_shift_by_powers_of_ten() {
        for digits in 0..=u8::MAX {
            assert_eq!(shift(digits).to_bits(), (10_f64.powi(digits.into()) as f32).to_bits(), "{digits}");
        }
    }
}
