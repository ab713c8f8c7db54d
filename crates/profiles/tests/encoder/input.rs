//! From readings to steps: the zero of the sensor, its highest speed, and its range.

use profiles::board::SsiFrame;
use profiles::profile::Chain;
use std::num::NonZeroU16;

use profiles::encoder::{
    Module, OUT_OF_RANGE, Parameters, SENSOR_IMPLAUSIBLE, SENSOR_POSITION_ERROR, SENSOR_TOO_FAST, SensorType,
    Start,
};

use crate::bench::{Bench, frame, one};

const COUNTED: [SensorType; 2] = [SensorType::IncrementalCounted, SensorType::LinearIncrementalCounted];
const ABSOLUTE: [SensorType; 2] = [SensorType::MultiTurn, SensorType::LinearAbsolute];

/// The zero of the sensor lies 1000 steps below that of the encoder. The valid range begins at the sensor's zero and is
/// 100 steps long.
fn limited(kind: SensorType) -> Parameters {
    let mut parameters = Parameters { module: Module { offset: 1000, low: 1000, high: 1100 }, ..one(kind) };
    parameters.index = false;
    parameters
}

#[test]
fn every_sensor_begins_at_the_offset_of_the_module() {
    for kind in COUNTED.into_iter().chain(ABSOLUTE) {
        let mut bench = Bench::new(limited(kind));
        assert_eq!(bench.first().position, 1000, "{kind:?}");
        assert_eq!(bench.step(7).channels[0].position, 1007);
        bench.change(|parameters| parameters.module.offset = 1500);
        assert_eq!(bench.first().position, 1507, "moved by 500");
        bench.change(|parameters| parameters.module.offset = 1400);
        assert_eq!(bench.first().position, 1407, "and back by 100");
    }
}

#[test]
fn a_timer_may_begin_anywhere() {
    for kind in COUNTED {
        let mut bench = Bench::new(limited(kind));
        bench.lost = -12_345;
        assert_eq!(bench.first().position, 1000);
        assert_eq!(bench.step(-1).channels[0].position, 999);
    }
}

#[test]
fn the_index_is_the_zero_of_the_sensor() {
    for kind in [SensorType::Incremental, SensorType::LinearIncremental] {
        let mut bench = Bench::new(Parameters { index: true, ..limited(kind) });
        // The index is 100 steps from the position at power-on.
        bench.total = -100;
        bench.lost = -100;
        bench.stay();
        assert_eq!(bench.go(5).channels[0].position, 1005, "{kind:?}");
        assert_eq!(bench.go(1000).channels[0].position, 2000);
    }
}

#[test]
fn the_limits_of_the_module_are_in_steps_of_the_sensor() {
    for kind in COUNTED.into_iter().chain(ABSOLUTE) {
        let mut bench = Bench::new(limited(kind));
        bench.stay();
        for (total, state) in [(1, 0), (99, 0), (100, OUT_OF_RANGE), (50, 0), (0, OUT_OF_RANGE)] {
            assert_eq!(bench.go(total).channels[0].area & OUT_OF_RANGE, state, "{kind:?} at {total}");
        }
    }
}

#[test]
fn beyond_its_word_a_counted_position_continues_and_an_absolute_one_follows_the_sensor() {
    let around_zero = |kind| {
        let module = Module { offset: 0, low: -100, high: 100 };
        Bench::new(Parameters { module, index: false, ..one(kind) })
    };
    for kind in COUNTED {
        let mut bench = around_zero(kind);
        let states = [0, 30_000, 60_000, 65_536].map(|total| bench.go(total).channels[0].area);
        assert_eq!(states.map(|state| state & OUT_OF_RANGE), [0, OUT_OF_RANGE, OUT_OF_RANGE, OUT_OF_RANGE]);
    }
    for kind in ABSOLUTE {
        let mut bench = around_zero(kind);
        let states = [0, 1, -1].map(|total| bench.go(total).channels[0].area & OUT_OF_RANGE);
        assert_eq!(states, [0, 0, OUT_OF_RANGE], "-1 is the last step of the code");
    }
}

#[test]
fn of_a_single_turn_encoder_the_bits_of_a_turn_count() {
    let mut parameters = one(SensorType::SingleTurn);
    parameters.module = Module { offset: 0, low: 0, high: 8191 };
    let mut bench = Bench::new(parameters);
    let values = bench.receive(Some(frame(parameters.format, 5 * 8192 + 100))).channels[0];
    assert_eq!((values.position, values.area), (100, 0), "whatever is before them in the frame");
}

#[test]
fn as_fast_as_the_sensor_is_not_too_fast() {
    for (kind, state) in
        [(SensorType::MultiTurn, SENSOR_IMPLAUSIBLE), (SensorType::LinearIncrementalCounted, SENSOR_TOO_FAST)]
    {
        let mut parameters = Parameters { index: false, ..one(kind) };
        parameters.channels[0].fastest = 500;
        let mut bench = Bench::new(parameters);
        bench.stay();
        assert_eq!(bench.step(500).channels[0].sensor_state, 0);
        assert_eq!(bench.step(-501).channels[0].sensor_state & !SENSOR_POSITION_ERROR, state);
        bench.change(|parameters| parameters.channels[0].fastest = 0);
        bench.preset(0, 1);
        bench.stay();
        assert_eq!(bench.step(20_000).channels[0].sensor_state, 0, "0 is no limit");
    }
}

#[test]
fn an_offset_is_known_before_the_first_reading() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.go(5000);
    bench.preset(0, 100);
    assert_eq!(bench.first().offset, -4900);
    let retained = bench.encoder.retained_state();
    let mut words = [0; profiles::board::RETAINED_WORDS];
    assert!(bench.encoder.retain(&mut words));
    assert_eq!(words, retained.to_words());
    bench.parameters.channels[0].offset = -4900;
    let mut bench = Bench::started(bench.parameters, Start::Retained(retained), 5000);
    assert_eq!(bench.receive(None).channels[0].offset, -4900);
    assert_eq!(bench.first().position, 100);
}

#[test]
fn a_frame_that_is_not_followed_by_a_low_level_is_none() {
    let format = Parameters::default().format;
    let SsiFrame { bits, clocks } = frame(format, 77);
    let without = SsiFrame { bits: bits >> 2, clocks: clocks - 2 };
    assert!(format.read(SsiFrame { bits, clocks }).is_ok());
    assert!(format.read(without).is_err());
}

#[test]
fn the_count_of_turns_goes_round() {
    let mut parameters = one(SensorType::IncrementalCounted);
    parameters.channels[0].counted = NonZeroU16::new(2).unwrap();
    let mut bench = Bench::new(parameters);
    bench.stay();
    assert_eq!(bench.step(8191).channels[0].position, 8191);
    assert_eq!(bench.step(1).channels[0].position, 0);
}
