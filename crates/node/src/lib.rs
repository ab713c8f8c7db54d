//! One CANopen sensor node: everything that is its state, in two values that two priorities of the firmware own.
//!
//! [`Protocol`] is the CANopen device, [`Measurement`] the sampling half of its profile. A [`Snapshot`] goes from the second
//! to the first once a millisecond, [`Parameters`] go back when they have changed; each is one consistent set of values.
//! Measuring, and the meaning of the profile objects, are in the crate `profiles`.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
// Nothing that comes from the bus or from the flash may panic or index out of range.
#![cfg_attr(
    not(test),
    warn(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

mod application;
mod authorisation;
mod configured;
pub mod fault;
mod faults;
mod identity;
mod lasting;
mod lost_events;
mod packed;
mod protocol;
mod setup;
mod store_job;
mod stored;
mod storing;
mod transfer_buffer;
mod trial;

pub use application::LOST_EVENTS;
pub use canopen::lss::BitRate;
pub use canopen::nmt::State;
pub use canopen::{Action, BusEvent, Frame, Instant, Next, NodeId, QueueFull, Transmit};
pub use fault::FAULTS;
pub use identity::Identity;
pub use lasting::LastingRecord;
pub use profiles::fault::Fault;
pub use profiles::{Measurement, Parameters, Personality, Snapshot};
pub use protocol::Protocol;
pub use setup::Setup;
pub use store_job::StoreJob;
pub use trial::Verdict;
