//! A node whose own process data leave no room for its heartbeat and its SDO server.

use canopen::Duration;
use node::Personality;

use crate::common::{Bus, Motion, bus, nmt, try_write, write};

/// Runs for 14 s and asks the SDO server once a second.
fn run(bus: &mut Bus) {
    for _ in 0..14 {
        bus.run(Duration::from_millis(1000));
        let _ = try_write(bus, 1, 0x1029, 1, &[0]);
    }
}

/// P25, with the event timer.
#[test]
fn a_tpdo_every_millisecond_leaves_room_at_every_bit_rate() {
    for kbit in [10, 20, 50] {
        let mut bus = bus(kbit, Personality::Pressure, Motion::default());
        write(&mut bus, 1, 0x1800, 5, &1_u16.to_le_bytes());
        nmt(&mut bus, 1);
        run(&mut bus);
    }
}

/// P25, with a change in every sample.
#[test]
fn a_noisy_pressure_without_inhibit_time_leaves_room() {
    let mut bus = bus(50, Personality::Pressure, Motion { noise: 500, ..Motion::default() });
    write(&mut bus, 1, 0x1800, 5, &0_u16.to_le_bytes());
    nmt(&mut bus, 1);
    run(&mut bus);
}

/// L25: 8.3 revolutions a second.
#[test]
fn three_position_units_of_a_lift_leave_room_by_their_defaults() {
    let mut bus = bus(250, Personality::Lift, Motion { speed: 34, ..Motion::default() });
    write(&mut bus, 1, 0x2305, 0, &[0x0F]);
    for unit in 1..=4 {
        let _ = try_write(&mut bus, 1, 0x2301, unit, &[1]);
    }
    nmt(&mut bus, 1);
    run(&mut bus);
}

/// E34.
#[test]
fn a_cyclic_timer_of_a_millisecond_leaves_room() {
    let mut bus = bus(50, Personality::Encoder, Motion { speed: 4, ..Motion::default() });
    write(&mut bus, 1, 0x6200, 0, &1_u16.to_le_bytes());
    nmt(&mut bus, 1);
    run(&mut bus);
}

/// Events are no exception: an event timer repeats them.
#[test]
fn event_timers_of_a_millisecond_on_all_tpdos_of_a_lift_leave_room() {
    for kbit in [10, 50, 250] {
        let mut bus = bus(kbit, Personality::Lift, Motion { noise: 500, ..Motion::default() });
        write(&mut bus, 1, 0x2305, 0, &[0x0F]);
        for communication in [0x1801, 0x1881, 0x1901, 0x1906, 0x1907, 0x1980, 0x1981] {
            write(&mut bus, 1, communication, 5, &1_u16.to_le_bytes());
        }
        nmt(&mut bus, 1);
        run(&mut bus);
    }
}
