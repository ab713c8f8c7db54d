//! An emulated Cortex-M4 with its NVIC that runs ELF files in virtual time.
//!
//! A [`Machine`] is the core, its memory and the [`chip::Peripherals`] around it. Instructions are carried out by the
//! CPU library; everything of the architecture around them is here, one idea a module: exception entry and return,
//! the interrupt controller, the system control space, and time, which passes block by block at the cost that
//! `costs` models. Given the same image and the same peripherals, a run is the same bit for bit.

mod bitband;
mod clock;
mod core;
mod costs;
mod dwt;
mod error;
mod exception;
mod exceptions;
mod fault;
mod hooks;
mod incident;
mod loader;
mod machine;
mod mechanism;
mod memory;
mod model;
mod nvic;
mod ppb;
mod registers;
mod scb;
mod stats;
mod system;
mod systick;
mod trace;

pub use error::Error;
pub use exception::Exception;
pub use fault::Fault;
pub use incident::{FaultReport, Incident};
pub use loader::{Image, Segment};
pub use machine::{Machine, RAM_PATTERN, Stop};
pub use mechanism::Mechanism;
pub use model::Model;
pub use stats::{Activity, Stats};
