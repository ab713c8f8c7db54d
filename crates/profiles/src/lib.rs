//! What the node measures, as the CiA device profiles define it. Pure functions and small states; no bus, no hardware.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

pub mod encoder;
pub mod lift;
pub mod pressure;
