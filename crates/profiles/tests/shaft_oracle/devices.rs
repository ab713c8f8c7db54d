//! The devices that are judged: an encoder with two channels, and two position units of a lift.

use profiles::board::{
    Inputs, POSITION_RECORD_WORDS, PowerOn, RETAINED_WORDS, RawEncoder, RawSample, Retained,
};
use profiles::encoder::{
    ALARM_POSITION, CODE_SEQUENCE, Command, DIRECTION, Encoder, Format, Parameters, PositionRecord,
    RetainedState, SCALING, SENSOR_POSITION_ERROR, SENSOR_UNREFERENCED, Scale, Sensor, Snapshot, Start,
    WARNING_REFERENCE,
};
use profiles::lift::position::{self, NOT_REFERENCED, PositionUnits, Source, UNKNOWN, UnitValues};
use profiles::profile::Chain;

use profiles::{Measurement, Personality, pressure};

use std::num::{NonZeroU16, NonZeroU32};

use crate::shaft::Case;
use crate::tally::Reset;

/// A position with what is said about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shown {
    pub(crate) position: u32,
    pub(crate) is_condemned: bool,
    pub(crate) awaits_index: bool,
}

pub(crate) trait Device {
    /// The sensor of a position.
    fn sensor(&self, at: usize) -> Sensor;
    /// The scale of a position with the present settings.
    fn scale(&self, at: usize) -> Scale;
    fn sample(&mut self, raw: &RawEncoder) -> [Shown; 2];
    /// Presets one of the positions, and stores all parameters.
    fn preset(&mut self, at: usize, value: u32, raw: &RawEncoder);
    /// Counts the other way.
    fn turn_round(&mut self);
    /// Object 2109h; `false` for a device without it.
    fn acknowledge(&mut self) -> bool;
    fn restart(&mut self, reset: Reset);
}

/// The retained words after a reset, and the record about them.
fn kept(words: [u32; RETAINED_WORDS], reset: Reset) -> (Retained, Option<[u32; POSITION_RECORD_WORDS]>) {
    let retained = if reset == Reset::NoBattery { Retained::Nothing } else { Retained::Words(words) };
    (retained, Some(PositionRecord::of(&words).to_words()))
}

fn parameters(case: &Case) -> Parameters {
    let mut parameters = Parameters { index: case.index, format: Format::COMMON, ..Parameters::default() };
    for (channel, kind) in parameters.channels.iter_mut().zip(case.kinds()) {
        channel.kind = Some(kind);
    }
    if case.is_scaled {
        parameters.operating = SCALING;
        (parameters.per_revolution, parameters.range) = (3600, 36_000);
        parameters.step = 10_000;
    }
    if case.is_geared {
        // Ten revolutions are three turns of a table with 3600 units.
        (parameters.per_revolution, parameters.range) = (10_800, 3600);
        parameters.gear = NonZeroU16::new(10).unwrap();
    }
    parameters
}

/// A device that measures the shaft: the encoder alone, or the module of an encoder and a transmitter.
pub(crate) trait Chained {
    fn start(words: Retained, record: Option<[u32; POSITION_RECORD_WORDS]>) -> Self;
    fn apply(&mut self, parameters: &Parameters);
    fn sample(&mut self, raw: &RawEncoder) -> Snapshot;
    fn words(&self) -> [u32; RETAINED_WORDS];
}

impl Chained for Encoder {
    fn start(words: Retained, record: Option<[u32; POSITION_RECORD_WORDS]>) -> Encoder {
        Encoder::new(Start::of(words, record))
    }

    fn apply(&mut self, parameters: &Parameters) {
        Chain::apply(self, parameters);
    }

    fn sample(&mut self, raw: &RawEncoder) -> Snapshot {
        Encoder::sample(self, raw)
    }

    fn words(&self) -> [u32; RETAINED_WORDS] {
        RetainedState::to_words(&self.retained_state())
    }
}

/// The measurement of the combined personality.
pub(crate) struct Combined(Measurement, profiles::Snapshot);

impl Chained for Combined {
    fn start(retained: Retained, stored: Option<[u32; POSITION_RECORD_WORDS]>) -> Combined {
        let power_on = PowerOn { retained, stored, ..PowerOn::default() };
        Combined(Measurement::new(Personality::Combined, &power_on), profiles::Snapshot::default())
    }

    fn apply(&mut self, parameters: &Parameters) {
        self.0.apply(&profiles::Parameters::Combined((*parameters, pressure::Parameters::default())));
    }

    fn sample(&mut self, raw: &RawEncoder) -> Snapshot {
        let analogue =
            RawSample { pressure: 0, supply: 0, temperature: 0, reference: 0, thermistor: 0, count: 16 };
        let inputs = Inputs { analogue, position: *raw, digital: [false; 2] };
        self.0.update(&inputs, &mut self.1);
        let profiles::Snapshot::Combined((snapshot, _)) = self.1 else { panic!("another personality") };
        snapshot
    }

    fn words(&self) -> [u32; RETAINED_WORDS] {
        let mut words = [0; RETAINED_WORDS];
        assert!(self.0.retain(&mut words));
        words
    }
}

pub(crate) struct EncoderDevice<E> {
    encoder: E,
    parameters: Parameters,
    /// The content of the parameter store.
    stored: Parameters,
}

