//! Decisions about the bus and the watchdog. They know no register.

pub mod back_off;
pub mod bit_rate_detection;
pub mod guest;
pub mod supervision;
