//! Sans-IO CANopen (CiA 301, 305): frame and time in, frames and the next deadline out.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

mod frame;
mod time;

pub use frame::Frame;
pub use time::{Duration, Instant};
