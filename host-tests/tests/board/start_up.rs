//! The duration of a start: from power-on to the boot-up message.
//!
//! `cargo test --profile sim -p host-tests --features board --test board -- start_up --nocapture` prints the times.

use canbus::Time;
use emulator::Estimate;
use sim::world::World;

use crate::support::{Master, SECOND, world};

/// The parameter pages (memory.x).
const PAGES: u32 = 0x0800_8000;
const SIZE: usize = 0x8000;

/// Switches the power off and on, and returns the time until the boot-up message is on the bus.
fn boot_up(world: &mut World) -> Time {
    let now = world.now();
    world.machine(0).power_off();
    world.machine(0).power_on(now);
    until_boot_up(world, now)
}

fn until_boot_up(world: &mut World, start: Time) -> Time {
    world.take_frames();
    world.run_until(start + SECOND * 2);
    let boot_up = crate::support::frame(0x701, &[0]);
    let first = world.take_frames().into_iter().find(|sent| sent.frame == boot_up);
    first.expect("a boot-up message").at.since(start)
}

/// NMT reset node: the power stays on, so the earlier check of the application is still valid.
fn reset(world: &mut World, master: &Master) -> Time {
    let now = world.now();
    master.send(world, 0, &[0x81, 1]);
    until_boot_up(world, now)
}

/// Changes a bit of the last stored record.
fn damage(world: &mut World) {
    let mut pages = vec![0; SIZE];
    world.machine(0).read(PAGES, &mut pages).unwrap();
    // The commit word and the closing mark follow the last record.
    let at = pages.iter().rposition(|&byte| byte != 0xFF).unwrap() - 8;
    world.machine(0).write(PAGES + u32::try_from(at).unwrap(), &[pages[at] ^ 1]).unwrap();
}

/// Prints the times of a start, and checks them against their limits.
fn start(personality: &str, rate: u32, estimate: Estimate) -> (World, Master) {
    let mut world = world(&format!("--bitrate {rate} --node 1:{personality} --cycles {estimate}"));
    let master = Master::join_at(&mut world, rate * 1000);
    world.run_until(SECOND);
    let after_power_on = boot_up(&mut world);
    let after_reset = reset(&mut world, &master);
    let [power_on, again] = [after_power_on, after_reset].map(|time| time.as_micros() as f64 / 1e3);
    println!(
        "{personality} at {rate} kbit/s, {estimate}: boot-up {power_on:.1} ms after power-on, {again:.1} ms after a reset"
    );
    // The signature of the application is checked twice.
    let limit = if estimate == Estimate::Worst { 450 } else { 300 };
    assert!(after_power_on < Time::from_millis(limit), "{personality} at {rate} kbit/s: {after_power_on:?}");
    assert!(after_reset < Time::from_millis(100), "{personality} at {rate} kbit/s: {after_reset:?}");
    (world, master)
}

#[test]
fn the_boot_up_message_comes_soon_after_power_on() {
    for rate in [1000, 250, 10] {
        for personality in ["pressure", "encoder", "combined", "lift"] {
            start(personality, rate, Estimate::Modelled);
        }
        start("pressure", rate, Estimate::Best);
        start("pressure", rate, Estimate::Worst);
    }
}

#[test]
fn a_damaged_page_costs_its_erasure() {
    let (mut world, master) = start("pressure", 250, Estimate::Modelled);
    master.ask(&mut world, 1, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']);
    damage(&mut world);
    let time = boot_up(&mut world);
    println!("with a damaged page: {:.0} ms", time.as_micros() as f64 / 1e3);
    assert!(time < Time::from_millis(700), "with a damaged page: {time:?}");
}
