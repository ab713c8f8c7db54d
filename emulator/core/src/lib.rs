//! An emulated Cortex-M4 with its NVIC that runs ELF files in virtual time.

mod context;
mod core;
mod cost;
mod engine;
mod exception;
mod fault;
mod loader;
mod machine;
mod mechanism;
mod nvic;
mod ppb;
mod scb;
mod stats;
mod systick;

pub use exception::Exception;
pub use fault::Fault;
pub use loader::{Image, Segment};
pub use machine::{Error, Incident, Machine, Model, RAM_PATTERN, Stop};
pub use mechanism::Mechanism;
pub use stats::{Activity, Stats};
