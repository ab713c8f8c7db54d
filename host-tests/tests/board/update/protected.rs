//! A board with a write-protected bootloader and a flash that cannot be read, as `cargo xtask protect` leaves it.

use canbus::Time;
use chip::{BusFault, Peripherals};
use protect::{OptionBytes, Registers, current, program};

use super::bench::{version_a, version_b};
use super::fleet::{Shared, boards, update};
use crate::support::SECOND;

/// Sectors 0 and 1.
const BOOTLOADER: usize = 32 * 1024;

/// A debug probe on the first board, which keeps running.
struct Probe<'a>(&'a Shared);

impl Probe<'_> {
    /// The duration of an access by a fast probe.
    fn pause(&self) {
        let mut world = self.0.borrow_mut();
        let next = world.now() + Time::from_millis(20);
        world.run_until(next);
    }
}

impl Registers for Probe<'_> {
    type Error = BusFault;

    fn read(&mut self, address: u32) -> Result<u32, BusFault> {
        self.pause();
        let mut world = self.0.borrow_mut();
        let now = world.now();
        world.machine(0).peripherals_mut().read(address, 4, now)
    }

    fn write(&mut self, address: u32, value: u32) -> Result<(), BusFault> {
        self.pause();
        let mut world = self.0.borrow_mut();
        let now = world.now();
        world.machine(0).peripherals_mut().write(address, 4, value, now)
    }
}

#[test]
fn a_protected_board_is_updated_to_b_and_back() {
    let world = boards(1);
    let before = world.borrow_mut().machine(0).flash();
    program(&mut Probe(&world), OptionBytes::FACTORY.with_bootloader(true).with_read_out(true)).unwrap();
    // The protection of the flash takes effect at power-on.
    let now = world.borrow().now();
    world.borrow_mut().machine(0).power_off();
    world.borrow_mut().machine(0).power_on(now);
    world.borrow_mut().run_until(now + SECOND);
    for image in [version_b(0), version_a()] {
        let reports = update(&world, "1", &image, None);
        assert_eq!(reports[0]["new_identification"], image.header.code_crc());
        assert!(current(&mut Probe(&world)).unwrap().keeps_bootloader());
    }
    assert!(world.borrow_mut().machine(0).flash()[..BOOTLOADER] == before[..BOOTLOADER]);
}
