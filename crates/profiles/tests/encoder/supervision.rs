//! Disturbed readings, alarms, warnings, and what is reported as an emergency.

use profiles::board::{Board, SsiFrame};
use profiles::encoder::{
    ALARM_POSITION, Coding, Conditions, Format, Parity, SENSOR_IMPLAUSIBLE, SENSOR_NO_SIGNAL, SENSOR_PARITY,
    SENSOR_POSITION_ERROR, SUPPORTED_WARNINGS, SensorType, Snapshot, WARNING_BATTERY, WARNING_FREQUENCY,
    WARNING_OPERATING_TIME, WARNING_REFERENCE, WARNING_WATCHDOG,
};

use crate::bench::{Bench, frame, one, two};

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

/// After an outage the sensor may be further away: as far as it can have moved.
#[test]
fn a_sensor_comes_back_from_where_it_can_have_moved() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.stay();
    (0..50).for_each(|_| _ = bench.receive(None));
    assert_eq!(bench.go(510_001).channels[0].position, 0, "51 ms at 10 000 steps");
    assert_eq!(bench.go(510_001).channels[0].position, 510_001, "52 ms");
}

#[test]
fn conditions_must_last_to_count_and_to_go() {
    // At the limits is within them.
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
        bench.raw.board = bad;
        (0..9).for_each(|_| assert_eq!(seen(bench.stay()), (Conditions::default(), 0)));
        assert_eq!(seen(bench.stay()), (conditions, warnings));
        bench.raw.board = fine;
        (0..9).for_each(|_| assert_eq!(seen(bench.stay()), (conditions, warnings)));
        assert_eq!(seen(bench.stay()), (Conditions::default(), 0));
    }
}

#[test]
fn warnings_go_when_all_is_well_again() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    assert_eq!(bench.stay().warnings, WARNING_REFERENCE);
    bench.go(4000);
    assert_eq!(bench.go(5000).warnings, 0);
    assert_eq!(bench.go(15_001).warnings, WARNING_FREQUENCY);
    assert_eq!(bench.stay().warnings, 0);
    bench.raw.board.watchdog_reset = true;
    assert_eq!(bench.stay().warnings, WARNING_WATCHDOG);
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
    let start = profiles::encoder::Start::Kept(bench.encoder.kept());
    assert_eq!(Bench::started(bench.parameters, start, 0).stay().warnings, WARNING_OPERATING_TIME);
}

#[test]
fn a_memory_error_of_the_board_is_reported() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.raw.board.memory_error = true;
    assert!(bench.stay().conditions.memory);
}
