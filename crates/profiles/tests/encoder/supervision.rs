//! Disturbed readings, alarms, warnings, and faults that are reported as emergencies.

use profiles::board::{Board, Retained, SsiFrame};
use profiles::encoder::{
    ALARM_COMMISSIONING, ALARM_POSITION, Coding, Command, Conditions, Format, Parity, SENSOR_IMPLAUSIBLE,
    SENSOR_NO_SIGNAL, SENSOR_PARITY, SENSOR_POSITION_ERROR, SENSOR_TOO_FAST, SUPPORTED_WARNINGS, SensorType,
    Snapshot, Start, WARNING_BATTERY, WARNING_FREQUENCY, WARNING_OPERATING_TIME, WARNING_REFERENCE,
    WARNING_SPEED, WARNING_WATCHDOG,
};

use crate::bench::{Bench, delivered, frame, one, two};

#[test]
fn two_bad_frames_are_tolerated_and_the_third_is_a_position_error() {
    for (bad, state) in [
        (None, SENSOR_NO_SIGNAL),
        (Some(SsiFrame { bits: u64::MAX, clocks: 28 }), SENSOR_NO_SIGNAL),
        (Some(SsiFrame { bits: 0, clocks: 28 }), SENSOR_NO_SIGNAL),
        (Some(frame(Format::COMMON, 500_000)), SENSOR_IMPLAUSIBLE),
    ] {
        let mut bench = Bench::new(one(SensorType::MultiTurn));
        bench.go(1234);
        for _ in 0..2 {
            let snapshot = bench.receive(bad);
            assert_eq!((snapshot.channels[0].sensor_state, snapshot.alarms), (state, 0));
            assert_eq!(snapshot.channels[0].position, 1234, "held");
        }
        let snapshot = bench.receive(bad);
        assert_eq!(snapshot.channels[0].sensor_state, state | SENSOR_POSITION_ERROR);
        assert_eq!(snapshot.alarms, ALARM_POSITION);
        assert_eq!(snapshot.conditions.sensor_break, state == SENSOR_NO_SIGNAL);
        assert_eq!(snapshot.conditions.position, state == SENSOR_IMPLAUSIBLE);
        assert_eq!(bench.go(1300).channels[0].position, 1300, "back");
    }
}

#[test]
fn two_sensors_with_the_same_fault_do_not_cancel_out() {
    let mut bench = Bench::new(two(SensorType::MultiTurn, SensorType::SingleTurn));
    bench.stay();
    (0..2).for_each(|_| assert_eq!(bench.receive(None).alarms, 0));
    assert_eq!(bench.receive(None).alarms, ALARM_POSITION);
}

#[test]
fn a_wrong_parity_is_no_position() {
    let mut parameters = one(SensorType::SingleTurn);
    parameters.format = Format::new(0, 8, Coding::Binary, false, Parity::Even).unwrap();
    let mut bench = Bench::new(parameters);
    let frame = |word: u64| Some(SsiFrame { bits: (1 << 9 | word) << 1, clocks: 11 });
    assert_eq!(bench.receive(frame(3 << 1)).channels[0].position, 3);
    let values = bench.receive(frame(7 << 1)).channels[0];
    assert_eq!((values.position, values.sensor_state), (3, SENSOR_PARITY));
}

#[test]
fn the_encoder_s_own_alarm_is_one() {
    let mut parameters = one(SensorType::SingleTurn);
    parameters.format = Format::new(0, 8, Coding::Binary, true, Parity::None).unwrap();
    let mut bench = Bench::new(parameters);
    let frame = |word: u64| Some(SsiFrame { bits: (1 << 9 | word) << 1, clocks: 11 });
    assert_eq!(bench.receive(frame(3 << 1)).alarms, 0);
    assert_eq!(bench.receive(frame(3 << 1 | 1)).alarms, ALARM_POSITION);
}

