//! Transfer of measured values into the image, and of parameters out of the image.

use super::Sensors;
use crate::board::DIGITAL_INPUTS;
use crate::encoder::{
    Area, Cam, Cams, ChannelParameters, ChannelValues, Command, LongSpeed, Module, Parameters, Snapshot,
};
use crate::last_sent::LastSent;
use canopen::dictionary::{Dictionary, Field};
use core::num::NonZeroU16;

/// 6004h and 6020h:1 as PDO mapping entries.
pub(super) const POSITION: u32 = 0x6004_0020;
const FIRST_POSITION: u32 = 0x6020_0120;

/// Type of an encoder with several sensors.
const MULTI_SENSOR: u8 = 10;

/// Number of the device profile, CiA 406.
const PROFILE_NUMBER: u32 = 0x196;

/// The device type: the type of the encoder and the number of the profile.
pub(crate) const fn device_type(encoder_type: u8) -> u32 {
    (encoder_type as u32) << 16 | PROFILE_NUMBER
}

/// The places of the encoder's values in the image of a dictionary with the encoder's objects.
#[derive(Debug)]
pub struct Fields {
    device_type: Field,
    mappings: [Field; 2],
    pub(super) sensors: Sensors,
    pub(super) channels: [Channel; 2],
    /// Preset, position and offset of the first channel in the objects without sub-indexes.
    pub(super) preset: Field,
    pub(super) position: Field,
    offset: Field,
    pub(super) acknowledgements: Field,
    pub(super) factory_key: Field,
    acknowledgement: Field,
    operating: Field,
    per_revolution: Field,
    range: Field,
    step: Field,
    speed_step: Field,
    gear: Field,
    long_speed: [Field; 2],
    module: [Field; 3],
    identification: [Field; 3],
    operating_status: Field,
    resolution: Field,
    revolutions: Field,
    alarms: Field,
    warnings: [Field; 2],
    operating_time: Field,
    /// 1018h:4 and 650Bh.
    serial_number: [Field; 2],
}

/// The places of one channel's values.
#[derive(Debug)]
pub(super) struct Channel {
    pub(super) preset: Field,
    pub(super) presets: Field,
    pub(super) position: Field,
    pub(super) sensor_state: Field,
    speed: Field,
    long_speed: Field,
    threshold: Field,
    cam_delay: Field,
    preset_input: Field,
    cam_state: Field,
    cam_enable: Field,
    cam_polarity: Field,
    cams: [CamFields; 8],
    area_state: Field,
    area: [Field; 2],
    offset: Field,
    commissioning: Field,
}

/// The places of one cam's limits.
#[derive(Debug)]
struct CamFields {
    low: Field,
    high: Field,
    hysteresis: Field,
}

impl CamFields {
    const fn new(d: &Dictionary, cam: u16, sub: u8) -> CamFields {
        let (low, high) = (d.field(0x6310 + cam, sub), d.field(0x6320 + cam, sub));
        CamFields { low, high, hysteresis: d.field(0x6330 + cam, sub) }
    }

    fn cam(&self, image: &[u8]) -> Cam {
        let [low, high] = [self.low, self.high].map(|at| i32::from_le_bytes(at.load(image)));
        Cam { low, high, hysteresis: self.hysteresis.u16(image) }
    }
}

impl Channel {
    const fn new(d: &Dictionary, sub: u8) -> Channel {
        Channel {
            preset: d.field(0x6010, sub),
            presets: d.field(0x210A, sub),
            position: d.field(0x6020, sub),
            sensor_state: d.field(0x210B, sub),
            speed: d.field(0x6030, sub),
            long_speed: d.field(0x2110, sub),
            threshold: d.field(0x2112, sub),
            cam_delay: d.field(0x2113, sub),
            preset_input: d.field(0x2115, sub),
            cam_state: d.field(0x6300, sub),
            cam_enable: d.field(0x6301, sub),
            cam_polarity: d.field(0x6302, sub),
            cams: [
                CamFields::new(d, 0, sub),
                CamFields::new(d, 1, sub),
                CamFields::new(d, 2, sub),
                CamFields::new(d, 3, sub),
                CamFields::new(d, 4, sub),
                CamFields::new(d, 5, sub),
                CamFields::new(d, 6, sub),
                CamFields::new(d, 7, sub),
            ],
            area_state: d.field(0x6400, sub),
            area: [d.field(0x6401, sub), d.field(0x6402, sub)],
            offset: d.field(0x650C, sub),
            commissioning: d.field(0x210C, sub),
        }
    }