impl<E: Chained> EncoderDevice<E> {
    pub(crate) fn new(case: &Case) -> EncoderDevice<E> {
        let parameters = parameters(case);
        let mut device =
            EncoderDevice { encoder: E::start(Retained::Nothing, None), parameters, stored: parameters };
        device.encoder.apply(&parameters);
        device
    }
}

impl<E: Chained> Device for EncoderDevice<E> {
    fn sensor(&self, at: usize) -> Sensor {
        self.parameters.sensors().nth(at).unwrap()
    }

    fn scale(&self, at: usize) -> Scale {
        self.parameters.scale(&self.sensor(at))
    }

    fn sample(&mut self, raw: &RawEncoder) -> [Shown; 2] {
        let snapshot = self.encoder.sample(raw);
        [0, 1].map(|at| {
            let (values, kind) = (snapshot.channels[at], self.sensor(at).kind);
            let relative = !kind.is_absolute() && !kind.is_retained();
            let condemning = SENSOR_POSITION_ERROR | if relative { SENSOR_UNREFERENCED } else { 0 };
            let is_unreferenced = values.sensor_state & SENSOR_UNREFERENCED != 0;
            Shown {
                position: values.position,
                is_condemned: values.sensor_state & condemning != 0,
                awaits_index: self.parameters.index && !kind.is_absolute() && is_unreferenced,
            }
        })
    }

    fn preset(&mut self, at: usize, value: u32, raw: &RawEncoder) {
        let preset = &mut self.parameters.channels[at].preset;
        *preset = Command { value, count: preset.count.checked_add(1).unwrap_or(1) };
        self.encoder.apply(&self.parameters);
        let offsets = self.encoder.sample(raw).channels.map(|values| values.offset);
        self.stored = self.parameters;
        for (channel, offset) in self.stored.channels.iter_mut().zip(offsets) {
            (channel.offset, channel.preset) = (offset, Command::default());
        }
    }

    fn turn_round(&mut self) {
        self.parameters.operating ^= if self.sensor(0).kind.is_linear() { DIRECTION } else { CODE_SEQUENCE };
        self.encoder.apply(&self.parameters);
    }

    fn acknowledge(&mut self) -> bool {
        let acknowledge = &mut self.parameters.acknowledge;
        let count = acknowledge.count.checked_add(1).unwrap_or(1);
        *acknowledge = Command { value: ALARM_POSITION.into(), count };
        self.encoder.apply(&self.parameters);
        true
    }

    fn restart(&mut self, reset: Reset) {
        let (retained, record) = kept(self.encoder.words(), reset);
        self.encoder = E::start(retained, record);
        self.parameters = self.stored;
        self.encoder.apply(&self.parameters);
    }
}

/// Two position units with their own zero, on one sensor or on two.
pub(crate) struct LiftDevice {
    units: PositionUnits,
    parameters: position::Parameters,
    stored: position::Parameters,
    values: [UnitValues; 2],
}

impl LiftDevice {
    pub(crate) fn new(case: &Case) -> LiftDevice {
        // The other pulley has a range that is no whole number of steps.
        let travel = NonZeroU32::new(if case.is_scaled { 314_159 } else { 200_000 }).unwrap();
        let sensors = Parameters { operating: 0, ..parameters(case) };
        let mut parameters = position::Parameters { sensors, travel, ..position::Parameters::default() };
        let second = if case.kind == case.second { Source::First } else { Source::Second };
        if second == Source::First {
            parameters.sensors.channels[1].kind = None;
        }
        for (unit, source) in parameters.units.iter_mut().zip([Source::First, second]) {
            unit.source = Some(source);
        }
        let units = PositionUnits::default();
        let mut device = LiftDevice { units, parameters, stored: parameters, values: Default::default() };
        device.units.apply(&parameters);
        device
    }
}

impl Device for LiftDevice {
    fn sensor(&self, at: usize) -> Sensor {
        let is_second = self.parameters.units[at].source == Some(Source::Second);
        self.parameters.sensors.sensors().nth(is_second.into()).unwrap()
    }

    fn scale(&self, at: usize) -> Scale {
        let step = NonZeroU32::new(u32::from(self.parameters.position_step.get()) * 10_000).unwrap();
        Scale::along(&self.sensor(at).native(), self.parameters.travel, step).unwrap()
    }

    fn sample(&mut self, raw: &RawEncoder) -> [Shown; 2] {
        let [first, second, ..] = self.units.sample(raw).units;
        self.values = [first, second];
        self.values.map(|values| Shown {
            position: values.position,
            is_condemned: values.state & (UNKNOWN | NOT_REFERENCED) != 0,
            awaits_index: self.parameters.sensors.index && values.warnings & WARNING_REFERENCE != 0,
        })
    }

    fn preset(&mut self, at: usize, value: u32, _: &RawEncoder) {
        let offset = self.parameters.preset(at, self.values[at].reading, value).unwrap();
        let unit = &mut self.parameters.units[at];
        (unit.offset, unit.references) = (offset, unit.references % 200 + 1);
        self.stored = self.parameters;
        self.units.apply(&self.parameters);
    }

    fn turn_round(&mut self) {}

    fn acknowledge(&mut self) -> bool {
        false
    }

    fn restart(&mut self, reset: Reset) {
        let words = self.units.retained_state().to_words();
        let (retained, record) = kept(words, reset);
        self.units = PositionUnits::new(Start::of(retained, record));
        self.parameters = self.stored;
        self.units.apply(&self.parameters);
    }
}
