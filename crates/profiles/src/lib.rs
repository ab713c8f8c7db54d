//! What the node measures, as the CiA device profiles define it. Pure functions and small states; no bus, no hardware.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

pub mod pressure;
