//! One CANopen sensor node. Its whole state is in two values that belong to two priorities of the firmware.
//!
//! [`Protocol`] is the CANopen device, [`Measurement`] the sampling half of its profile. Once a millisecond a
//! [`Snapshot`] goes from the measurement to the protocol; [`Parameters`] go the other way when they have changed. Each
//! is one consistent set of values. Measuring and the behaviour of the profile objects are in the crate `profiles`.
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
mod device_value;
pub mod fault;
mod faults;
mod identity;
mod lost_events;
mod memory;
mod packed;
mod position_record;
mod protocol;
mod self_test;
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
pub use device_value::{log_event, stored_log};
pub use fault::FAULTS;
pub use identity::Identity;
pub use memory::{EraseBudget, MemoryState, ParameterMemory};
pub use position_record::StoredPositionRecord;
pub use profiles::fault::Fault;
pub use profiles::{Measurement, Parameters, Personality, Snapshot};
pub use protocol::Protocol;
pub use setup::Setup;
pub use store_job::StoreJob;
pub use trial::Verdict;
