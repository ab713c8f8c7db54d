//! A CAN bus in bit-accurate virtual time.

mod controller;
mod frame;
mod time;

pub use controller::{Attachment, BusError, Controller};
pub use frame::{ExtendedId, Frame, Id, StandardId};
pub use time::Time;
