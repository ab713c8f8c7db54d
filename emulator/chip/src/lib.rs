//! Register-level models of the STM32F4 peripherals that the node uses.

mod access;
pub mod can;
mod clocks;
mod dbgmcu;
mod flash;
mod gpio;
mod lane;
mod map;
mod peripherals;
mod pwr;
mod rcc;
mod register;
mod stm32f4;
mod syscfg;
mod timer;
mod unmodelled;
mod variant;

pub use clocks::Clocks;
pub use peripherals::{BusFault, Effect, IrqLines, Memory, Peripherals};
pub use rcc::Rcc;
pub use stm32f4::{Board, Stm32f4};
pub use unmodelled::{Direction, Reason, Unmodelled};
pub use variant::{FLASH_BASE, Variant};
