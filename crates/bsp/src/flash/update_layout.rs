//! Memory layout of an update: the regions `SECURITY`, `WEAR`, `IMAGE_HEADER`, `APPLICATION`, `STAGING` and `KEPT` of memory.x.

use update::{Area, Layout};

const KIB: u32 = 1024;

/// The first quarter of sector S4 of every STM32F4 with 512 KiB or more (RM0390, 3.3). The sector is never erased.
const SECURITY: Area = Area::new(64 * KIB, &[16 * KIB]);
/// The rest of that sector: a word for each erase, 12,288.
const WEAR: Area = Area::new(80 * KIB, &[48 * KIB]);
/// Sectors S5, S6 and S7.
const APPLICATION: Area = Area::new(128 * KIB, &[128 * KIB]);
const STAGING: Area = Area::new(256 * KIB, &[128 * KIB]);
const KEPT: Area = Area::new(384 * KIB, &[128 * KIB]);

/// The areas of an update.
pub const LAYOUT: Layout = match Layout::new(SECURITY, WEAR, APPLICATION, STAGING, KEPT) {
    Some(layout) => layout,
    None => panic!("an area is too small"),
};
