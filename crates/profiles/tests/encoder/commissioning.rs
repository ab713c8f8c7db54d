//! The commissioning diagnostic finds the faults that it promises, and none without a fault.

use profiles::encoder::{
    ALARM_COMMISSIONING, COMMISSIONING, Coding, Command, Format, Parameters, Parity, Progress, SensorType,
};

use crate::bench::{Bench, frame, one};

fn diagnosed(kind: SensorType) -> Bench {
    Bench::new(Parameters { operating: COMMISSIONING, ..one(kind) })
}

fn progress(bench: &mut Bench) -> Progress {
    bench.stay().channels[0].commissioning
}

#[test]
fn the_diagnostic_is_off_until_requested() {
    let mut bench = Bench::new(one(SensorType::MultiTurn));
    assert_eq!(progress(&mut bench), Progress::Off);
    bench.change(|parameters| parameters.operating = COMMISSIONING);
    assert_eq!(progress(&mut bench), Progress::Running);
    bench.change(|parameters| parameters.operating = 0);
    assert_eq!(progress(&mut bench), Progress::Off);
}

#[test]
fn a_good_encoder_passes_at_rest_and_over_two_turns() {
    for kind in [SensorType::MultiTurn, SensorType::SingleTurn, SensorType::IncrementalCounted] {
        for speed in [1_i64, 7, -13, 64, 400] {
            let mut bench = diagnosed(kind);
            (0..1000).for_each(|_| _ = bench.stay());
            assert_eq!(progress(&mut bench), Progress::GoodAtRest, "{kind:?}");
            (0..20_000 / speed.abs()).for_each(|_| _ = bench.step(speed));
            assert_eq!(progress(&mut bench), Progress::GoodOverTurns, "{kind:?} at {speed}");
            assert_eq!(bench.stay().alarms, 0);
        }
    }
}

#[test]
fn an_open_line_is_found_at_rest() {
    let mut bench = diagnosed(SensorType::MultiTurn);
    bench.stay();
    let snapshot = bench.receive(None);
    assert_eq!(snapshot.channels[0].commissioning, Progress::BadReading);
    assert_eq!(snapshot.alarms, ALARM_COMMISSIONING);
    // The alarm stays until the diagnostic is switched off and the alarm is acknowledged.
    assert_eq!(progress(&mut bench), Progress::BadReading);
    bench.change(|parameters| {
        parameters.operating = 0;
        parameters.acknowledge = Command { value: 2, count: 1 };
    });
    assert_eq!(bench.stay().alarms, 0);
}

#[test]
fn a_gap_in_the_code_is_found() {
    let mut bench = diagnosed(SensorType::MultiTurn);
    bench.stay();
    bench.step(10_001);
    assert_eq!(progress(&mut bench), Progress::BadReading);
}

#[test]
fn a_stuck_bit_is_found_over_two_turns() {
    let format = Format::new(4, 8, Coding::Gray, false, Parity::None).unwrap();
    for bit in 0..8 {
        for level in [0, 1] {
            let mut bench = diagnosed(SensorType::MultiTurn);
            bench.change(|parameters| parameters.format = format);
            let mut last = Progress::Off;
            for total in 0..1200 {
                let mut frame = frame(format, total);
                frame.bits = frame.bits & !(4 << bit) | (level << (2 + bit));
                last = bench.receive(Some(frame)).channels[0].commissioning;
            }
            assert_eq!(last, Progress::StuckBit, "bit {bit} at {level}");
        }
    }
}

#[test]
fn a_bit_that_sticks_later_is_found_over_the_next_two_turns() {
    let format = Format::new(4, 8, Coding::Binary, false, Parity::None).unwrap();
    let mut bench = diagnosed(SensorType::MultiTurn);
    bench.change(|parameters| parameters.format = format);
    let mut last = Progress::Off;
    for total in 0..=512 {
        last = bench.receive(Some(frame(format, total))).channels[0].commissioning;
    }
    assert_eq!(last, Progress::GoodOverTurns);
    for total in 513..1100 {
        let mut frame = frame(format, total);
        frame.bits &= !4;
        last = bench.receive(Some(frame)).channels[0].commissioning;
    }
    assert_eq!(last, Progress::StuckBit);
}

#[test]
fn a_movement_is_two_turns_without_a_rest() {
    for (rest, expected) in [(100, Progress::GoodOverTurns), (101, Progress::GoodAtRest)] {
        let mut bench = diagnosed(SensorType::MultiTurn);
        (0..1000).for_each(|_| _ = bench.stay());
        // A turn and a half, a rest, and a turn.
        (0..1536).for_each(|_| _ = bench.step(8));
        (0..rest).for_each(|_| assert_eq!(progress(&mut bench), Progress::GoodAtRest));
        (0..1024).for_each(|_| _ = bench.step(8));
        assert_eq!(progress(&mut bench), expected, "after {rest} ms");
    }
}

#[test]
fn two_turns_of_a_rod_are_8192_steps() {
    let mut bench = diagnosed(SensorType::LinearAbsolute);
    (0..1000).for_each(|_| _ = bench.stay());
    (0..8191).for_each(|_| assert_eq!(bench.step(1).channels[0].commissioning, Progress::GoodAtRest));
    assert_eq!(bench.step(1).channels[0].commissioning, Progress::GoodOverTurns);
}

#[test]
fn an_index_that_does_not_come_is_found() {
    let mut bench = diagnosed(SensorType::Incremental);
    bench.stay();
    for _ in 0..9 {
        bench.total += 1000;
        bench.stay();
    }
    assert_eq!(progress(&mut bench), Progress::BadIndex);
}

#[test]
fn an_index_at_the_wrong_distance_is_found() {
    let mut bench = diagnosed(SensorType::Incremental);
    bench.change(|parameters| parameters.channels[0].resolution = 4000.try_into().unwrap());
    (0..10).for_each(|_| _ = bench.step(1000));
    assert_eq!(progress(&mut bench), Progress::BadIndex);
}

#[test]
fn too_fast_is_found() {
    let mut bench = diagnosed(SensorType::Incremental);
    bench.stay();
    bench.step(10_001);
    assert_eq!(progress(&mut bench), Progress::TooFast);
}

#[test]
fn a_start_with_the_diagnostic_saved_is_no_fault() {
    let mut bench = diagnosed(SensorType::MultiTurn);
    (0..2).for_each(|_| _ = bench.receive(None));
    (0..1001).for_each(|_| _ = bench.stay());
    assert_eq!((progress(&mut bench), bench.stay().alarms), (Progress::GoodAtRest, 0));
    let mut bench = diagnosed(SensorType::MultiTurn);
    (0..20).for_each(|_| _ = bench.receive(None));
    assert_eq!(bench.receive(None).channels[0].commissioning, Progress::BadReading, "no word at all");
}
