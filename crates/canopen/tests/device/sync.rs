//! SYNC with a counter, a period and a window: 1006h, 1007h, 1019h and 1800h:6.

use crate::bench::Bench;
use canopen::{Duration, Frame};

const TPDO: u16 = 0x185;

/// An operational device with a TPDO of type `every`; with `counts`, the SYNC has a counter up to 10.
fn bench(every: u8, start: u8, counts: bool) -> Bench {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write(0x1800, 2, &[every]).unwrap();
    bench.write(0x1800, 6, &[start]).unwrap();
    bench.write32(0x1800, 1, 0x0000_0185).unwrap();
    bench.write(0x1019, 0, &[if counts { 10 } else { 0 }]).unwrap();
    bench.nmt(1);
    bench.take();
    bench
}

fn sync(bench: &mut Bench, counter: u8) -> bool {
    bench.receive(Frame::new(0x80, &[counter]).unwrap());
    bench.take().iter().any(|frame| frame.id() == TPDO)
}

fn emergencies(bench: &mut Bench) -> Vec<u16> {
    let messages = bench.sent().into_iter().filter(|(id, _)| *id == 0x085);
    messages.map(|(_, data)| u16::from_le_bytes([data[0], data[1]])).collect()
}

#[test]
fn the_count_begins_with_the_start_value() {
    let mut bench = bench(2, 5, true);
    let sent: Vec<_> = (1..=10).filter(|&counter| sync(&mut bench, counter)).collect();
    assert_eq!(sent, [6, 8, 10]);
}

#[test]
fn without_a_counter_or_a_start_value_every_sync_counts() {
    let mut bench = bench(1, 0, true);
    assert!(sync(&mut bench, 7));
    let mut bench = self::bench(1, 5, false);
    bench.sync();
    assert_eq!(bench.take().len(), 1);
}

#[test]
fn a_sync_of_the_wrong_length_is_an_error_and_no_sync() {
    for (counts, data) in [(true, &[][..]), (true, &[1, 2]), (false, &[1])] {
        let mut bench = bench(1, 0, counts);
        bench.receive(Frame::new(0x80, data).unwrap());
        let frames = bench.take();
        assert!(frames.iter().all(|frame| frame.id() == 0x085));
        assert_eq!(frames.len(), 1);
        assert_eq!(frames[0].data()[..2], [0x40, 0x82]);
    }
}

#[test]
fn syncs_of_the_wrong_length_are_one_error_until_a_right_one() {
    for (counts, wrong, right) in [(true, &[1, 2][..], &[1][..]), (false, &[1], &[])] {
        let mut bench = bench(1, 0, counts);
        for _ in 0..100 {
            bench.receive(Frame::new(0x80, wrong).unwrap());
        }
        assert_eq!(errors(&mut bench), [0x8240]);
        bench.receive(Frame::new(0x80, right).unwrap());
        assert_eq!(errors(&mut bench), [0]);
        bench.receive(Frame::new(0x80, wrong).unwrap());
        assert_eq!(errors(&mut bench), [0x8240]);
        bench.write32(0x1005, 0, 0x81).unwrap();
        assert_eq!(errors(&mut bench), [0], "a new CAN-ID");
    }
}

/// The error codes of the EMCYs since the last call.
fn errors(bench: &mut Bench) -> Vec<u16> {
    let emcys = bench.sent().into_iter().filter(|(id, _)| *id == 0x085);
    emcys.map(|(_, data)| u16::from_le_bytes([data[0], data[1]])).collect()
}

#[test]
fn a_new_window_leaves_the_monitoring_of_the_period_alone() {
    let mut bench = Bench::operational();
    bench.write32(0x1006, 0, 10_000).unwrap();
    bench.sync();
    bench.take();
    bench.write32(0x1007, 0, 5000).unwrap();
    bench.run(Duration::from_millis(20));
    assert_eq!(errors(&mut bench), [0x8100]);
    bench.write32(0x1007, 0, 0).unwrap();
    assert_eq!(errors(&mut bench), [], "the SYNC is still missing");
    bench.sync();
    assert_eq!(errors(&mut bench), [0]);
}

#[test]
fn the_counter_is_0_or_2_to_240_and_fixed_while_there_is_a_period() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1019, 0, &[1]), Err(0x0609_0030));
    assert_eq!(bench.write(0x1019, 0, &[241]), Err(0x0609_0031));
    assert_eq!(bench.write(0x1019, 0, &[240]), Ok(()));
    bench.write32(0x1006, 0, 1000).unwrap();
    assert_eq!(bench.write(0x1019, 0, &[0]), Err(0x0800_0022));
}

#[test]
fn the_start_value_is_fixed_while_the_pdo_is_valid() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1800, 6, &[1]), Err(0x0609_0030));
}

