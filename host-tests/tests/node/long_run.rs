//! A week of the protocol: every timer continues, beyond the range of a 32-bit counter of microseconds.

use canopen::{Duration, Instant};
use host_tests::bench::{Bench, ID};

const SECOND: u64 = 1_000_000;
const WEEK: u64 = 7 * 24 * 3600;

/// Runs from deadline to deadline until `end`, and returns the instants of the frames with this identifier.
fn run(bench: &mut Bench, end: Instant, id: u16) -> Vec<u64> {
    let mut instants = vec![];
    loop {
        let next = bench.poll();
        let frames = bench.take();
        instants.extend(frames.iter().filter(|(of, _)| *of == id).map(|_| bench.now.0));
        if next > end {
            return instants;
        }
        assert!(next > bench.now, "what is due at {:?} stays due", bench.now);
        bench.now = next;
    }
}

#[test]
fn a_heartbeat_a_second_for_a_week() {
    let mut bench = Bench::booted();
    bench.write(0x1017, 0, &1000_u16.to_le_bytes()).unwrap();
    bench.take();
    let start = bench.now;
    let beats = run(&mut bench, start + Duration(WEEK * SECOND), 0x700 + u16::from(ID));
    assert_eq!(beats.len() as u64, WEEK);
    assert!(beats.windows(2).all(|pair| pair[1] - pair[0] == SECOND), "and each at its time");
}

#[test]
fn an_event_timer_and_a_heartbeat_consumer_past_the_wrap_of_32_bits() {
    let mut bench = Bench::booted();
    // The node monitors the heartbeat of node 5, with 2 s.
    bench.write(0x1016, 1, &0x0005_07D0_u32.to_le_bytes()).unwrap();
    bench.write(0x1800, 5, &700_u16.to_le_bytes()).unwrap();
    bench.nmt(1);
    bench.take();
    let start = bench.now;
    let end = start + Duration((1 << 32) + 10 * SECOND);
    let sent = run(&mut bench, end, 0x180 + u16::from(ID));
    assert_eq!(sent.len() as u64, (end.0 - start.0) / 700_000);
    assert!(sent.windows(2).all(|pair| pair[1] - pair[0] == 700_000));
}
