//! States that change without a reason, or do not change although 1029h demands it.

use host_tests::bench::{Bench, raw};
use node::Personality;
use profiles::board::RawSample;

const STOPPED: u8 = 2;
/// Personalities with a pressure channel.
const PERSONALITIES: [Personality; 2] = [Personality::Pressure, Personality::Combined];

fn run(bench: &mut Bench, milliseconds: u32, reading: &RawSample) {
    (0..milliseconds).for_each(|_| bench.sample(reading));
}

/// A sensor whose line is at the supply.
fn rail() -> RawSample {
    RawSample { pressure: 16 * 4095, supply: 16 * 4095, ..raw(0.0, 298.15) }
}

/// P21.
#[test]
fn an_error_that_stops_a_node_is_reported_first() {
    for personality in PERSONALITIES {
        let mut bench = Bench::booted_as(personality);
        bench.write(0x1029, 2, &[STOPPED]).expect("1029h:2");
        run(&mut bench, 100, &raw(100_000.0, 298.15));
        bench.nmt(1);
        run(&mut bench, 1500, &raw(100_000.0, 298.15));
        run(&mut bench, 3000, &rail());
    }
}

/// P26: stored parameters that cannot be read.
#[test]
fn an_error_that_is_found_at_a_start_acts_as_1029h_demands() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        bench.write(0x1029, 2, &[STOPPED]).expect("1029h:2");
        bench.write(0x1010, 2, b"save").expect("a save");
        bench.write(0x1017, 0, &900_u16.to_le_bytes()).expect("1017h");
        bench.write(0x1010, 2, b"save").expect("a save");
        let mut bench = bench.power_cycled_with_damage();
        run(&mut bench, 4000, &raw(100_000.0, 298.15));
    }
}