#[test]
fn a_missing_sync_is_signalled_until_the_next_sync() {
    let mut bench = bench(1, 0, false);
    bench.write32(0x1006, 0, 10_000).unwrap();
    bench.run(Duration::from_millis(100));
    assert_eq!(emergencies(&mut bench), []);
    bench.sync();
    bench.run(Duration(14_999));
    assert_eq!(emergencies(&mut bench), []);
    bench.run(Duration(1));
    assert_eq!(emergencies(&mut bench), [0x8100]);
    bench.run(Duration::from_millis(100));
    bench.sync();
    assert_eq!(emergencies(&mut bench), [0]);
}

#[test]
fn outside_operational_no_sync_is_missed() {
    let mut bench = bench(1, 0, false);
    bench.write32(0x1006, 0, 10_000).unwrap();
    bench.sync();
    bench.nmt(0x80);
    bench.run(Duration::from_millis(100));
    assert_eq!(emergencies(&mut bench), []);
}

#[test]
fn after_the_window_a_synchronous_pdo_is_dropped() {
    for (window, sent) in [(500, 0), (5_000, 1), (0, 1)] {
        let mut bench = bench(1, 0, false);
        bench.write32(0x1007, 0, window).unwrap();
        bench.take();
        bench.out.room = 0;
        bench.sync();
        bench.out.room = 10;
        bench.run(Duration::from_millis(20));
        assert_eq!(bench.take().iter().filter(|frame| frame.id() == TPDO).count(), sent, "{window}");
    }
}

#[test]
fn the_end_of_the_window_belongs_to_the_window() {
    for (passed, sent) in [(2000, 1), (2001, 0)] {
        let mut bench = bench(1, 0, false);
        bench.write32(0x1007, 0, 2000).unwrap();
        bench.take();
        bench.out.room = 0;
        bench.sync();
        bench.now = bench.now + Duration(passed);
        bench.out.room = 10;
        bench.poll();
        assert_eq!(bench.take().iter().filter(|frame| frame.id() == TPDO).count(), sent, "after {passed} us");
    }
}

/// The usual sequence of a master that starts again: its SYNC is away, and the NMT state changes meanwhile.
#[test]
fn a_sync_in_another_nmt_state_ends_the_fault_of_a_missing_one() {
    for commands in [[0x80, 1], [2, 1], [1, 1]] {
        let mut bench = bench(1, 0, false);
        bench.write32(0x1006, 0, 100_000).unwrap();
        bench.sync();
        bench.run(Duration::from_millis(200));
        assert_eq!(emergencies(&mut bench), [0x8100]);
        commands.into_iter().for_each(|command| bench.nmt(command));
        bench.sync();
        assert_eq!(emergencies(&mut bench), [0], "{commands:x?}");
    }
}

/// 1006h has 32 bits, 71 minutes, as the ticks have: with a longer period less than half a period is left.
#[test]
fn a_sync_after_up_to_70_minutes_is_never_missing() {
    for minutes in [40, 48, 60, 70] {
        let mut bench = bench(1, 0, false);
        let period = Duration::from_millis(minutes * 60_000);
        bench.write32(0x1006, 0, period.0 as u32).unwrap();
        for _ in 0..3 {
            bench.sync();
            bench.run(period);
        }
        assert_eq!(emergencies(&mut bench), [], "a period of {minutes} min");
        bench.run(Duration::from_millis(60_000 * minutes.div_ceil(2)));
        assert_eq!(emergencies(&mut bench), [0x8100], "a period of {minutes} min");
    }
}

#[test]
fn a_long_period_is_monitored_for_one_and_a_half_periods() {
    for period in [2_000_000_000_u32, 1 << 31, 2_800_000_000] {
        let mut bench = bench(1, 0, false);
        bench.write32(0x1006, 0, period).unwrap();
        bench.sync();
        let end = u64::from(period) + u64::from(period / 2);
        bench.run(Duration(end - 1));
        assert_eq!(emergencies(&mut bench), [], "a period of {period} us");
        bench.run(Duration(1));
        assert_eq!(emergencies(&mut bench), [0x8100], "a period of {period} us");
        bench.sync();
        assert_eq!(emergencies(&mut bench), [0]);
    }
}

/// The window is one of the synchronous types.
#[test]
fn after_the_window_an_event_driven_pdo_still_waits_for_its_inhibit_time() {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write(0x1800, 3, &1000_u16.to_le_bytes()).unwrap();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    bench.write32(0x1800, 1, 0x0000_0185).unwrap();
    bench.write32(0x1007, 0, 2000).unwrap();
    bench.nmt(1);
    assert_eq!(bench.take().len(), 1);
    bench.sync();
    bench.set_value(1, &[1, 0, 0, 0]);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(200)), [100_000]);
}