/// After an outage the sensor may be as far away as it can have moved, but not a step further.
#[test]
fn readings_within_the_possible_movement_are_accepted_again() {
    for (moved, is_believed) in [(510_000, true), (510_001, false)] {
        let mut bench = Bench::new(one(SensorType::MultiTurn));
        bench.stay();
        (0..50).for_each(|_| _ = bench.receive(None));
        let position = if is_believed { 510_000 } else { 0 };
        for _ in 0..1000 {
            assert_eq!(bench.go(moved).channels[0].position, position, "51 ms at 10 000 steps");
        }
    }
}

/// Implausible readings are rejected however long they last; a preset accepts them.
#[test]
fn a_jump_is_rejected_until_the_code_returns_or_a_preset() {
    for step in [0, 3, -700] {
        let mut bench = Bench::new(delivered(SensorType::MultiTurn));
        let mut total = 100_000;
        (0..50).for_each(|_| {
            total += step;
            bench.go(total);
        });
        let held = bench.first().position;
        for n in 1..=5000 {
            total += step;
            let snapshot = bench.go(total + 4096);
            assert_eq!(snapshot.channels[0].position, held, "{n} ms at {step}");
            let error = if n > 2 { SENSOR_POSITION_ERROR } else { 0 };
            assert_eq!(snapshot.channels[0].sensor_state, SENSOR_IMPLAUSIBLE | error);
            assert_eq!((snapshot.alarms, snapshot.conditions.position), (u16::from(n > 2), n > 2));
        }
        total += step;
        let back = bench.go(total).channels[0];
        let there = (total.rem_euclid(1 << 25), 0);
        assert_eq!((i64::from(back.position), back.sensor_state), there, "it jumps back");
        bench.go(total + 4096);
        bench.preset(0, 77);
        let there = bench.go(total + 4096).channels[0];
        assert_eq!((there.position, there.sensor_state), (77, 0), "a preset says where it is");
    }
}

/// With the parameters as delivered, half a turn in a millisecond is implausible for any sensor.
#[test]
fn the_fastest_movement_follows_from_the_resolution() {
    for (steps, fastest) in [(13, 1690), (10, 211), (17, 27_034), (2, 1)] {
        let mut parameters = delivered(SensorType::MultiTurn);
        parameters.format = Format::new(8, steps, Coding::Gray, false, Parity::None).unwrap();
        let sensor = parameters.sensors().next().unwrap();
        assert_eq!(sensor.fastest, fastest, "12,000 rpm of {steps} bits and 3 %");
        let mut bench = Bench::new(parameters);
        bench.stay();
        assert_eq!(bench.go(1 << (steps - 1)).channels[0].sensor_state, SENSOR_IMPLAUSIBLE);
    }
    let rod = delivered(SensorType::LinearAbsolute).sensors().next().unwrap();
    assert_eq!(rod.fastest, 4883 + 4883 / 32, "20 m/s and 3 %");
}

/// Movement too fast for the sensor is an error until the index confirms the count.
#[test]
fn a_count_that_was_too_fast_is_in_doubt_until_the_index_confirms_it() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(4000);
    bench.go(5000);
    bench.change(|parameters| parameters.channels[0].fastest = 1000);
    let snapshot = bench.go(6001);
    assert_eq!(snapshot.channels[0].sensor_state, SENSOR_TOO_FAST | SENSOR_POSITION_ERROR);
    assert!(snapshot.alarms == ALARM_POSITION && snapshot.conditions.position);
    (0..1000).for_each(|_| assert_eq!(bench.first().sensor_state, SENSOR_POSITION_ERROR));
    (0..2).for_each(|_| assert_eq!(bench.step(1000).channels[0].sensor_state, SENSOR_POSITION_ERROR));
    assert_eq!(bench.step(1000).channels[0].sensor_state, 0, "the index is where it should be");
    (0..98).for_each(|_| assert!(bench.stay().conditions.position, "told for a tenth of a second"));
    assert!(!bench.stay().conditions.position);
}

