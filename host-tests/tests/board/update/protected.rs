//! A board with a write-protected bootloader and a flash that cannot be read, as `cargo xtask protect` leaves it.

use programmer::protect::{OptionBytes, current, program};
use workbench::bringup::Probe;

use super::bench::{version_a, version_b};
use super::fleet::{boards, update};
use crate::support::SECOND;

/// Sectors 0 and 1.
const BOOTLOADER: usize = 32 * 1024;

#[test]
fn a_protected_board_is_updated_to_b_and_back() {
    let world = boards(1);
    let before = world.borrow_mut().machine(0).flash();
    program(
        &mut Probe(&mut world.borrow_mut()),
        OptionBytes::FACTORY.with_bootloader(true).with_read_out(true),
    )
    .unwrap();
    // The protection of the flash takes effect at power-on.
    let now = world.borrow().now();
    world.borrow_mut().machine(0).power_off();
    world.borrow_mut().machine(0).power_on(now);
    world.borrow_mut().run_until(now + SECOND);
    for image in [version_b(0), version_a()] {
        let reports = update(&world, "1", &image, None);
        assert_eq!(reports[0]["new_identification"], image.header.code_crc());
        assert!(current(&mut Probe(&mut world.borrow_mut())).unwrap().keeps_bootloader());
    }
    assert!(world.borrow_mut().machine(0).flash()[..BOOTLOADER] == before[..BOOTLOADER]);
}
