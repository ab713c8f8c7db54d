//! Register-level models of the STM32F4 peripherals that the node uses, and of the world around them.
//!
//! [`Stm32f4`] is the chip without its core. A core drives the chip through [`Peripherals`]. A test or simulator
//! connects the [`can`] controllers, changes the quantities that the sensors measure ([`plant`]) and injects faults.
//!
//! | file | contents |
//! |---|---|
//! | `map`, `access`, `lane` | addresses: which peripheral answers, whether it is clocked, narrow accesses |
//! | `stm32f4`, `schedule`, `clock_and_reset` | the peripherals together: time, interrupt lines, clocks, resets |
//! | `converter`, `pins` | links of peripherals: timer to ADC to DMA to memory; encoders and buttons to their pins |
//! | one file or folder each | the peripherals, which do not depend on each other |
//! | `rules` | limits that silicon enforces: clocks, wait states, pins, sampling times |
//! | `loss` | events that a test makes the chip lose |
//! | `plant` | pressure, temperature, shaft, buttons, faults and the board's analogue front end |
//!
//! No model is stepped: a peripheral computes its state at the instant of an access from its state at the last access,
//! and `deadline` returns the next instant at which a change is visible without an access. An access that a model
//! cannot answer as silicon would is recorded: [`Stm32f4::unmodelled`].
//!
//! The images do not use these peripherals of the chip: RTC, WWDG, TIM1 and TIM8, ADC2 and ADC3, DAC, USARTs, I2C, SAI,
//! SDIO, USB, DCMI, CEC, FMC, QUADSPI and the power-down modes. They have a name in the map, but no model.

mod access;
mod adc;
mod backup_ram;
mod board;
mod breach;
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
pub mod random;
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

pub use board::ButtonPin;
pub use board::{BUTTONS, Board, FrontEnd, SsiFormat, SsiFormatError};
pub use breach::Breach;
pub use clocks::Clocks;
pub use flash::Flash;
pub use loss::Loss;
pub use peripherals::{BusFault, Effect, FlashAccess, IrqLines, Memory, Peripherals};
pub use stm32f4::Stm32f4;
pub use unmodelled::{Direction, Reason, Unmodelled};
pub use variant::{FLASH_BASE, Variant};
