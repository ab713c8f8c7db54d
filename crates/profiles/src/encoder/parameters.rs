//! All parameters of the encoder as one consistent set.

use core::num::{NonZeroU16, NonZeroU32};

use crate::board::PositionInputs;

use super::{Area, Cams, Format, Limits, Module, Scale, Sensor, SensorType, Settings};

/// Operating parameter (6000h): the position falls when the shaft turns clockwise. Rotary encoders only.
pub const CODE_SEQUENCE: u16 = 1 << 0;
/// Operating parameter (6000h): the commissioning diagnostic runs.
pub const COMMISSIONING: u16 = 1 << 1;
/// Operating parameter (6000h): the scaling function works.
pub const SCALING: u16 = 1 << 2;
/// Operating parameter (6000h): the measuring direction is reverse. Linear encoders only.
pub const DIRECTION: u16 = 1 << 3;

/// Value of 2104h: the fastest movement follows from [`HIGHEST_SPEED`] for a shaft, from [`HIGHEST_RATE`] for a linear
/// encoder.
pub const AUTOMATIC: u32 = u32::MAX;
/// Revolutions per minute above the range of any encoder.
pub const HIGHEST_SPEED: u32 = 12_000;
/// Speed of a linear encoder above the range of any: 20 m/s, in nm per millisecond or um per second.
pub const HIGHEST_RATE: u32 = 20_000_000;

/// A command. It is carried out once per change of `count`; a count of 0 means that no command has been given yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// The argument: a preset value, or a mask of alarms to clear.
    pub value: u32,
    /// Number of commands given so far.
    pub count: u8,
}

/// The parameters of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelParameters {
    /// The sensor, `None` for a channel that is not used.
    pub kind: Option<SensorType>,
    /// See [`Sensor::resolution`].
    pub resolution: NonZeroU32,
    /// See [`Sensor::counted`].
    pub counted: NonZeroU16,
    /// See [`Sensor::fastest`]; [`AUTOMATIC`] for a value that follows from the resolution.
    pub fastest: u32,
    /// The stored offset (650Ch), used at start alone. It belongs to the scale that was stored with it.
    pub offset: i32,
    /// Preset (6003h, 6010h).
    pub preset: Command,
    /// A bit for each user of the sensor whose position is reported: a position unit of a lift, or bit 0.
    pub users: u8,
    /// For each user, counts the presets by another part of the device; 0 for none.
    pub references: [u8; 4],
    /// Cams (6301h to 6337h).
    pub cams: Cams,
    /// Work area (6401h, 6402h).
    pub area: Area,
    /// Delay that the cams compensate, in 0.1 ms.
    pub cam_delay: i16,
}

/// Settings of the long speed values (2111h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LongSpeed {
    /// The unit is 0.01 rpm or um/s, not that of 6030h.
    pub is_in_own_unit: bool,
    /// Time constant of the average in milliseconds.
    pub millis: NonZeroU16,
}

/// The parameters of the encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// Operating parameters (6000h): [`SCALING`] and the other bits.
    pub operating: u16,
    /// Measuring units per revolution (6001h).
    pub per_revolution: u32,
    /// Total measuring range (6002h).
    pub range: u32,
    /// Revolutions of the sensor that have the units of 6001h.
    pub gear: NonZeroU16,
    /// Unit and averaging of the long speed values.
    pub long_speed: LongSpeed,
    /// Position measuring step of a linear encoder in nm (6005h:1).
    pub step: u32,
    /// Speed measuring step of a linear encoder in 0.01 mm/s (6005h:2).
    pub speed_step: u32,
    /// Travel per revolution of a shaft in um. If given, every sensor counts in `step` and `speed_step` like a linear
    /// encoder, over all positions that the sensor distinguishes. `None` outside of lifts.
    pub travel: Option<NonZeroU32>,
    /// Sub-indexes 1 and 2 of the objects with channels.
    pub channels: [ChannelParameters; 2],
    /// Frame of the SSI input.
    pub format: Format,
    /// Whether the index input is used.
    pub index: bool,
    /// Manufacturer's data of the sensors (650Ah).
    pub module: Module,
    /// Limits of the board's measurements.
    pub limits: Limits,
    /// Acknowledgement of alarms.
    pub acknowledge: Command,
}

impl Default for ChannelParameters {
    /// An unused channel.
    fn default() -> ChannelParameters {
        ChannelParameters {
            kind: None,
            resolution: const { NonZeroU32::new(4096).unwrap() },
            counted: const { NonZeroU16::new(4096).unwrap() },
            fastest: AUTOMATIC,
            offset: 0,
            preset: Command::default(),
            users: 1,
            references: [0; 4],
            cams: Cams::default(),
            area: Area { low: 0, high: i32::MAX },
            cam_delay: 0,
        }
    }
}

impl Default for Parameters {
    /// One incremental encoder with 1024 lines, an index and electronic counting.
    fn default() -> Parameters {
        let first =
            ChannelParameters { kind: Some(SensorType::IncrementalCounted), ..ChannelParameters::default() };
        Parameters {
            operating: 0,
            per_revolution: 4096,
            range: 4096 * 4096,
            gear: NonZeroU16::MIN,
            long_speed: LongSpeed { is_in_own_unit: false, millis: NonZeroU16::MIN },
            step: 10_000,
            speed_step: 100,
            travel: None,
            channels: [first, ChannelParameters::default()],
            format: Format::COMMON,
            index: true,
            module: Module::default(),
            limits: Limits::default(),
            acknowledge: Command::default(),
        }
    }
}

