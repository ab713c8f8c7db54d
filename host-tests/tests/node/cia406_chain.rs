//! The encoder compared with golden values, which golden/cia406_chain.py has computed with unbounded integers.

use profiles::board::{RawEncoder, SsiFrame};
use profiles::profile::Chain;
use std::fmt::Debug;
use std::num::{NonZeroU16, NonZeroU32};
use std::str::FromStr;

use profiles::encoder::{
    CODE_SEQUENCE, ChannelParameters, Coding, Command, DIRECTION, Encoder, Format, Parameters, Parity,
    SCALING, SensorType,
};

const POSITION: &str = include_str!("../../golden/cia406_position.csv");
const SPEED: &str = include_str!("../../golden/cia406_speed.csv");

fn number<T: FromStr<Err: Debug>>(text: &str) -> T {
    text.parse().unwrap()
}

fn kind(code: &str) -> SensorType {
    SensorType::from_code(number(code)).unwrap()
}

fn with_sensor(kind: SensorType, resolution: &str, counted: &str) -> Parameters {
    let channel = ChannelParameters {
        kind: Some(kind),
        resolution: number::<NonZeroU32>(resolution),
        counted: number::<NonZeroU16>(counted),
        fastest: 0,
        ..ChannelParameters::default()
    };
    Parameters { channels: [channel, ChannelParameters::default()], index: false, ..Parameters::default() }
}

fn format(cells: &[&str]) -> Format {
    let &[revolution_bits, step_bits, gray, alarm, parity] = cells else { panic!() };
    let coding = if gray == "1" { Coding::Gray } else { Coding::Binary };
    let parity = [Parity::None, Parity::Even, Parity::Odd][number::<usize>(parity)];
    Format::new(number(revolution_bits), number(step_bits), coding, alarm == "1", parity).unwrap()
}

/// The parameters of a row of positions.
fn parameters(cells: &[&str]) -> Parameters {
    let &[code, resolution, counted, .., scaling, reversed, per_revolution, range, step] = &cells[..13]
    else {
        panic!()
    };
    let direction = if kind(code).is_linear() { DIRECTION } else { CODE_SEQUENCE };
    // The golden positions without scaling are in the steps of the sensor.
    let is_native = kind(code).is_linear() && scaling == "0";
    Parameters {
        operating: (number::<u16>(scaling) * SCALING) | (number::<u16>(reversed) * direction),
        per_revolution: number(per_revolution),
        range: number(range),
        step: number(if is_native { resolution } else { step }),
        format: format(&cells[3..8]),
        ..with_sensor(kind(code), resolution, counted)
    }
}

fn raw(kind: SensorType, format: Format, bits: &str) -> RawEncoder {
    let bits = u64::from_str_radix(bits, 16).unwrap();
    if kind.is_absolute() {
        let frame = SsiFrame { bits, clocks: format.length() + 3 };
        return RawEncoder { ssi: Some(frame), ..RawEncoder::default() };
    }
    RawEncoder { counter: u16::try_from(bits).unwrap(), ..RawEncoder::default() }
}

#[test]
fn positions() {
    for line in POSITION.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let mut parameters = parameters(&cells);
        assert!(parameters.is_consistent(), "{line}");
        let mut encoder = Encoder::default();
        encoder.apply(&parameters);
        let mut offset = 0;
        for (i, (bits, position)) in cells[16].split(' ').zip(cells[17].split(' ')).enumerate() {
            if i == number::<usize>(cells[14]) {
                parameters.channels[0].preset = Command { value: number(cells[13]), count: 1 };
                encoder.apply(&parameters);
                offset = number(cells[15]);
            }
            let sample = encoder.sample(&raw(kind(cells[0]), parameters.format, bits)).channels[0];
            assert_eq!((sample.position, sample.offset), (number(position), offset), "sample {i} of {line}");
        }
    }
}

/// After a second the speed is right to 1 % or to one unit.
#[test]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn speeds() {
    for line in SPEED.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let mut parameters = with_sensor(kind(cells[0]), cells[1], "100");
        parameters.speed_step = number(cells[3]);
        if !kind(cells[0]).is_linear() {
            parameters.operating = SCALING;
            (parameters.per_revolution, parameters.range) = (number(cells[2]), number(cells[2]));
        }
        let mut encoder = Encoder::default();
        encoder.apply(&parameters);
        let (per_second, expected): (f64, i16) = (number(cells[4]), number(cells[5]));
        for millis in 0..4000 {
            let counter = (per_second * f64::from(millis) / 1000.0).floor() as i64 as u16;
            let speed = encoder.sample(&RawEncoder { counter, ..RawEncoder::default() }).channels[0].speed;
            if millis < 3000 {
                continue;
            }
            let deviation = f64::from(speed) - f64::from(expected);
            let allowed = (f64::from(expected).abs() * 0.01).max(1.0);
            assert!(deviation.abs() <= allowed, "{speed} after {millis} ms: {line}");
        }
    }
}