#[test]
fn conditions_must_last_to_count_and_to_go() {
    // A value at its limit is within the limits.
    let fine = Board { supply: Some(4500), current: Some(200), battery: Some(2400), ..Board::default() };
    let cases: [(Board, Conditions, u16); 5] = [
        (Board { supply: Some(4499), ..fine }, Conditions { voltage: true, ..Conditions::default() }, 0),
        (Board { supply: Some(5501), ..fine }, Conditions { voltage: true, ..Conditions::default() }, 0),
        (Board { current: Some(201), ..fine }, Conditions { current: true, ..Conditions::default() }, 0),
        (Board { battery: Some(2399), ..fine }, Conditions::default(), WARNING_BATTERY),
        (Board::default(), Conditions::default(), 0),
    ];
    for (bad, conditions, warnings) in cases {
        let mut bench = Bench::new(one(SensorType::MultiTurn));
        let seen = |snapshot: Snapshot| (snapshot.conditions, snapshot.warnings);
        assert_eq!(
            bench.stay().supported_warnings & WARNING_BATTERY,
            0,
            "support is claimed for what is measured"
        );
        bench.raw.board = bad;
        let has_battery = bad.battery.is_some();
        (0..9).for_each(|_| assert_eq!(seen(bench.stay()), (Conditions::default(), 0)));
        assert_eq!(seen(bench.stay()), (conditions, warnings));
        bench.raw.board = fine;
        (0..9).for_each(|_| assert_eq!(seen(bench.stay()), (conditions, warnings)));
        assert_eq!(seen(bench.stay()), (Conditions::default(), 0));
        bench.raw.board = bad;
        assert_eq!(bench.stay().supported_warnings & WARNING_BATTERY != 0, has_battery);
    }
}

/// The jumps of the bench are faster than 6030h can show.
#[test]
fn warnings_go_when_all_is_well_again() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    assert_eq!(bench.stay().warnings & !WARNING_SPEED, WARNING_REFERENCE);
    bench.go(4000);
    assert_eq!(bench.go(5000).warnings & !WARNING_SPEED, 0);
    assert_eq!(bench.go(15_001).warnings & !WARNING_SPEED, WARNING_FREQUENCY);
    assert_eq!(bench.stay().warnings & !WARNING_SPEED, 0);
    bench.raw.board.watchdog_reset = true;
    assert_eq!(bench.stay().warnings & !WARNING_SPEED, WARNING_WATCHDOG);
    assert_eq!(SUPPORTED_WARNINGS & 2, 0, "there is no light to measure");
}

#[test]
fn the_operating_time_warns_once_in_a_life_with_power() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.change(|parameters| parameters.limits.operating_time = 1);
    (0..359_999).for_each(|_| assert_eq!(bench.stay().warnings, 0));
    assert_eq!(bench.stay().warnings, WARNING_OPERATING_TIME);
    bench.change(|parameters| parameters.limits.operating_time = 2);
    assert_eq!(bench.stay().warnings, 0);
    bench.change(|parameters| parameters.limits.operating_time = 1);
    assert_eq!(bench.stay().warnings, 0, "only after power-on again");
    let start = profiles::encoder::Start::Retained(bench.encoder.retained_state());
    assert_eq!(Bench::started(bench.parameters, start, 0).stay().warnings, WARNING_OPERATING_TIME);
}

#[test]
fn a_memory_error_of_the_board_is_reported() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.raw.board.memory_error = true;
    assert!(bench.stay().conditions.memory);
}

