//! bxCAN: bit timing, filters, both queues, and the controller.

pub mod bit_timing;
pub mod bus_state;
pub mod filters;
pub mod mailbox;
pub mod transmit_queue;

#[cfg(target_os = "none")]
pub(crate) mod controller;
#[cfg(target_os = "none")]
pub(crate) mod receive;
#[cfg(target_os = "none")]
pub(crate) mod transmit;

#[cfg(target_os = "none")]
pub use controller::{Controller, acknowledge_error};
