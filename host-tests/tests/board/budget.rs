//! What the application may take. Its slot has 127.5 KiB of flash: the rest is for what it grows by in the field.

use crate::support::{SECOND, world};

const KIB: u32 = 1024;
const FLASH: u32 = 112 * KIB;
/// Of variables; the stack has 20 KiB of its own.
const RAM: u32 = 28 * KIB;

#[test]
fn the_application_keeps_to_its_budget() {
    let mut world = world("--bitrate 1000");
    world.run_until(SECOND);
    let memory = world.summary(1.0, 0).nodes[0].memory;
    println!("application: {} bytes of flash, budget {FLASH}", memory.flash);
    println!("application: {} bytes of RAM, budget {RAM}, and {} of stack", memory.ram, memory.stack);
    assert!(memory.flash > 0 && memory.flash <= FLASH);
    assert!(memory.ram > 0 && memory.ram <= RAM);
}
