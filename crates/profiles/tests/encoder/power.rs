//! State retained through a loss of power.

use profiles::board::Retained;
use profiles::encoder::{
    ALARM_POSITION, CODE_SEQUENCE, Encoder, PositionRecord, RetainedState, SENSOR_POSITION_ERROR,
    SENSOR_UNREFERENCED, SensorType, Start,
};
use profiles::profile::Chain;

use crate::bench::{Bench, one, two};

/// Loses the power, moves the sensor to `total`, and restores the power.
fn after_power_loss(bench: &Bench, total: i64) -> Bench {
    let retained = RetainedState::from_words(&bench.encoder.retained_state().to_words());
    Bench::started(bench.parameters, Start::Retained(retained), total)
}

/// The same with an empty battery: only the parameter store has data for the start.
fn after_loss_of_memory(bench: &Bench, total: i64) -> Bench {
    let stored = PositionRecord::of(&bench.encoder.retained_state().to_words()).to_words();
    Bench::started(bench.parameters, Start::of(Retained::Nothing, Some(stored)), total)
}

/// Stores the offsets, as a preset does.
fn store_offsets(bench: &mut Bench) {
    let offsets = bench.stay().channels.map(|channel| channel.offset);
    bench.parameters.channels.iter_mut().zip(offsets).for_each(|(own, offset)| own.offset = offset);
}

#[test]
fn counted_positions_go_on_where_they_were() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    (1..=20).for_each(|turns| _ = bench.go(turns * 5000));
    bench.rest();
    let mut back = after_power_loss(&bench, 100_000);
    let values = back.first();
    assert_eq!((values.position, values.sensor_state), (100_000, 0), "and is still referenced");
    assert_eq!(back.step(7).channels[0].position, 100_007);
}

#[test]
fn a_count_without_electronic_multi_turn_restarts() {
    for (kind, position) in [(SensorType::Incremental, 0), (SensorType::SingleTurn, 100_000 % 8192)] {
        let mut bench = Bench::new(one(kind));
        (0..=20).for_each(|turns| _ = bench.go(turns * 5000));
        let values = after_power_loss(&bench, 100_000).first();
        assert_eq!(values.position, position, "{kind:?}");
        let unreferenced = if kind == SensorType::Incremental { SENSOR_UNREFERENCED } else { 0 };
        assert_eq!(values.sensor_state, unreferenced);
    }
}

/// Turned during a loss of power, by less than half of the sensor's range.
#[test]
fn an_absolute_sensor_follows_movements_without_power() {
    let mut bench = Bench::new(one(SensorType::SingleTurnCounted));
    (0..=20).for_each(|turns| _ = bench.go(turns * 3000));
    bench.rest();
    for moved in [4000, -4000, 1, 0] {
        assert_eq!(i64::from(after_power_loss(&bench, 60_000 + moved).first().position), 60_000 + moved);
    }
}

#[test]
fn an_incremental_sensor_detects_a_movement_without_power_at_the_index() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(5000);
    bench.rest();
    let mut back = after_power_loss(&bench, 5300);
    (0..10).for_each(|_| assert_eq!(back.first().position, 5000));
    let snapshot = back.go(8200);
    assert_eq!(
        (snapshot.channels[0].position, snapshot.alarms),
        (7900, ALARM_POSITION),
        "it is not believed"
    );
    let snapshot = back.go(12_300);
    assert_eq!(
        (snapshot.channels[0].position, snapshot.channels[0].sensor_state),
        (12_300, 0),
        "but two are"
    );
}

#[test]
fn the_offset_is_stored_with_the_parameters() {
    let mut bench = Bench::new(two(SensorType::IncrementalCounted, SensorType::MultiTurn));
    bench.stay();
    bench.go(1000);
    bench.preset(0, 10);
    bench.preset(1, 20);
    bench.stay();
    store_offsets(&mut bench);
    let positions = |bench: &mut Bench| bench.stay().channels.map(|channel| channel.position);
    assert_eq!(positions(&mut after_power_loss(&bench, 1000)), [10, 20]);
    // Parameters that were changed but not saved have their old values again, and the old offset fits them.
    let saved = bench.parameters;
    bench.change(|parameters| parameters.operating = CODE_SEQUENCE);
    bench.stay();
    bench.preset(0, 5);
    bench.stay();
    bench.parameters = saved;
    assert_eq!(positions(&mut after_power_loss(&bench, 1000)), [10, 20]);
}

