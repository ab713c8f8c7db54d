//! Identity of the product, object 1018h, for firmware, bootloader, data sheets and signed images. Change this file to
//! build a product of your own.

/// Vendor-ID, 1018h:1. 0 means no vendor: insert the vendor-ID that CiA has assigned to you.
pub const VENDOR_ID: u32 = 0;

/// Revision number, 1018h:3: major in the high word, minor in the low word.
pub const REVISION: u32 = 0x0001_0000;

/// Product code, 1018h:2, of a personality by its number (object 2000h).
#[must_use]
pub const fn code(personality: u8) -> u32 {
    personality as u32 + 1
}

/// Board code, 2004h:1 and in the header of an image. An image has all personalities, so it is made for a board and not
/// for a product. Boards that cannot run each other's images need different codes.
pub const BOARD: u32 = 0x0446_0001;
