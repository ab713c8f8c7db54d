//! Where an update puts things: the regions `IMAGE_HEADER`, `APPLICATION` and `STAGING` of memory.x.

use update::{Area, Layout};

const KIB: u32 = 1024;

/// Sectors S4 and S5, S6 and S7 of every STM32F4 with 512 KiB or more (RM0390, 3.3). The bootloader and the parameters lie
/// before them.
const APPLICATION: Area = Area::new(64 * KIB, &[64 * KIB, 128 * KIB]);
const STAGING: Area = Area::new(256 * KIB, &[128 * KIB, 128 * KIB]);

/// The areas of an update.
pub const LAYOUT: Layout = match Layout::new(APPLICATION, STAGING) {
    Some(layout) => layout,
    None => panic!("staging is too small"),
};