/// The stated maximum, 12,000 rpm, is 1638.4 steps of 13 bits in a millisecond.
#[test]
fn the_stated_maximum_speed_is_read_at_its_value_at_a_start_and_both_ways() {
    for (sign, kind) in [1, -1].into_iter().flat_map(|sign| {
        [SensorType::MultiTurn, SensorType::SingleTurnCounted, SensorType::LinearAbsolute]
            .map(|kind| (sign, kind))
    }) {
        let per_second = if kind.is_linear() { 20_000_000_000 / 4096 } else { 200 * 8192 };
        let mut bench = Bench::new(delivered(kind));
        // The second reading comes 2 % late.
        let at = |micros: i64| sign * per_second * micros / 1_000_000;
        bench.go(at(0));
        for n in 1..500 {
            let values = bench.go(at(1000 * n + 20)).channels[0];
            assert_eq!(values.sensor_state, 0, "{kind:?} ms {n}");
        }
    }
}

/// A rejected reading of a sensor whose code is enough is believed on request, and by a reset.
#[test]
fn a_sensor_that_is_well_again_is_believed_on_request() {
    let jumped = || {
        let mut bench = Bench::new(delivered(SensorType::MultiTurn));
        bench.go(100_000);
        (0..200).for_each(|_| _ = bench.go(100_000 + 600_000));
        assert_eq!(bench.first().position, 100_000);
        bench
    };
    let acknowledge = |bench: &mut Bench, value| {
        bench.change(|parameters| {
            parameters.acknowledge = Command { value, count: parameters.acknowledge.count + 1 };
        });
    };
    let mut bench = jumped();
    acknowledge(&mut bench, ALARM_COMMISSIONING.into());
    assert_eq!(bench.first().position, 100_000, "another alarm");
    acknowledge(&mut bench, ALARM_POSITION.into());
    let snapshot = bench.stay();
    assert_eq!((snapshot.channels[0].position, snapshot.channels[0].sensor_state), (700_000, 0));
    assert_eq!(snapshot.alarms, 0);
    let start = Start::Retained(jumped().encoder.retained_state());
    let snapshot = Bench::started(delivered(SensorType::MultiTurn), start, 700_000).stay();
    assert_eq!((snapshot.channels[0].position, snapshot.alarms), (700_000, 0));
    // Uncounted turns are lost, also with a trusted reading.
    let mut bench = Bench::new(delivered(SensorType::SingleTurnCounted));
    (0..50).for_each(|_| _ = bench.stay());
    (0..200).for_each(|_| _ = bench.go(4096));
    acknowledge(&mut bench, ALARM_POSITION.into());
    assert_eq!(bench.stay().alarms, ALARM_POSITION);
}

/// Two missed readings at 10,000 rpm are 0.5 turns of a single-turn sensor.
#[test]
fn missed_readings_lose_no_turn_while_the_way_is_certain() {
    for (missed, is_known) in [(1, true), (2, true), (10, true), (12, false), (4200, false)] {
        let mut bench = Bench::new(delivered(SensorType::SingleTurnCounted));
        let mut total = 0;
        for step in (0..1365_i64).step_by(40).chain([1365; 20]) {
            total += step;
            bench.go(total);
        }
        for fastest in [u32::MAX, 0] {
            bench.change(|parameters| parameters.channels[0].fastest = fastest);
            (0..missed).for_each(|_| _ = bench.receive(None));
            total += 1365 * (missed + 1);
            let values = bench.go(total).channels[0];
            let range = 4096 * 8192;
            let is_right = i64::from(values.position) == total.rem_euclid(range);
            assert!(is_right || !is_known, "{missed} at {fastest}: {values:?} and not {total}");
            assert_eq!(values.sensor_state & SENSOR_POSITION_ERROR != 0, !is_known, "{missed} at {fastest}");
        }
    }
}

/// One EMCY, although the first word comes a millisecond after the start.
#[test]
fn a_lost_position_is_one_fault_at_a_start() {
    let lost = Start::of(Retained::Nothing, Some([0; 2]));
    let mut bench = Bench::started(delivered(SensorType::SingleTurnCounted), lost, 0);
    let conditions = [bench.receive(None), bench.stay(), bench.stay()].map(|snapshot| snapshot.conditions);
    assert!(conditions.iter().all(|all| all.position && !all.sensor_break), "{conditions:?}");
}
