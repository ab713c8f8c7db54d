//! The car position unit: up to four positions along the shaft, from the two channels of the encoder.
//!
//! The encoder counts the travel of its sensor in measuring steps (6384h:1). A position unit adds its offset and its
//! direction. A preset only changes the offset, so the offset is a parameter like any other:
//!
//! ```text
//! position (6383h) = ± travel + offset, modulo all positions that the sensor distinguishes
//! ```
//!
//! Positions are unsigned and wrap, as in CiA 406. A preset places the whole travel of the car above 0.

use crate::board::{RETAINED_WORDS, RawEncoder};
use crate::profile::Chain;
use core::num::{NonZeroU16, NonZeroU32};

use crate::encoder::{
    self, Area, ChannelParameters, ChannelValues, Conditions, Encoder, Module, RetainedState, SENSOR_ALARM,
    SENSOR_HELD, SENSOR_NO_SIGNAL, SENSOR_PARITY, SENSOR_TOO_FAST, SENSOR_UNREFERENCED, Sensor, Start,
    area_state,
};

/// Number of position units in a device.
pub const UNITS: usize = 4;

/// Operating parameter (6380h): the position falls when the sensor counts up.
pub const INVERTED: u16 = 1 << 3;

/// The bits of the state that are the area state (63B0h to 63B3h): those of 6400h of CiA 406.
pub const AREA: u8 = encoder::OUT_OF_RANGE | encoder::OVERFLOW | encoder::UNDERFLOW;

/// State of a position unit: the sensor gives no position.
pub const UNKNOWN: u8 = 1 << 3;

/// State of a position unit: not referenced. The position must not be trusted before a preset, or before an index that
/// determines the position.
pub const NOT_REFERENCED: u8 = 1 << 4;

/// The encoder channel of a position unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Channel 1.
    First,
    /// Channel 2.
    Second,
}

impl Source {
    /// The source with this channel number.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Source> {
        match code {
            1 => Some(Source::First),
            2 => Some(Source::Second),
            _ => None,
        }
    }

    pub(super) fn of<T>(self, [first, second]: &[T; 2]) -> &T {
        match self {
            Source::First => first,
            Source::Second => second,
        }
    }
}

/// The parameters of one position unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitParameters {
    /// `None` for an unused unit.
    pub source: Option<Source>,
    /// Operating parameters (6380h): [`INVERTED`].
    pub operating: u16,
    /// Difference between position and travel, in measuring steps.
    pub offset: i32,
    /// Limits of the position (63B4h to 63BBh), compared like the work area of CiA 406.
    pub limits: Area,
    /// Number of presets (2306h); 0 before the first one, [`NO_OFFSET`] when the offset has lost its meaning since.
    pub references: u8,
}

/// Number of presets of a unit whose offset has lost its meaning: its sensor or its units have changed.
pub const NO_OFFSET: u8 = u8::MAX;

/// The parameters of the position units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// The sensors, and the limits of the board's measurements. The other fields belong to CiA 406 and are not used.
    pub sensors: encoder::Parameters,
    /// Travel of the car per revolution of a rotary sensor, in um.
    pub travel: NonZeroU32,
    /// Position measuring step (6384h:1) in 10 um.
    pub position_step: NonZeroU16,
    /// Speed measuring step (6384h:2) in 0.1 mm/s.
    pub speed_step: NonZeroU16,
    /// The units.
    pub units: [UnitParameters; UNITS],
}

impl Default for UnitParameters {
    /// An unused unit.
    fn default() -> UnitParameters {
        UnitParameters {
            source: None,
            operating: 0,
            offset: 0,
            limits: Area { low: 0, high: i32::MAX },
            references: 0,
        }
    }
}

impl Default for Parameters {
    /// Unit 1 with the first channel; 1 mm, 1 mm/s, and 200 mm per revolution.
    fn default() -> Parameters {
        let mut units = [UnitParameters::default(); UNITS];
        let [first, ..] = &mut units;
        first.source = Some(Source::First);
        Parameters {
            sensors: encoder::Parameters::default(),
            travel: const { NonZeroU32::new(200_000).unwrap() },
            position_step: const { NonZeroU16::new(100).unwrap() },
            speed_step: const { NonZeroU16::new(10).unwrap() },
            units,
        }
    }
}

