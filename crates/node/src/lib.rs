//! One CANopen sensor node: everything that is its state, in two values that two priorities of the firmware own.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

mod measurement;
mod protocol;
mod setup;
mod signal;

pub use canopen::{Frame, Instant, NodeId, QueueFull, Transmit};
pub use measurement::{Measurement, Parameters, Snapshot};
pub use profiles::pressure::{FactoryCalibration, RawSample};
pub use protocol::Protocol;
pub use setup::{Personality, REVISION, Setup, VENDOR_ID};
pub use signal::{BusEvent, Request};
