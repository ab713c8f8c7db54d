//! A register-level STM32F4 that runs the node's ELF files in virtual time.

mod peripherals;

pub use peripherals::{BusFault, Effect, IrqLines, Memory, Peripherals};
