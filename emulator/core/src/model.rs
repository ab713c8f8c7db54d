//! The memory map of the chip, and the errors of a machine.

use std::ops::Range;

use thiserror::Error as ThisError;
use unicorn_engine::uc_error;

/// The memory of a chip.
#[derive(Clone, Debug)]
pub struct Model {
    /// The flash array.
    pub flash: Range<u32>,
    /// The RAM.
    pub ram: Range<u32>,
    /// The addresses that belong to the chip's registers instead of memory.
    pub peripherals: Vec<Range<u32>>,
}

impl Model {
    /// An STM32F4 with 128 KiB of RAM and this much flash.
    pub fn stm32f4(flash: u32) -> Model {
        Model {
            flash: 0x0800_0000..0x0800_0000 + flash,
            ram: 0x2000_0000..0x2002_0000,
            // The peripherals of all buses, and the system memory with identification and calibration.
            peripherals: vec![0x1FFF_0000..0x1FFF_8000, 0x4000_0000..0x4008_0000, 0x5000_0000..0x5006_1000],
        }
    }
}

/// An error of a machine.
#[derive(Debug, ThisError)]
pub enum Error {
    /// The ELF file is not a program for this chip.
    #[error("{0}")]
    Elf(String),
    /// The CPU library refused.
    #[error("the CPU library failed: {0:?}")]
    Cpu(uc_error),
}

impl From<uc_error> for Error {
    fn from(error: uc_error) -> Error {
        Error::Cpu(error)
    }
}