impl Parameters {
    /// The encoder type of object 1000h: the type of the one sensor, 10 for two sensors, 0 for none.
    #[must_use]
    pub fn encoder_type(&self) -> u8 {
        match self.channels.map(|channel| channel.kind) {
            [Some(_), Some(_)] => 10,
            [Some(kind), None] | [None, Some(kind)] => kind.code(),
            [None, None] => 0,
        }
    }

    /// The sensor of a channel.
    #[must_use]
    pub fn sensor(&self, channel: &ChannelParameters) -> Option<Sensor> {
        let ChannelParameters { resolution, counted, fastest, .. } = *channel;
        let (format, index) = (self.format, self.index);
        let sensor = |kind| Sensor { kind, resolution, counted, format, index, fastest };
        channel.kind.map(|kind| with_limit(sensor(kind)))
    }

    /// All sensors.
    pub fn sensors(&self) -> impl Iterator<Item = Sensor> {
        self.channels.iter().filter_map(|channel| self.sensor(channel))
    }

    /// The board inputs to be read for the sensors.
    #[must_use]
    pub fn inputs(&self) -> PositionInputs {
        let is_absolute = self.sensors().any(|sensor| sensor.kind.is_absolute());
        PositionInputs { are_used: true, ssi_bits: is_absolute.then(|| self.format.length()) }
    }

    /// Whether every sensor can give the scaling that the parameters ask for.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.sensors().all(|sensor| self.asked_scale(&sensor).is_some())
    }

    /// The scale of a sensor: the one asked for, or the sensor's own steps if it cannot give that one.
    #[must_use]
    pub fn scale(&self, sensor: &Sensor) -> Scale {
        self.asked_scale(sensor)
            .unwrap_or_else(|| Scale::unscaled(&sensor.native(), self.is_reversed(sensor)))
    }

    /// Units of 6030h per native step and second: measuring units of a shaft, speed measuring steps of a linear
    /// encoder.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // The result has 15 bits, less than 24.
    pub fn speed_factor(&self, sensor: &Sensor) -> f32 {
        if let Some(nanometres) = self.way(sensor) {
            // A step of 6005h:2 is 0.01 mm/s: 10 000 nm/s.
            return nanometres / (10_000.0 * self.speed_step.max(1) as f32);
        }
        let scale = self.scale(sensor);
        scale.units() as f32 / scale.turn().get() as f32
    }

    /// Units of the long speed value per native step and second.
    #[allow(clippy::cast_precision_loss)] // The result has 24 bits.
    pub(super) fn long_speed_factor(&self, sensor: &Sensor) -> f32 {
        match self.way(sensor) {
            _ if !self.long_speed.is_in_own_unit => self.speed_factor(sensor),
            Some(nanometres) => nanometres / 1000.0,
            None => 60.0 * 100.0 / sensor.resolution().max(1) as f32,
        }
    }

    /// Travel per native step in nm; `None` if the sensor measures an angle.
    #[allow(clippy::cast_precision_loss)]
    fn way(&self, sensor: &Sensor) -> Option<f32> {
        if sensor.kind.is_linear() {
            return Some(sensor.resolution.get() as f32);
        }
        self.travel.map(|travel| travel.get() as f32 * 1000.0 / sensor.resolution() as f32)
    }

    /// Object 6500h: the active parameters. Bit 1 says that the commissioning diagnostic is supported.
    #[must_use]
    pub fn operating_status(&self) -> u16 {
        let scaling = if self.is_consistent() { SCALING } else { 0 };
        COMMISSIONING | self.operating & (self.directions() | scaling)
    }

    /// The direction bits of 6000h that apply to one of the sensors.
    #[must_use]
    pub fn directions(&self) -> u16 {
        self.sensors().fold(0, |bits, sensor| bits | direction_bit(&sensor))
    }

    fn asked_scale(&self, sensor: &Sensor) -> Option<Scale> {
        if let Some(travel) = self.travel {
            return Scale::along(&sensor.native(), travel, NonZeroU32::new(self.step)?);
        }
        let settings = Settings {
            reversed: self.is_reversed(sensor),
            scaling: self.operating & SCALING != 0,
            per_revolution: self.per_revolution,
            range: self.range,
            step: self.step,
            gear: self.gear,
        };
        Scale::new(&sensor.native(), &settings)
    }

    fn is_reversed(&self, sensor: &Sensor) -> bool {
        self.operating & direction_bit(sensor) != 0
    }
}

/// Replaces [`AUTOMATIC`] by the fastest movement that follows from the resolution.
fn with_limit(sensor: Sensor) -> Sensor {
    if sensor.fastest != AUTOMATIC {
        return sensor;
    }
    Sensor { fastest: automatic(&sensor), ..sensor }
}

/// The most steps in a millisecond at [`HIGHEST_SPEED`] or [`HIGHEST_RATE`], and 3 % for the instants of the readings:
/// the second one after a start comes late. Half a turn in a millisecond could be either direction; the limit is well
/// below that.
pub(super) fn automatic(sensor: &Sensor) -> u32 {
    let resolution = sensor.resolution().max(1);
    let steps = if sensor.kind.is_linear() {
        HIGHEST_RATE.div_ceil(resolution)
    } else {
        resolution.div_ceil(60_000 / HIGHEST_SPEED)
    };
    steps.saturating_add(steps / 32)
}

fn direction_bit(sensor: &Sensor) -> u16 {
    if sensor.kind.is_linear() { DIRECTION } else { CODE_SEQUENCE }
}
