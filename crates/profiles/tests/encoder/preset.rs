//! Presets and offsets, and their changes.

use profiles::encoder::{CODE_SEQUENCE, Coding, Format, Parameters, Parity, SCALING, SensorType};

use crate::bench::{Bench, one, two};

#[test]
fn a_preset_is_read_back_and_moves_on() {
    for kind in [SensorType::IncrementalCounted, SensorType::MultiTurn, SensorType::LinearAbsolute] {
        let mut bench = Bench::new(one(kind));
        bench.stay();
        bench.go(1000);
        bench.preset(0, 12_345);
        let values = bench.first();
        assert_eq!((values.position, values.offset, values.presets), (12_345, 11_345, 1));
        assert_eq!(bench.step(-1).channels[0].position, 12_344);
    }
}

#[test]
fn a_preset_counts_once() {
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.preset(0, 10);
    bench.stay();
    bench.step(5);
    bench.change(|parameters| parameters.channels[0].area.low = 1);
    assert_eq!(bench.first().position, 15);
}

#[test]
fn each_channel_has_its_preset() {
    let mut bench = Bench::new(two(SensorType::IncrementalCounted, SensorType::MultiTurn));
    bench.stay();
    bench.go(1000);
    bench.preset(1, 5);
    let [first, second] = bench.stay().channels;
    assert_eq!((first.position, first.offset, second.position, second.offset), (1000, 0, 5, -995));
}

#[test]
fn counting_the_other_way_leaves_the_position() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.go(1000);
    bench.preset(0, 300);
    bench.stay();
    bench.change(|parameters| parameters.operating = CODE_SEQUENCE);
    assert_eq!(bench.first().position, 300);
    assert_eq!(bench.step(10).channels[0].position, 290);
    bench.change(|parameters| parameters.operating = 0);
    let values = bench.first();
    assert_eq!((values.position, values.offset), (290, 290 - 1010));
}

#[test]
fn in_other_units_the_offset_is_gone() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    bench.change(|parameters| {
        parameters.operating = SCALING;
        (parameters.per_revolution, parameters.range) = (8192, 1 << 20);
    });
    let changes: [fn(&mut Parameters); 3] = [
        |parameters| parameters.per_revolution = 360,
        |parameters| parameters.range = 3600,
        |parameters| parameters.operating = 0,
    ];
    for change in changes {
        bench.preset(0, 7);
        assert_eq!(bench.first().position, 7);
        bench.change(change);
        assert_eq!(bench.first().offset, 0);
    }
}

/// Parameters that do not concern units must leave position, offset and speed unchanged: an incremental encoder could
/// not find its position again.
#[test]
fn other_parameters_leave_the_position() {
    let changes: [fn(&mut Parameters); 5] = [
        |parameters| parameters.limits.highest_current = 1,
        |parameters| parameters.channels[0].fastest = 0,
        |parameters| parameters.channels[0].area.low = 7,
        |parameters| parameters.channels[1].kind = Some(SensorType::MultiTurn),
        |parameters| {
            parameters.format = Format::new(0, 10, Coding::Binary, true, Parity::Odd).unwrap();
        },
    ];
    let mut bench = Bench::new(one(SensorType::IncrementalCounted));
    bench.stay();
    bench.preset(0, 77);
    bench.stay();
    bench.change(|parameters| parameters.index = false);
    (0..100).for_each(|_| _ = bench.step(30));
    for change in changes {
        let before = bench.step(30).channels[0];
        bench.change(change);
        let after = bench.step(30).channels[0];
        assert_eq!((after.position, after.offset, after.speed), (before.position + 30, 77, before.speed));
    }
}

#[test]
fn a_preset_outside_of_the_range_does_nothing() {
    let mut bench = Bench::new(one(SensorType::SingleTurn));
    bench.go(100);
    bench.preset(0, 8192);
    assert_eq!(bench.first().position, 100);
}
