//! Downloads that are aborted and act.

use host_tests::bench::{Bench, raw};
use node::Personality;

/// Writes other values in Operational, where no page is erased, until the store of the node is full and beyond.
fn preset_until_full(bench: &mut Bench, index: u16, sub: u8) {
    bench.nmt(1);
    for value in 1..=600_u32 {
        bench.sample(&raw(0.0, 298.15));
        let _ = bench.write(index, sub, &value.to_le_bytes());
    }
}

/// E27, C22.
#[test]
fn a_preset_of_an_encoder_is_in_force_or_refused() {
    let mut bench = Bench::booted_as(Personality::Encoder);
    preset_until_full(&mut bench, 0x6003, 0);
}

/// L24, C22.
#[test]
fn a_preset_of_a_position_unit_is_in_force_or_refused() {
    let mut bench = Bench::booted_as(Personality::Lift);
    bench.write(0x2305, 0, &[1]).expect("a position unit");
    preset_until_full(&mut bench, 0x6382, 1);
}
