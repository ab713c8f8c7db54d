//! Heartbeat producer, 1017h, and consumer, 1016h.

use crate::bench::Bench;
use canopen::nmt::State;
use canopen::{Duration, Frame, Instant};

#[test]
fn heartbeats_keep_their_grid() {
    let mut bench = Bench::booted();
    let times = bench.times_of(0x705, Duration::from_millis(3500));
    assert_eq!(times, [1_000_000, 2_000_000, 3_000_000]);
}

#[test]
fn a_late_poll_does_not_shift_the_grid_and_a_long_gap_makes_no_burst() {
    let mut bench = Bench::booted();
    bench.now = bench.now + Duration(1_400_000);
    assert_eq!(bench.times_of(0x705, Duration::from_millis(700)), [0, 600_000]);
    bench.now = bench.now + Duration(10_300_000);
    assert_eq!(bench.times_of(0x705, Duration::from_millis(900)), [0]);
}

#[test]
fn a_new_time_starts_with_a_heartbeat_and_zero_ends_them() {
    let mut bench = Bench::booted();
    bench.write(0x1017, 0, &[20, 0]).unwrap();
    assert_eq!(bench.sent(), [(0x705, vec![0x7F])]);
    assert_eq!(bench.times_of(0x705, Duration::from_millis(50)), [20_000, 40_000]);
    bench.write(0x1017, 0, &[0, 0]).unwrap();
    assert_eq!(bench.times_of(0x705, Duration::from_millis(5000)), []);
}

#[test]
fn it_carries_the_state() {
    let mut bench = Bench::booted();
    for (command, code) in [(1, 5), (2, 4), (0x80, 0x7F)] {
        bench.nmt(command);
        bench.take();
        bench.run(Duration::from_millis(1000));
        assert!(bench.sent().contains(&(0x705, vec![code])));
    }
}

#[test]
fn a_full_queue_is_tried_again_after_a_millisecond() {
    let mut bench = Bench::booted();
    bench.out.room = 0;
    bench.now = bench.now + Duration::from_millis(1000);
    assert_eq!(bench.poll(), bench.now + Duration::from_millis(1));
    bench.out.room = 1;
    assert_eq!(bench.times_of(0x705, Duration::from_millis(1)), [1000]);
}

#[test]
fn an_idle_poll_gives_the_cached_deadline() {
    let mut bench = Bench::booted();
    let due = bench.poll();
    assert_eq!(due, Instant(2_000_000));
    assert_eq!(bench.poll(), due);
}

/// Receives a heartbeat of another node.
fn beat(bench: &mut Bench, node: u16) {
    bench.receive(Frame::new(0x700 + node, &[5]).unwrap());
}

fn emergencies(bench: &mut Bench) -> Vec<(u8, u8, u8)> {
    let messages = bench.sent().into_iter().filter(|(id, _)| *id == 0x085);
    messages.map(|(_, data)| (data[0], data[1], data[3])).collect()
}

#[test]
fn a_node_is_watched_from_its_first_heartbeat_on() {
    let mut bench = Bench::operational();
    bench.write32(0x1016, 1, 0x0009_0064).unwrap();
    bench.run(Duration::from_millis(500));
    assert_eq!((emergencies(&mut bench), bench.device.state()), (vec![], State::Operational));
    beat(&mut bench, 9);
    bench.run(Duration(99_999));
    assert_eq!(emergencies(&mut bench), []);
    bench.run(Duration(1));
    assert_eq!(emergencies(&mut bench), [(0x30, 0x81, 1)]);
    assert_eq!(bench.device.state(), State::PreOperational);
    bench.run(Duration::from_millis(500));
    beat(&mut bench, 9);
    assert_eq!(emergencies(&mut bench), [(0, 0, 0)]);
}

