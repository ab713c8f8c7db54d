//! Position and speed of a moving rotary or linear encoder.

use profiles::encoder::{
    CODE_SEQUENCE, Cam, Cams, DIRECTION, LongSpeed, SCALING, SENSOR_INDEX, SENSOR_POSITION_ERROR,
    SENSOR_UNREFERENCED, SensorType, WARNING_SPEED,
};

use crate::bench::{Bench, one, two};

/// 6000 rpm with 4096 steps per turn: steps after `millis` milliseconds.
fn at_6000_rpm(millis: i64) -> i64 {
    (4096 * millis).div_euclid(10)
}

/// In hundredths of a degree over ten revolutions, the position wraps ten times a second, in both directions.
#[test]
fn a_shaft_at_6000_rpm_crosses_the_wrap_both_ways() {
    for kind in [SensorType::IncrementalCounted, SensorType::MultiTurn] {
        for (direction, code_sequence) in [(1, 0), (-1, 0), (1, CODE_SEQUENCE), (-1, CODE_SEQUENCE)] {
            let mut parameters = one(kind);
            parameters.operating = SCALING | code_sequence;
            (parameters.per_revolution, parameters.range) = (3600, 36_000);
            parameters.format = profiles::encoder::Format::new(
                12,
                12,
                profiles::encoder::Coding::Gray,
                false,
                profiles::encoder::Parity::None,
            )
            .unwrap();
            let mut bench = Bench::new(parameters);
            let sign = if code_sequence == 0 { direction } else { -direction };
            for millis in 0..1000 {
                let total = at_6000_rpm(millis * direction);
                let values = bench.go(total).channels[0];
                let counted = if code_sequence == 0 { total } else { -1 - total };
                let expected = (counted * 3600).div_euclid(4096).rem_euclid(36_000);
                assert_eq!(i64::from(values.position), expected, "after {millis} ms");
                if millis > 2 {
                    // 100 revolutions a second are beyond INTEGER16 in these units.
                    assert_eq!(values.speed, if sign > 0 { i16::MAX } else { i16::MIN });
                }
            }
        }
    }
}

#[test]
fn the_speed_has_no_jump_where_the_position_wraps() {
    let mut parameters = one(SensorType::IncrementalCounted);
    parameters.operating = SCALING;
    (parameters.per_revolution, parameters.range) = (100, 100);
    for (direction, low, high) in [(1, 9900, 10_100), (-1, -10_100, -9900)] {
        let mut bench = Bench::new(parameters);
        for millis in 0..2000 {
            let speed = bench.go(at_6000_rpm(millis * direction)).channels[0].speed;
            assert!(millis < 3 || (low..=high).contains(&speed), "{speed} after {millis} ms");
        }
    }
}

/// A linear encoder with steps of 1 um at 0.3 m/s, with measuring steps of 10 um and mm/s.
#[test]
fn a_rod_has_its_own_measuring_steps() {
    let mut parameters = one(SensorType::LinearIncremental);
    parameters.operating = SCALING | DIRECTION;
    parameters.channels[0].resolution = 1000.try_into().unwrap();
    (parameters.step, parameters.speed_step, parameters.range) = (10_000, 100, 1_000_000);
    parameters.index = false;
    let mut bench = Bench::new(parameters);
    let values = (0..=1000).map(|millis| bench.go(-300 * millis).channels[0]).last().unwrap();
    assert_eq!((values.position, values.speed), (29_999, 300));
}

#[test]
fn channels_are_scaled_alike_and_have_cams_of_their_own() {
    let mut parameters = two(SensorType::IncrementalCounted, SensorType::MultiTurn);
    parameters.operating = SCALING;
    (parameters.per_revolution, parameters.range) = (360, 3600);
    let cams = |low, high| Cams { cams: [Cam { low, high, hysteresis: 0 }; 8], enable: 0x81, polarity: 0 };
    parameters.channels[0].cams = cams(90, 180);
    parameters.channels[1].cams = cams(45, 50);
    let mut bench = Bench::new(parameters);
    bench.stay();
    let [first, second] = bench.go(1024).channels;
    assert_eq!((first.position, first.cams, second.position, second.cams), (90, 0x81, 45, 0x81));
    let [first, second] = bench.go(1280).channels;
    assert_eq!((first.position, first.cams, second.position, second.cams), (112, 0x81, 56, 0));
}

#[test]
fn the_first_index_is_the_zero_of_the_turn() {
    let mut bench = Bench::started(one(SensorType::Incremental), profiles::encoder::Start::First, 3000);
    assert_eq!(bench.first().sensor_state, SENSOR_UNREFERENCED);
    assert_eq!(bench.first().position, 0, "nobody knows yet");
    let values = bench.go(4196).channels[0];
    assert_eq!((values.position, values.sensor_state), (100, 0));
    // Backwards over the index again: no correction.
    let values = bench.go(4000).channels[0];
    assert_eq!((values.position, values.sensor_state), (4000, 0));
}

