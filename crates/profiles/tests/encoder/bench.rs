//! A test bench that moves an encoder, rotary or linear.

use profiles::board::{RawEncoder, SsiFrame};
use profiles::encoder::{
    ChannelParameters, ChannelValues, Coding, Command, Encoder, Format, Parameters, SensorType, Snapshot,
    Start,
};
use profiles::profile::Chain;

/// The encoder with its parameters, and the position of the sensors.
pub(crate) struct Bench {
    pub(crate) encoder: Encoder,
    pub(crate) parameters: Parameters,
    /// Steps of the sensors from their zero.
    pub(crate) total: i64,
    /// Steps that the timer has lost.
    pub(crate) lost: i64,
    pub(crate) raw: RawEncoder,
}

/// Parameters for the leaps of the bench, which are faster than any encoder: 2104h is set accordingly.
pub(crate) fn one(kind: SensorType) -> Parameters {
    let mut parameters = delivered(kind);
    parameters.channels.iter_mut().for_each(|channel| channel.fastest = 10_000);
    parameters
}

/// The parameters as delivered, with this sensor type. A linear encoder counts in its own steps of 4096 nm.
pub(crate) fn delivered(kind: SensorType) -> Parameters {
    let mut parameters = Parameters { step: 4096, ..Parameters::default() };
    parameters.channels[0].kind = Some(kind);
    parameters
}

pub(crate) fn two(first: SensorType, second: SensorType) -> Parameters {
    let mut parameters = one(first);
    parameters.channels[1] = ChannelParameters { kind: Some(second), ..parameters.channels[1] };
    parameters
}

impl Bench {
    pub(crate) fn new(parameters: Parameters) -> Bench {
        Bench::started(parameters, Start::First, 0)
    }

    pub(crate) fn started(parameters: Parameters, start: Start, total: i64) -> Bench {
        let mut encoder = Encoder::new(start);
        encoder.apply(&parameters);
        Bench { encoder, parameters, total, lost: total, raw: RawEncoder::default() }
    }

    /// Applies the changes that `change` makes.
    pub(crate) fn change(&mut self, change: impl FnOnce(&mut Parameters)) {
        change(&mut self.parameters);
        self.encoder.apply(&self.parameters);
    }

    pub(crate) fn preset(&mut self, channel: usize, value: u32) {
        self.change(|parameters| {
            let count = parameters.channels[channel].preset.count + 1;
            parameters.channels[channel].preset = Command { value, count };
        });
    }

    /// Moves to `total` within a millisecond. The index is at the start of a turn of 4096 steps.
    pub(crate) fn go(&mut self, total: i64) -> Snapshot {
        let index = [total, self.total].map(|at| at.div_euclid(4096)).into_iter().max().unwrap_or(0) * 4096;
        let crossed = self.total.div_euclid(4096) != total.div_euclid(4096);
        self.raw.index = crossed.then(|| self.counter(index));
        self.total = total;
        self.stay()
    }

    pub(crate) fn step(&mut self, by: i64) -> Snapshot {
        self.go(self.total + by)
    }

    /// A millisecond without further movement.
    pub(crate) fn stay(&mut self) -> Snapshot {
        self.raw.counter = self.counter(self.total);
        self.raw.ssi = Some(frame(self.parameters.format, self.total));
        let snapshot = self.encoder.sample(&self.raw);
        self.raw.index = None;
        snapshot
    }

    /// Rests until the shaft counts as being at rest.
    pub(crate) fn rest(&mut self) {
        (0..100).for_each(|_| _ = self.stay());
    }

    /// A millisecond with this frame.
    pub(crate) fn receive(&mut self, frame: Option<SsiFrame>) -> Snapshot {
        self.raw.ssi = frame;
        self.encoder.sample(&self.raw)
    }

    pub(crate) fn first(&mut self) -> ChannelValues {
        self.stay().channels[0]
    }

    /// The timer count at this position of the sensor.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn counter(&self, total: i64) -> u16 {
        (total - self.lost) as u16
    }
}

/// A frame without alarm bit and parity.
pub(crate) fn frame(format: Format, total: i64) -> SsiFrame {
    let bits = format.position_bits();
    let position = u64::try_from(total.rem_euclid(1 << bits)).unwrap();
    let code = if is_gray(format) { position ^ (position >> 1) } else { position };
    SsiFrame { bits: ((1 << bits) | code) << 2, clocks: bits + 3 }
}

fn is_gray(format: Format) -> bool {
    let binary = Format::new(
        u8::try_from(format.revolution_bits()).unwrap(),
        u8::try_from(format.step_bits()).unwrap(),
        Coding::Binary,
        false,
        profiles::encoder::Parity::None,
    );
    binary != Some(format)
}