    fn publish(&self, values: &ChannelValues, image: &mut [u8]) {
        self.speed.store(image, values.speed.to_le_bytes());
        self.long_speed.store(image, values.long_speed.to_le_bytes());
        self.sensor_state.store(image, [values.sensor_state]);
        self.commissioning.store(image, [values.commissioning.code()]);
        // A sample from before the last preset must not restore the old position.
        if values.presets == self.presets.u8(image) {
            self.position.store(image, values.position.to_le_bytes());
            self.offset.store(image, values.offset.to_le_bytes());
            self.cam_state.store(image, [values.cams]);
            self.area_state.store(image, [values.area]);
        }
    }

    fn parameters(&self, sensor: ChannelParameters, image: &[u8]) -> ChannelParameters {
        let [low, high] = self.area.map(|at| i32::from_le_bytes(at.load(image)));
        ChannelParameters {
            preset: Command { value: self.preset.u32(image), count: self.presets.u8(image) },
            cams: Cams {
                cams: self.cams.each_ref().map(|cam| cam.cam(image)),
                enable: self.cam_enable.u8(image),
                polarity: self.cam_polarity.u8(image),
            },
            area: Area { low, high },
            cam_delay: i16::from_le_bytes(self.cam_delay.load(image)),
            offset: i32::from_le_bytes(self.offset.load(image)),
            ..sensor
        }
    }
}

/// Events of a channel since the last sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reports {
    /// The position when each TPDO was sent.
    pub(super) sent: LastSent,
    /// The preset input was off.
    was_off: bool,
    /// The preset input has gone on.
    pub(super) has_preset: bool,
}

impl Reports {
    pub(super) const NEW: Reports = Reports { sent: LastSent::NEW, was_off: false, has_preset: false };
}

impl Channel {
    /// Takes the values of a millisecond.
    pub(super) fn report(&self, digital: [bool; DIGITAL_INPUTS], reports: &mut Reports, image: &[u8]) {
        let input = usize::from(self.preset_input.u8(image));
        let is_on = input.checked_sub(1).and_then(|input| digital.get(input)).is_none_or(|is_on| *is_on);
        reports.has_preset |= is_on && reports.was_off && input > 0;
        reports.was_off = !is_on;
    }

    /// Whether the position is less than the threshold (2112h) away from the one that a TPDO has sent.
    #[inline(never)]
    fn is_quiet(&self, reports: &Reports, tpdo: usize, image: &[u8]) -> bool {
        self.position.u32(image).abs_diff(reports.sent.of(tpdo)) < self.threshold.u32(image)
    }
}

impl Fields {
    /// Whether the value at this place belongs to a position that has hardly moved since a TPDO was sent.
    pub(super) fn is_quiet(&self, reports: &[Reports; 2], tpdo: usize, place: usize, image: &[u8]) -> bool {
        let is_first = self.position.is_at(place);
        self.channels.iter().zip(reports).zip([is_first, false]).any(|((channel, reports), is_own)| {
            let fields = [channel.position, channel.speed, channel.long_speed];
            (is_own || fields.iter().any(|field| field.is_at(place)))
                && channel.is_quiet(reports, tpdo, image)
        })
    }

