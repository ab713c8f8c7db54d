//! One channel: from the sensor to position, speed, cams and work area.

use super::area::area_state;
use super::commissioning::Commissioning;
use super::input::Input;
use super::speed::{rounded, speed_value};
use super::trust::ALL;
use super::{
    Area, CamChannel, ChannelParameters, Command, Module, Parameters, Position, Progress, RetainedChannel,
    Scale, Sensor, Speedometer,
};
use crate::board::RawEncoder;

/// Output of a channel for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChannelValues {
    /// Position value (6004h, 6020h).
    pub position: u32,
    /// Speed value (6030h).
    pub speed: i16,
    /// Long speed value (2110h).
    pub long_speed: i32,
    /// Cam state register (6300h).
    pub cams: u8,
    /// Area state register (6400h).
    pub area: u8,
    /// Offset value (6509h, 650Ch).
    pub offset: i32,
    /// State of the sensor: bits `SENSOR_..`.
    pub sensor_state: u8,
    /// Progress of the commissioning diagnostic.
    pub commissioning: Progress,
    /// [`Command::count`] of the last preset that this position includes.
    pub presets: u8,
    /// The position that the readings of the sensor would give: equal to [`position`](ChannelValues::position) unless
    /// the readings are rejected as implausible.
    pub reading: u32,
    /// A bit for each user of the sensor whose position is not known.
    pub unknown: u8,
    /// The sensor does not answer, for longer than is tolerated.
    pub is_broken: bool,
}

/// The counter of the commands that were taken, and the command that waits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pending {
    count: u8,
    value: Option<u32>,
}

impl Pending {
    /// Takes note of the last command.
    pub(super) fn set(&mut self, command: Command) {
        if command.count != self.count {
            self.count = command.count;
            self.value = Some(command.value).filter(|_| command.count != 0);
        }
    }

    /// The command to be carried out.
    pub(super) fn take(&mut self) -> Option<u32> {
        self.value.take()
    }
}

/// A channel and its state.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    input: Input,
    /// Resolution of the sensor, saved with the retained position.
    resolution: u32,
    position: Position,
    speedometer: Speedometer,
    speed_factor: f32,
    /// Units of the long speed value per step and second.
    long_factor: f32,
    /// Part of a new speed in the average.
    share: f32,
    average: f32,
    /// Units by which the cams are ahead, per step and second; 0 without compensation.
    lead: f32,
    cams: CamChannel,
    area: Area,
    module: Module,
    commissioning: Commissioning,
    preset: Pending,
    references: [u8; 4],
}

impl Channel {
    /// A channel that has not measured yet, with its retained position. `offset` belongs to the scale of the
    /// parameters.
    #[inline(never)]
    pub(super) fn new(
        all: &Parameters,
        own: &ChannelParameters,
        sensor: Sensor,
        retained: &RetainedChannel,
        offset: i32,
    ) -> Channel {
        let scale = all.scale(&sensor);
        let resolution = sensor.resolution();
        let mut channel = Channel {
            input: Input::new(sensor, &scale, all.module.offset, own.users, retained),
            resolution,
            position: Position::new(scale, offset),
            speedometer: Speedometer::new(0),
            speed_factor: 0.0,
            long_factor: 0.0,
            share: 1.0,
            average: 0.0,
            lead: 0.0,
            cams: CamChannel::default(),
            area: own.area,
            module: all.module,
            commissioning: Commissioning::default(),
            preset: Pending { count: own.preset.count, value: None },
            references: own.references,
        };
        channel.configure(all, own, &scale);
        channel
    }

    /// Whether the channel belongs to this sensor: another sensor needs another channel.
    pub(super) fn is_of(&self, sensor: &Sensor) -> bool {
        sensor.is_like(self.input.sensor())
    }

