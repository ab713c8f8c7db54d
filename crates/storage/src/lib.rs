//! storage
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
