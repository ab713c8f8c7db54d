//! An absolute encoder of 12 + 13 bits on a shaft, its readings disturbed, and what the node makes of them.

use profiles::board::{RawEncoder, SsiFrame};
use profiles::encoder::{ChannelValues, Encoder, Format, Parameters, SensorType, Start};
use profiles::profile::Chain;

use crate::figure::{Chart, Curve, INPUT, OUTPUT, READ, stairs, svg};
use crate::stimulus::LENGTH;

/// Steps of the shaft in a millisecond: 600 rpm of 8192 steps.
const STEPS_A_MILLISECOND: f64 = 81.92;
const HALF_A_TURN: i64 = 4096;
/// Milliseconds in which the readings are disturbed.
const DISTURBED: std::ops::Range<usize> = 30..50;

/// What disturbs the readings for 20 ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Disturbance {
    /// The code jumps by half a turn.
    Jump,
    /// No clock is answered.
    Silence,
}

/// What the node had of one millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// When the shaft was read, in milliseconds.
    pub ms: usize,
    /// Where the shaft was, in steps.
    pub shaft: i64,
    /// What the encoder said, in steps; `None` for no answer.
    pub read: Option<i64>,
    /// What the node publishes.
    pub values: ChannelValues,
}

/// Turns the shaft at 600 rpm for the time of a plot, with the parameters as delivered.
#[must_use]
pub fn turn(disturbance: Disturbance) -> Vec<Sample> {
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

/// The word of a position in Gray code behind the start bit, the line at rest behind the word.
fn frame(format: Format, position: i64) -> SsiFrame {
    let (position, bits) = (position.unsigned_abs(), format.position_bits());
    SsiFrame { bits: ((1 << bits) | (position ^ (position >> 1))) << 2, clocks: bits + 3 }
}

/// The plot as text.
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
