//! What the core has to know of the chip around it.

use std::ops::Range;

/// The memories of a chip and the clock that it starts with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Model {
    /// The flash array, also seen at address 0 (boot from main flash, RM0390 section 2.4).
    pub flash: Range<u32>,
    /// RAM; every range is a multiple of 4 KiB.
    pub ram: Vec<Range<u32>>,
    /// What the peripherals answer besides 4000_0000h..6000_0000h, in multiples of 4 KiB: system memory with the
    /// unique identifier, option bytes.
    pub windows: Vec<Range<u32>>,
    /// The core clock after reset, in hertz.
    pub reset_clock: u64,
}

impl Model {
    /// Length of the flash array in bytes.
    pub fn flash_size(&self) -> usize {
        (self.flash.end - self.flash.start) as usize
    }
}
