//! Register-level models of the STM32F4 peripherals that the node uses.

mod peripherals;

pub use peripherals::{BusFault, Effect, IrqLines, Memory, Peripherals};
