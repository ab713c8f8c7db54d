//! Sans-IO CANopen (CiA 301, 305): frame and time in, frames and the next deadline out.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

mod frame;
mod node_id;
mod time;
mod transmit;

pub use frame::Frame;
pub use node_id::NodeId;
pub use time::{Duration, Instant};
pub use transmit::{QueueFull, Transmit};
