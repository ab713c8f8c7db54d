//! 2005h: the values of the board that the firmware knows, in every personality.

use host_tests::bench::Bench;
use node::Personality;

const SELF_TEST: u16 = 0x2005;
/// "tes" in ASCII, before the number of a value.
const KEY: u32 = 0x7465_7300;

fn value(bench: &mut Bench) -> u32 {
    u32::from_le_bytes(bench.read(SELF_TEST, 0).unwrap().try_into().unwrap())
}

#[test]
fn a_number_with_the_key_selects_a_value_and_any_other_write_selects_none() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        for (written, shown) in [
            (KEY + 3, 0x0300_0001),
            (KEY + 255, 0xFF00_0001),
            (KEY, 1),
            (3, 3),
            (KEY + 0x100, KEY + 0x100),
            (KEY - 1, KEY - 1),
        ] {
            bench.write(SELF_TEST, 0, &u32::to_le_bytes(written)).unwrap();
            bench.protocol.self_test(|number| u32::from(number) << 24 | 1);
            assert_eq!(value(&mut bench), shown, "{personality:?}: {written:08X} was written");
        }
    }
}
