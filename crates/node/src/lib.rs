//! One CANopen sensor node: everything that is its state, in two values that two priorities of the firmware own.
//!
//! [`Protocol`] is the CANopen device, [`Measurement`] the sampling chain. A [`Snapshot`] goes from the second to the
//! first once a millisecond, [`Parameters`] go back when they have changed; each is one consistent set of values.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

pub mod combined;
mod communication;
mod configured;
mod dictionaries;
pub mod encoder;
mod fault;
mod faults;
mod flags;
mod keeping;
pub mod lift;
mod lost_events;
mod manufacturer;
mod measurement;
mod parcel;
mod personality;
pub mod pressure;
mod profile;
mod protocol;
mod setup;
mod stored;
mod transfer_buffer;

pub use canopen::lss::BitRate;
pub use canopen::nmt::State;
pub use canopen::{Action, BusEvent, Frame, Instant, Next, NodeId, QueueFull, Transmit};
pub use fault::Fault;
pub use lost_events::LOST_EVENTS;
pub use measurement::{Measurement, Parameters, Snapshot};
pub use parcel::Parcel;
pub use personality::Personality;
pub use profiles::encoder::{
    Board as EncoderBoard, ChannelParameters as EncoderChannel, Frame as SsiFrame, Kept, RawEncoder, Start,
};
pub use profiles::pressure::{FactoryCalibration, RawSample};
pub use protocol::Protocol;
pub use setup::{REVISION, Setup, VENDOR_ID};
