//! The encoder: two channels and their common state.

use super::channel::{Channel, Pending};
use super::supervision::{Conditions, Supervision, supported_warnings};
use super::{
    ALARM_POSITION, ChannelParameters, ChannelValues, Limits, Parameters, RetainedChannel, RetainedState,
    Start,
};
use crate::board::{DIGITAL_INPUTS, Inputs, PositionInputs, PowerOn, RETAINED_WORDS, RawEncoder};
use crate::profile::Chain;

/// Output of the encoder for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Snapshot {
    /// Values of channels 1 and 2 (sub-indexes 1 and 2). Objects without channels show channel 1.
    pub channels: [ChannelValues; 2],
    /// Operating status (6500h).
    pub operating_status: u16,
    /// Resolution of the first sensor (6501h).
    pub resolution: u32,
    /// Revolutions that the first sensor distinguishes (6502h).
    pub revolutions: u16,
    /// Alarms (6503h).
    pub alarms: u16,
    /// Warnings (6505h).
    pub warnings: u16,
    /// Supported warnings (6506h).
    pub supported_warnings: u16,
    /// Operating time (6508h) in 0.1 h.
    pub operating_time: u32,
    /// The faults to be reported as emergencies.
    pub conditions: Conditions,
    /// The digital inputs that are on.
    pub digital: [bool; DIGITAL_INPUTS],
}

/// The whole measuring chain with its state.
#[derive(Clone, Debug)]
pub struct Encoder {
    channels: [Option<Channel>; 2],
    /// The operating time, and the retained positions that no channel has taken over yet.
    retained: RetainedState,
    /// No parameters have been applied yet, so the sensors are not known.
    is_new: bool,
    supervision: Supervision,
    limits: Limits,
    acknowledge: Pending,
    /// The part of the snapshot that depends on parameters alone.
    fixed: Snapshot,
}

impl Default for Encoder {
    fn default() -> Encoder {
        Encoder::new(Start::First)
    }
}

impl Encoder {
    /// An encoder after power-on. There is no position until parameters are applied: the first parameters tell whether
    /// the retained positions belong to these sensors.
    #[must_use]
    #[inline(never)]
    pub fn new(start: Start) -> Encoder {
        Encoder {
            channels: [None, None],
            retained: start.retained_state(),
            is_new: true,
            supervision: Supervision::new(matches!(start, Start::Damaged(_))),
            limits: Limits::default(),
            acknowledge: Pending::default(),
            fixed: Snapshot::default(),
        }
    }

    /// Processes the readings of one millisecond.
    pub fn sample(&mut self, raw: &RawEncoder) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.measure(raw, &mut snapshot);
        snapshot
    }

    fn measure(&mut self, raw: &RawEncoder, snapshot: &mut Snapshot) {
        self.retained.operating_time.tick();
        if let Some(mask) = self.acknowledge.take() {
            let [low, high, ..] = mask.to_le_bytes();
            let mask = u16::from_le_bytes([low, high]);
            self.supervision.acknowledge(mask);
            if mask & ALARM_POSITION != 0 {
                self.channels.iter_mut().flatten().for_each(Channel::believe);
            }
        }
        let fixed = &self.fixed;
        snapshot.operating_status = fixed.operating_status;
        (snapshot.resolution, snapshot.revolutions) = (fixed.resolution, fixed.revolutions);
        let channels = self.channels.iter_mut().zip(&fixed.channels);
        for (values, (channel, unused)) in snapshot.channels.iter_mut().zip(channels) {
            match channel {
                Some(channel) => channel.sample(raw, values),
                None => *values = *unused,
            }
        }
        let (channels, limits, time) = (&snapshot.channels, &self.limits, self.retained.operating_time);
        snapshot.alarms = self.supervision.alarms(channels);
        snapshot.warnings = self.supervision.warnings(channels, &raw.board, limits, time);
        snapshot.supported_warnings = supported_warnings(&raw.board);
        snapshot.conditions = self.supervision.conditions(channels, &raw.board, limits);
        snapshot.operating_time = time.tenths();
    }

    /// Writes the retained state to `words`, in its stored form.
    pub(crate) fn retain_in(&self, words: &mut [u32; RETAINED_WORDS]) {
        let (places, rest) = words.as_chunks_mut::<{ RetainedChannel::WORDS }>();
        for ((place, channel), before) in places.iter_mut().zip(&self.channels).zip(&self.retained.channels) {
            *place = match channel {
                Some(channel) => channel.retained().to_words(),
                None => before.to_words(),
            };
        }
        rest.iter_mut().zip(self.retained.operating_time.to_words()).for_each(|(to, from)| *to = from);
    }

    /// The state to be retained through a loss of power: see [`RetainedState`].
    #[must_use]
    #[inline(never)]
    pub fn retained_state(&self) -> RetainedState {
        let mut channels = self.retained.channels;
        for (retained, channel) in channels.iter_mut().zip(&self.channels) {
            *retained = channel.as_ref().map_or(*retained, Channel::retained);
        }
        RetainedState { channels, operating_time: self.retained.operating_time }
    }
}

impl Chain for Encoder {
    type Parameters = Parameters;
    type Snapshot = Snapshot;

    fn new(power_on: &PowerOn) -> Encoder {
        Encoder::new(Start::of(power_on.retained, power_on.stored))
    }

    fn apply(&mut self, parameters: &Parameters) {
        // Retained positions are for the first parameters only: a channel that is switched off and on again starts
        // afresh.
        let retained = core::mem::take(&mut self.retained.channels);
        let is_new = core::mem::take(&mut self.is_new);
        for ((channel, own), retained) in self.channels.iter_mut().zip(&parameters.channels).zip(&retained) {
            apply(channel, parameters, own, retained, if is_new { own.offset } else { 0 });
        }
        self.acknowledge.set(parameters.acknowledge);
        self.limits = parameters.limits;
        self.fixed = fixed(parameters);
    }

    fn update(&mut self, inputs: &Inputs, snapshot: &mut Snapshot) {
        self.measure(&inputs.position, snapshot);
        snapshot.digital = inputs.digital;
    }

    fn position_inputs(parameters: &Parameters) -> PositionInputs {
        parameters.inputs()
    }

    fn retain(&self, words: &mut [u32; RETAINED_WORDS]) -> bool {
        self.retain_in(words);
        true
    }
}

fn apply(
    channel: &mut Option<Channel>,
    all: &Parameters,
    own: &ChannelParameters,
    retained: &RetainedChannel,
    offset: i32,
) {
    match (all.sensor(own), channel) {
        (Some(sensor), Some(channel)) if channel.is_of(&sensor) => channel.apply(all, own, sensor),
        (Some(sensor), channel) => *channel = Some(Channel::new(all, own, sensor, retained, offset)),
        (None, channel) => *channel = None,
    }
}

fn fixed(parameters: &Parameters) -> Snapshot {
    let first = parameters.sensors().next();
    let unused = |channel: ChannelParameters| ChannelValues {
        presets: channel.preset.count,
        ..ChannelValues::default()
    };
    Snapshot {
        channels: parameters.channels.map(unused),
        operating_status: parameters.operating_status(),
        resolution: first.map_or(0, |sensor| sensor.resolution()),
        revolutions: first.map_or(0, |sensor| sensor.revolutions()),
        ..Snapshot::default()
    }
}
