//! Deadlines in the past, which starve the rest of a node.

use canopen::Duration;
use node::Personality;
use profiles::lift::devices::Devices;

use crate::common::{Motion, bus, nmt, run_with_load, write};

/// Button words wait while more urgent frames fill the bus (K21).
#[test]
fn button_calls_on_a_busy_bus_leave_all_deadlines_in_the_future() {
    let mut bus = bus(250, Personality::Lift, Motion { press: 20, ..Motion::default() });
    write(&mut bus, 1, 0x2305, 0, &[7]);
    for sub in 1..=2 {
        write(&mut bus, 1, 0x6100, sub, &[5, sub, 1, 0, 1, 0]);
    }
    nmt(&mut bus, 1);
    run_with_load(&mut bus, 2000, 0x002, 3);
    bus.run(Duration::from_millis(2000));
}

/// A multiplexed TPDO with an event timer loses all of its objects (K22).
#[test]
fn a_deselected_multiplexed_tpdo_has_no_deadline_in_the_past() {
    let mut bus = bus(250, Personality::Lift, Motion::default());
    write(&mut bus, 1, 0x2305, 0, &[Devices::ALL.0 & 3]);
    write(&mut bus, 1, 0x1801, 5, &100_u16.to_le_bytes());
    nmt(&mut bus, 1);
    bus.run(Duration::from_millis(500));
    write(&mut bus, 1, 0x2305, 0, &[0]);
    bus.run(Duration::from_millis(1000));
}
