//! What outlives a loss of power.

use profiles::encoder::{
    ALARM_POSITION, CODE_SEQUENCE, Encoder, Kept, SENSOR_UNREFERENCED, SensorType, Start,
};
use profiles::profile::Chain;

use crate::bench::{Bench, one, two};

/// The power is lost, the sensor is moved to `total`, the power comes back.
fn after_power_loss(bench: &Bench, total: i64) -> Bench {
    let kept = Kept::from_words(&bench.encoder.kept().to_words());
    Bench::started(bench.parameters, Start::Kept(kept), total)
}

#[test]
fn counted_positions_go_on_where_they_were() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    (1..=20).for_each(|turns| _ = bench.go(turns * 5000));
    let mut back = after_power_loss(&bench, 100_000);
    let values = back.first();
    assert_eq!((values.position, values.sensor_state), (100_000, 0), "and is still referenced");
    assert_eq!(back.step(7).channels[0].position, 100_007);
}

#[test]
fn what_is_not_counted_electronically_starts_afresh() {
    for (kind, position) in [(SensorType::Incremental, 0), (SensorType::SingleTurn, 100_000 % 8192)] {
        let mut bench = Bench::new(one(kind));
        (0..=20).for_each(|turns| _ = bench.go(turns * 5000));
        let values = after_power_loss(&bench, 100_000).first();
        assert_eq!(values.position, position, "{kind:?}");
        let unreferenced = if kind == SensorType::Incremental { SENSOR_UNREFERENCED } else { 0 };
        assert_eq!(values.sensor_state, unreferenced);
    }
}

/// Turned while off, by less than half of what the sensor tells apart.
#[test]
fn an_absolute_sensor_knows_what_happened_in_the_dark() {
    let mut bench = Bench::new(one(SensorType::SingleTurnCounted));
    (0..=20).for_each(|turns| _ = bench.go(turns * 3000));
    for moved in [4000, -4000, 1, 0] {
        assert_eq!(i64::from(after_power_loss(&bench, 60_000 + moved).first().position), 60_000 + moved);
    }
}

#[test]
fn an_incremental_sensor_notices_at_the_index_that_it_was_turned_in_the_dark() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(5000);
    let mut back = after_power_loss(&bench, 5300);
    assert_eq!(back.first().position, 5000);
    let snapshot = back.go(8200);
    assert_eq!((snapshot.channels[0].position, snapshot.alarms), (8200, ALARM_POSITION));
}

#[test]
fn the_offset_is_kept_with_its_units() {
    let mut bench = Bench::new(two(SensorType::IncrementalCounted, SensorType::MultiTurn));
    bench.stay();
    bench.go(1000);
    bench.preset(0, 10);
    bench.preset(1, 20);
    bench.stay();
    let positions = |bench: &mut Bench| bench.stay().channels.map(|channel| channel.position);
    assert_eq!(positions(&mut after_power_loss(&bench, 1000)), [10, 20]);
    // Parameters that were changed and not saved are the old ones again: the offset does not belong to them.
    bench.parameters.operating = CODE_SEQUENCE;
    let all = 1 << 25;
    assert_eq!(positions(&mut after_power_loss(&bench, 1000)), [(1 << 24) - 1001, all - 1001]);
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
fn what_was_kept_is_still_there_before_the_first_sample() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.go(5000);
    let kept = bench.encoder.kept();
    let mut encoder = Encoder::new(Start::Kept(kept));
    assert_eq!(encoder.kept(), kept, "before there are parameters");
    encoder.apply(&bench.parameters);
    assert_eq!(encoder.kept(), kept, "before there is a sample");
}

#[test]
fn damage_is_a_memory_error_and_an_alarm_where_a_position_is_lost() {
    for (kind, alarms) in [(SensorType::IncrementalCounted, ALARM_POSITION), (SensorType::SingleTurn, 0)] {
        let mut bench = Bench::started(one(kind), Start::Damaged, 0);
        let snapshot = bench.stay();
        assert_eq!((snapshot.alarms, snapshot.conditions.memory), (alarms, true));
    }
}

#[test]
fn operating_time_goes_on() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    (0..360_000).for_each(|_| _ = bench.stay());
    assert_eq!(bench.stay().operating_time, 1);
    let mut back = after_power_loss(&bench, 0);
    (0..359_998).for_each(|_| _ = back.stay());
    assert_eq!(back.stay().operating_time, 2, "the millisecond counts too");
}