/// An absolute position is unchanged. A position that needs retained memory is never shown as known before it is
/// referenced.
#[test]
fn without_a_battery_a_position_is_right_or_reported_as_lost() {
    let lost = SENSOR_UNREFERENCED | SENSOR_POSITION_ERROR;
    for (kind, state) in [
        (SensorType::MultiTurn, 0),
        (SensorType::SingleTurn, 0),
        (SensorType::LinearAbsolute, 0),
        (SensorType::SingleTurnCounted, lost),
        (SensorType::LinearCyclic, lost),
        (SensorType::IncrementalCounted, lost),
        (SensorType::LinearIncrementalCounted, lost),
    ] {
        let mut bench = Bench::new(one(kind));
        (0..=20).for_each(|turns| _ = bench.go(turns * 4300));
        bench.preset(0, 500);
        store_offsets(&mut bench);
        let mut back = after_loss_of_memory(&bench, 86_100);
        let snapshot = back.stay();
        let values = snapshot.channels[0];
        assert_eq!(values.sensor_state, state, "{kind:?}");
        assert!(values.position == 600 || state != 0, "{kind:?} at {}", values.position);
        assert_eq!((snapshot.alarms, snapshot.conditions.position), (u16::from(state != 0), state != 0));
        if state == 0 {
            continue;
        }
        // A reset does not make the position known.
        assert_eq!(after_power_loss(&back, 86_100).first().sensor_state & SENSOR_POSITION_ERROR, 1 << 7);
        back.preset(0, 600);
        let values = back.first();
        assert_eq!((values.position, values.sensor_state & SENSOR_POSITION_ERROR), (600, 0), "{kind:?}");
        back.rest();
        let again = after_power_loss(&back, 86_100).first();
        assert_eq!(again.sensor_state & SENSOR_POSITION_ERROR, 0, "and stays known with a battery");
    }
}

/// 360 units a turn and a range of 1000: 4096 turns are not a whole number of ranges, so the number of wraps matters.
#[test]
fn a_scaled_position_is_known_without_a_battery_until_the_code_has_come_round() {
    let mut parameters = one(SensorType::MultiTurn);
    parameters.operating = profiles::encoder::SCALING;
    (parameters.per_revolution, parameters.range) = (360, 1000);
    for (total, is_known) in [(8192 * 2000_i64, true), (8192 * 4095, false), (100, false)] {
        let mut bench = Bench::started(parameters, Start::First, total);
        bench.stay();
        bench.preset(0, 500);
        store_offsets(&mut bench);
        let values = after_loss_of_memory(&bench, total).first();
        assert_eq!(values.sensor_state & SENSOR_POSITION_ERROR == 0, is_known, "at {total}");
        assert!(!is_known || values.position == 500);
    }
}

/// With an index in every turn and a range of one turn, the index alone determines the position.
#[test]
fn an_index_is_reference_enough_where_every_turn_is_alike() {
    let mut parameters = one(SensorType::IncrementalCounted);
    parameters.channels[0].counted = 1.try_into().unwrap();
    let mut bench = Bench::new(parameters);
    bench.stay();
    let mut back = after_loss_of_memory(&bench, 3000);
    assert_eq!(back.first().sensor_state, SENSOR_UNREFERENCED | SENSOR_POSITION_ERROR);
    let values = back.go(4196).channels[0];
    assert_eq!((values.position, values.sensor_state), (100, 0));
}

#[test]
fn another_sensor_takes_back_nothing() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(5000);
    bench.parameters.channels[0].resolution = 1000.try_into().unwrap();
    assert_eq!(after_power_loss(&bench, 5000).first().position, 0);
}