impl Parameters {
    /// Whether every sensor resolves the measuring step.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.encoder().is_consistent()
    }

    /// The offset that makes the position of a unit `preset` when the position is `position` now. `None` for a unit
    /// without a sensor, and for a preset beyond the range of the sensor.
    #[must_use]
    pub fn preset(&self, unit: usize, position: u32, preset: u32) -> Option<i32> {
        let range = self.range(unit)?;
        let own = self.units.get(unit)?;
        let moved = i64::from(preset) - i64::from(position);
        (i64::from(preset) < range).then(|| folded(i64::from(own.offset) + moved, range))
    }

    /// The offset that keeps the position of a unit when its direction is reversed.
    #[must_use]
    pub fn turned(&self, unit: usize, position: u32) -> Option<i32> {
        let (range, own) = (self.range(unit)?, self.units.get(unit)?);
        // position = ± travel + old offset = ∓ travel + new offset.
        Some(folded(2 * i64::from(position) - i64::from(own.offset), range))
    }

    /// Number of different positions of a unit.
    fn range(&self, unit: usize) -> Option<i64> {
        let parameters = self.encoder();
        let source = self.units.get(unit)?.source?;
        let sensor = parameters.sensor(source.of(&parameters.channels))?;
        i64::try_from(parameters.scale(&sensor).range().get()).ok()
    }

    /// The parameters for the encoder: both channels count travel.
    #[inline(never)]
    fn encoder(&self) -> encoder::Parameters {
        let channel = |own: ChannelParameters| ChannelParameters {
            kind: own.kind,
            resolution: own.resolution,
            counted: own.counted,
            fastest: own.fastest,
            users: 0,
            ..ChannelParameters::default()
        };
        let mut channels = self.sensors.channels.map(channel);
        let [first, second] = &mut channels;
        for (number, unit) in self.units.iter().enumerate() {
            let channel = match unit.source {
                None => continue,
                Some(Source::First) => &mut *first,
                Some(Source::Second) => &mut *second,
            };
            channel.users |= 1 << number;
            if let Some(references) = channel.references.get_mut(number) {
                *references = if unit.references == NO_OFFSET { 0 } else { unit.references };
            }
        }
        encoder::Parameters {
            operating: 0,
            travel: Some(self.travel),
            // Steps in nm and in 0.01 mm/s.
            step: u32::from(self.position_step.get()) * 10_000,
            speed_step: u32::from(self.speed_step.get()) * 10,
            channels,
            module: Module::default(),
            ..self.sensors
        }
    }
}

/// Output of a position unit for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnitValues {
    /// Position (6383h) in measuring steps.
    pub position: u32,
    /// The offset that `position` includes.
    pub offset: i32,
    /// Speed (6390h) in speed measuring steps.
    pub speed: i16,
    /// The position by the readings of the sensor: equal to the position unless the readings are rejected as
    /// implausible.
    pub reading: u32,
    /// [`UNKNOWN`], [`NOT_REFERENCED`], and the bits of the area state of CiA 406 for a position beyond a limit.
    pub state: u8,
    /// Operating status (63C0h).
    pub operating_status: u16,
    /// Resolution (63C1h) of the sensor: steps per revolution, or nm a step.
    pub resolution: u32,
    /// Revolutions (63C2h) that the sensor distinguishes.
    pub revolutions: u16,
    /// Warnings (63C5h), the same as in CiA 406. They concern both sensors together.
    pub warnings: u16,
}

/// Output of the position units for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Snapshot {
    /// The units.
    pub units: [UnitValues; UNITS],
    /// The faults to be reported as emergencies.
    pub conditions: Conditions,
}

/// A unit in use.
#[derive(Clone, Copy, Debug)]
struct Unit {
    source: Source,
    is_inverted: bool,
    offset: i32,
    range: i64,
    limits: Area,
    /// The bit of the unit among the users of its sensor.
    user: u8,
    /// Whether the position of the unit was never set.
    needs_preset: bool,
    /// An index says where the unit is.
    has_mark: bool,
    /// The part of the values that depends on parameters alone.
    fixed: UnitValues,
}

impl Unit {
    fn new(all: &Parameters, number: usize, sensor: &Sensor) -> Option<Unit> {
        let own = all.units.get(number)?;
        let is_inverted = own.operating & INVERTED != 0;
        let fixed = UnitValues {
            offset: own.offset,
            operating_status: operating_status(is_inverted),
            resolution: sensor.resolution(),
            revolutions: sensor.revolutions(),
            ..UnitValues::default()
        };
        let (source, range) = (own.source?, all.range(number)?);
        let kind = sensor.kind;
        let has_origin = kind.is_absolute() && !kind.is_counted();
        Some(Unit {
            source,
            is_inverted,
            offset: own.offset,
            range,
            limits: own.limits,
            user: 1 << number,
            needs_preset: own.references == NO_OFFSET || (own.references == 0 && !has_origin),
            has_mark: own.references == 0 && kind.is_linear() && !kind.is_absolute() && sensor.index,
            fixed,
        })
    }

