//! Saves that are answered and lost.

use canopen::Frame;
use host_tests::bench::{Bench, ID};

/// An SDO request without a wait for its answer.
fn request(bench: &mut Bench, data: [u8; 8]) {
    bench.receive(&Frame::new(0x600 + u16::from(ID), &data).expect("a frame"));
}

const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];

/// A value is written between the request of a save, whose values are on their way, and a second save (C21).
#[test]
fn a_value_between_two_saves_is_saved() {
    let mut bench = Bench::booted();
    bench.stores_later = true;
    request(&mut bench, SAVE);
    let job = bench.begin_store().expect("a job");
    // 6126h:1 = 3.0
    let [a, b, c, d] = 3.0_f32.to_le_bytes();
    request(&mut bench, [0x23, 0x26, 0x61, 1, a, b, c, d]);
    request(&mut bench, SAVE);
    bench.end_store(job);
    bench.poll();
    // The second save may be a job of its own.
    while let Some(job) = bench.begin_store() {
        bench.end_store(job);
        bench.poll();
    }
    let _ = bench.power_cycled();
}
