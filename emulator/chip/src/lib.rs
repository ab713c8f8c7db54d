//! Register-level models of the STM32F4 peripherals that the node uses, and of the world around them.
//!
//! [`Stm32f4`] is the chip without its core. A core drives it through [`Peripherals`]; the world reaches its
//! [`can`] controllers, changes what its sensors see ([`plant`]) and breaks things.
//!
//! | file | what it holds |
//! |---|---|
//! | `map`, `access`, `lane` | addresses: which peripheral answers, whether it is clocked, narrow accesses |
//! | `stm32f4`, `schedule`, `clock_and_reset` | the peripherals together: time, interrupt lines, clocks, resets |
//! | `converter`, `pins` | what crosses peripherals: timer to ADC to DMA to memory; encoders and buttons to their pins |
//! | one file or folder each | the peripherals, which know nothing of each other |
//! | `rules` | what silicon does not forgive: clocks, wait states, pins, sampling times |
//! | `loss` | events that a test has the chip lose |
//! | `plant` | pressure, temperature, shaft, buttons, faults and the board's analogue front end |
//!
//! Nothing is stepped: a peripheral computes its state at the instant of an access from its state at the last one, and
//! `deadline` tells when something can be seen without an access. An access that the models cannot answer as silicon
//! would is on record: [`Stm32f4::unmodelled`].
//!
//! Of the chip's peripherals the images do not use RTC, WWDG, TIM1 and TIM8, ADC2 and ADC3, DAC, USARTs, I2C, SAI, SDIO,
//! USB, DCMI, CEC, FMC, QUADSPI and the power-down modes: these have a name in the map and no model.

mod access;
mod adc;
mod backup_ram;
mod board;
pub mod can;
mod clock_and_reset;
mod clocks;
mod converter;
mod crc_unit;
mod dbgmcu;
mod dma;
mod exti;
mod flash;
mod gpio;
mod iwdg;
mod lane;
mod loss;
mod map;
mod peripherals;
mod pins;
pub mod plant;
mod pwr;
mod rcc;
mod register;
mod rules;
mod schedule;
mod signature;
mod spi;
mod stm32f4;
mod syscfg;
mod timer;
mod unmodelled;
mod variant;

pub use board::{Board, SsiFormat};
pub use clocks::Clocks;
pub use flash::Flash;
pub use loss::Loss;
pub use peripherals::{BusFault, Effect, FlashAccess, IrqLines, Memory, Peripherals};
pub use rules::Breach;
pub use stm32f4::Stm32f4;
pub use unmodelled::{Direction, Reason, Unmodelled};
pub use variant::{FLASH_BASE, Variant};
