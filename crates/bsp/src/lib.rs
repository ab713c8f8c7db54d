//! Board support: all code that accesses registers of the STM32F4, and the only crate with `unsafe`.
//!
//! One folder for each peripheral. Logic without registers (bit timing, filter packing, the transmit queue, the extension
//! of the counter, oversampling, the crash record, the copies in the backup SRAM) stands beside the code with registers,
//! and is tested on the host. Code with registers is built for the target only; a file with `unsafe` says what for.
#![no_std]
// Only for the host, which has the modules without hardware: all other code cuts values to the width of a register.
#![cfg_attr(not(target_os = "none"), warn(clippy::pedantic))]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![deny(unsafe_code, clippy::undocumented_unsafe_blocks)]

pub mod analog;
pub mod boards;
pub mod can;
pub mod chip;
pub mod flash;
#[cfg(target_os = "none")]
mod front_end;
pub mod losses;
pub mod pins;
pub mod policy;
pub mod position;
pub mod power;
#[cfg(target_os = "none")]
pub mod start;
pub mod time;
#[cfg(target_os = "none")]
mod watchdog;

#[cfg(target_os = "none")]
mod programs {
    pub use stm32f4xx_hal::pac;

    pub use crate::analog::sampling::Sums;
    pub use crate::can::receive::{Frames, ReceiveQueue, Received, Receiver};
    pub use crate::can::transmit::Transmitter;
    pub use crate::chip::errata::{TaskEnd, sleep};
    pub use crate::flash::parameter_flash::ParameterFlash;
    pub use crate::flash::program_flash::ProgramFlash;
    pub use crate::flash::trial_flash::TrialFlash;
    pub use crate::front_end::{FrontEnd, Reading};
    pub use crate::pins::digital::{Buttons, Lamps};
    pub use crate::position::encoder::Counted;
    pub use crate::position::ssi::Ssi;
    pub use crate::power::backup::BackupMemory;
    pub use crate::start::board::Board;
    pub use crate::time::time_base::{Alarm, Clock, Ring, TimeInterrupt};
    pub use crate::watchdog::{StartUpWatchdog, Watchdog};
    // The logger of every image.
    use defmt_rtt as _;
}
#[cfg(target_os = "none")]
pub use programs::*;