#[test]
fn lost_steps_are_noticed_at_the_index_and_put_right_at_the_next() {
    for lost in [3, -3, 1000, -1000] {
        let mut bench = Bench::new(one(SensorType::IncrementalCounted));
        bench.stay();
        bench.go(4000);
        bench.go(5000);
        assert_eq!(bench.first().sensor_state, 0, "referenced");
        bench.lost += lost;
        bench.stay();
        bench.go(8000);
        for _ in 0..100 {
            let snapshot = bench.go(9000);
            assert_eq!(snapshot.channels[0].sensor_state, SENSOR_INDEX | SENSOR_POSITION_ERROR, "{lost}");
            assert_eq!((i64::from(snapshot.channels[0].position), snapshot.alarms), (9000 - lost, 1));
            assert!(snapshot.conditions.position);
        }
        let snapshot = bench.go(13_000);
        assert_eq!(snapshot.channels[0].position, 13_000, "a second index says the same");
        assert_eq!((snapshot.channels[0].sensor_state, snapshot.alarms), (0, 1), "nobody acknowledged");
    }
}

#[test]
fn a_step_beside_the_index_is_no_lost_step() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(4000);
    bench.go(5000);
    for late in [-2_i64, 2] {
        bench.raw.index = Some(u16::try_from(8192 + late).unwrap());
        bench.total = 9000;
        assert_eq!(bench.stay().channels[0].sensor_state, 0);
        assert_eq!(bench.first().position, 9000, "and no reason to move the position");
    }
}

#[test]
fn the_zero_of_a_rod_is_at_its_reference_mark() {
    let mut bench = Bench::started(one(SensorType::LinearIncremental), profiles::encoder::Start::First, 100);
    bench.stay();
    bench.total = 150;
    bench.raw.index = Some(20);
    assert_eq!(bench.stay().channels[0].position, 30);
    bench.total = 250;
    assert_eq!(bench.first().position, 130);
}

/// The index comes once and then no more. Whichever way the turn and a quarter is made, the loss is noticed.
#[test]
fn an_index_that_is_lost_is_noticed_every_time() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    for round in 0..3 {
        bench.go(4000);
        assert_eq!(bench.go(5000).channels[0].sensor_state, 0, "round {round}");
        let without_index = |bench: &mut Bench, by: i64| {
            bench.total += by;
            bench.stay()
        };
        (0..5).for_each(|_| assert_eq!(without_index(&mut bench, 800).channels[0].sensor_state, 0));
        let snapshot = (0..10).map(|_| without_index(&mut bench, 800)).last().unwrap();
        assert_eq!(snapshot.channels[0].sensor_state, SENSOR_INDEX | SENSOR_POSITION_ERROR);
        assert!(snapshot.alarms == 1 && snapshot.conditions.position);
        (0..15).for_each(|_| _ = without_index(&mut bench, -800));
    }
}

/// 4096 steps a revolution at 6000 rpm: 409,600 steps a second, which INTEGER16 cannot hold.
#[test]
fn a_long_speed_value_has_unit_and_average_and_the_short_one_a_limit_bit() {
    for (is_in_own_unit, millis, fastest, after) in
        [(false, 1, 409_600, 409_600), (true, 1, 600_000, 600_000), (true, 100, 600_000, 379_000)]
    {
        let mut parameters = one(SensorType::IncrementalCounted);
        parameters.long_speed = LongSpeed { is_in_own_unit, millis: millis.try_into().unwrap() };
        let mut bench = Bench::new(parameters);
        let at = |millis: i64| millis * 4096 / 10;
        let early = (1..=100).map(|millis| bench.go(at(millis))).last().unwrap();
        let near = |value: i32, expected: i32| (value - expected).abs() < expected / 50;
        assert!(near(early.channels[0].long_speed, after), "{}", early.channels[0].long_speed);
        let settled = (101..=1200).map(|millis| bench.go(at(millis))).last().unwrap();
        assert!(near(settled.channels[0].long_speed, fastest), "{}", settled.channels[0].long_speed);
        assert_eq!((settled.channels[0].speed, settled.warnings & WARNING_SPEED), (i16::MAX, WARNING_SPEED));
        (0..1100).for_each(|_| _ = bench.stay());
        let rest = bench.stay();
        assert_eq!((rest.channels[0].speed, rest.warnings & WARNING_SPEED), (0, 0));
    }
}

/// A cam from 1050 to 2050, at 100 steps a millisecond and a delay of 5 ms: it switches 500 steps earlier, both ways
/// and across zero.
#[test]
fn cams_compensate_their_delay() {
    for (low, high, start, step, on) in [
        (1050, 2050, 0, 100, 550..=1550),
        (1050, 2050, 3000, -100, 1550..=2550),
        (150, 350, -3000, 100, -350..=-150),
    ] {
        let mut parameters = one(SensorType::IncrementalCounted);
        let cam = Cam { low, high, hysteresis: 0 };
        let own = &mut parameters.channels[0];
        own.cams = Cams { cams: [cam; 8], enable: 1, polarity: 0 };
        own.cam_delay = 50;
        parameters.index = false;
        let mut bench = Bench::new(parameters);
        bench.stay();
        bench.go(start - 20 * step);
        for millis in -19..30 {
            let at = start + millis * step;
            let cams = bench.go(at).channels[0].cams;
            // The speed is known after a few changes.
            assert!(millis < 0 || cams == u8::from(on.contains(&at)), "{low}: {cams} at {at}");
        }
        bench.rest();
    }
}
