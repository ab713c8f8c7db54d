//! The indicators RUN and ERROR of CiA 303-3, at their pins.

use canbus::Time;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, running, unwatched, world, write};

/// The pins of the NUCLEO (crates/bsp/src/boards/nucleo_f446re.rs).
const PINS: [u32; 2] = [0, 1];
/// The looks of this test are 5 ms apart.
const SLACK: u64 = 10;

/// For RUN and ERROR: the shares of 12 s in which they are on, in percent, and the longest time without a change in ms.
fn watch(world: &mut World) -> [(u64, u64); 2] {
    const LOOKS: u64 = 2400;
    let (mut on, mut longest, mut since, mut last) = ([0; 2], [0; 2], [0; 2], [false; 2]);
    for look in 0..LOOKS {
        world.run_until(world.now() + Time::from_millis(5));
        for (at, pin) in PINS.into_iter().enumerate() {
            let is_on = world.machine(0).peripherals().output('B', pin) == Some(true);
            on[at] += u64::from(is_on);
            if is_on != last[at] {
                (last[at], since[at]) = (is_on, look);
            }
            longest[at] = longest[at].max((look - since[at]) * 5);
        }
    }
    [0, 1].map(|at| (on[at] * 100 / LOOKS, longest[at]))
}

fn assert_near(what: &str, (on, longest): (u64, u64), (share, span): (u64, u64)) {
    assert!(on.abs_diff(share) <= 3, "{what}: on for {on} % instead of {share} %");
    assert!(longest.abs_diff(span) <= SLACK, "{what}: {longest} ms without a change instead of {span} ms");
}

/// The shares and times of the patterns.
const BLINKING: (u64, u64) = (50, 200);
const SINGLE: (u64, u64) = (17, 1000);
const DOUBLE: (u64, u64) = (25, 1000);
const FLICKERING: (u64, u64) = (50, 50);
const OFF: (u64, u64) = (0, 12_000 - 5);
const ON: (u64, u64) = (100, 12_000 - 5);

#[test]
fn run_shows_the_nmt_state() {
    let mut world = running();
    let master = Master::join(&mut world);
    for (command, run) in [([128, 1], BLINKING), ([2, 1], SINGLE), ([1, 1], ON)] {
        master.send(&mut world, START_ALL.0, &command);
        world.run_until(world.now() + Time::from_millis(100));
        let [seen, error] = watch(&mut world);
        assert_near(&format!("RUN after command {}", command[0]), seen, run);
        assert_near("ERROR", error, OFF);
    }
}

#[test]
fn both_flicker_while_the_bit_rate_is_detected() {
    let mut world = world("--bitrate 500 --node 1:pressure@auto");
    world.run_until(SECOND);
    let [run, error] = watch(&mut world);
    assert_near("RUN", run, FLICKERING);
    assert_near("ERROR", error, FLICKERING);
}

#[test]
fn error_shows_a_missing_heartbeat() {
    let mut world = running();
    let master = Master::join(&mut world);
    // The heartbeat of node 9 within 100 ms; it comes once.
    write(&mut world, &master, (0x1016, 1), 4, 9 << 16 | 100);
    master.send(&mut world, 0x709, &[5]);
    world.run_until(world.now() + Time::from_millis(500));
    let [_, error] = watch(&mut world);
    assert_near("ERROR without the heartbeat", error, DOUBLE);
    master.send(&mut world, 0x709, &[5]);
    write(&mut world, &master, (0x1016, 1), 4, 0);
    world.run_until(world.now() + Time::from_millis(500));
    let [_, error] = watch(&mut world);
    assert_near("ERROR with the heartbeat", error, OFF);
}

#[test]
fn error_is_on_in_bus_off() {
    // The monitor of the bus would report the missing heartbeats.
    let mut world = unwatched("bootloader", "--bitrate 1000");
    world.run_until(SECOND);
    world.bus().faults.noise(1, 1.0);
    world.run_until(world.now() + SECOND);
    let [_, error] = watch(&mut world);
    assert!(error.0 > 90, "bus-off: on for {} %", error.0);
}
