//! Transfer of measured values into the image, and of parameters out of the image.

use super::calibration::Places;
use super::faults::FlagFields;
use super::functions::{Functions, States};
use crate::pressure::{ChannelParameters, ChannelValues, Parameters, Snapshot, Span, Unit};
use canopen::dictionary::{Dictionary, Field};

/// The places of one channel's values.
#[derive(Debug)]
pub(super) struct Channel {
    field_value: Field,
    pub(super) process_value: Field,
    process_value16: Field,
    process_value32: Field,
    pub(super) status: Field,
    pub(super) offset: Field,
    pub(super) tare: Field,
    scaling_factor: Field,
    scaling_offset: Field,
    unit: Field,
    digits: Field,
    pub(super) span: Span<Field>,
    span16: Span<Field>,
    span32: Span<Field>,
    filter_type: Field,
    filter_constant: Field,
}

/// The places of the transmitter's values in the image of a dictionary with the transmitter's objects.
#[derive(Debug)]
pub struct Fields {
    pub(super) pressure: Channel,
    pub(super) temperature: Channel,
    pub(super) calibration: Places,
    pub(super) flags: FlagFields,
    pub(super) functions: Functions,
    /// Added to the index of every object of the device profile.
    pub(super) shift: u16,
}

impl Channel {
    const fn new(d: &Dictionary, shift: u16, sub: u8) -> Channel {
        Channel {
            field_value: d.field(0x6100 + shift, sub),
            process_value: d.field(0x6130 + shift, sub),
            process_value16: d.field(0x7130 + shift, sub),
            process_value32: d.field(0x9130 + shift, sub),
            status: d.field(0x6150 + shift, sub),
            offset: d.field(0x6124 + shift, sub),
            tare: d.field(0x2210, sub),
            scaling_factor: d.field(0x6126 + shift, sub),
            scaling_offset: d.field(0x6127 + shift, sub),
            unit: d.field(0x6131 + shift, sub),
            digits: d.field(0x6132 + shift, sub),
            span: Span { start: d.field(0x6148 + shift, sub), end: d.field(0x6149 + shift, sub) },
            span16: Span { start: d.field(0x7148 + shift, sub), end: d.field(0x7149 + shift, sub) },
            span32: Span { start: d.field(0x9148 + shift, sub), end: d.field(0x9149 + shift, sub) },
            filter_type: d.field(0x61A0 + shift, sub),
            filter_constant: d.field(0x61A1 + shift, sub),
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
            tare: self.tare.f32(image),
            digits: self.digits.u8(image),
            span: Span { start: self.span.start.f32(image), end: self.span.end.f32(image) },
            span16: Span { start: start16, end: end16 },
            span32: Span { start: start32, end: end32 },
        }
    }
}

impl Fields {
    /// Looks the fields up during compilation; `shift` is added to the index of every object of the device profile.
    pub(crate) const fn new(d: &Dictionary, shift: u16) -> Fields {
        Fields {
            pressure: Channel::new(d, shift, 1),
            temperature: Channel::new(d, shift, 2),
            calibration: Places::new(d),
            flags: FlagFields::new(d),
            functions: Functions::new(d, shift),
            shift,
        }
    }

    /// Whether the value at this place belongs to a channel whose process value is less than its threshold away from the
    /// one that a TPDO has sent.
    pub(super) fn is_quiet(&self, states: &States, tpdo: usize, place: usize, image: &[u8]) -> bool {
        let channels = [&self.pressure, &self.temperature].into_iter().zip(&states.channels);
        channels.zip(self.functions.thresholds).any(|((channel, state), threshold)| {
            let Channel { field_value, process_value, process_value16, process_value32, .. } = channel;
            let fields = [field_value, process_value, process_value16, process_value32];
            let sent = f32::from_bits(state.sent.of(tpdo));
            fields.iter().any(|field| field.is_at(place))
                && (process_value.f32(image) - sent).abs() < threshold.f32(image)
        })
    }

    /// A TPDO has been sent.
    pub(super) fn sent(&self, states: &mut States, tpdo: usize, image: &[u8]) {
        for (channel, state) in [&self.pressure, &self.temperature].into_iter().zip(&mut states.channels) {
            state.sent.take(tpdo, channel.process_value, image);
        }
    }

    /// Copies a snapshot into the image.
    pub(crate) fn publish(&self, snapshot: &Snapshot, image: &mut [u8]) {
        self.pressure.publish(&snapshot.pressure, image);
        self.temperature.publish(&snapshot.temperature, image);
    }

    pub(super) fn pressure_unit(&self, image: &[u8]) -> Unit {
        Unit::pressure(self.pressure.unit.u32(image)).unwrap_or(Unit::BAR)
    }

    /// The parameters in the image. An impossible unit acts as the default one.
    pub(crate) fn parameters(&self, image: &[u8]) -> Parameters {
        let pressure = self.pressure_unit(image);
        let temperature = Unit::temperature(self.temperature.unit.u32(image)).unwrap_or(Unit::CELSIUS);
        Parameters {
            pressure: self.pressure.parameters(pressure, image),
            temperature: self.temperature.parameters(temperature, image),
            calibration: self.calibration.calibration(image),
        }
    }
}
