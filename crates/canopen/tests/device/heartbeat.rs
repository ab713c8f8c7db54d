//! Heartbeat producer, 1017h.

use crate::bench::Bench;
use canopen::{Duration, Instant};

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
