//! The list of errors and EMCY.

use host_tests::bench::{Bench, ID, raw};
use profiles::board::RawSample;

/// P31: EMCY is off, so the list of errors stays empty.
#[test]
fn an_error_that_no_emcy_has_sent_is_not_in_the_list() {
    let mut bench = Bench::booted();
    let off = 1_u32 << 31 | 0x80 | u32::from(ID);
    bench.write(0x1014, 0, &off.to_le_bytes()).expect("1014h");
    (0..100).for_each(|_| bench.sample(&raw(100_000.0, 298.15)));
    let rail = RawSample { pressure: 16 * 4095, supply: 16 * 4095, ..raw(0.0, 298.15) };
    (0..1500).for_each(|_| bench.sample(&rail));
    bench.read(0x1003, 0).expect("1003h:0");
    (0..300).for_each(|_| bench.sample(&rail));
}