    #[inline(never)]
    fn values(&self, channels: &[ChannelValues; 2], warnings: u16) -> UnitValues {
        let channel = self.source.of(channels);
        let at = |way: u32| {
            let way = i64::from(way);
            let counted = if self.is_inverted { -way } else { way };
            wrapped(counted + i64::from(self.offset), self.range)
        };
        let position = at(channel.position);
        UnitValues {
            position,
            reading: if channel.reading == channel.position { position } else { at(channel.reading) },
            speed: if self.is_inverted { channel.speed.saturating_neg() } else { channel.speed },
            state: area_state(&self.limits, &Module::default(), position, self.range, 0)
                | self.known(channel),
            warnings,
            ..self.fixed
        }
    }

    /// The bits of the state that say whether the position can be trusted.
    fn known(&self, channel: &ChannelValues) -> u8 {
        let state = channel.sensor_state;
        let unknown = if state & SENSOR_HELD == 0 { 0 } else { UNKNOWN };
        let is_read = state & (SENSOR_NO_SIGNAL | SENSOR_PARITY) == 0;
        let is_marked = self.has_mark && state & SENSOR_UNREFERENCED == 0;
        let is_wrong = channel.unknown & self.user != 0
            || state & (SENSOR_ALARM | SENSOR_TOO_FAST) != 0
            || (self.needs_preset && !is_marked);
        unknown | if is_read && is_wrong { NOT_REFERENCED } else { 0 }
    }
}

/// 63C0h: scaling (bit 2) is always on. The public text shows the direction in bit 0, 6380h has it in bit 3, so both
/// bits are set.
fn operating_status(is_inverted: bool) -> u16 {
    encoder::SCALING | if is_inverted { INVERTED | encoder::CODE_SEQUENCE } else { 0 }
}

/// A position modulo the range, which is at most 2^32.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn wrapped(position: i64, range: i64) -> u32 {
    position.checked_rem_euclid(range).unwrap_or(0) as u32
}

/// The equivalent offset (modulo the range) that is nearest to zero.
#[allow(clippy::cast_possible_truncation)]
fn folded(offset: i64, range: i64) -> i32 {
    let offset = i64::from(wrapped(offset, range));
    (if offset >= range - range / 2 { offset - range } else { offset }) as i32
}

/// The position units and their sensors.
#[derive(Clone, Debug)]
pub struct PositionUnits {
    encoder: Encoder,
    units: [Option<Unit>; UNITS],
}

impl Default for PositionUnits {
    fn default() -> PositionUnits {
        PositionUnits::new(Start::First)
    }
}

impl PositionUnits {
    /// The units after power-on. Measuring begins with the first parameters.
    #[must_use]
    pub fn new(start: Start) -> PositionUnits {
        PositionUnits { encoder: Encoder::new(start), units: [None; UNITS] }
    }

    /// Takes over parameters; they act from the next sample on.
    #[inline(never)]
    pub fn apply(&mut self, parameters: &Parameters) {
        let encoder = parameters.encoder();
        self.encoder.apply(&encoder);
        for ((number, unit), own) in (0..).zip(&mut self.units).zip(&parameters.units) {
            let sensor = own.source.and_then(|source| encoder.sensor(source.of(&encoder.channels)));
            *unit = sensor.and_then(|sensor| Unit::new(parameters, number, &sensor));
        }
    }

    /// Processes the readings of one millisecond.
    pub fn sample(&mut self, raw: &RawEncoder) -> Snapshot {
        let encoder::Snapshot { channels, warnings, conditions, .. } = self.encoder.sample(raw);
        let absent = UnitValues { state: UNKNOWN, ..UnitValues::default() };
        let values = |unit: Option<Unit>| unit.map_or(absent, |unit| unit.values(&channels, warnings));
        Snapshot { units: self.units.map(values), conditions }
    }

    /// Writes the retained state to `words`, in its stored form.
    pub(super) fn retain(&self, words: &mut [u32; RETAINED_WORDS]) {
        self.encoder.retain_in(words);
    }

    /// The state to be retained through a loss of power.
    #[must_use]
    pub fn retained_state(&self) -> RetainedState {
        self.encoder.retained_state()
    }
}
