//! Plots of an absolute encoder of 12 + 13 bits on a shaft: disturbed readings, and the values that the node publishes.

use profiles::board::{RawEncoder, SsiFrame};
use profiles::encoder::{ChannelValues, Encoder, Format, Parameters, SensorType, Start};
use profiles::profile::Chain;

use crate::figure::{Chart, Curve, INPUT, OUTPUT, READ, stairs, svg};
use crate::stimulus::LENGTH;

/// Steps of the shaft in a millisecond: 600 rpm with 8192 steps a turn.
const STEPS_A_MILLISECOND: f64 = 81.92;
const HALF_A_TURN: i64 = 4096;
/// The milliseconds with disturbed readings.
const DISTURBED: std::ops::Range<usize> = 30..50;

/// The disturbance of the readings for 20 ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Disturbance {
    /// The code jumps by half a turn.
    Jump,
    /// The encoder does not answer the clock.
    Silence,
}

/// The data of one millisecond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// The time of the reading, in milliseconds.
    pub(crate) ms: usize,
    /// The true position of the shaft, in steps.
    pub(crate) shaft: i64,
    /// The reading of the encoder, in steps; `None` without an answer.
    pub(crate) read: Option<i64>,
    /// The values that the node publishes.
    pub(crate) values: ChannelValues,
}

/// Turns the shaft at 600 rpm for the time of a plot, with default parameters.
pub(crate) fn turn(disturbance: Disturbance) -> Vec<Sample> {
    let mut parameters = Parameters::default();
    parameters.channels[0].kind = Some(SensorType::MultiTurn);
    let mut encoder = Encoder::new(Start::First);
    encoder.apply(&parameters);
    let format = parameters.format;
    (0..LENGTH).map(|ms| sample(&mut encoder, format, ms, disturbance)).collect()
}

fn sample(encoder: &mut Encoder, format: Format, ms: usize, disturbance: Disturbance) -> Sample {
    let shaft = (STEPS_A_MILLISECOND * ms as f64) as i64;
    let read = match disturbance {
        _ if !DISTURBED.contains(&ms) => Some(shaft),
        Disturbance::Jump => Some(shaft + HALF_A_TURN),
        Disturbance::Silence => None,
    };
    let ssi = read.map(|position| frame(format, position));
    let values = encoder.sample(&RawEncoder { ssi, ..RawEncoder::default() }).channels[0];
    Sample { ms, shaft, read, values }
}

/// The SSI frame of a position: the start bit, the word in Gray code, and the line at rest.
fn frame(format: Format, position: i64) -> SsiFrame {
    let (position, bits) = (position.unsigned_abs(), format.position_bits());
    SsiFrame { bits: ((1 << bits) | (position ^ (position >> 1))) << 2, clocks: bits + 3 }
}

/// The plot as SVG text.
pub(crate) fn plot() -> String {
    svg(&[chart(Disturbance::Jump), chart(Disturbance::Silence)])
}

fn chart(disturbance: Disturbance) -> Chart {
    let samples = turn(disturbance);
    let at = |sample: &Sample| sample.ms as f64;
    let shaft = samples.iter().map(|sample| (at(sample), sample.shaft as f64)).collect();
    let mut curves = vec![Curve { name: "shaft".into(), color: INPUT, points: shaft }];
    if disturbance == Disturbance::Jump {
        let read = samples.iter().filter_map(|sample| Some((at(sample), sample.read? as f64)));
        curves.push(Curve { name: "code".into(), color: READ, points: stairs(&read.collect::<Vec<_>>()) });
    }
    let position: Vec<_> = samples.iter().map(|sample| (at(sample), sample.values.position.into())).collect();
    curves.push(Curve { name: "6004h".into(), color: OUTPUT, points: stairs(&position) });
    let title = match disturbance {
        Disturbance::Jump => "600 rpm, the code jumps by half a turn from 30 to 50 ms",
        Disturbance::Silence => "600 rpm, no answer from 30 to 50 ms",
    };
    Chart { title: title.into(), unit: "steps", range: 0.0..8500.0, curves }
}
