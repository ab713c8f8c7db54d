//! What the core has to know of the chip around it.

use std::ops::Range;

/// The memories of a chip; what is neither memory nor of the core belongs to its peripherals.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Model {
    /// The flash array, also seen at address 0 (boot from main flash; RM0390, section 2.4).
    pub flash: Range<u32>,
    /// The RAM.
    pub ram: Range<u32>,
    /// What the peripherals answer besides 4000_0000h..6000_0000h, in multiples of 4 KiB.
    pub windows: Vec<Range<u32>>,
    /// The core clock after reset, in hertz.
    pub reset_clock: u64,
}

impl Model {
    /// An STM32F4 with this much flash and 128 KiB of RAM; its system memory holds identification and calibration.
    pub fn stm32f4(flash: u32) -> Model {
        Model {
            flash: 0x0800_0000..0x0800_0000 + flash,
            ram: 0x2000_0000..0x2002_0000,
            windows: vec![0x1FFF_0000..0x2000_0000],
            reset_clock: 16_000_000,
        }
    }

    /// Length of the flash array in bytes.
    pub(crate) fn flash_size(&self) -> usize {
        (self.flash.end - self.flash.start) as usize
    }
}
