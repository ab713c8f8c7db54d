//! Board support: all code that accesses registers of the STM32F4, and the only crate with `unsafe`.
//!
//! Logic without registers (bit timing, filter packing, the transmit queue, the extension of the counter, oversampling,
//! supervision, the crash record, the copies in the backup SRAM, the counts of lost events) has modules of its own,
//! which are tested on the host. The modules below `hardware` are built for the target only.
#![no_std]
// Only for the host, which has the modules without hardware: all other code cuts values to the width of a register.
#![cfg_attr(not(target_os = "none"), warn(clippy::pedantic))]
#![deny(unsafe_code, clippy::undocumented_unsafe_blocks)]

pub mod back_off;
pub mod backup_copies;
pub mod battery;
pub mod bit_rate_detection;
pub mod bit_timing;
pub mod boards;
pub mod bus_state;
pub mod chip_thermometer;
pub mod crash_record;
pub mod debounce;
pub mod extension;
pub mod filters;
pub mod flash_area;
pub mod guest;
pub mod handover;
pub mod losses;
pub mod mailbox;
pub mod oversampling;
pub mod reset_cause;
pub mod sectors;
pub mod serial_number;
pub mod ssi_word;
pub mod step;
pub mod supervision;
pub mod transmit_queue;
pub mod update_layout;
pub mod vectors;

#[cfg(target_os = "none")]
#[expect(unsafe_code, reason = "registers, memory by its address, the fault handler")]
mod hardware;

#[cfg(target_os = "none")]
pub use hardware::*;
