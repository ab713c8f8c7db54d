//! Transfers of several frames.

use host_tests::bench::Bench;
use node::Personality;

#[test]
fn a_text_is_read_in_segments() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        let name = bench.read(0x1008, 0).expect("1008h");
        assert!(name.len() > 7, "more than a segment");
    }
}