    /// Looks the fields up during compilation. `device_type` is the index of the device type: 1000h or 67FFh.
    pub(crate) const fn new(d: &Dictionary, device_type: u16) -> Fields {
        Fields {
            device_type: d.field(device_type, 0),
            mappings: [d.field(0x1A00, 1), d.field(0x1A01, 1)],
            sensors: Sensors::new(d),
            channels: [Channel::new(d, 1), Channel::new(d, 2)],
            preset: d.field(0x6003, 0),
            position: d.field(0x6004, 0),
            offset: d.field(0x6509, 0),
            acknowledgements: d.field(0x210A, 3),
            factory_key: d.field(0x2108, 0),
            acknowledgement: d.field(0x2109, 0),
            operating: d.field(0x6000, 0),
            per_revolution: d.field(0x6001, 0),
            range: d.field(0x6002, 0),
            step: d.field(0x6005, 1),
            speed_step: d.field(0x6005, 2),
            gear: d.field(0x2114, 0),
            long_speed: [d.field(0x2111, 1), d.field(0x2111, 2)],
            module: [d.field(0x2107, 1), d.field(0x2107, 2), d.field(0x2107, 3)],
            identification: [d.field(0x650A, 1), d.field(0x650A, 2), d.field(0x650A, 3)],
            operating_status: d.field(0x6500, 0),
            resolution: d.field(0x6501, 0),
            revolutions: d.field(0x6502, 0),
            alarms: d.field(0x6503, 0),
            warnings: [d.field(0x6505, 0), d.field(0x6506, 0)],
            operating_time: d.field(0x6508, 0),
            serial_number: [d.field(0x1018, 4), d.field(0x650B, 0)],
        }
    }

    /// Fills in the values that the table cannot have: the serial number (650Bh, hard-wired to 1018h:4), and the values
    /// that depend on the sensors in use. A stored mapping stays as the client has stored it.
    pub(super) fn initialise(&self, image: &mut [u8], has_default_mapping: bool) {
        let [source, shown] = self.serial_number;
        shown.store(image, source.load::<4>(image));
        let encoder_type = self.parameters(image).encoder_type();
        self.device_type.store(image, device_type(encoder_type).to_le_bytes());
        if encoder_type == MULTI_SENSOR && has_default_mapping {
            self.map_first_channel(image);
        }
    }

    /// An encoder with several sensors maps 6020h:1 in place of 6004h (CiA 406, 1A00h). Both have the same bits.
    fn map_first_channel(&self, image: &mut [u8]) {
        for mapping in &self.mappings {
            if mapping.u32(image) == POSITION {
                mapping.store(image, FIRST_POSITION.to_le_bytes());
            }
        }
    }

    /// Copies a snapshot into the image.
    pub(crate) fn publish(&self, snapshot: &Snapshot, image: &mut [u8]) {
        for (channel, values) in self.channels.iter().zip(&snapshot.channels) {
            channel.publish(values, image);
        }
        let [first, _] = &self.channels;
        self.position.store(image, first.position.load::<4>(image));
        self.offset.store(image, first.offset.load::<4>(image));
        self.operating_status.store(image, snapshot.operating_status.to_le_bytes());
        self.resolution.store(image, snapshot.resolution.to_le_bytes());
        self.revolutions.store(image, snapshot.revolutions.to_le_bytes());
        self.alarms.store(image, snapshot.alarms.to_le_bytes());
        for (shown, warnings) in self.warnings.iter().zip([snapshot.warnings, snapshot.supported_warnings]) {
            shown.store(image, warnings.to_le_bytes());
        }
        self.operating_time.store(image, snapshot.operating_time.to_le_bytes());
        for (shown, source) in self.identification.iter().zip(&self.module) {
            shown.store(image, source.load::<4>(image));
        }
    }

    /// The parameters in the image. An impossible value acts as the default.
    pub(crate) fn parameters(&self, image: &[u8]) -> Parameters {
        let [offset, low, high] = self.module.map(|at| i32::from_le_bytes(at.load(image)));
        let mask = self.acknowledgement.u16(image).into();
        let sensors = self.sensors.parameters(image);
        let [unit, millis] = &self.long_speed;
        let ([first, second], [a, b]) = (&self.channels, sensors.channels);
        Parameters {
            operating: self.operating.u16(image),
            per_revolution: self.per_revolution.u32(image),
            range: self.range.u32(image),
            gear: NonZeroU16::new(self.gear.u16(image)).unwrap_or(NonZeroU16::MIN),
            long_speed: LongSpeed {
                is_in_own_unit: unit.u8(image) != 0,
                millis: NonZeroU16::new(millis.u16(image)).unwrap_or(NonZeroU16::MIN),
            },
            step: self.step.u32(image),
            speed_step: self.speed_step.u32(image),
            channels: [first.parameters(a, image), second.parameters(b, image)],
            module: Module { offset, low, high },
            acknowledge: Command { value: mask, count: self.acknowledgements.u8(image) },
            ..sensors
        }
    }
}
