//! How long a start takes: from power-on to the boot-up message.
//!
//! `cargo test --profile sim -p host-tests --features board --test board -- start_up --nocapture` prints the times.

use canbus::Time;
use sim::world::World;

use crate::support::{Master, SECOND, world};

/// The parameter pages (memory.x).
const PAGES: u32 = 0x0800_8000;
const SIZE: usize = 0x8000;

/// Switches the power off and on, and gives the time until the boot-up message is on the bus.
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

/// NMT reset node: the power stays, and what was proven of the application.
fn reset(world: &mut World, master: &Master) -> Time {
    let now = world.now();
    master.send(world, 0, &[0x81, 1]);
    until_boot_up(world, now)
}

/// Changes a bit of the last record that is stored.
fn damage(world: &mut World) {
    let mut pages = vec![0; SIZE];
    world.machine(0).read(PAGES, &mut pages).unwrap();
    // Behind the last record are the commit word and the closing mark.
    let at = pages.iter().rposition(|&byte| byte != 0xFF).unwrap() - 8;
    world.machine(0).write(PAGES + u32::try_from(at).unwrap(), &[pages[at] ^ 1]).unwrap();
}

#[test]
fn the_boot_up_message_comes_soon_after_power_on() {
    for rate in [1000, 250, 10] {
        for personality in ["pressure", "encoder", "combined", "lift"] {
            let mut world = world(&format!("--bitrate {rate} --node 1:{personality}"));
            let master = Master::join_at(&mut world, rate * 1000);
            world.run_until(SECOND);
            let time = boot_up(&mut world);
            println!(
                "{personality} at {rate} kbit/s: boot-up {:.1} ms after power-on",
                time.as_micros() as f64 / 1e3
            );
            // The signature of the application is checked.
            assert!(time < Time::from_millis(300), "{personality} at {rate} kbit/s: {time:?}");
            let time = reset(&mut world, &master);
            println!("after a reset: {:.1} ms", time.as_micros() as f64 / 1e3);
            assert!(time < Time::from_millis(100), "{personality} at {rate} kbit/s: {time:?}");
            if (rate, personality) == (250, "pressure") {
                master.ask(&mut world, 1, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']);
                damage(&mut world);
                let time = boot_up(&mut world);
                println!("with a damaged page: {:.0} ms", time.as_micros() as f64 / 1e3);
                assert!(time < Time::from_millis(700), "with a damaged page: {time:?}");
            }
        }
    }
}
