//! Boards with wrong oscillators: within the limits of docs/board.md the boards understand each other.

use crate::support::{SECOND, run, world};

/// Numbers of errors on the bus and of boot-up messages for two boards at a bit rate, with their oscillators `ppm` off
/// in opposite directions, on a bus with 50 % load.
fn heard(bit_rate: u16, ppm: i32) -> (u64, u64) {
    let flags = format!(
        "--bitrate {bit_rate} --load 50 --node 1:pressure --node 2:encoder --oscillator 1={ppm} --oscillator 2=-{ppm}"
    );
    let report = run(&mut world(&flags), SECOND * 3);
    (report.bus.errors, report.nodes.iter().map(|node| node.heard.boot_ups).sum())
}

#[test]
fn boards_with_oscillators_a_thousandth_off_understand_each_other_at_every_bit_rate() {
    for bit_rate in [1000, 800, 500, 250, 125, 50, 20, 10] {
        assert_eq!(heard(bit_rate, 1000), (0, 2), "{bit_rate} kbit/s");
    }
}

/// Also beside an adapter, which acknowledges by a clock of its own.
#[test]
fn a_board_with_a_crystal_of_any_tolerance_understands_the_adapter() {
    for ppm in [-2000, -300, -50, -20, 20, 50, 100, 300, 700, 2000] {
        let flags = format!("--bitrate 1000 --node 1:pressure --oscillator 1={ppm}");
        let report = run(&mut world(&flags), SECOND);
        assert_eq!((report.bus.errors, report.nodes[0].heard.boot_ups), (0, 1), "{ppm} ppm");
    }
}

#[test]
fn boards_with_oscillators_one_per_cent_off_do_not() {
    assert!(heard(1000, 10_000).0 > 0);
}