#[test]
fn retained_data_is_unchanged_before_the_first_sample() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(5000);
    let retained = bench.encoder.retained_state();
    let mut encoder = Encoder::new(Start::Retained(retained));
    assert_eq!(encoder.retained_state(), retained, "before there are parameters");
    encoder.apply(&bench.parameters);
    assert_eq!(encoder.retained_state(), retained, "before there is a sample");
}

#[test]
fn damage_is_a_memory_error_and_an_alarm_where_a_position_is_lost() {
    for (kind, alarms) in [(SensorType::IncrementalCounted, ALARM_POSITION), (SensorType::SingleTurn, 0)] {
        let record = PositionRecord::from_words([0, 0]);
        let mut bench = Bench::started(one(kind), Start::Damaged(record), 0);
        let snapshot = bench.stay();
        assert_eq!((snapshot.alarms, snapshot.conditions.memory), (alarms, true));
    }
}

#[test]
fn operating_time_continues() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    (0..360_000).for_each(|_| _ = bench.stay());
    assert_eq!(bench.stay().operating_time, 1);
    let mut back = after_power_loss(&bench, 0);
    (0..359_998).for_each(|_| _ = back.stay());
    assert_eq!(back.stay().operating_time, 2, "the millisecond counts too");
}

/// The last sample saw the shaft turn, so the movement since then is unknown.
#[test]
fn a_shaft_that_turns_at_a_reset_has_lost_its_turns() {
    for (kind, is_known) in [
        (SensorType::MultiTurn, true),
        (SensorType::LinearAbsolute, true),
        (SensorType::SingleTurnCounted, false),
        (SensorType::IncrementalCounted, false),
        (SensorType::LinearIncrementalCounted, false),
        (SensorType::LinearCyclic, false),
    ] {
        let mut bench = Bench::new(one(kind));
        (0..=20).for_each(|turns| _ = bench.go(turns * 500));
        let mut back = after_power_loss(&bench, 10_000 + 3 * 8192);
        for _ in 0..3 {
            assert_eq!(back.first().sensor_state & SENSOR_POSITION_ERROR == 0, is_known, "{kind:?}");
            back.rest();
            back = after_power_loss(&back, 10_000 + 3 * 8192);
        }
        back.preset(0, 7);
        back.rest();
        assert_eq!(back.first().sensor_state & SENSOR_POSITION_ERROR, 0, "{kind:?} after a preset");
    }
}

#[test]
fn a_shaft_that_turns_right_after_a_start_has_turned_before() {
    for (millis, is_known) in [(0, false), (8, false), (11, true)] {
        let mut bench = Bench::new(one(SensorType::IncrementalCounted));
        bench.rest();
        let mut back = after_power_loss(&bench, 0);
        (0..=millis).for_each(|_| _ = back.stay());
        back.step(2);
        assert_eq!(back.first().sensor_state & SENSOR_POSITION_ERROR == 0, is_known, "{millis} ms");
    }
}

/// Data retained by a firmware before this layout has no position.
#[test]
fn words_of_an_older_layout_are_a_lost_position() {
    let mut words = RetainedState::default().to_words();
    words[..4].copy_from_slice(&[u32::from_le_bytes([5, 2, 0, 0]), 4096, 1000, 0]);
    let start = Start::Retained(RetainedState::from_words(&words));
    let values = Bench::started(one(SensorType::IncrementalCounted), start, 0).first();
    assert_ne!(values.sensor_state & SENSOR_POSITION_ERROR, 0);
}

/// The power fails again and again while the node starts.
#[test]
fn a_shaft_at_rest_keeps_its_position_through_starts_that_are_cut_short() {
    for kind in [SensorType::IncrementalCounted, SensorType::SingleTurnCounted] {
        let mut bench = Bench::new(one(kind));
        (0..=20).for_each(|turns| _ = bench.go(turns * 500));
        bench.rest();
        for millis in [1, 5, 50] {
            bench = after_power_loss(&bench, 10_000);
            (0..millis).for_each(|_| assert_eq!(bench.first().sensor_state & SENSOR_POSITION_ERROR, 0));
        }
        assert_eq!(bench.first().position, 10_000);
    }
}