    /// Takes over parameters; they act from the next sample on.
    #[inline(never)]
    pub(super) fn apply(&mut self, all: &Parameters, own: &ChannelParameters, sensor: Sensor) {
        let scale = all.scale(&sensor);
        let shaft = self.input.tracker().map(super::Tracker::shaft).unwrap_or_default();
        self.position.rescale(scale, shaft);
        self.input.apply(sensor, &scale, all.module.offset, own.users);
        self.preset.set(own.preset);
        for (user, (before, now)) in self.references.iter_mut().zip(own.references).enumerate() {
            if ![0, *before].contains(&now) {
                self.input.refer(1 << user);
            }
            *before = now;
        }
        self.configure(all, own, &scale);
    }

    #[inline(never)]
    #[allow(clippy::cast_precision_loss)] // Speeds have 24 bits.
    fn configure(&mut self, all: &Parameters, own: &ChannelParameters, scale: &Scale) {
        let factor = all.speed_factor(self.input.sensor());
        let long = all.long_speed_factor(self.input.sensor());
        let sign = if scale.is_reversed() { -1.0 } else { 1.0 };
        (self.speed_factor, self.long_factor) = (sign * factor, sign * long);
        self.share = 1.0 / f32::from(all.long_speed.millis.get());
        let per_step = scale.units() as f32 / scale.turn().get() as f32;
        // A delay of 1 is 0.1 ms.
        self.lead = sign * per_step * f32::from(own.cam_delay) / 10_000.0;
        self.cams.apply(&own.cams, scale.range().get().cast_signed());
        (self.area, self.module) = (own.area, all.module);
        self.commissioning.set(all.operating & super::COMMISSIONING != 0);
    }

    /// Processes one sample.
    #[inline(never)]
    pub(super) fn sample(&mut self, raw: &RawEncoder, values: &mut ChannelValues) {
        let preset = self.preset.take();
        if preset.is_some() {
            self.input.refer(ALL);
        }
        let seen = self.input.read(raw, self.position.scale());
        if self.input.has_begun() {
            self.commissioning.observe(self.input.sensor(), &seen);
        }
        values.sensor_state = seen.state;
        values.commissioning = self.commissioning.progress();
        values.offset = self.position.offset();
        values.presets = self.preset.count;
        values.unknown = self.input.unknown();
        values.is_broken = seen.is_broken;
        let Some(tracker) = self.input.tracker() else {
            *values = ChannelValues {
                position: 0,
                speed: 0,
                long_speed: 0,
                cams: 0,
                area: 0,
                reading: 0,
                ..*values
            };
            return;
        };
        if let Some(preset) = preset {
            self.position.preset(preset, tracker.shaft());
        }
        let position = self.position.value(tracker.shaft());
        let speed = self.speedometer.update(tracker.count());
        // At most 2^32.
        let range = self.position.scale().range().get().cast_signed();
        values.position = position;
        values.speed = speed_value(speed, self.speed_factor);
        self.average += (speed - self.average) * self.share;
        values.long_speed = rounded(self.average * self.long_factor);
        values.cams = self.cams.update(self.ahead(position, speed));
        values.area = area_state(&self.area, &self.module, position, range, self.input.native());
        values.offset = self.position.offset();
        values.reading = self.reading(position);
    }

    /// The position that the cams see: where the shaft will be after their delay.
    #[inline]
    fn ahead(&self, position: u32, speed: f32) -> u32 {
        if self.lead == 0.0 {
            position
        } else {
            self.position.scale().moved(position, rounded(speed * self.lead))
        }
    }

    /// The position that the readings would give, were they accepted.
    fn reading(&self, position: u32) -> u32 {
        let there = self.input.doubtful();
        there.map_or(position, |there| self.position.scale().value(there.shaft(), self.position.offset()))
    }

    /// Accepts rejected readings, where the reading alone is the position.
    #[inline(never)]
    pub(super) fn believe(&mut self) {
        self.input.believe();
    }

    /// The state to be retained in the memory with the battery.
    #[inline]
    pub(super) fn retained(&self) -> RetainedChannel {
        self.input.retained(self.resolution)
    }
}