#[test]
fn each_node_is_watched_on_its_own() {
    let mut bench = Bench::booted();
    bench.write32(0x1016, 1, 0x0009_0064).unwrap();
    bench.write32(0x1016, 4, 0x000A_0064).unwrap();
    beat(&mut bench, 9);
    beat(&mut bench, 10);
    bench.run(Duration::from_millis(100));
    assert_eq!(emergencies(&mut bench), [(0x30, 0x81, 1), (0x30, 0x81, 4)]);
    beat(&mut bench, 10);
    assert_eq!(emergencies(&mut bench), []);
    beat(&mut bench, 9);
    assert_eq!(emergencies(&mut bench), [(0, 0, 0)]);
}

#[test]
fn frames_other_than_heartbeats_do_not_count() {
    let mut bench = Bench::booted();
    bench.write32(0x1016, 1, 0x0009_0064).unwrap();
    bench.receive(Frame::new(0x709, &[5, 0]).unwrap());
    bench.receive(Frame::remote(0x709, 1).unwrap());
    bench.receive(Frame::new(0x70A, &[5]).unwrap());
    bench.run(Duration::from_millis(500));
    assert_eq!(emergencies(&mut bench), []);
}

#[test]
fn entries_are_checked_and_an_unused_one_ends_the_watch() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write32(0x1016, 1, 0x0109_0064), Err(0x0609_0030));
    bench.write32(0x1016, 1, 0x0009_0064).unwrap();
    assert_eq!(bench.write32(0x1016, 2, 0x0009_0032), Err(0x0604_0043));
    assert_eq!(bench.write32(0x1016, 1, 0x0009_0032), Ok(()));
    assert!(bench.device.service_ids().any(|id| id.get() == 0x709));
    beat(&mut bench, 9);
    bench.run(Duration::from_millis(50));
    assert_eq!(emergencies(&mut bench), [(0x30, 0x81, 1)]);
    for unused in [0x0009_0000, 0x0000_0064, 0x0080_0064] {
        assert_eq!(bench.write32(0x1016, 1, unused), Ok(()));
        assert!(!bench.device.service_ids().any(|id| id.get() == 0x709));
    }
    assert_eq!(emergencies(&mut bench), [(0, 0, 0)]);
}

/// 1016h:2 is node 9 with 100 ms.
#[test]
fn a_stored_node_is_watched_after_a_reset_and_a_restored_one_is_not() {
    let mut bench = Bench::booted();
    let watches = |bench: &Bench| bench.device.service_ids().any(|id| id.get() == 0x709);
    for (stored, is_watched) in [(vec![0x16, 0x10, 2, 1, 4, 100, 0, 9, 0], true), (vec![], false)] {
        bench.device.application_mut().stored[0] = stored;
        bench.nmt(0x82);
        bench.start();
        bench.take();
        assert_eq!(watches(&bench), is_watched);
        beat(&mut bench, 9);
        bench.run(Duration::from_millis(100));
        let expected = if is_watched { vec![(0x30, 0x81, 2)] } else { vec![] };
        assert_eq!(emergencies(&mut bench), expected);
    }
}

#[test]
fn a_poll_after_whole_periods_sends_one_heartbeat() {
    for periods in 2..=4 {
        let mut bench = Bench::booted();
        bench.now = bench.now + Duration(periods * 1_000_000);
        assert_eq!(bench.times_of(0x705, Duration(999_999)), [0], "after {periods} periods");
        assert_eq!(bench.times_of(0x705, Duration(1)), [1]);
    }
}

#[test]
fn a_reset_of_the_communication_ends_a_watch_that_is_not_stored() {
    for sub in 1..=4 {
        let mut bench = Bench::booted();
        bench.write32(0x1016, sub, 0x0009_0064).unwrap();
        beat(&mut bench, 9);
        bench.nmt(0x82);
        bench.start();
        assert!(!bench.device.service_ids().any(|id| id.get() == 0x709), "1016h:{sub}");
        beat(&mut bench, 9);
        bench.run(Duration::from_millis(500));
        assert_eq!(emergencies(&mut bench), [], "1016h:{sub}");
    }
}
