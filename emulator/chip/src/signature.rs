//! The electronic signature in system memory: unique identifier, flash size and factory calibration
//! (RM0390 section 34, DS10693, calibration values).

use crate::plant::front_end::{TS_CAL1, TS_CAL2, VREFIN_CAL};
use crate::variant::Variant;

/// Address of the unique identifier, the begin of this block.
pub(crate) const BASE: u32 = 0x1FFF_7A10;

/// The word at `offset` from the unique identifier.
pub(crate) fn read(variant: Variant, unique_id: [u32; 3], offset: u32) -> Option<u32> {
    let high = |half_word: u32| half_word << 16 | 0xFFFF;
    match offset {
        0x00 | 0x04 | 0x08 => Some(unique_id[offset as usize / 4]),
        // The size, in KiB, is the half-word at 1FFF 7A22h.
        0x10 => Some(high(variant.flash_size() / 1024)),
        0x18 => Some(high(VREFIN_CAL.into())),
        0x1C => Some(u32::from(TS_CAL2) << 16 | u32::from(TS_CAL1)),
        _ => None,
    }
}
