//! Inhibit times.

use canopen::Frame;
use host_tests::bench::{Bench, ID, raw};

const TPDO_1: u16 = 0x180 + ID as u16;

/// A TPDO that is sent with every change of its value, 500 ms apart.
fn inhibited() -> Bench {
    let mut bench = Bench::booted();
    let id = u32::from(TPDO_1);
    bench.write(0x1800, 1, &(id | 1 << 31).to_le_bytes()).expect("off");
    bench.write(0x1800, 2, &[255]).expect("1800h:2");
    bench.write(0x1800, 3, &5000_u16.to_le_bytes()).expect("500 ms");
    bench.write(0x1800, 5, &0_u16.to_le_bytes()).expect("1800h:5");
    bench.write(0x1800, 1, &id.to_le_bytes()).expect("on");
    bench.sample(&raw(100_000.0, 298.15));
    bench.nmt(1);
    bench
}

#[test]
fn an_inhibit_time_separates_events() {
    let mut bench = inhibited();
    (0..1200).for_each(|n| bench.sample(&raw(100_000.0 + 50.0 * f64::from(n), 298.15)));
}

/// P28: a write to another setting of the TPDO, or a remote frame, does not end its inhibit time.
#[test]
fn an_inhibit_time_outlasts_writes_and_remote_frames() {
    let changes: [fn(&mut Bench); 4] = [
        |bench| bench.write(0x1800, 5, &0_u16.to_le_bytes()).expect("1800h:5"),
        |bench| bench.write(0x1800, 2, &[255]).expect("1800h:2"),
        |bench| bench.write(0x1800, 1, &u32::from(TPDO_1).to_le_bytes()).expect("1800h:1"),
        |bench| bench.receive(&Frame::remote(TPDO_1, 8).expect("a frame")),
    ];
    for change in changes {
        let mut bench = inhibited();
        for n in 0..300 {
            bench.sample(&raw(100_000.0 + 50.0 * f64::from(n), 298.15));
            if n % 55 == 54 {
                change(&mut bench);
            }
        }
    }
}
