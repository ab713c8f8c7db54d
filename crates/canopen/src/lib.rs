#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
// Data from the bus or from the flash must never cause a panic or an index out of range.
#![cfg_attr(
    not(test),
    warn(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

mod array;
mod can_id;
pub mod client;
mod copy;
mod device;
pub mod dictionary;
pub mod eds;
#[cfg(feature = "embedded-can")]
pub mod embedded_can;
pub mod emcy;
mod frame;
pub mod guide;
mod heartbeat;
pub mod indicators;
pub mod lss;
pub mod nmt;
mod node_id;
pub mod objects;
pub mod pdo;
pub mod sdo;
mod sync;
pub mod testing;
mod time;
mod time_stamp;
mod transmit;

pub use can_id::{CanId, CobId};
pub use device::{
    Action, Application, BusEvent, Damage, Definition, Device, Job, Next, Reset, ServiceDevice, Soundness,
    Stored,
};
pub use emcy::{Condition, ErrorClass, Fault};
pub use frame::Frame;
pub use node_id::NodeId;
pub use sdo::Part;
pub use time::{Duration, Instant};
use time::{Span, Tick};
pub use time_stamp::TimeOfDay;
pub use transmit::{QueueFull, Transmit};

/// Items for the macros; not for other use.
#[doc(hidden)]
pub mod plumbing {
    pub use crate::array::Array;
    pub use crate::device::Rows;
    pub use crate::heartbeat::Monitored;
}
