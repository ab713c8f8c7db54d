//! A broken rule of the chip fails the run and names the place in the source. All other board tests run with all rules
//! on.

use chip::Peripherals;
use emulator::{Access, Bug};

use crate::support::{SECOND, world};

/// FLASH_ACR, RM0390 section 3.8.1.
const FLASH_ACR: u32 = 0x4002_3C00;

/// A firmware without wait states.
fn without_wait_states() -> sim::world::World {
    let mut world = world("--bitrate 1000");
    world.run_until(SECOND);
    let now = world.machine(0).now();
    world.machine(0).peripherals_mut().write(FLASH_ACR, 4, 0, now).unwrap();
    world
}

#[test]
#[should_panic(expected = "a rule of the chip is broken: 1.000")]
fn a_broken_rule_fails_the_run() {
    without_wait_states().run_until(SECOND + SECOND);
}

#[test]
fn a_broken_rule_is_reported_with_its_place_in_the_source() {
    let mut world = world("--bitrate 1000");
    let access = Access::Wrong { bits: 0xF, value: 0 };
    world.machine(0).seed(Bug { register: FLASH_ACR, access });
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| world.run_until(SECOND + SECOND)));
    let message = *outcome.unwrap_err().downcast::<String>().unwrap();
    assert!(message.contains("0 wait states of the flash at 144000000 Hz; it needs 4"), "{message}");
    assert!(message.contains("crates/bsp/src/start/clock_tree.rs:"), "the program's own line: {message}");
    let summary = world.summary(1.0, 0);
    assert!(summary.has_broken_rules() && summary.nodes[0].broken_rules.len() == 1, "{summary}");
}
