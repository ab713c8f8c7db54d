//! Measured values into the image, parameters out of it.

use super::DICTIONARY;
use canopen::dictionary::Field;
use profiles::pressure::{Calibration, ChannelParameters, ChannelValues, Parameters, Snapshot, Span, Unit};

/// Where the values of one channel are.
pub(super) struct Channel {
    field_value: Field,
    pub(super) process_value: Field,
    process_value16: Field,
    process_value32: Field,
    pub(super) status: Field,
    pub(super) offset: Field,
    scaling_factor: Field,
    scaling_offset: Field,
    unit: Field,
    digits: Field,
    span: Span<Field>,
    span16: Span<Field>,
    span32: Span<Field>,
    filter_type: Field,
    filter_constant: Field,
}

pub(super) const PRESSURE: Channel = Channel::new(1);
pub(super) const TEMPERATURE: Channel = Channel::new(2);

impl Channel {
    const fn new(sub: u8) -> Channel {
        let d = DICTIONARY;
        Channel {
            field_value: d.field(0x6100, sub),
            process_value: d.field(0x6130, sub),
            process_value16: d.field(0x7130, sub),
            process_value32: d.field(0x9130, sub),
            status: d.field(0x6150, sub),
            offset: d.field(0x6124, sub),
            scaling_factor: d.field(0x6126, sub),
            scaling_offset: d.field(0x6127, sub),
            unit: d.field(0x6131, sub),
            digits: d.field(0x6132, sub),
            span: Span { start: d.field(0x6148, sub), end: d.field(0x6149, sub) },
            span16: Span { start: d.field(0x7148, sub), end: d.field(0x7149, sub) },
            span32: Span { start: d.field(0x9148, sub), end: d.field(0x9149, sub) },
            filter_type: d.field(0x61A0, sub),
            filter_constant: d.field(0x61A1, sub),
        }
    }

    fn publish(&self, values: &ChannelValues, image: &mut [u8]) {
        self.field_value.store(image, values.field_value.to_le_bytes());
        self.process_value.store(image, values.process_value.to_le_bytes());
        self.process_value16.store(image, values.process_value16.to_le_bytes());
        self.process_value32.store(image, values.process_value32.to_le_bytes());
        self.status.store(image, [values.status]);
    }

    fn parameters(&self, unit: Unit, image: &[u8]) -> ChannelParameters {
        let [start16, end16] =
            [self.span16.start, self.span16.end].map(|at| i16::from_le_bytes(at.load(image)));
        let [start32, end32] =
            [self.span32.start, self.span32.end].map(|at| i32::from_le_bytes(at.load(image)));
        ChannelParameters {
            filter_type: self.filter_type.u8(image),
            filter_constant: self.filter_constant.u8(image),
            scaling_factor: self.scaling_factor.f32(image),
            scaling_offset: self.scaling_offset.f32(image),
            unit,
            offset: self.offset.f32(image),
            digits: self.digits.u8(image),
            span: Span { start: self.span.start.f32(image), end: self.span.end.f32(image) },
            span16: Span { start: start16, end: end16 },
            span32: Span { start: start32, end: end32 },
        }
    }
}

/// Takes a snapshot into the image.
pub(crate) fn publish(snapshot: &Snapshot, image: &mut [u8]) {
    PRESSURE.publish(&snapshot.pressure, image);
    TEMPERATURE.publish(&snapshot.temperature, image);
}

/// The parameters in the image. A unit that no write could have put there acts as the default one.
pub(crate) fn parameters(image: &[u8]) -> Parameters {
    let pressure = Unit::pressure(PRESSURE.unit.u32(image)).unwrap_or(Unit::BAR);
    let temperature = Unit::temperature(TEMPERATURE.unit.u32(image)).unwrap_or(Unit::CELSIUS);
    Parameters {
        pressure: PRESSURE.parameters(pressure, image),
        temperature: TEMPERATURE.parameters(temperature, image),
        calibration: Calibration::default(),
    }
}
